#include "support/Spectrum.h"

#include <algorithm>
#include <cmath>
#include <complex>

namespace simflex::examples {

std::vector<double> calcAmplitudeSpectrum(const std::vector<double>& signal, double step,
                                          double center, double width,
                                          const std::vector<double>& frequencies) {
    const double pi = std::acos(-1.0);
    const long first = std::max(0L, long(std::ceil((center - width / 2) / step)));
    const long last =
        std::min(long(signal.size()) - 1, long(std::floor((center + width / 2) / step)));
    std::vector<double> result(frequencies.size(), 0.0);
    if (last < first) return result;

    double mean = 0, weight = 0;
    std::vector<double> window;
    for (long k = first; k <= last; ++k) {
        window.push_back(0.5 * (1 + std::cos(2 * pi * (double(k) * step - center) / width)));
        mean += window.back() * signal[k];
        weight += window.back();
    }
    mean /= weight;
    const double wholeWeight = 0.5 * width / step;  // of a window within the signal
    for (size_t j = 0; j < frequencies.size(); ++j) {
        const std::complex<double> turn = std::polar(1.0, -2 * pi * frequencies[j] * step);
        std::complex<double> phase = 1, sum = 0;
        for (long k = first; k <= last; ++k, phase *= turn)
            sum += window[k - first] * (signal[k] - mean) * phase;
        result[j] = 2 * std::abs(sum) / wholeWeight;
    }
    return result;
}

}  // namespace simflex::examples
