#pragma once
/** @file
The largest eigenpairs of a symmetric positive semidefinite operator, C y = μ y, by block Lanczos.
Internal to reduction.

The basis V of the block Krylov space {X, CX, C²X, …} grows by a block a step,

    C V = V T + W Eᵀ,   T = VᵀCV,   W ⟂ V,

orthogonalised against all of V twice. With T s = θ s, (θ, V s) is an eigenpair to the residual
‖W Eᵀs‖. A block reads the factor behind C once for all its vectors, and finds eigenvalues as often
as they occur, up to its width; where as many as that coincide, a fresh block looks for more. When
V is full, it restarts from its best Ritz vectors (thick restart).

Sums run over fixed chunks of rows in a fixed order: the bits do not depend on the number of
threads, if those of C do not.

    Eigenpairs pairs = calcLargestEigenpairs(C, {50}, "normal modes", progress);

Sources: G. H. Golub, R. Underwood, The block Lanczos method for computing eigenvalues, Math.
Software III (1977) 361–377; K. Wu, H. Simon, Thick-restart Lanczos method for large symmetric
eigenvalue problems, SIAM J. Matrix Anal. Appl. 22 (2000) 602–616; A. Stathopoulos, K. Wu, A block
orthogonalization procedure with constant synchronization requirements, SIAM J. Sci. Comput. 23
(2002) 2165–2182. **/

#include <Eigen/Dense>
#include <limits>
#include <string>

#include "simflex/base/Progress.h"

namespace simflex {

/** A symmetric positive semidefinite operator on vectors of a fixed size, many at a time. **/
class SymmetricOperator {
public:
    virtual ~SymmetricOperator() = default;
    virtual Eigen::Index size() const = 0;

    /** Y ← C X, both size×k. **/
    virtual void apply(const Eigen::MatrixXd& X, Eigen::MatrixXd& Y) const = 0;
};

/** Which eigenpairs: the `count` largest, but none below `smallest`. **/
struct ModeRange {
    int count = std::numeric_limits<int>::max();
    double smallest = 0;
};

struct Eigenpairs {
    Eigen::VectorXd values;   ///< descending
    Eigen::MatrixXd vectors;  ///< orthonormal columns
    int numBlocks = 0;        ///< blocks that were applied to C
};

struct LanczosOptions {
    int blockSize = 8;
    int largestBasis = 0;     ///< vectors; 0: as many as are taken without a restart, nearly always
    double accuracy = 1e-12;  ///< residual over the eigenvalue
};

/** The eigenpairs of `range`; fewer where C has fewer above round-off (1e-14 of the largest).
Dense linear algebra for small sizes.
@param phase  for the progress.
@throws std::runtime_error if it does not converge. @throws Cancelled. **/
Eigenpairs calcLargestEigenpairs(const SymmetricOperator& C, const ModeRange& range,
                                 const std::string& phase, const ProgressCallback& progress = {},
                                 const LanczosOptions& options = {});

/** Vectors of the basis that finding `count` eigenpairs usually takes, for estimates. **/
int estimateLanczosBasis(int count, int blockSize = 8);

}  // namespace simflex
