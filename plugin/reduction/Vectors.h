#pragma once
/** @file
Blocks of vectors. Internal to reduction.

Vectors are columns of row-major matrices: a row holds one coordinate of all vectors, so sparse
matrices, factors and permutations move contiguous numbers, and each of their entries is read once
for all vectors. **/

#include <Eigen/Core>

namespace simflex {

using Vectors = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

}  // namespace simflex
