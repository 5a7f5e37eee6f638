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

/** Calls visit(row, column, value) for every entry that the system stores. **/
template <class Visit>
void visitEntries(const NewtonSystem& system, Visit visit) {
    int first = 0;
    for (const NewtonSystem::Block& block : system.blocks) {
        const int n = block.size;
        if (block.form == NewtonSystem::Block::Form::Dense) {
            for (int j = 0; j < n; ++j)
                for (int i = 0; i < n; ++i) visit(first + i, first + j, block.dense[i + n * j]);
        } else {
            for (int j = 0; j < 6; ++j)
                for (int i = 0; i < 6; ++i) visit(first + i, first + j, block.head[i + 6 * j]);
            for (int k = 0; k < n - 6; ++k) {
                for (int i = 0; i < 6; ++i) {
                    visit(first + i, first + 6 + k, block.coupling[i + 6 * k]);
                    visit(first + 6 + k, first + i, block.coupling[i + 6 * k]);
                }
                visit(first + 6 + k, first + 6 + k, block.diagonal[k]);
            }
        }
        first += n;
    }
    const int lambda = first;
    first = 0;
    for (const NewtonSystem::Block& block : system.blocks) {
        for (int column = 0; column < int(block.rows.size()); ++column)
            for (int i = 0; i < block.size; ++i) {
                const double value = block.Gt[i + block.size * column];
                visit(first + i, lambda + block.rows[column], value);
                visit(lambda + block.rows[column], first + i, value);
            }
        first += block.size;
    }
}

}  // namespace

MatrixXd assembleBlock(const NewtonSystem::Block& block) {
    const int n = block.size;
    if (block.form == NewtonSystem::Block::Form::Dense) return matrix(block.dense, n, n);
    MatrixXd J = MatrixXd::Zero(n, n);
    J.topLeftCorner(6, 6) = matrix(block.head, 6, 6);
    J.topRightCorner(6, n - 6) = matrix(block.coupling, 6, n - 6);
    J.bottomLeftCorner(n - 6, 6) = J.topRightCorner(6, n - 6).transpose();
    J.bottomRightCorner(n - 6, n - 6).diagonal() = vector(block.diagonal);
    return J;
}

MatrixXd assembleDense(const NewtonSystem& system) {
    const int size = system.numSpeeds() + system.numMultipliers();
    MatrixXd A = MatrixXd::Zero(size, size);
    visitEntries(system, [&](int i, int j, double value) { A(i, j) = value; });
    return A;
}

Eigen::SparseMatrix<double> assembleSparse(const NewtonSystem& system) {
    const int size = system.numSpeeds() + system.numMultipliers();
    std::vector<Eigen::Triplet<double>> entries;
    visitEntries(system, [&](int i, int j, double value) { entries.emplace_back(i, j, value); });
    Eigen::SparseMatrix<double> A(size, size);
    A.setFromTriplets(entries.begin(), entries.end());
    return A;
}

VectorXd assembleRightHandSide(const NewtonSystem& system) {
    VectorXd b(system.numSpeeds() + system.numMultipliers());
    int first = 0;
    for (const NewtonSystem::Block& block : system.blocks) {
        b.segment(first, block.size) = -vector(block.r);
        first += block.size;
    }
    b.tail(system.numMultipliers()) = -vector(system.c);
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
