#pragma once
/** @file
Vibrations in recorded results: amplitude spectra, waterfalls and order tracks.

    const auto& run = results.findAnalysis("run_up");
    const AmplitudeSpectrum spectrum = calcSpectrum(run.time, bearing);
    const Waterfall waterfall = calcWaterfall(run.time, bearing, speed, 40);
    const OrderTrack once = trackOrders(run.time, bearing, speed, {1, 2})[0];

Times are those of result rows, evenly spaced; a last row that comes early (the end of a run) is
ignored. Vibrations above half the sampling rate are aliased to a lower frequency. See isAliased().
**/

#include <vector>

namespace simflex {

/** Amplitudes of sines: a steady a·sin(2πft) has the peak a. The mean is removed. **/
struct AmplitudeSpectrum {
    std::vector<double> frequency;  ///< [Hz], from 0
    std::vector<double> amplitude;  ///< in the values' unit
};

/** Computes the spectrum by a Hann window and a Fourier transform of all values. Peaks extend two
resolutions 1/duration to each side, and reach at least 0.85 of the amplitude at any frequency.
@throws std::invalid_argument if times are not evenly spaced or fewer than 8, or values are not
finite. **/
AmplitudeSpectrum calcSpectrum(const std::vector<double>& time, const std::vector<double>& values);

/** True if the spectrum just below half the sampling rate is large enough to suggest faster
vibrations, which appear at wrong frequencies. **/
bool isAliased(const AmplitudeSpectrum& spectrum);

/** Spectra of segments of a motion that overlap by half. **/
struct Waterfall {
    std::vector<double> time, speed;  ///< middle of each segment; mean of the given speed
    std::vector<double> frequency;    ///< [Hz]
    std::vector<std::vector<double>> amplitude;  ///< of each segment
};

/** @param speed  at each time, or empty
@param numPieces  number of segments, at least 1
@throws std::invalid_argument as calcSpectrum(), also if segments would have fewer than 8 rows. **/
Waterfall calcWaterfall(const std::vector<double>& time, const std::vector<double>& values,
                        const std::vector<double>& speed, int numPieces);

/** The part of a vibration that is synchronous with a rotational speed. In each segment of some
revolutions,

    values ≈ c + d·t + Σ a_o cos(o θ) + b_o sin(o θ),   θ = ∫ speed dt

is fitted for all orders o together by least squares, weighted by a Hann window. **/
struct OrderTrack {
    double order;
    std::vector<double> time, speed;  ///< middle of each segment
    std::vector<double> amplitude;    ///< √(a² + b²), in the values' unit
    std::vector<double> phase;        ///< of a·cos(oθ + φ), θ from the first row [degrees]
};

/** @param speed  [rad/s], of one sign
@param revolutions  of a segment: longer segments resolve close orders better, but amplitudes must
    change more slowly
@throws std::invalid_argument if times are not evenly spaced, the speed changes sign, the motion has
fewer revolutions, orders are not positive and different, or rows are too few to resolve the highest
order at the highest speed. **/
std::vector<OrderTrack> trackOrders(const std::vector<double>& time,
                                    const std::vector<double>& values,
                                    const std::vector<double>& speed,
                                    const std::vector<double>& orders, double revolutions = 8);

}  // namespace simflex
