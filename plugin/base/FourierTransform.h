#pragma once
/** @file
The discrete Fourier transform, by Eigen (kissfft) for any number of values. Internal. **/

#include <complex>
#include <vector>

namespace simflex {

/** X_k = Σ x_j exp(−2πi jk/n), k = 0 … n − 1, in O(n log n) whatever the prime factors of n. **/
std::vector<std::complex<double>> calcFourierTransform(const std::vector<double>& x);

}  // namespace simflex
