#pragma once
/** @file
Largest eigenpairs of a symmetric positive semidefinite operator, C y = μ y, by block Lanczos.
Internal to reduction.

The basis V of the block Krylov space {X, CX, C²X, …} grows by one block per step,

    C V = V T + W Eᵀ,   T = VᵀCV,   W ⟂ V,

orthogonalised against all of V twice. With T s = θ s, (θ, V s) is an eigenpair with residual ‖W
Eᵀs‖. A block reads the factor behind C once for all its vectors and finds eigenvalues up to a
multiplicity of its width; if that many coincide, a fresh block searches for more. When V is full,
it restarts from its best Ritz vectors (thick restart).

Sums run over fixed chunks of rows in a fixed order: the result is bit-identical for any number of
threads, provided that C is.

    Eigenpairs pairs = calcLargestEigenpairs(C, {50}, "normal modes", progress);

Sources: G. H. Golub, R. Underwood, The block Lanczos method for computing eigenvalues, Math.
Software III (1977) 361–377; K. Wu, H. Simon, Thick-restart Lanczos method for large symmetric
eigenvalue problems, SIAM J. Matrix Anal. Appl. 22 (2000) 602–616; A. Stathopoulos, K. Wu, A block
orthogonalization procedure with constant synchronization requirements, SIAM J. Sci. Comput. 23
(2002) 2165–2182. **/

#include <Eigen/Dense>
#include <limits>
#include <string>

#include "Vectors.h"
#include "simflex/base/Progress.h"

namespace simflex {

/** A symmetric positive semidefinite operator on blocks of vectors. **/
class SymmetricOperator {
public:
    virtual ~SymmetricOperator() = default;
    virtual Eigen::Index size() const = 0;

    /** Y ← C X, both size×k. **/
    virtual void apply(const Vectors& X, Vectors& Y) const = 0;
};

/** Range of eigenpairs: the `count` largest, but none below `smallest`. **/
struct ModeRange {
    int count = std::numeric_limits<int>::max();
    double smallest = 0;
};

struct Eigenpairs {
    Eigen::VectorXd values;  ///< descending
    Vectors vectors;         ///< orthonormal columns
    int numBlocks = 0;       ///< number of applications of C to a block
};

struct LanczosOptions {
    int blockSize = 8;
    int largestBasis = 0;     ///< vectors; 0: enough to avoid a restart nearly always
    double accuracy = 1e-12;  ///< residual relative to the eigenvalue
};

/** Computes the eigenpairs of `range`; fewer if C has fewer above round-off (1e-14 of the largest).
Uses dense linear algebra for small sizes.
@param phase  for progress reports.
@throws std::runtime_error if it does not converge. @throws Cancelled. **/
Eigenpairs calcLargestEigenpairs(const SymmetricOperator& C, const ModeRange& range,
                                 const std::string& phase, const ProgressCallback& progress = {},
                                 const LanczosOptions& options = {});

/** Estimates the basis size needed for `count` eigenpairs. **/
int estimateLanczosBasis(int count, int blockSize = 8);

}  // namespace simflex
