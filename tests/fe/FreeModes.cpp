#include "fe/FreeModes.h"

#include <Spectra/SymGEigsShiftSolver.h>

#include <Eigen/Sparse>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace simflex {
namespace testing {
namespace {

using Matrix = Eigen::SparseMatrix<double>;

/** A ⊗ 1_copies of a symmetric matrix. **/
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

/** (K − σM)⁻¹ by Cholesky, for σ < 0. **/
class ShiftInvert {
public:
    using Scalar = double;
    ShiftInvert(const Matrix& K, const Matrix& M) : _K(K), _M(M) {}
    Eigen::Index rows() const { return _K.rows(); }
    Eigen::Index cols() const { return _K.cols(); }
    void set_shift(double sigma) {
        _solver.compute(_K - sigma * _M);
        if (_solver.info() != Eigen::Success) throw std::runtime_error("K is not free and regular");
    }
    void perform_op(const double* x, double* y) const {
        Eigen::Map<Eigen::VectorXd>(y, rows()) =
            _solver.solve(Eigen::Map<const Eigen::VectorXd>(x, rows()));
    }

private:
    const Matrix &_K, &_M;
    Eigen::SimplicialLLT<Matrix> _solver;
};

class Product {
public:
    using Scalar = double;
    explicit Product(const Matrix& M) : _M(M) {}
    Eigen::Index rows() const { return _M.rows(); }
    Eigen::Index cols() const { return _M.cols(); }
    void perform_op(const double* x, double* y) const {
        Eigen::Map<Eigen::VectorXd>(y, rows()) = _M * Eigen::Map<const Eigen::VectorXd>(x, rows());
    }

private:
    const Matrix& _M;
};

}  // namespace

std::vector<double> calcFreeFrequencies(const FeModel& model, int numModes) {
    const int n = 3 * model.mesh.numNodes();
    const Matrix T = toEigen(model.constraints, n);
    const Matrix K = T.transpose() * toEigen(model.K, 1) * T;
    const Matrix M = T.transpose() * toEigen(model.m, 3) * T;
    // A shift well below the first elastic frequency, but far above round-off.
    const double shift = -1e-7 * K.diagonal().maxCoeff() / M.diagonal().maxCoeff();
    ShiftInvert inverse(K, M);
    Product product(M);
    Spectra::SymGEigsShiftSolver<ShiftInvert, Product, Spectra::GEigsMode::ShiftInvert> solver(
        inverse, product, numModes, std::min<int>(int(K.rows()), 3 * numModes), shift);
    solver.init();
    solver.compute(Spectra::SortRule::LargestMagn, 1000, 1e-12, Spectra::SortRule::SmallestAlge);
    if (solver.info() != Spectra::CompInfo::Successful) throw std::runtime_error("no eigenvalues");
    std::vector<double> hertz;
    for (const double eigenvalue : solver.eigenvalues())
        hertz.push_back(std::sqrt(std::max(0.0, eigenvalue)) / (2 * M_PI));
    std::sort(hertz.begin(), hertz.end());
    return hertz;
}

}  // namespace testing
}  // namespace simflex
