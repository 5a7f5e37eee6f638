#pragma once
/** @file
The discrete Fourier transform of any length, by Eigen (kissfft). Internal. **/

#include <complex>
#include <vector>

namespace simflex {

/** Returns X_k = Σ x_j exp(−2πi jk/n), k = 0 … n − 1. O(n log n) for any prime factors of n. **/
std::vector<std::complex<double>> calcFourierTransform(const std::vector<double>& x);

}  // namespace simflex
