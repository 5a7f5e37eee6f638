#include "NewtonReference.h"

#include <vector>

namespace simflex::test {
namespace {

using Eigen::Map;
using Eigen::MatrixXd;

template <class Scalar>
Map<const MatrixOf<Scalar>> matrix(const std::vector<Scalar>& entries, int rows, int columns) {
    return {entries.data(), rows, columns};
}

template <class Scalar>
Map<const VectorOf<Scalar>> vector(const std::vector<Scalar>& entries) {
    return {entries.data(), Eigen::Index(entries.size())};
}

}  // namespace

template <class Scalar>
MatrixOf<Scalar> assembleBlock(const BasicNewtonSystem<Scalar>& system,
                               const typename BasicNewtonSystem<Scalar>::Block& block) {
    const int n = block.size;
    if (block.form != NewtonBlock::Form::Arrow) return matrix(block.matrix, n, n);
    MatrixOf<Scalar> J = MatrixOf<Scalar>::Zero(n, n);
    J.topLeftCorner(6, 6) = matrix(block.head, 6, 6);
    J.block(6, 0, n - 6, 3) = matrix(block.coupling, n - 6, 3);
    J.block(0, 6, 3, n - 6) = J.block(6, 0, n - 6, 3).transpose();
    J.bottomRightCorner(n - 6, n - 6).diagonal() =
        vector(system.parts[size_t(block.part)].diagonal);
    return J;
}

template <class Scalar>
MatrixXd assembleGt(const BasicNewtonSystem<Scalar>& system, const NewtonBlock& block) {
    if (block.columns == NewtonBlock::Columns::Own)
        return matrix(block.Gt, block.size, block.numColumns());
    const auto& part = system.parts[size_t(block.part)];
    const auto shapes = matrix(*part.shapes, part.numModes, 6 * part.numFrames);
    const auto coefficients = matrix(block.coefficients, 6, block.numColumns());
    MatrixXd Gt(block.size, block.numColumns());
    Gt.topRows(6) = matrix(block.Gt, 6, block.numColumns());
    int first = 0;
    for (const NewtonBlock::Side& side : block.sides) {
        Gt.block(6, first, part.numModes, side.numColumns) =
            shapes.middleCols(6 * side.frame, 6) * coefficients.middleCols(first, side.numColumns);
        first += side.numColumns;
    }
    return Gt;
}

template <class Scalar>
MatrixOf<Scalar> assembleDense(const BasicNewtonSystem<Scalar>& system) {
    const int speeds = system.numSpeeds(), size = speeds + system.numMultipliers();
    MatrixOf<Scalar> A = MatrixOf<Scalar>::Zero(size, size);
    int first = 0;
    for (const auto& block : system.blocks) {
        A.block(first, first, block.size, block.size) = assembleBlock(system, block);
        const MatrixXd Gt = assembleGt(system, block);
        for (int k = 0; k < block.numColumns(); ++k) {
            const int row = speeds + block.rows[size_t(k)];
            A.block(first, row, block.size, 1) += Gt.col(k).template cast<Scalar>();
            A.block(row, first, 1, block.size) += Gt.col(k).transpose().template cast<Scalar>();
        }
        first += block.size;
    }
    for (size_t row = 0; row < system.compliance.size(); ++row)
        A(speeds + int(row), speeds + int(row)) = -system.compliance[row];
    for (int row : system.pairs) {
        const Scalar D = system.compliance[size_t(row)];
        A(speeds + row, speeds + row + 1) = -system.PairFactor * D;
        A(speeds + row + 1, speeds + row) = -D;
    }
    for (const auto& coupling : system.couplings)
        for (size_t j = 0; j < coupling.rows.size(); ++j)
            for (size_t i = 0; i < coupling.rows.size(); ++i)
                A(speeds + coupling.rows[i], speeds + coupling.rows[j]) -=
                    coupling.values[i + j * coupling.rows.size()];
    return A;
}

Eigen::SparseMatrix<double> assembleSparse(const NewtonSystem& system) {
    return assembleDense(system).sparseView();
}

template <class Scalar>
VectorOf<Scalar> multiply(const BasicNewtonSystem<Scalar>& system, const VectorOf<Scalar>& x) {
    const int speeds = system.numSpeeds();
    VectorOf<Scalar> product = VectorOf<Scalar>::Zero(x.size());
    int first = 0;
    for (const auto& block : system.blocks) {
        const VectorOf<Scalar> u = x.segment(first, block.size);
        const MatrixXd Gt = assembleGt(system, block);
        product.segment(first, block.size) = assembleBlock(system, block) * u;
        for (int k = 0; k < block.numColumns(); ++k) {
            const int row = speeds + block.rows[size_t(k)];
            product.segment(first, block.size) += Gt.col(k) * x[row];
            product[row] += (Gt.col(k).transpose() * u).value();
        }
        first += block.size;
    }
    for (size_t row = 0; row < system.compliance.size(); ++row)
        product[speeds + int(row)] -= system.compliance[row] * x[speeds + int(row)];
    for (int row : system.pairs) {
        const Scalar D = system.compliance[size_t(row)];
        product[speeds + row] -= system.PairFactor * D * x[speeds + row + 1];
        product[speeds + row + 1] -= D * x[speeds + row];
    }
    for (const auto& coupling : system.couplings)
        for (size_t j = 0; j < coupling.rows.size(); ++j)
            for (size_t i = 0; i < coupling.rows.size(); ++i)
                product[speeds + coupling.rows[i]] -=
                    coupling.values[i + j * coupling.rows.size()] * x[speeds + coupling.rows[j]];
    return product;
}

template <class Scalar>
VectorOf<Scalar> assembleRightHandSide(const BasicNewtonSystem<Scalar>& system) {
    VectorOf<Scalar> b(system.numSpeeds() + system.numMultipliers());
    b << -vector(system.r), -vector(system.c);
    return b;
}

template <class Scalar>
VectorOf<Scalar> solveDense(const BasicNewtonSystem<Scalar>& system) {
    return assembleDense(system).partialPivLu().solve(assembleRightHandSide(system));
}

template <class Scalar>
VectorOf<Scalar> solveLeastNorm(const BasicNewtonSystem<Scalar>& system) {
    return assembleDense(system).completeOrthogonalDecomposition().solve(
        assembleRightHandSide(system));
}

template MatrixOf<double> assembleBlock(const BasicNewtonSystem<double>&,
                                        const BasicNewtonSystem<double>::Block&);
template MatrixXd assembleGt(const BasicNewtonSystem<double>&, const NewtonBlock&);
template MatrixOf<double> assembleDense(const BasicNewtonSystem<double>&);
template VectorOf<double> multiply(const BasicNewtonSystem<double>&, const VectorOf<double>&);
template VectorOf<double> assembleRightHandSide(const BasicNewtonSystem<double>&);
template VectorOf<double> solveDense(const BasicNewtonSystem<double>&);
template VectorOf<double> solveLeastNorm(const BasicNewtonSystem<double>&);

template MatrixOf<std::complex<double>> assembleBlock(
    const BasicNewtonSystem<std::complex<double>>&,
    const BasicNewtonSystem<std::complex<double>>::Block&);
template MatrixXd assembleGt(const BasicNewtonSystem<std::complex<double>>&, const NewtonBlock&);
template MatrixOf<std::complex<double>> assembleDense(
    const BasicNewtonSystem<std::complex<double>>&);
template VectorOf<std::complex<double>> multiply(const BasicNewtonSystem<std::complex<double>>&,
                                                 const VectorOf<std::complex<double>>&);
template VectorOf<std::complex<double>> assembleRightHandSide(
    const BasicNewtonSystem<std::complex<double>>&);
template VectorOf<std::complex<double>> solveDense(const BasicNewtonSystem<std::complex<double>>&);
template VectorOf<std::complex<double>> solveLeastNorm(
    const BasicNewtonSystem<std::complex<double>>&);

}  // namespace simflex::test
