#pragma once
/** @file
Interface for alternative factorizations of the stiffness matrix. Internal to reduction. **/

#include <Eigen/Dense>
#include <string>

#include "BlockLanczos.h"
#include "simflex/fe/FeModel.h"

namespace simflex {

/** M + U S Uᵀ, where U has few columns. **/
struct CorrectedMatrix {
    const SymmetricMatrix& M;
    const Eigen::MatrixXd& U;  ///< n×k, k may be 0
    const Eigen::MatrixXd& S;  ///< k×k, symmetric
};

class StiffnessSolver {
public:
    virtual ~StiffnessSolver() = default;

    /** Factors K. @throws std::runtime_error if K is not positive definite or memory is
    insufficient. **/
    virtual void factor(const SymmetricMatrix& K) = 0;

    /** Returns K⁻¹ B, n×k. @pre factor(). **/
    virtual Eigen::MatrixXd solve(const Eigen::MatrixXd& B) const = 0;

    /** Computes the largest μ = 1/ω² and x with K x = ω² M x + D λ, Dᵀx = 0, xᵀKx = 1.
    @param D  the constraints, one per column: n×c, c may be 0. @pre factor().
    @throws std::runtime_error if it does not converge. @throws Cancelled. **/
    virtual Eigenpairs calcModes(const CorrectedMatrix& M, const Eigen::MatrixXd& D,
                                 const ModeRange& range, const std::string& phase,
                                 const ProgressCallback& progress) const = 0;

    /** Returns the number of non-zeros of the factor. @pre factor(). **/
    virtual long numFactorEntries() const = 0;
};

}  // namespace simflex
