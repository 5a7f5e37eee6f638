#pragma once
/** @file
The numbers of a supernodal Cholesky factor whose pattern is known. Internal to reduction.

    L_ss L_ssᵀ = A_ss − Σ_d L_sd L_sdᵀ,   L_rs = (A_rs − Σ_d L_rd L_sdᵀ) L_ss⁻ᵀ

by supernodes s, d being those before s that have rows in s. Disjoint subtrees of the elimination
tree go to threads; the large supernodes above them are shared out in blocks of columns, by tiles of
rows. Who computes what does not depend on the number of threads, nor do the bits: BLAS, which
would divide its work by the number of threads, has one here.

O(flops) time; besides the factor, A's entries once more and two tiles for each thread. **/

#include <cstdint>

#include "SupernodalFactor.h"
#include "simflex/fe/FeModel.h"

namespace simflex {

/** Factors P A Pᵀ.
@param order    row of A for each row of L
@param values   receives L, by L.valueStarts; what lies above the diagonal is undefined
@returns the row of L at which a pivot is not positive; −1: none **/
std::int64_t factorSupernodes(const SymmetricMatrix& A, const std::int64_t* order,
                              const SupernodalFactor& L, double* values, int threads);

}  // namespace simflex
