#include "fe/FreeModes.h"

#include <Eigen/Dense>
#include <Eigen/Sparse>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>

namespace simflex {
namespace testing {
namespace {

using Matrix = Eigen::SparseMatrix<double>;

/** Returns A ⊗ 1_copies of a symmetric matrix. **/
Matrix toEigen(const SymmetricMatrix& A, int copies) {
    std::vector<Eigen::Triplet<double>> entries;
    for (int column = 0; column < A.size; ++column)
        for (auto k = A.columnStarts[size_t(column)]; k < A.columnStarts[size_t(column) + 1]; ++k)
            for (int a = 0; a < copies; ++a) {
                const int i = copies * A.rows[size_t(k)] + a, j = copies * column + a;
                entries.emplace_back(i, j, A.values[size_t(k)]);
                if (i != j) entries.emplace_back(j, i, A.values[size_t(k)]);
            }
    Matrix result(copies * A.size, copies * A.size);
    result.setFromTriplets(entries.begin(), entries.end());
    return result;
}

Matrix toEigen(const NodalConstraints& T, int numRows) {
    std::vector<Eigen::Triplet<double>> entries;
    Matrix result(numRows, T.empty() ? numRows : T.numCoordinates);
    if (T.empty()) {
        result.setIdentity();
        return result;
    }
    for (int row = 0; row < numRows; ++row)
        for (auto k = T.rowStarts[size_t(row)]; k < T.rowStarts[size_t(row) + 1]; ++k)
            entries.emplace_back(row, T.columns[size_t(k)], T.coefficients[size_t(k)]);
    result.setFromTriplets(entries.begin(), entries.end());
    return result;
}

}  // namespace

// Subspace iteration (Bathe, Finite Element Procedures, ch. 11.6): inverse iteration of a block
// three times as wide as the requested modes, with Rayleigh-Ritz projection.
std::vector<double> calcFreeFrequencies(const FeModel& model, int numModes) {
    const int n = 3 * model.mesh.numNodes();
    const Matrix T = toEigen(model.constraints, n);
    const Matrix K = T.transpose() * toEigen(model.K, 1) * T;
    const Matrix M = T.transpose() * toEigen(model.m, 3) * T;
    // A shift well below the first elastic frequency, but far above round-off.
    const double shift = 1e-7 * K.diagonal().maxCoeff() / M.diagonal().maxCoeff();
    const Eigen::SimplicialLLT<Matrix> shifted(K + shift * M);
    if (shifted.info() != Eigen::Success) throw std::runtime_error("K is not free and regular");

    std::mt19937 random;
    Eigen::MatrixXd X = Eigen::MatrixXd::NullaryExpr(
        K.rows(), std::min<Eigen::Index>(K.rows(), 3 * numModes),
        [&] { return std::uniform_real_distribution<double>(-1, 1)(random); });
    Eigen::VectorXd eigenvalues = Eigen::VectorXd::Zero(numModes);
    for (int iteration = 0; iteration < 1000; ++iteration) {
        X = shifted.solve(M * X);
        X = Eigen::HouseholderQR<Eigen::MatrixXd>(X).householderQ() *
            Eigen::MatrixXd::Identity(X.rows(), X.cols());
        const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> ritz(X.transpose() * K * X,
                                                                             X.transpose() * M * X);
        X *= ritz.eigenvectors();
        const Eigen::VectorXd previous = eigenvalues;
        eigenvalues = ritz.eigenvalues().head(numModes);
        if (((eigenvalues - previous).array().abs() > 1e-8 * (eigenvalues.array().abs() + shift))
                .any())
            continue;
        std::vector<double> hertz;
        for (const double eigenvalue : eigenvalues)
            hertz.push_back(std::sqrt(std::max(0.0, eigenvalue)) / (2 * M_PI));
        return hertz;
    }
    throw std::runtime_error("the frequencies did not converge");
}

}  // namespace testing
}  // namespace simflex
