// Tangent equations of chains and rings with random matrices, against dense LU.

#include "simflex/solver/equilibrium/TangentElimination.h"

#include <gtest/gtest.h>

#include <complex>
#include <random>

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"
#include "support/PointMassPart.h"

namespace simflex {
namespace {

using ::Eigen::Dynamic;
using ::Eigen::Index;
using ::Eigen::MatrixXd;
using ::Eigen::VectorXd;
using Number = std::complex<double>;

/** Flexible bodies, each attached to the previous one by a ball; in a ring, the last one also to
Ground. **/
struct Mechanism {
    SimTK::MultibodySystem system;
    SimTK::SimbodyMatterSubsystem matter{system};
    SimTK::GeneralForceSubsystem forces{system};
    FlexibleBodySubsystem flexible{system, matter};
    SimTK::State state;

    Mechanism(int numBodies, bool isRing) {
        const auto part = test::makePointMassPart().body;
        Attachment before(matter.Ground());
        for (int k = 0; k < numBodies; ++k) {
            const FlexibleBody body(flexible, part);
            Joint::Ball(flexible, before, body.interface("A"));
            before = body.interface("B");
        }
        if (isRing) Joint::Ball(flexible, before, Attachment(matter.Ground(), SimTK::Vec3(1)));
        state = system.realizeTopology();
        system.realize(state, SimTK::Stage::Velocity);
    }
};

void realizeAt(Evaluation& equations, const SimTK::State& state) {
    const Topology& topology = equations.getTopology();
    SolutionPoint point;
    point.resize(topology.numQ, topology.numU, topology.numMultipliers, topology.numZ);
    equations.getBlocks().getFromState(state, point.q.data(), point.u.data());
    equations.realize(0, point.q.data(), point.u.data());
    VectorXd residual(topology.numU);  // the residual must precede the mass matrix
    equations.calcResidual(point.q.data(), point.u.data(), point.uDot.data(), point.lambda.data(),
                           residual.data());
}

template <class Matrix>
Matrix makeRandom(Index rows, Index columns, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform(-1, 1);
    Matrix matrix(rows, columns);
    for (Index j = 0; j < columns; ++j)
        for (Index i = 0; i < rows; ++i) {
            matrix(i, j) = uniform(random);
            if constexpr (std::is_same_v<typename Matrix::Scalar, Number>)
                matrix(i, j) += Number(0, uniform(random));
        }
    return matrix;
}

/** Extracts the blocks of a matrix between neighbours and zeroes all other entries in both. **/
template <class Scalar, class Matrix>
BlockMatrix<Scalar> takeBlocks(const BlockGraph& graph, Matrix& dense) {
    BlockMatrix<Scalar> blocks(graph);
    Matrix kept = Matrix::Zero(dense.rows(), dense.cols());
    for (size_t column = 0; column < graph.sizes.size(); ++column)
        for (const int row : graph.neighbours[column]) {
            const auto place = [&](Matrix& of) {
                return of.block(graph.firstU[size_t(row)], graph.firstU[column],
                                graph.sizes[size_t(row)], graph.sizes[column]);
            };
            blocks.at(row, int(column)) = place(dense);
            place(kept) = place(dense);
        }
    dense = kept;
    return blocks;
}

MatrixXd collectG(const BlockMass& mass, Index n) {
    MatrixXd G(mass.numMultipliers, n);
    for (Index j = 0; j < n; ++j) G.col(j) = mass.multiplyG(VectorXd::Unit(n, j));
    return G;
}

template <class Scalar>
void compareWithDense(int numBodies, bool isRing, bool isSymmetric) {
    using Matrix = ::Eigen::Matrix<Scalar, Dynamic, Dynamic>;
    using Vector = ::Eigen::Matrix<Scalar, Dynamic, 1>;
    using Symmetry = typename TangentElimination<Scalar>::Symmetry;
    const Mechanism mechanism(numBodies, isRing);
    Evaluation equations(mechanism.system, mechanism.state);
    realizeAt(equations, mechanism.state);
    const BlockMass mass(equations);
    const BlockGraph graph(equations, BlockGraph::Links::OfJoints);
    const Index n = graph.firstU.back() + graph.sizes.back(), m = mass.numMultipliers;
    ASSERT_EQ(m, 3 * (numBodies + (isRing ? 1 : 0)));

    Matrix A = makeRandom<Matrix>(n, n, 1);
    if (isSymmetric) A = (A + A.transpose()).eval();
    A.diagonal().array() += 30.0;
    const BlockMatrix<Scalar> blocks = takeBlocks<Scalar>(graph, A);
    Matrix whole = Matrix::Zero(n + m, n + m);
    whole.topLeftCorner(n, n) = A;
    whole.bottomLeftCorner(m, n) = collectG(mass, n).template cast<Scalar>();
    whole.topRightCorner(n, m) = whole.bottomLeftCorner(m, n).transpose();
    const Vector b = makeRandom<Matrix>(n + m, 1, 2);
    const ::Eigen::PartialPivLU<Matrix> lu(whole);
    const Vector expected = lu.solve(b);

    TangentElimination<Scalar> elimination(graph, mass);
    const VectorXd scale = VectorXd::Ones(n) + 0.5 * VectorXd(makeRandom<MatrixXd>(n, 1, 3));
    for (const int threads : {1, 2}) {
        elimination.setNumThreads(threads);
        elimination.factor(blocks, scale, isSymmetric ? Symmetry::Symmetric : Symmetry::General);
        Vector f = b.head(n), g = b.tail(m);
        elimination.solve(f, g);
        EXPECT_LT((f - expected.head(n)).norm(), 1e-7 * expected.head(n).norm());
        EXPECT_LT((g - expected.tail(m)).norm(), 1e-7 * expected.tail(m).norm());
    }
    // Several columns of forces only.
    Matrix F = makeRandom<Matrix>(n, 3, 4), right = Matrix::Zero(n + m, 3);
    right.topRows(n) = F;
    elimination.solveEach(F);
    const Matrix each = lu.solve(right).topRows(n);
    EXPECT_LT((F - each).norm(), 1e-7 * each.norm());
}

TEST(TangentElimination, SolvesWhatDenseEquationsSolve) {
    for (const bool isRing : {false, true})
        for (const bool isSymmetric : {false, true}) {
            SCOPED_TRACE(isRing);
            SCOPED_TRACE(isSymmetric);
            compareWithDense<double>(5, isRing, isSymmetric);
            compareWithDense<Number>(5, isRing, isSymmetric);
        }
}

TEST(TangentElimination, CountsTheNegativeEigenvaluesOfWhatTheJointsLeaveFree) {
    const Mechanism mechanism(4, true);
    Evaluation equations(mechanism.system, mechanism.state);
    realizeAt(equations, mechanism.state);
    const BlockMass mass(equations);
    const BlockGraph graph(equations, BlockGraph::Links::OfJoints);
    const Index n = graph.firstU.back() + graph.sizes.back(), m = mass.numMultipliers;
    const MatrixXd G = collectG(mass, n);
    const MatrixXd Q = ::Eigen::HouseholderQR<MatrixXd>(G.transpose()).householderQ();
    const MatrixXd free = Q.rightCols(n - m);
    int before = int(n);
    for (const double shift : {-1e3, 0.0, 4.0, 1e3}) {
        MatrixXd A = makeRandom<MatrixXd>(n, n, 5);
        A = (A + A.transpose()).eval();
        A.diagonal().array() += shift;
        const BlockMatrix<double> blocks = takeBlocks<double>(graph, A);
        const VectorXd eigenvalues = ::Eigen::SelfAdjointEigenSolver<MatrixXd>(
                                         free.transpose() * A * free, ::Eigen::EigenvaluesOnly)
                                         .eigenvalues();
        TangentElimination<double> elimination(graph, mass);
        elimination.factor(blocks, VectorXd::Ones(n),
                           TangentElimination<double>::Symmetry::Symmetric);
        const int count = elimination.countNegative();
        EXPECT_EQ(count, (eigenvalues.array() < 0).count()) << "shift " << shift;
        EXPECT_LE(count, before);
        before = count;
    }
    EXPECT_EQ(before, 0);
}

TEST(TangentElimination, ClosesJoints) {
    const Mechanism mechanism(3, true);
    Evaluation equations(mechanism.system, mechanism.state);
    realizeAt(equations, mechanism.state);
    const BlockMass mass(equations);
    const BlockGraph graph(equations, BlockGraph::Links::OfJoints);
    const Index n = graph.firstU.back() + graph.sizes.back();
    MatrixXd A = MatrixXd::Identity(n, n);
    const BlockMatrix<double> blocks = takeBlocks<double>(graph, A);
    TangentElimination<double> elimination(graph, mass);
    elimination.factor(blocks, VectorXd::Ones(n), TangentElimination<double>::Symmetry::Symmetric);
    const MatrixXd open = makeRandom<MatrixXd>(n, 2, 6), G = collectG(mass, n);
    MatrixXd X = open;
    elimination.close(X);
    EXPECT_LT((G * X).norm(), 1e-7 * (G * open).norm());
    // With A = 1 it is the orthogonal projection.
    const MatrixXd projected = open - G.transpose() * (G * G.transpose()).ldlt().solve(G * open);
    EXPECT_LT((X - projected).norm(), 1e-7 * open.norm());
}

}  // namespace
}  // namespace simflex
