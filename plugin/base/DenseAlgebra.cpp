#include "simflex/base/DenseAlgebra.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <limits>

namespace simflex {

using Eigen::MatrixXd;

namespace {

Eigen::CompleteOrthogonalDecomposition<MatrixXd> decompose(const MatrixXd& A, double threshold) {
    Eigen::CompleteOrthogonalDecomposition<MatrixXd> decomposition;
    if (threshold >= 0) decomposition.setThreshold(threshold);
    decomposition.compute(A);
    return decomposition;
}

}  // namespace

SymmetricEigen calcSymmetricEigen(const MatrixXd& A) {
    const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(A);
    return {solver.eigenvalues(), solver.eigenvectors(), solver.info() == Eigen::Success};
}

SymmetricEigen calcSymmetricEigen(const MatrixXd& A, const MatrixXd& B) {
    const Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd> solver(A, B);
    return {solver.eigenvalues(), solver.eigenvectors(), solver.info() == Eigen::Success};
}

bool isPositiveDefinite(const MatrixXd& A) {
    return Eigen::LLT<MatrixXd>(A).info() == Eigen::Success;
}

double calcSmallestPivot(const MatrixXd& A) {
    const Eigen::LDLT<MatrixXd> factor(A);
    return factor.info() == Eigen::Success ? factor.vectorD().minCoeff()
                                           : -std::numeric_limits<double>::infinity();
}

ColumnSpace calcColumnSpace(const MatrixXd& A, double threshold) {
    const auto decomposition = decompose(A, threshold);
    ColumnSpace space;
    space.rank = int(decomposition.rank());
    const Eigen::Index rest = A.rows() - space.rank;
    MatrixXd last = MatrixXd::Zero(A.rows(), rest);
    last.bottomRows(rest).setIdentity();
    space.complement = decomposition.householderQ() * last;
    space.pseudoInverse = decomposition.pseudoInverse();
    return space;
}

MatrixXd solveLeastSquares(const MatrixXd& A, const MatrixXd& B, double threshold) {
    return decompose(A, threshold).solve(B);
}

}  // namespace simflex
