#include "simflex/base/DenseAlgebra.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <limits>

namespace simflex {

using Eigen::MatrixXd;
using Eigen::VectorXd;

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

GeneralEigen calcGeneralEigen(const MatrixXd& A) {
    const Eigen::EigenSolver<MatrixXd> solver(A);
    if (solver.info() != Eigen::Success) return {};
    return {solver.eigenvalues(), solver.eigenvectors(), true};
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

ThinQr calcThinQr(const MatrixXd& A) {
    const Eigen::HouseholderQR<MatrixXd> QR(A);
    return {QR.householderQ() * MatrixXd::Identity(A.rows(), A.cols()),
            QR.matrixQR().topRows(A.cols()).triangularView<Eigen::Upper>()};
}

struct LeastSquares::Factors {
    Eigen::CompleteOrthogonalDecomposition<MatrixXd> QTZ;
};

LeastSquares::LeastSquares(const MatrixXd& A, double threshold)
    : m_factors(new Factors{decompose(A, threshold)}) {}

LeastSquares::~LeastSquares() = default;

int LeastSquares::getRank() const {
    return int(m_factors->QTZ.rank());
}

MatrixXd LeastSquares::solve(const MatrixXd& B) const {
    return m_factors->QTZ.solve(B);
}

struct SquareSystem::Factors {
    Eigen::PartialPivLU<MatrixXd> LU;
};

SquareSystem::SquareSystem(const MatrixXd& A)
    : m_factors(new Factors{Eigen::PartialPivLU<MatrixXd>(A)}) {}

SquareSystem::~SquareSystem() = default;

double SquareSystem::getSmallestPivot() const {
    return m_factors->LU.matrixLU().diagonal().cwiseAbs().minCoeff();
}

VectorXd SquareSystem::solve(const VectorXd& b) const {
    return m_factors->LU.solve(b);
}

MatrixXd SquareSystem::solveEach(const MatrixXd& B) const {
    return m_factors->LU.solve(B);
}

Eigen::MatrixXcd solveEach(const Eigen::MatrixXcd& A, const Eigen::MatrixXcd& B) {
    return A.partialPivLu().solve(B);
}

MatrixXd calcInverse(const MatrixXd& A) {
    return A.inverse();
}

Eigen::MatrixXcd calcInverse(const Eigen::MatrixXcd& A) {
    return A.inverse();
}

VectorXd solveSymmetric(const MatrixXd& A, const VectorXd& b) {
    return Eigen::LDLT<MatrixXd>(A).solve(b);
}

MatrixXd solveEachSymmetric(const MatrixXd& A, const MatrixXd& B) {
    return Eigen::LDLT<MatrixXd>(A).solve(B);
}

MatrixXd calcCongruent(const MatrixXd& Z, const MatrixXd& A) {
    return Z.transpose() * A * Z;
}

std::vector<int> orderColumns(const MatrixXd& A) {
    const Eigen::ColPivHouseholderQR<MatrixXd> QR(A);
    const auto& order = QR.colsPermutation().indices();
    return {order.begin(), order.end()};
}

}  // namespace simflex
