#pragma once
/** @file
Amplitude spectrum of a piece of a signal, by the Fourier sum with a Hann window: a steady sine of
amplitude a gives a at its frequency, whatever the window's length. **/

#include <vector>

namespace simflex::examples {

/** @param signal  sampled every `step` seconds; its mean within the window is taken off
@param center, width  of the window [s]; samples beyond the ends count as the mean
@param frequencies  [Hz]
@return amplitude per frequency, in the signal's unit. O(samples in window·frequencies). **/
std::vector<double> calcAmplitudeSpectrum(const std::vector<double>& signal, double step,
                                          double center, double width,
                                          const std::vector<double>& frequencies);

}  // namespace simflex::examples
