#pragma once
/** @file
Sparse Cholesky factorization P A Pᵀ = L Lᵀ by CHOLMOD (supernodal, AMD or METIS order, long
indices). Internal to reduction. **/

#include <Eigen/Dense>
#include <memory>

#include "simflex/fe/FeModel.h"

namespace simflex {

class SparseCholesky {
public:
    SparseCholesky();
    ~SparseCholesky();

    /** Factors A. @throws SingularMatrix if A is not positive definite to round-off. **/
    void factor(const SymmetricMatrix& A);

    /** A⁻¹ B for many right-hand sides. @pre factor(). **/
    Eigen::MatrixXd solve(const Eigen::MatrixXd& B) const;

    /** Y ← L⁻¹ P X for many right-hand sides. @pre factor(). **/
    void solveLower(const Eigen::MatrixXd& X, Eigen::MatrixXd& Y) const;

    /** Y ← Pᵀ L⁻ᵀ X for many right-hand sides. @pre factor(). **/
    void solveUpper(const Eigen::MatrixXd& X, Eigen::MatrixXd& Y) const;

    /** A rough estimate of 1/cond(A). @pre factor(). **/
    double estimateReciprocalCondition() const;

    int size() const;
    long numFactorEntries() const;

    /** Thrown with the row (of A) at which the pivot vanished. **/
    struct SingularMatrix : std::runtime_error {
        explicit SingularMatrix(int pivotRow)
            : std::runtime_error("the matrix is not positive definite"), row(pivotRow) {}
        int row;
    };

private:
    struct Data;
    std::unique_ptr<Data> _data;
};

}  // namespace simflex
