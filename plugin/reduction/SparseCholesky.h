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

    /** y ← L⁻¹ P x. @pre factor(). **/
    void solveLower(const double* x, double* y) const;

    /** y ← Pᵀ L⁻ᵀ x. @pre factor(). **/
    void solveUpper(const double* x, double* y) const;

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
