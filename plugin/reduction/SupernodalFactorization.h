#pragma once
/** @file
Numeric factorization of a supernodal Cholesky factor with known pattern. Internal to reduction.

    L_ss L_ssᵀ = A_ss − Σ_d L_sd L_sdᵀ,   L_rs = (A_rs − Σ_d L_rd L_sdᵀ) L_ss⁻ᵀ

by supernodes s, where d are the earlier ones with rows in s. Threads process disjoint subtrees of
the elimination tree; the large supernodes above them are divided into blocks of columns and tiles
of rows. The partition does not depend on the number of threads, so results are bit-identical: BLAS,
which would partition by threads, runs on one.

O(flops) time. Memory besides the factor: another copy of A's entries and two tiles per thread. **/

#include <cstdint>

#include "SupernodalFactor.h"
#include "simflex/fe/FeModel.h"

namespace simflex {

/** Factors P A Pᵀ.
@param order    row of A for each row of L
@param values   receives L, by L.valueStarts; entries above the diagonal are undefined
@returns the row of L at which a pivot is not positive; −1: none **/
std::int64_t factorSupernodes(const SymmetricMatrix& A, const std::int64_t* order,
                              const SupernodalFactor& L, double* values, int threads);

}  // namespace simflex
