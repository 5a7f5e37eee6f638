#include "simflex/base/FourierTransform.h"

#include <cmath>
#include <cstddef>
#include <unsupported/Eigen/FFT>

namespace simflex {

namespace {

using Complexes = std::vector<std::complex<double>>;

constexpr std::size_t LargestFactor =
    50;  // above it kissfft's n·factor operations cost more than a convolution

std::size_t findLargestPrimeFactor(std::size_t n) {
    std::size_t largest = 1;
    for (std::size_t factor = 2; factor * factor <= n; ++factor)
        for (; n % factor == 0; n /= factor) largest = factor;
    return n > 1 ? n : largest;
}

/** Transforms by a convolution of power-of-two length (L. I. Bluestein, 1970). **/
Complexes convolve(const std::vector<double>& x) {
    const std::size_t n = x.size();
    std::size_t m = 1;
    while (m < 2 * n) m *= 2;
    Complexes chirp(n), a(m), b(m), transformed, other;
    for (std::size_t k = 0; k < n; ++k)
        chirp[k] = std::polar(1.0, -M_PI * double(k * k % (2 * n)) / double(n));
    for (std::size_t k = 0; k < n; ++k) {
        a[k] = x[k] * chirp[k];
        b[k] = b[(m - k) % m] = std::conj(chirp[k]);
    }
    Eigen::FFT<double> fft;
    fft.fwd(transformed, a);
    fft.fwd(other, b);
    for (std::size_t k = 0; k < m; ++k) transformed[k] *= other[k];
    fft.inv(a, transformed);
    for (std::size_t k = 0; k < n; ++k) chirp[k] *= a[k];
    return chirp;
}

}  // namespace

Complexes calcFourierTransform(const std::vector<double>& x) {
    if (x.size() < 2) return {x.begin(), x.end()};
    if (findLargestPrimeFactor(x.size()) > LargestFactor) return convolve(x);
    Complexes transformed;
    Eigen::FFT<double>().fwd(transformed, x);
    return transformed;
}

}  // namespace simflex
