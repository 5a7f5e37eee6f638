#pragma once
/** @file
aᵀb of plain arrays (private header). Eight interleaved sums in a fixed order are fast and
bit-identical for any alignment, unlike Eigen's sums over unaligned memory. **/

namespace simflex {

inline double dot(const double* a, const double* b, int size) {
    double sums[8] = {0, 0, 0, 0, 0, 0, 0, 0};
    int i = 0;
    for (; i + 8 <= size; i += 8)
        for (int k = 0; k < 8; ++k) sums[k] += a[i + k] * b[i + k];
    for (; i < size; ++i) sums[0] += a[i] * b[i];
    return ((sums[0] + sums[1]) + (sums[2] + sums[3])) +
           ((sums[4] + sums[5]) + (sums[6] + sums[7]));
}

}  // namespace simflex
