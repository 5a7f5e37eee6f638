/** @file
Inertia relief modes, modes at frequencies, missing static deflection, and the finer twin of a part:
against CalculiX and against dense linear algebra on the same K and M. **/

#include <gmock/gmock.h>

#include <Eigen/Dense>
#include <cmath>
#include <sstream>

#include "fe/TestDecks.h"
#include "simflex/fe/CalculixDeck.h"
#include "simflex/reduction/Reduction.h"

namespace simflex {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using testing::Brick;
using ::testing::HasSubstr;
using testing::TestFolder;

using Position = std::array<double, 3>;
using Tie = std::pair<std::string, Position>;

MatrixXd makeDense(const SymmetricMatrix& A, int perRow = 1) {
    MatrixXd dense = MatrixXd::Zero(perRow * A.size, perRow * A.size);
    for (int column = 0; column < A.size; ++column)
        for (auto k = A.columnStarts[column]; k < A.columnStarts[column + 1]; ++k)
            for (int a = 0; a < perRow; ++a) {
                dense(perRow * A.rows[k] + a, perRow * column + a) = A.values[k];
                dense(perRow * column + a, perRow * A.rows[k] + a) = A.values[k];
            }
    return dense;
}

/** Returns M a for nodal accelerations by position in the deck. **/
template <class Acceleration>
VectorXd makeInertiaLoad(const FeModel& model, const Acceleration& acceleration) {
    const Index numNodes = model.mesh.numNodes();
    MatrixXd a(numNodes, 3), f = MatrixXd::Zero(numNodes, 3);
    for (Index node = 0; node < numNodes; ++node)
        a.row(node) = acceleration(Eigen::Map<const Vector3d>(&model.mesh.positions[3 * node]));
    const SymmetricMatrix& m = model.m;
    for (int column = 0; column < m.size; ++column)
        for (auto k = m.columnStarts[column]; k < m.columnStarts[column + 1]; ++k) {
            f.row(m.rows[k]) += m.values[k] * a.row(column);
            if (m.rows[k] != column) f.row(column) += m.values[k] * a.row(m.rows[k]);
        }
    VectorXd joined(3 * numNodes);
    for (Index node = 0; node < numNodes; ++node) joined.segment<3>(3 * node) = f.row(node);
    return joined;
}

/** Returns the rigid motions of all nodes about a point. **/
MatrixXd calcRigidMotionsAbout(const Mesh& mesh, const Vector3d& point) {
    MatrixXd R(3 * mesh.numNodes(), 6);
    for (int node = 0; node < mesh.numNodes(); ++node) {
        const Vector3d r = Eigen::Map<const Vector3d>(&mesh.positions[3 * size_t(node)]) - point;
        for (int j = 0; j < 3; ++j) {
            R.block<3, 1>(3 * node, j) = Vector3d::Unit(j);
            R.block<3, 1>(3 * node, 3 + j) = Vector3d::Unit(j).cross(r);
        }
    }
    return R;
}

/** Returns the displacements of all nodes for the part's rigid motions and modes: B = [R, Φ]. **/
MatrixXd makeShapes(const FeModel& model, const ReducedBody& body) {
    MatrixXd B(3 * body.mesh.numNodes(), 6 + body.numModes);
    B << calcRigidMotionsAbout(model.mesh, Eigen::Map<const Vector3d>(body.centerOfMass.data())),
        Eigen::Map<const MatrixXd>(body.Phi.data(), B.rows(), body.numModes);
    return B;
}

/** Returns the same for the motion of an interface: 6×(6 + modes). **/
MatrixXd makeInterfaceShapes(const ReducedBody& body, const std::string& name) {
    const auto& interface = body.getInterface(name);
    const Index n = body.numModes;
    MatrixXd A(6, 6 + n);
    A << MatrixXd::Identity(6, 6), MatrixXd::Zero(6, n);
    for (int j = 0; j < 3; ++j)
        A.block<3, 1>(0, 3 + j) =
            Vector3d::Unit(j).cross(Eigen::Map<const Vector3d>(interface.position.data()));
    A.block(0, 6, 3, n) = Eigen::Map<const MatrixXd>(interface.Phi.data(), 3, n);
    A.block(3, 6, 3, n) = Eigen::Map<const MatrixXd>(interface.Psi.data(), 3, n);
    return A;
}

/** Returns the part's coordinates under nodal forces with one interface held. **/
VectorXd solveHeld(const ReducedBody& body, const std::string& held, const VectorXd& forces) {
    const Index n = 6 + body.numModes;
    MatrixXd system = MatrixXd::Zero(n + 6, n + 6);
    VectorXd scale = VectorXd::Ones(n + 6);
    for (Index i = 6; i < n; ++i) {
        system(i, i) = body.omegaSquared[size_t(i - 6)];
        scale[i] = 1 / std::sqrt(system(i, i));
    }
    system.bottomLeftCorner(6, n) = makeInterfaceShapes(body, held);
    system.topRightCorner(n, 6) = system.bottomLeftCorner(6, n).transpose();
    VectorXd right = VectorXd::Zero(n + 6);
    right.head(n) = forces;
    const MatrixXd scaled = scale.asDiagonal() * system * scale.asDiagonal();
    const VectorXd x = scaled.fullPivLu().solve(scale.asDiagonal() * right);
    return (scale.asDiagonal() * x).head(n);
}

// -------------------------------------------------------------------------------------------------
// comparison with CalculiX

struct HeldPart {
    const char* name;
    const char* elementType;
    double h;
    const char *firstSet, *secondSet;
    double length;
};

void PrintTo(const HeldPart& part, std::ostream* out) {
    *out << part.name << " " << part.elementType;
}

class InertiaReliefTest : public ::testing::TestWithParam<HeldPart> {};

TEST_P(InertiaReliefTest, WithoutAnyNormalModeWeightAndTurningBendThePartAsInCalculix) {
    SIMFLEX_NEEDS_CALCULIX();
    const HeldPart& part = GetParam();
    const TestFolder folder;
    const std::string deck = testing::meshExamplePart(folder, part.name, part.elementType, part.h);
    const Tie first{part.firstSet, {0, 0, 0}}, second{part.secondSet, {part.length, 0, 0}};
    ReductionOptions options;
    options.interfaces = {{"first", part.firstSet}, {"second", part.secondSet}};
    options.interfaces[0].master = first.second;
    options.interfaces[1].master = second.second;
    options.hasInertiaRelief = true;
    options.numModes = 12 + 12;
    const FeModel model = readCalculixDeck(deck);
    const ReducedBody body = reduce(model, options);
    EXPECT_TRUE(body.report->normalFrequencies.empty());
    EXPECT_EQ(body.report->numAttachmentModes, 12);
    const MatrixXd B = makeShapes(model, body);
    std::ostringstream watched;
    watched << "*NSET, NSET=WATCHED\n";
    for (const int number : model.mesh.nodeNumbers) watched << number << ",\n";
    testing::writeText(deck, testing::readText(deck) + watched.str());

    const Vector3d g(0.6 * 9.81, -0.64 * 9.81, 0.48 * 9.81);
    const Vector3d axis(0.36, 0.48, 0.8), point(0.02, -0.05, 0.01);
    const double omegaSquared = 1e4;
    const VectorXd weight = makeInertiaLoad(model, [&](const Vector3d&) { return g; });
    const VectorXd turning = makeInertiaLoad(model, [&](const Vector3d& x) {
        return Vector3d(-omegaSquared * axis.cross(axis.cross(x - point)));
    });
    const std::pair<VectorXd, const char*> cases[] = {
        {weight, "*DLOAD\nBODY, GRAV, 9.81, 0.6, -0.64, 0.48\n"},
        {turning, "*DLOAD\nBODY, CENTRIF, 1e4, 0.02, -0.05, 0.01, 0.36, 0.48, 0.8\n"}};
    for (const auto& [f, cards] : cases) {
        const auto expected =
            testing::calcCalculixDisplacements(folder, deck, first, second, "WATCHED", cards);
        const VectorXd u = B * solveHeld(body, "first", B.transpose() * f);
        double largest = 0, error = 0;
        for (int node = 0; node < model.mesh.numNodes(); ++node) {
            const auto& x = expected.at(model.mesh.nodeNumbers[size_t(node)]);
            const Vector3d there(x[0], x[1], x[2]);
            largest = std::max(largest, there.norm());
            error = std::max(error, (u.segment<3>(3 * node) - there).norm());
        }
        EXPECT_LT(error, 1e-5 * largest) << cards;
        EXPECT_GT(largest, 0);
    }
}

INSTANTIATE_TEST_SUITE_P(
    Parts, InertiaReliefTest,
    ::testing::Values(HeldPart{"crank", "C3D8R", 0.003, "SHAFT", "PIN", 0.06},
                      HeldPart{"crank", "C3D20", 0.004, "SHAFT", "PIN", 0.06},
                      HeldPart{"shapely_rod", "C3D10", 0.004, "BIG_END", "SMALL_END", 0.18}),
    [](const auto& part) { return std::string(part.param.name) + "_" + part.param.elementType; });

// -------------------------------------------------------------------------------------------------
// comparison with dense algebra

class StaticModesTest : public ::testing::Test {
protected:
    static void SetUpTestSuite() {
        TestFolder folder;
        testing::writeText(folder / "brick.inp", Brick().text());
        model = new FeModel(readCalculixDeck(folder / "brick.inp"));
        K = makeDense(model->K);
        M = makeDense(model->m, 3);
    }
    static void TearDownTestSuite() { delete model; }

    static ReductionOptions twoEnds(int numModes) {
        ReductionOptions options;
        options.name = "brick";
        options.interfaces = {{"left", "LEFT", TieType::Rigid},
                              {"right", "RIGHT", TieType::Distributing}};
        options.numModes = numModes;
        return options;
    }

    /** Returns T of u = T q: the motion of the left master first, then that of the other nodes. **/
    static MatrixXd tieLeft() {
        const auto& nodes = model->mesh.nodeSets.at("LEFT");
        const Index n = K.cols();
        MatrixXd T = MatrixXd::Zero(n, 6 + n - 3 * Index(nodes.size()));
        const MatrixXd R = calcRigidMotionsAbout(model->mesh, findMiddle("LEFT"));
        for (const int node : nodes) T.block(3 * node, 0, 3, 6) = R.middleRows(3 * node, 3);
        Index column = 6;
        for (int node = 0; node < model->mesh.numNodes(); ++node)
            if (!std::binary_search(nodes.begin(), nodes.end(), node))
                for (int a = 0; a < 3; ++a) T(3 * node + a, column++) = 1;
        return T;
    }

    static Vector3d findMiddle(const std::string& set) {
        Vector3d mean = Vector3d::Zero();
        for (const int node : model->mesh.nodeSets.at(set))
            mean += Eigen::Map<const Vector3d>(&model->mesh.positions[3 * size_t(node)]);
        return mean / double(model->mesh.nodeSets.at(set).size());
    }

    /** Returns the right end's nodal forces for a unit force on its master, distributed uniformly
    over its 2×2 faces.
    **/
    static VectorXd pushRight(int axis) {
        VectorXd f = VectorXd::Zero(K.cols());
        for (const int node : model->mesh.nodeSets.at("RIGHT")) {
            const auto x = model->mesh.position(node);
            f[3 * node + axis] =
                (std::abs(x[1]) < 1e-9 ? 2 : 1) * (std::abs(x[2]) < 1e-9 ? 2 : 1) / 16.0;
        }
        return f;
    }

    static FeModel* model;
    static MatrixXd K, M;
};

FeModel* StaticModesTest::model = nullptr;
MatrixXd StaticModesTest::K, StaticModesTest::M;

TEST_F(StaticModesTest, EveryLinearFieldOfAccelerationIsCarriedExactly) {
    ReductionOptions options = twoEnds(24);
    const ReducedBody plain = reduce(*model, twoEnds(12));
    options.hasInertiaRelief = true;
    const ReducedBody body = reduce(*model, options);
    EXPECT_EQ(body.numModes, 18);
    MatrixXd T = tieLeft();
    const MatrixXd free = T.rightCols(T.cols() - 6);
    const Eigen::LDLT<MatrixXd> factored(free.transpose() * K * free);
    const MatrixXd B = makeShapes(*model, body), plainB = makeShapes(*model, plain);
    double worstPlain = 0;
    for (int k = 0; k < 12; ++k) {
        const VectorXd f = makeInertiaLoad(*model, [&](const Vector3d& x) {
            return k < 3 ? Vector3d(Vector3d::Unit(k))
                         : Vector3d(x[(k - 3) / 3] * Vector3d::Unit(k % 3));
        });
        const VectorXd expected = free * factored.solve(free.transpose() * f);
        const VectorXd u = B * solveHeld(body, "left", B.transpose() * f),
                       without = plainB * solveHeld(plain, "left", plainB.transpose() * f);
        EXPECT_LT((u - expected).norm(), 1e-6 * expected.norm()) << "field " << k;
        worstPlain = std::max(worstPlain, (without - expected).norm() / expected.norm());
    }
    EXPECT_GT(worstPlain, 0.01);  // otherwise the test is void
}

TEST_F(StaticModesTest, APartWithoutInterfacesGetsTheSixThatBendIt) {
    ReductionOptions options;
    options.numModes = 6 + 6;
    options.hasInertiaRelief = true;
    const ReducedBody body = reduce(*model, options);
    EXPECT_EQ(body.numModes, 6);
    EXPECT_EQ(body.report->numAttachmentModes, 6);
}

/** Harmonic responses at a frequency of the part and of the full model. **/
TEST_F(StaticModesTest, AtItsFrequencyThePartAnswersAsTheFullModel) {
    const MatrixXd T = tieLeft();
    const MatrixXd KT = T.transpose() * K * T, MT = T.transpose() * M * T;
    const VectorXd normal =
        Eigen::Map<const VectorXd>(reduce(*model, twoEnds(20)).report->normalFrequencies.data(), 8);
    const int load = 3 * model->mesh.indexOf(5) + 1;
    for (const int numNormal : {0, 4})
        for (const double hertz : {0.6 * normal[0], 0.5 * (normal[2] + normal[3])}) {
            ReductionOptions options = twoEnds(12 + 1 + 13 + numNormal);
            options.loadPoints = {{"node:5", "y"}};
            options.frequencies = {hertz};
            const ReducedBody body = reduce(*model, options);
            options.frequencies.clear();
            const ReducedBody plain = reduce(*model, options);
            const double shift = std::pow(2 * M_PI * hertz, 2);
            const Eigen::PartialPivLU<MatrixXd> full(KT - shift * MT);
            const auto answer = [&](const ReducedBody& of, const VectorXd& f,
                                    const VectorXd& onLeft) -> VectorXd {
                const MatrixXd B = makeShapes(*model, of);
                MatrixXd dynamic = -shift * (B.transpose() * M * B);
                for (int i = 0; i < of.numModes; ++i)
                    dynamic(6 + i, 6 + i) += of.omegaSquared[size_t(i)];
                return B * dynamic.partialPivLu().solve(
                               B.transpose() * f +
                               makeInterfaceShapes(of, "left").transpose() * onLeft);
            };
            double worstPlain = 0;
            const auto check = [&](const VectorXd& f, const VectorXd& onLeft, const char* what) {
                VectorXd right = T.transpose() * f;
                right.head(6) += onLeft;
                const VectorXd expected = T * full.solve(right);
                EXPECT_LT((answer(body, f, onLeft) - expected).norm(), 1e-7 * expected.norm())
                    << what << " at " << hertz << " Hz, normal modes: " << numNormal;
                worstPlain = std::max(
                    worstPlain, (answer(plain, f, onLeft) - expected).norm() / expected.norm());
            };
            VectorXd f = VectorXd::Zero(K.cols());
            const VectorXd nothing = f, still = VectorXd::Zero(6);
            f[load] = 1;
            check(f, still, "load point");
            for (int axis = 0; axis < 3; ++axis) check(pushRight(axis), still, "right interface");
            for (int k = 0; k < 6; ++k) check(nothing, VectorXd::Unit(6, k), "left interface");
            EXPECT_GT(worstPlain, 1e-6);  // otherwise the test is void
        }
}

TEST_F(StaticModesTest, ModesThatFrequenciesShareAreTakenOnce) {
    ReductionOptions options = twoEnds(12 + 24 + 4);
    const double hertz = 0.5 * reduce(*model, twoEnds(20)).report->normalFrequencies[0];
    options.frequencies = {hertz, hertz};
    EXPECT_EQ(reduce(*model, options).report->numAttachmentModes, 12);
}

TEST_F(StaticModesTest, FrequenciesThatCannotBeAreRefused) {
    const auto errorOf = [&](const ReductionOptions& options) -> std::string {
        try {
            reduce(*model, options);
        } catch (const std::invalid_argument& error) {
            return error.what();
        }
        return "accepted";
    };
    ReductionOptions options = twoEnds(40);
    options.frequencies = {-3};
    EXPECT_THAT(errorOf(options), HasSubstr("must be positive"));
    options.frequencies = {100};
    options.numModes = 20;
    EXPECT_THAT(errorOf(options), HasSubstr("ask for at least 24"));
    ReductionOptions alone;
    alone.frequencies = {100};
    EXPECT_THAT(errorOf(alone), HasSubstr("neither"));
}

TEST_F(StaticModesTest, WhatIsLackingOfStaticDeflectionIsThatOfDenseAlgebra) {
    ReductionOptions options = twoEnds(13);
    options.loadPoints = {{"node:5", "y"}};
    options.numCheckedModes = 1;
    const ReducedBody body = reduce(*model, options);
    const auto errorOf = [](const ReducedBody& of, const std::string& load) {
        for (const StaticError& error : of.report->staticErrors)
            if (error.load == load) return error.error;
        ADD_FAILURE() << load;
        return 0.0;
    };
    EXPECT_EQ(body.report->staticErrors.size(), 6u + 12u + 1u);
    // The compliance of the tied free model under a load balanced by inertia.
    const MatrixXd T = tieLeft(), KT = T.transpose() * K * T, MT = T.transpose() * M * T;
    const MatrixXd R =
        T.colPivHouseholderQr().solve(calcRigidMotionsAbout(model->mesh, Vector3d::Zero()));
    const MatrixXd MR = MT * R;
    const auto calcError = [&](const ReducedBody& of, const VectorXd& f) {
        const VectorXd q = T.transpose() * f,
                       p = q - MR * (R.transpose() * MR).ldlt().solve(R.transpose() * q);
        const double whole = p.dot((KT + MR * MR.transpose()).ldlt().solve(p));
        const MatrixXd Phi = makeShapes(*model, of).rightCols(of.numModes);
        const Eigen::Map<const VectorXd> omegaSquared(of.omegaSquared.data(), of.numModes);
        return 1 - (Phi.transpose() * f).cwiseAbs2().cwiseQuotient(omegaSquared).sum() / whole;
    };
    VectorXd f = VectorXd::Zero(K.cols());
    f[3 * model->mesh.indexOf(5) + 1] = 1;
    const double atPoint = calcError(body, f), atRight = calcError(body, pushRight(1));
    EXPECT_NEAR(errorOf(body, "force y at load point 'node:5'"), atPoint, 1e-8);
    EXPECT_NEAR(errorOf(body, "force y on interface 'right'"), atRight, 1e-8);
    EXPECT_GT(atRight, 1e-4);

    // With inertia relief nothing is missing.
    options.numModes = 25;
    options.hasInertiaRelief = true;
    const ReducedBody relieved = reduce(*model, options);
    for (const StaticError& error : relieved.report->staticErrors)
        EXPECT_LT(std::abs(error.error), 1e-8) << error.load;
}

TEST_F(StaticModesTest, TheFinerTwinLeavesThePartAsItIsAndTellsWhatItLacks) {
    ReductionOptions options = twoEnds(16);
    const ReducedBody alone = reduce(*model, options);
    options.numFurtherModes = 10;
    const ReducedBody body = reduce(*model, options);
    EXPECT_EQ(body.Phi, alone.Phi);
    EXPECT_EQ(body.omegaSquared, alone.omegaSquared);
    EXPECT_FALSE(alone.finer);
    ASSERT_TRUE(body.finer && body.finer->further);
    const ReducedBody& finer = *body.finer;
    EXPECT_EQ(finer.report->normalFrequencies.size(), 14u);
    EXPECT_EQ(finer.numModes, 12 + 12 + 14 - 6);
    const size_t m = finer.further->displacements.size();
    EXPECT_EQ(m, 10u + 12u);

    // Shapes within the part's span do not involve the additional modes; others do.
    const Eigen::Map<const MatrixXd> coarse(body.Phi.data(), K.cols(), body.numModes),
        fine(finer.Phi.data(), K.cols(), finer.numModes),
        coordinates(finer.further->coordinates.data(), Index(m), finer.numModes);
    const MatrixXd xi = fine.transpose() * M * coarse;
    EXPECT_LT((fine * xi - coarse).norm(), 1e-8 * coarse.norm());  // also in the twin's span
    const VectorXd sizes =
        Eigen::Map<const VectorXd>(body.omegaSquared.data(), body.numModes).cwiseSqrt();
    EXPECT_LT(((coordinates * xi).array().rowwise() / sizes.transpose().array()).abs().maxCoeff(),
              1e-7);
    // Together with the part's own modes they reproduce the energy: rank and size.
    EXPECT_EQ(Eigen::FullPivLU<MatrixXd>(coordinates).rank(), Index(m));
    const MatrixXd perUnit =
        coordinates * Eigen::Map<const VectorXd>(finer.omegaSquared.data(), finer.numModes)
                          .cwiseSqrt()
                          .cwiseInverse()
                          .asDiagonal();
    EXPECT_LT((perUnit * perUnit.transpose() - MatrixXd::Identity(Index(m), Index(m))).norm(),
              1e-6);
}

}  // namespace
}  // namespace simflex
