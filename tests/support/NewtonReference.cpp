#include "NewtonReference.h"

#include <vector>

namespace simflex::test {
namespace {

using Eigen::Map;
using Eigen::MatrixXd;
using Eigen::VectorXd;

Map<const MatrixXd> matrix(const std::vector<double>& entries, int rows, int columns) {
    return {entries.data(), rows, columns};
}

Map<const VectorXd> vector(const std::vector<double>& entries) {
    return {entries.data(), Eigen::Index(entries.size())};
}

}  // namespace

MatrixXd assembleBlock(const NewtonSystem& system, const NewtonSystem::Block& block) {
    const int n = block.size;
    if (block.form != NewtonSystem::Block::Form::Arrow) return matrix(block.matrix, n, n);
    MatrixXd J = MatrixXd::Zero(n, n);
    J.topLeftCorner(6, 6) = matrix(block.head, 6, 6);
    J.block(6, 0, n - 6, 3) = matrix(block.coupling, n - 6, 3);
    J.block(0, 6, 3, n - 6) = J.block(6, 0, n - 6, 3).transpose();
    J.bottomRightCorner(n - 6, n - 6).diagonal() =
        vector(system.parts[size_t(block.part)].diagonal);
    return J;
}

MatrixXd assembleGt(const NewtonSystem& system, const NewtonSystem::Block& block) {
    if (block.columns == NewtonSystem::Block::Columns::Own)
        return matrix(block.Gt, block.size, block.numColumns());
    const NewtonSystem::Part& part = system.parts[size_t(block.part)];
    const auto shapes = matrix(*part.shapes, part.numModes, 6 * part.numFrames);
    const auto coefficients = matrix(block.coefficients, 6, block.numColumns());
    MatrixXd Gt(block.size, block.numColumns());
    Gt.topRows(6) = matrix(block.Gt, 6, block.numColumns());
    int first = 0;
    for (const NewtonSystem::Side& side : block.sides) {
        Gt.block(6, first, part.numModes, side.numColumns) =
            shapes.middleCols(6 * side.frame, 6) * coefficients.middleCols(first, side.numColumns);
        first += side.numColumns;
    }
    return Gt;
}

MatrixXd assembleDense(const NewtonSystem& system) {
    const int speeds = system.numSpeeds(), size = speeds + system.numMultipliers();
    MatrixXd A = MatrixXd::Zero(size, size);
    int first = 0;
    for (const NewtonSystem::Block& block : system.blocks) {
        A.block(first, first, block.size, block.size) = assembleBlock(system, block);
        const MatrixXd Gt = assembleGt(system, block);
        for (int k = 0; k < block.numColumns(); ++k) {
            const int row = speeds + block.rows[size_t(k)];
            A.block(first, row, block.size, 1) += Gt.col(k);
            A.block(row, first, 1, block.size) += Gt.col(k).transpose();
        }
        first += block.size;
    }
    for (size_t row = 0; row < system.compliance.size(); ++row)
        A(speeds + int(row), speeds + int(row)) = -system.compliance[row];
    return A;
}

Eigen::SparseMatrix<double> assembleSparse(const NewtonSystem& system) {
    return assembleDense(system).sparseView();
}

VectorXd multiply(const NewtonSystem& system, const VectorXd& x) {
    const int speeds = system.numSpeeds();
    VectorXd product = VectorXd::Zero(x.size());
    int first = 0;
    for (const NewtonSystem::Block& block : system.blocks) {
        const VectorXd u = x.segment(first, block.size);
        const MatrixXd Gt = assembleGt(system, block);
        product.segment(first, block.size) = assembleBlock(system, block) * u;
        for (int k = 0; k < block.numColumns(); ++k) {
            const int row = speeds + block.rows[size_t(k)];
            product.segment(first, block.size) += Gt.col(k) * x[row];
            product[row] += Gt.col(k).dot(u);
        }
        first += block.size;
    }
    for (size_t row = 0; row < system.compliance.size(); ++row)
        product[speeds + int(row)] -= system.compliance[row] * x[speeds + int(row)];
    return product;
}

VectorXd assembleRightHandSide(const NewtonSystem& system) {
    VectorXd b(system.numSpeeds() + system.numMultipliers());
    b << -vector(system.r), -vector(system.c);
    return b;
}

VectorXd solveDense(const NewtonSystem& system) {
    return assembleDense(system).partialPivLu().solve(assembleRightHandSide(system));
}

VectorXd solveLeastNorm(const NewtonSystem& system) {
    return assembleDense(system).completeOrthogonalDecomposition().solve(
        assembleRightHandSide(system));
}

}  // namespace simflex::test
