/** @file
Modal invariants against closed forms and against brute-force sums over the mesh. **/

#include <gmock/gmock.h>

#include <cmath>
#include <random>

#include "fe/TestDecks.h"
#include "simflex/fe/CalculixDeck.h"
#include "simflex/reduction/ModalInvariants.h"
#include "simflex/reduction/Reduction.h"

namespace simflex {
namespace {

using testing::Brick;
using testing::TestFolder;

FeModel readBrick(const Brick& brick) {
    TestFolder folder;
    testing::writeText(folder / "brick.inp", brick.text());
    return readCalculixDeck(folder / "brick.inp");
}

Eigen::Matrix3d tensorOf(const double* six) {
    Eigen::Matrix3d I;
    I << six[0], six[3], six[4], six[3], six[1], six[5], six[4], six[5], six[2];
    return I;
}

Eigen::Matrix3d boxInertia(const Brick& b) {
    const double m = b.mass(), x = b.size[0] * b.size[0], y = b.size[1] * b.size[1],
                 z = b.size[2] * b.size[2];
    return Eigen::Vector3d(y + z, x + z, x + y).asDiagonal() * (m / 12);
}

/** Returns the invariants of modes given as displacement fields of s. **/
template <class Field>
ReducedBody invariantsOf(const FeModel& model, int numModes, Field field) {
    const FeProducts products(model, std::vector<int>(size_t(model.mesh.numNodes()), -1));
    const RigidMotion rigid = calcRigidMotions(model, products);
    MeanAxisModes modes;
    modes.Phi.resize(model.K.size, numModes);
    for (int node = 0; node < model.mesh.numNodes(); ++node)
        for (int i = 0; i < numModes; ++i)
            modes.Phi.block<3, 1>(3 * node, i) =
                field(i, Eigen::Map<const Eigen::Vector3d>(&model.mesh.positions[3 * node]) -
                             rigid.center);
    modes.boundary.resize(0, numModes);
    modes.omegaSquared = Eigen::VectorXd::Ones(numModes);
    ReducedBody body;
    setModalInvariants(model, products, rigid, modes, InterfaceTies(model, {}), body);
    return body;
}

class BoxInvariants : public ::testing::TestWithParam<const char*> {};

TEST_P(BoxInvariants, UndeformedInertiaIsThatOfTheBox) {
    Brick brick;
    brick.type = GetParam();
    const ReducedBody body = invariantsOf(readBrick(brick), 0, [](int, auto s) { return s; });
    EXPECT_NEAR(body.mass, brick.mass(), 1e-12 * brick.mass());
    EXPECT_LT((tensorOf(body.inertia.data()) - boxInertia(brick)).norm(),
              1e-11 * boxInertia(brick).norm());
}

// Full integration of these elements is exact for products of linear fields.
INSTANTIATE_TEST_SUITE_P(Elements, BoxInvariants, ::testing::Values("C3D8", "C3D20"));

TEST(ModalInvariants, UniformStretchHasItsClosedForm) {
    const Brick brick;
    const double c = 3.7;
    const ReducedBody body = invariantsOf(readBrick(brick), 1, [c](int, const Eigen::Vector3d& s) {
        return Eigen::Vector3d(c * s.x(), 0, 0);
    });
    // r_x = (1 + cξ) s_x: I_yy and I_zz gain (2cξ + c²ξ²)∑m s_x², nothing else changes.
    const double sxx = brick.mass() * brick.size[0] * brick.size[0] / 12;
    const double first[6] = {0, 2 * c * sxx, 2 * c * sxx, 0, 0, 0};
    const double second[6] = {0, c * c * sxx, c * c * sxx, 0, 0, 0};
    for (int k = 0; k < 6; ++k) {
        EXPECT_NEAR(body.I1[k], first[k], 1e-11 * first[1]);
        EXPECT_NEAR(body.I2[k][0], second[k], 1e-11 * second[1]);
    }
}

TEST(ModalInvariants, StretchAndShearCoupleByTheirCrossProduct) {
    const Brick brick;
    const double x2 = brick.size[0] * brick.size[0], y2 = brick.size[1] * brick.size[1];
    // A shear weighted by (y·x², x·y²) so that it has no angular momentum.
    const ReducedBody body =
        invariantsOf(readBrick(brick), 2, [&](int i, const Eigen::Vector3d& s) {
            return i == 0 ? Eigen::Vector3d(s.x(), 0, 0)
                          : Eigen::Vector3d(s.y() * x2, s.x() * y2, 0);
        });
    const double expected = y2 * brick.mass() * x2 / 12;  // ∑m φ₁ₓ φ₂ᵧ
    EXPECT_NEAR(body.N[2][0 + 2 * 1], expected, 1e-11 * expected);
    EXPECT_NEAR(body.N[2][1 + 2 * 0], -expected, 1e-11 * expected);
    EXPECT_EQ(body.N[2][0], 0);
    EXPECT_NEAR(body.N[0][2], 0, 1e-11 * expected);
    EXPECT_NEAR(body.N[1][2], 0, 1e-11 * expected);
}

TEST(ModalInvariants, AModeThatMovesTheCentreOfMassIsRefused) {
    const FeModel model = readBrick(Brick());
    EXPECT_THAT(
        [&] { invariantsOf(model, 1, [](int, auto) { return Eigen::Vector3d(1, 0, 0); }); },
        ::testing::ThrowsMessage<std::invalid_argument>(::testing::HasSubstr("∑m φ of mode 1")));
    EXPECT_THAT(
        [&] {
            invariantsOf(model, 1, [](int, const Eigen::Vector3d& s) {
                return Eigen::Vector3d(-s.y(), s.x(), 0);
            });
        },
        ::testing::ThrowsMessage<std::invalid_argument>(::testing::HasSubstr("∑m s×φ of mode 1")));
}

class ReducedBrick : public ::testing::TestWithParam<const char*> {
protected:
    void SetUp() override {
        Brick brick;
        brick.type = GetParam();
        model = readBrick(brick);
        ReductionOptions options;
        options.interfaces = {{"left", "LEFT"}, {"right", "RIGHT"}};
        options.numModes = 30;
        body = reduce(model, options);
    }

    /** Calls f(p, q, m_pq) for every entry of the nodal mass matrix, both triangles. **/
    template <class Function>
    void forEachMass(Function f) const {
        for (int q = 0; q < model.m.size; ++q)
            for (auto k = model.m.columnStarts[q]; k < model.m.columnStarts[q + 1]; ++k) {
                f(model.m.rows[k], q, model.m.values[k]);
                if (model.m.rows[k] != q) f(q, model.m.rows[k], model.m.values[k]);
            }
    }

    Eigen::Vector3d position(int node) const {
        return Eigen::Map<const Eigen::Vector3d>(&body.mesh.positions[3 * node]);
    }
    Eigen::Vector3d displacement(int node, const Eigen::VectorXd& xi) const {
        Eigen::Vector3d u(0, 0, 0);
        for (int i = 0; i < body.numModes; ++i)
            u += xi[i] * Eigen::Map<const Eigen::Vector3d>(
                             &body.Phi[i * 3 * model.mesh.numNodes() + 3 * node]);
        return u;
    }
    Eigen::VectorXd randomModes(unsigned seed) const {
        std::mt19937 random(seed);
        std::uniform_real_distribution<double> uniform(-1, 1);
        Eigen::VectorXd xi(body.numModes);
        // A size that moves nodes by about the size of the part, so that every order matters.
        for (double& value : xi) value = 0.02 * uniform(random);
        return xi;
    }

    FeModel model;
    ReducedBody body;
};

TEST_P(ReducedBrick, InertiaPolynomialIsTheBruteForceInertia) {
    const Eigen::VectorXd xi = randomModes(1);
    Eigen::Matrix3d expected = Eigen::Matrix3d::Zero();
    forEachMass([&](int p, int q, double m) {
        const Eigen::Vector3d a = position(p) + displacement(p, xi),
                              b = position(q) + displacement(q, xi);
        expected += m * (a.dot(b) * Eigen::Matrix3d::Identity() - a * b.transpose());
    });
    std::array<double, 6> six = body.inertia;
    const int n = body.numModes;
    for (int c = 0; c < 6; ++c)
        for (int i = 0; i < n; ++i) {
            six[c] += xi[i] * body.I1[c + 6 * i];
            for (int j = 0; j < n; ++j) six[c] += xi[i] * xi[j] * body.I2[c][i + n * j];
        }
    EXPECT_GT((expected - tensorOf(body.inertia.data())).norm(), 0.1 * expected.norm());
    EXPECT_LT((tensorOf(six.data()) - expected).norm(), 1e-12 * expected.norm());
}

TEST_P(ReducedBrick, AngularMomentumOfModesIsTheBruteForceSum) {
    const Eigen::VectorXd xi = randomModes(2), rate = randomModes(3);
    Eigen::Vector3d expected(0, 0, 0), atRest(0, 0, 0), moved(0, 0, 0);
    forEachMass([&](int p, int q, double m) {
        expected += m * (position(p) + displacement(p, xi)).cross(displacement(q, rate));
        atRest += m * position(p).cross(displacement(q, rate));
        moved += m * displacement(q, rate);
    });
    const int n = body.numModes;
    Eigen::Vector3d C(0, 0, 0);
    for (int a = 0; a < 3; ++a)
        C[a] = xi.dot(Eigen::Map<const Eigen::MatrixXd>(body.N[a].data(), n, n) * rate);
    EXPECT_LT((C - expected).norm(), 1e-12 * xi.norm() * rate.norm());
    EXPECT_LT(atRest.norm(), 1e-12 * std::sqrt(body.inertia[2]) * rate.norm());
    EXPECT_LT(moved.norm(), 1e-12 * std::sqrt(body.mass) * rate.norm());
}

TEST_P(ReducedBrick, ModesAreOrthonormalAndStiffnessDiagonal) {
    const int n = body.numModes;
    const Shapes Phi =
        Eigen::Map<const Eigen::MatrixXd>(body.Phi.data(), 3 * model.mesh.numNodes(), n);
    const FeProducts products(model, std::vector<int>(size_t(model.mesh.numNodes()), -1));
    const Eigen::MatrixXd mass = Phi.transpose() * products.m.multiplyPerAxis(Phi);
    const Eigen::MatrixXd stiffness = Phi.transpose() * products.K.multiply(Phi);
    const RigidMotion rigid = calcRigidMotions(model, products);
    const Eigen::MatrixXd drift = rigid.R.transpose() * products.m.multiplyPerAxis(Phi);
    EXPECT_LT((mass - Eigen::MatrixXd::Identity(n, n)).cwiseAbs().maxCoeff(), 1e-12);
    EXPECT_LT(drift.cwiseAbs().maxCoeff(), 1e-12 * std::sqrt(body.mass));
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j)
            EXPECT_NEAR(stiffness(i, j), i == j ? body.omegaSquared[i] : 0,
                        1e-11 * body.omegaSquared[n - 1]);
    EXPECT_TRUE(std::is_sorted(body.omegaSquared.begin(), body.omegaSquared.end()));
}

TEST_P(ReducedBrick, InterfaceNodesFollowTheirMaster) {
    const double size = body.calcRadius();
    for (const auto& interface : body.interfaces)
        for (const int node : interface.nodes)
            for (int i = 0; i < body.numModes; ++i) {
                const Eigen::Vector3d phi(&interface.Phi[3 * i]), psi(&interface.Psi[3 * i]);
                const Eigen::Vector3d arm =
                    position(node) - Eigen::Vector3d(interface.position.data());
                const Eigen::Vector3d u(&body.Phi[i * 3 * model.mesh.numNodes() + 3 * node]);
                EXPECT_LT((u - phi - psi.cross(arm)).norm(),
                          1e-11 * (phi.norm() + psi.norm() * size));
            }
}

TEST_P(ReducedBrick, GyroscopicInvariantIsAntisymmetric) {
    const int n = body.numModes;
    for (const auto& N : body.N)
        for (int i = 0; i < n; ++i)
            for (int j = 0; j < n; ++j) EXPECT_EQ(N[i + n * j], -N[j + n * i]);
}

INSTANTIATE_TEST_SUITE_P(Elements, ReducedBrick, ::testing::Values("C3D8", "C3D8R", "C3D20"));

}  // namespace
}  // namespace simflex
