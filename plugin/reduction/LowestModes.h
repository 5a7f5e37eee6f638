#pragma once
/** @file
The lowest modes of A φ = ω² M φ, A positive definite, M = m ⊗ 1₃ positive *semi*definite. Internal
to reduction.

With A = L Lᵀ the pencil becomes the standard symmetric problem C y = μ y, C = L⁻¹ M L⁻ᵀ,
φ = L⁻ᵀ y, μ = 1/ω²: shift-invert Lanczos about zero in which M is only ever multiplied with. (A
semidefinite M as inner product would let its null space, that of CalculiX's one-point mass of
C3D8R, grow without bound.) **/

#include <functional>

#include "BlockLanczos.h"
#include "SparseCholesky.h"
#include "SymmetricProduct.h"
#include "simflex/fe/Progress.h"

namespace simflex {

/** M U of many vectors U. **/
using MassProduct = std::function<Shapes(const Shapes&)>;

/** @param factored  the Cholesky factor of A.
@param range  count and μ = 1/ω² of the modes; a smallest μ > 0 is a limit of frequency, and then
    fewer modes than counted are no error.
@returns shapes, ascending in ω, with φᵀAφ = 1.
@throws std::invalid_argument if M has not that many modes. @throws Cancelled. **/
Eigen::MatrixXd calcLowestModes(const SparseCholesky& factored, const MassProduct& multiplyMass,
                                const ModeRange& range, const ProgressCallback& progress);

/** The same for M = m ⊗ 1₃.
@param factored  the Cholesky factor of A, 3·m.size rows.
@param numModes  how many modes, 1 … rank of M.
@returns 3·m.size × numModes shapes, ascending in ω, with φᵀAφ = 1.
@throws std::invalid_argument if M has not that many modes. @throws Cancelled. **/
Eigen::MatrixXd calcLowestModes(const SparseCholesky& factored, const FullRows& m, int numModes,
                                const ProgressCallback& progress);

}  // namespace simflex
