// Linearized equations and natural modes against closed forms and against accelerations of
// displaced states.

#include <gtest/gtest.h>

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"
#include "simflex/forces/Bushing.h"

#include "simflex/forces/ModalDamping.h"
#include "simflex/solver/BdfIntegrator.h"
#include "simflex/solver/Eigenmodes.h"
#include "simflex/solver/FrequencyResponse.h"
#include "simflex/solver/StaticEquilibrium.h"
#include "simflex/solver/equilibrium/TangentElimination.h"
#include "support/PointMassPart.h"

namespace simflex {
namespace {

using namespace SimTK;

constexpr Real Gravity = 9.81;

std::vector<Real> listFrequencies(const std::vector<Eigenmode>& modes) {
    std::vector<Real> frequencies;
    for (const Eigenmode& mode : modes) frequencies.push_back(2 * Pi * mode.frequency);
    return frequencies;
}

/** A body with inertia (I1, I1, I3) about its centre of mass. **/
Body::Rigid makeTop(Real mass, const Vec3& center, Real I1, Real I3) {
    const Inertia central(I1, I1, I3);
    return Body::Rigid(MassProperties(mass, center, central.shiftFromMassCenter(center, mass)));
}

/** A part with random modes, and a spring and a damper from its frame to Ground. **/
struct SpringMounted {
    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    FlexibleBodySubsystem flexible{system, matter};
    FlexibleBody body;
    State state;

    SpringMounted() : body(flexible, test::makePointMassPart().body) {
        Force::Gravity(forces, matter, Vec3(1, -9.81, 2));
        Force::TwoPointLinearSpring(forces, matter.Ground(), Vec3(0.1, 0.5, 0), body.getFrame(),
                                    Vec3(0.05, 0.02, 0.01), 300, 0.3);
        Force::TwoPointLinearDamper(forces, matter.Ground(), Vec3(0.1, 0.5, 0), body.getFrame(),
                                    Vec3(0.05, 0.02, 0.01), 4);
        ModalDamping(flexible, body, 0.02);
        state = system.realizeTopology();
        body.setFramePose(state, Transform(Rotation(0.4, UnitVec3(1, 2, -1)), Vec3(0.1, 0.2, 0.3)));
        Vector xi(body.getNumModes());
        for (int i = 0; i < xi.size(); ++i) xi[i] = 1e-3 * std::cos(1.0 + i);
        body.setModalCoordinates(state, xi);
    }

    Vector calcUDot(const State& at) const {
        BdfIntegrator integrator(system);
        integrator.initialize(at);
        return integrator.getUDot();
    }
};

/** Displaced flexible and rigid bodies with joints, a bushing between two of them and a load. **/
struct Assembly {
    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    FlexibleBodySubsystem flexible{system, matter};
    State state;

    explicit Assembly(Real stiffening) {
        Force::Gravity(forces, matter, Vec3(1, -9.81, 2));
        test::PointMassPartOptions options;
        options.numModes = 34;
        options.cells = {5, 1, 1};
        options.stiffening = stiffening;
        const auto part = test::makePointMassPart(options).body;
        const FlexibleBody a(flexible, part), b(flexible, part);
        const MobilizedBody::Pin crank(matter.Ground(), Transform(),
                                       makeTop(1, Vec3(0, 0.1, 0), 1, 2), Transform());
        Joint::Pin(flexible, matter.Ground(), a.interface("A"));
        Joint::Weld(flexible, a.interface("B"), b.interface("A"));
        Joint::Pin(flexible, b.interface("B"), Attachment(crank, Vec3(0.1, 0.2, 0.3)));
        Bushing(flexible, a.interface("A"), b.interface("B"),
                Bushing::diagonal(Vec6(300, 200, 100, 3000, 2000, 1000)),
                Bushing::diagonal(Vec6(3, 5, 2, 40, 30, 20)));
        Bushing(flexible, Attachment(crank, Vec3(0, 0.1, 0)), a.interface("B"),
                Bushing::diagonal(Vec6(10, 20, 30, 400, 300, 200)),
                Bushing::diagonal(Vec6(1, 2, 3, 4, 5, 6)));
        ModalDamping(flexible, a, 0.02);
        state = system.realizeTopology();
        a.setFramePose(state, Transform(Rotation(0.4, UnitVec3(1, 2, -1)), Vec3(0.1, 0.2, 0.3)));
        b.setFramePose(state, Transform(Rotation(-0.7, UnitVec3(3, 2, 1)), Vec3(0.5, 0.1, 0.2)));
        crank.setOneQ(state, 0, 0.3);
        for (const FlexibleBody& body : {a, b}) {
            Vector xi(body.getNumModes());
            for (int i = 0; i < xi.size(); ++i) xi[i] = 1e-3 * std::cos(1.0 + i);
            body.setModalCoordinates(state, xi);
        }
    }
};

TEST(Linearization, StiffnessAndDampingFoundInFramesAreThoseOfDifferencesOfAllForces) {
    for (const Real stiffening : {0.0, 1.0}) {
        SCOPED_TRACE(stiffening);
        Assembly model(stiffening);
        model.system.realize(model.state, Stage::Velocity);
        Evaluation equations(model.system, model.state);
        const Topology& topology = equations.getTopology();
        SolutionPoint point;
        point.resize(topology.numQ, topology.numU, topology.numMultipliers, topology.numZ);
        equations.getBlocks().getFromState(model.state, point.q.data(), point.u.data());
        for (size_t k = 0; k < point.lambda.size(); ++k)
            point.lambda[k] = 30 * std::cos(1.0 + double(k));
        const auto evaluate = [&](const std::vector<double>& q, ::Eigen::VectorXd& r) {
            equations.realize(0, q.data(), point.u.data());
            equations.calcResidual(q.data(), point.u.data(), point.uDot.data(), point.lambda.data(),
                                   r.data());
        };
        ::Eigen::VectorXd r(topology.numU);
        evaluate(point.q, r);
        const BlockMass mass(equations);
        const CoordinateScales scales(equations.getBlocks());
        const BlockGraph graph(equations, BlockGraph::Links::OfJoints);
        BlockMatrix<double> K = calcStiffness(equations, scales, graph, mass, point, evaluate);
        EXPECT_EQ(K.hasShapes(0), stiffening == 0);
        const ::Eigen::MatrixXd expected =
            differentiateByQ(equations, scales, 0, point.q, point.u, evaluate);
        const Eigen::Index n = expected.rows();
        ::Eigen::MatrixXd found(n, n);
        for (Eigen::Index i = 0; i < n; ++i)
            found.col(i) = K.multiply(::Eigen::VectorXd::Unit(n, i));
        EXPECT_LT((found - expected).norm(), 1e-9 * expected.norm());
        EXPECT_LT((K.getDiagonal() - expected.diagonal()).norm(), 1e-9 * expected.norm());
        const ::Eigen::MatrixXd soft = expected.topLeftCorner(6, 6);
        EXPECT_LT((found.topLeftCorner(6, 6) - soft).norm(), 1e-7 * soft.norm());
        const auto checkDamping = [&] {
            const BlockMatrix<double> D =
                calcDampingBlocks(equations, scales, graph, mass, point, {});
            EXPECT_EQ(D.hasShapes(0), stiffening == 0);
            const ::Eigen::MatrixXd damping = calcDampingMatrix(equations, scales, point);
            ::Eigen::MatrixXd foundDamping(n, n);
            for (Eigen::Index i = 0; i < n; ++i)
                foundDamping.col(i) = D.multiply(::Eigen::VectorXd::Unit(n, i));
            EXPECT_LT((foundDamping - damping).norm(), 1e-8 * damping.norm());
            const ::Eigen::MatrixXd softDamping = damping.topLeftCorner(6, 6);
            EXPECT_LT((foundDamping.topLeftCorner(6, 6) - softDamping).norm(),
                      1e-8 * softDamping.norm());
        };
        checkDamping();

        // Eliminates K + M with the joints.
        K.addMass(mass, 1e5);
        TangentElimination<double> elimination(graph, mass);
        elimination.factor(K, ::Eigen::VectorXd::Constant(n, 1e-3),
                           TangentElimination<double>::Symmetry::General);
        ::Eigen::VectorXd f(n), g(topology.numMultipliers);
        for (Eigen::Index i = 0; i < n; ++i) f[i] = std::cos(2.0 + double(i));
        for (Eigen::Index i = 0; i < g.size(); ++i) g[i] = 1e-3 * std::sin(1.0 + double(i));
        ::Eigen::VectorXd x = f, lambda = g;
        elimination.solve(x, lambda);
        EXPECT_LT((K.multiply(x) + mass.multiplyGt(lambda) - f).norm(), 1e-8 * f.norm());
        EXPECT_LT((mass.multiplyG(x) - g).norm(), 1e-6 * g.norm());
    }
}

TEST(Linearization, PredictsAccelerationsOfDisplacedStates) {
    const SpringMounted model;
    const Linearization linear = calcLinearization(model.system, model.state);
    const Vector before = model.calcUDot(model.state);
    EXPECT_LT((before - linear.uDot).normInf(), 1e-9 * before.normInf());
    // Displacements of ±h along random directions: second-order terms cancel.
    const int n = linear.M.nrow(), first = model.body.getFrame().getFirstUIndex(model.state);
    for (int trial = 0; trial < 3; ++trial) {
        Vector delta(n);
        for (int i = 0; i < n; ++i) delta[i] = 1e-5 * std::cos(1.3 * i + trial) / (i < 6 ? 1 : 10);
        Vector change(n, Real(0));
        for (const Real sign : {-1.0, 1.0}) {
            State moved = model.state;
            model.system.realize(moved, Stage::Position);
            const Vec3 turn = sign * Vec3::getAs(&delta[first]);
            const Vec3 shift = sign * Vec3::getAs(&delta[first + 3]);
            const Transform X = model.body.getFramePose(moved);
            model.body.setFramePose(
                moved, Transform(Rotation(turn.norm(), UnitVec3(turn)) * X.R(), X.p() + shift));
            for (int k = 0; k < model.body.getNumModalMobilizers(); ++k) {
                const MobilizedBody& modes = model.body.getModalMobilizer(k);
                const int u0 = modes.getFirstUIndex(moved), q0 = modes.getFirstQIndex(moved);
                for (int i = 0; i < modes.getNumU(moved); ++i)
                    moved.updQ()[q0 + i] += sign * delta[u0 + i];
            }
            change += 0.5 * sign * model.calcUDot(moved);
        }
        const Vector residual = linear.M * change + linear.K * delta;
        EXPECT_LT(residual.normInf(), 1e-8 * Vector(linear.K * delta).normInf()) << trial;
    }
}

TEST(Linearization, StiffnessAboutAnEquilibriumIsTheHessianOfTheEnergy) {
    // Without joints, δᵀKδ is the second difference of the energy along any path if its gradient
    // vanishes.
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    Force::Gravity(forces, matter, -YAxis, Gravity);
    const Vec3 stations[] = {{0.2, 0.1, 0}, {-0.2, 0.1, 0.1}, {0, 0.1, -0.2}};
    FlexibleBodySubsystem flexible(system, matter);
    const FlexibleBody body(flexible, test::makePointMassPart().body);
    for (const Vec3& station : stations)
        Force::TwoPointLinearSpring(forces, matter.Ground(), 3 * station, body.getFrame(), station,
                                    400, 0.2);
    StaticEquilibrium equilibrium(system);
    equilibrium.solve(system.realizeTopology());
    const State& state = equilibrium.getState();
    const Linearization linear = calcLinearization(system, state);
    const auto calcEnergy = [&](const Eigenmode& mode, Real amplitude) {
        const State moved = calcModeStates(system, linear, mode, amplitude, 1)[0];
        system.realize(moved, Stage::Dynamics);
        return flexible.calcEnergy(moved);
    };
    const std::vector<Eigenmode> modes = calcEigenmodes(linear);
    EXPECT_EQ(modes.size(), size_t(linear.M.nrow()));
    system.realize(state, Stage::Dynamics);
    const Real atRest = flexible.calcEnergy(state), h = 1e-3;
    for (const size_t k : {0, 2, 5, 6, 9}) {
        // ω² of a mode from the energies at two amplitudes and its displacement per unit of x.
        Eigenmode opposite = modes[k];
        opposite.shape *= Complex(-1);
        const Real work = calcEnergy(modes[k], h) + calcEnergy(opposite, h) - 2 * atRest;
        const State moved = calcModeStates(system, linear, modes[k], h, 1)[0];
        const Vector xi = body.getModalCoordinates(moved) - body.getModalCoordinates(state);
        Real scale = 0, largest = 0;
        for (int i = 0; i < xi.size(); ++i) {
            const int u = int(body.getModalMobilizer(i / 6).getFirstUIndex(state)) + i % 6;
            if (std::abs(xi[i]) <= largest) continue;
            largest = std::abs(xi[i]);
            scale = xi[i] / modes[k].shape[u].real();
        }
        const Real omegaSquared = work / square(scale);
        EXPECT_NEAR(omegaSquared, square(2 * Pi * modes[k].frequency), 1e-4 * omegaSquared) << k;
    }
}

TEST(Linearization, PredictsAccelerationsOfChangedSpeeds) {
    const SpringMounted model;
    const Linearization linear = calcLinearization(model.system, model.state);
    const int n = linear.M.nrow();
    Vector speed(n), change(n, Real(0));
    for (int i = 0; i < n; ++i) speed[i] = 0.1 * std::cos(1.3 * i);
    for (const Real sign : {-1.0, 1.0}) {
        State moved = model.state;
        moved.updU() = sign * speed;
        change += 0.5 * sign * model.calcUDot(moved);
    }
    const Vector residual = linear.M * change + linear.D * speed;
    EXPECT_LT(residual.normInf(), 1e-9 * Vector(linear.D * speed).normInf());
}

TEST(Eigenmodes, OfAFreePartAreItsOwnWithTheirDampingAndSixRigidMotions) {
    for (const Real ratio : {0.0, 0.03}) {
        MultibodySystem system;
        SimbodyMatterSubsystem matter(system);
        FlexibleBodySubsystem flexible(system, matter);
        const auto part = test::makePointMassPart().body;
        const FlexibleBody body(flexible, part);
        if (ratio > 0) ModalDamping(flexible, body, ratio);
        const State state = system.realizeTopology();
        const std::vector<Eigenmode> modes = calcEigenmodes(calcLinearization(system, state));
        ASSERT_EQ(modes.size(), size_t(6 + part->numModes));
        for (int k = 0; k < 6; ++k) EXPECT_TRUE(modes[size_t(k)].isRigidMotion()) << k;
        for (int k = 0; k < part->numModes; ++k) {
            const Eigenmode& mode = modes[size_t(6 + k)];
            const Real expected = std::sqrt(part->omegaSquared[size_t(k)]) / (2 * Pi);
            EXPECT_NEAR(mode.frequency, expected, 1e-9 * expected);
            EXPECT_NEAR(mode.dampingRatio, ratio, 1e-9);
        }
    }
}

TEST(Eigenmodes, OfADoublePendulumAreThoseOfTheTextbook) {
    // Two equal point-like bobs on equal massless rods: ω² = (2 ∓ √2) g/l.
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    Force::Gravity gravity(forces, matter, -YAxis, Gravity);
    const Real l = 0.7;
    const Body::Rigid bob(
        MassProperties(1.3, Vec3(0, -l, 0), Inertia(1.3 * Vec3(l * l, 0, l * l))));
    MobilizedBody::Pin first(matter.Ground(), Transform(), bob, Transform());
    MobilizedBody::Pin second(first, Transform(Vec3(0, -l, 0)), bob, Transform());
    const State state = system.realizeTopology();
    const std::vector<Real> found =
        listFrequencies(calcEigenmodes(calcLinearization(system, state)));
    ASSERT_EQ(found.size(), 2u);
    EXPECT_NEAR(found[0], std::sqrt((2 - std::sqrt(2.0)) * Gravity / l), 1e-9 * found[0]);
    EXPECT_NEAR(found[1], std::sqrt((2 + std::sqrt(2.0)) * Gravity / l), 1e-9 * found[1]);
}

TEST(Eigenmodes, StandingPendulumGrowsAndShrinks) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    Force::Gravity gravity(forces, matter, -YAxis, Gravity);
    const Real l = 0.5;
    MobilizedBody::Pin pin(
        matter.Ground(), Transform(),
        Body::Rigid(MassProperties(2, Vec3(0, l, 0), Inertia(2 * Vec3(l * l, 0, l * l)))),
        Transform());
    const std::vector<Eigenmode> modes =
        calcEigenmodes(calcLinearization(system, system.realizeTopology()));
    ASSERT_EQ(modes.size(), 2u);
    Real sum = 0;
    for (const Eigenmode& mode : modes) {
        EXPECT_NEAR(std::abs(mode.eigenvalue.real()), std::sqrt(Gravity / l), 1e-9);
        EXPECT_EQ(std::abs(mode.dampingRatio), 1);
        sum += mode.eigenvalue.real();
    }
    EXPECT_NEAR(sum, 0, 1e-9);
    const std::vector<Eigenmode> growing = calcGrowingModes(system, system.getDefaultState());
    ASSERT_EQ(growing.size(), 1u);
    EXPECT_NEAR(growing[0].eigenvalue.real(), std::sqrt(Gravity / l), 1e-9);
}

TEST(Eigenmodes, WithoutSpeedsNothingGrows) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    MobilizedBody::Weld(matter.Ground(), Body::Rigid(MassProperties(1, Vec3(0), Inertia(1))));
    EXPECT_TRUE(calcGrowingModes(system, system.realizeTopology()).empty());
}

TEST(Eigenmodes, SleepingTopPrecessesAndNutates) {
    // I₁ω² − I₃Ωω + mgl = 0 about the pivot. Non-rotating axes: two pins and the spin.
    const Real m = 1.5, l = 0.1, I1 = 0.02, I3 = 0.008, spin = 150;
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    Force::Gravity gravity(forces, matter, -ZAxis, Gravity);
    const Body::Massless ring;
    const Rotation zToX(Pi / 2, YAxis), zToY(-Pi / 2, XAxis);
    MobilizedBody::Pin aboutX(matter.Ground(), Transform(zToX), ring, Transform(zToX));
    MobilizedBody::Pin aboutY(aboutX, Transform(zToY), ring, Transform(zToY));
    MobilizedBody::Pin top(aboutY, Transform(), makeTop(m, Vec3(0, 0, l), I1 - m * l * l, I3),
                           Transform());
    State state = system.realizeTopology();
    top.setOneU(state, 0, spin);
    const std::vector<Eigenmode> modes = calcEigenmodes(calcLinearization(system, state));
    const Real root = std::sqrt(I3 * I3 * spin * spin - 4 * I1 * m * Gravity * l);
    ASSERT_EQ(modes.size(), 3u);
    EXPECT_TRUE(modes[0].isRigidMotion());  // the spin angle
    const Real precession = (I3 * spin - root) / (2 * I1), nutation = (I3 * spin + root) / (2 * I1);
    EXPECT_NEAR(modes[1].eigenvalue.imag(), precession, 1e-8 * nutation);
    EXPECT_NEAR(modes[2].eigenvalue.imag(), nutation, 1e-8 * nutation);
    EXPECT_NEAR(modes[2].dampingRatio, 0, 1e-8);
    // Circular motion: a quarter period apart.
    const Complex ratio = modes[2].shape[1] / modes[2].shape[0];
    EXPECT_NEAR(std::abs(ratio), 1, 1e-8);
    EXPECT_NEAR(ratio.real(), 0, 1e-8);
}

TEST(Eigenmodes, FreeSymmetricBodyNutatesAtItsEulerFrequencyInTurningAxes) {
    const Real I1 = 0.02, I3 = 0.03, spin = 40;
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    MobilizedBody::Free body(matter.Ground(), Transform(), makeTop(1, Vec3(0), I1, I3),
                             Transform());
    State state = system.realizeTopology();
    body.setQToFitRotation(state, Rotation(0.7, UnitVec3(1, -1, 2)));
    system.realize(state, Stage::Position);
    body.setUToFitAngularVelocity(state, body.getBodyRotation(state) * Vec3(0, 0, spin));
    bool hasEuler = false;
    for (const Eigenmode& mode : calcEigenmodes(calcLinearization(system, state))) {
        const Real rate = mode.eigenvalue.imag();
        hasEuler = hasEuler || std::abs(rate - spin * (I3 - I1) / I1) < 1e-6 * spin;
        EXPECT_LT(std::abs(mode.eigenvalue.real()), 1e-5 * spin);
        // The other modes are at rest in space, so rotate with Ω, or at rest in the body.
        EXPECT_TRUE(rate < 1e-5 * spin || std::abs(rate - spin) < 1e-5 * spin ||
                    std::abs(rate - spin * (I3 - I1) / I1) < 1e-6 * spin)
            << rate;
    }
    EXPECT_TRUE(hasEuler);
}

/** The same part, rigid and symmetric, on a ball at its first interface, spinning upright. **/
TEST(Eigenmodes, FlexibleBodyOnABallSpinsAsATopInTurningAxes) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    Force::Gravity gravity(forces, matter, -ZAxis, Gravity);
    FlexibleBodySubsystem flexible(system, matter);
    auto part = std::make_shared<ReducedBody>(*test::makePointMassPart().body);
    const Real central = 0.02, I3 = 0.012, l = 0.05, spin = 200;
    part->inertia = {central, central, I3, 0, 0, 0};
    part->interfaces[0].position = {0, 0, -l};
    const FlexibleBody top(flexible, part);
    Joint::Ball ball(flexible, matter.Ground(), top.interface("A"));
    State state = system.realizeTopology();
    for (int k = 0; k < top.getNumModalMobilizers(); ++k) top.getModalMobilizer(k).lock(state);
    top.setFramePose(state, Transform(Vec3(0, 0, l)));
    system.realize(state, Stage::Position);
    top.setFrameVelocity(state, SpatialVec(Vec3(0, 0, spin), Vec3(0)));
    const std::vector<Eigenmode> modes = calcEigenmodes(calcLinearization(system, state));
    const Real m = part->mass, I1 = central + m * l * l;
    const Real root = std::sqrt(I3 * I3 * spin * spin - 4 * I1 * m * Gravity * l);
    std::vector<Real> expected{std::abs((I3 * spin - root) / (2 * I1) - spin),
                               std::abs((I3 * spin + root) / (2 * I1) - spin)};
    std::sort(expected.begin(), expected.end());
    ASSERT_EQ(modes.size(), 3u);
    EXPECT_TRUE(modes[0].isRigidMotion());
    EXPECT_NEAR(modes[1].eigenvalue.imag(), expected[0], 1e-7 * spin);
    EXPECT_NEAR(modes[2].eigenvalue.imag(), expected[1], 1e-7 * spin);
}

TEST(Eigenmodes, RedundantJointsChangeNothing) {
    std::vector<std::vector<Real>> found;
    for (const bool isTwice : {false, true}) {
        MultibodySystem system;
        SimbodyMatterSubsystem matter(system);
        GeneralForceSubsystem forces(system);
        Force::Gravity gravity(forces, matter, -XAxis, Gravity);
        FlexibleBodySubsystem flexible(system, matter);
        const FlexibleBody body(flexible, test::makePointMassPart().body);
        State state = system.realizeTopology();
        body.setPoseByInterface(state, "A", Transform());
        system.realize(state, Stage::Position);
        const Transform X_GA(Vec3(0));
        Joint::Pin pin(flexible, matter.Ground(), body.interface("A"));
        if (isTwice) Joint::Ball(flexible, matter.Ground(), body.interface("A"));
        state = system.realizeTopology();
        body.setPoseByInterface(state, "A", Transform());
        found.push_back(listFrequencies(calcEigenmodes(calcLinearization(system, state))));
    }
    ASSERT_EQ(found[0].size(), found[1].size());
    for (size_t k = 0; k < found[0].size(); ++k)
        EXPECT_NEAR(found[0][k], found[1][k], 1e-7 * (1 + found[0][k])) << k;
}

TEST(Eigenmodes, ModeStatesMoveByTheAmplitudeAndComeBack) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    FlexibleBodySubsystem flexible(system, matter);
    const FlexibleBody body(flexible, test::makePointMassPart().body);
    const State state = system.realizeTopology();
    const Linearization linear = calcLinearization(system, state);
    const std::vector<Eigenmode> modes = calcEigenmodes(linear);
    const std::vector<State> frames = calcModeStates(system, linear, modes[6], 0.01, 8);
    ASSERT_EQ(frames.size(), 8u);
    const Vector first = body.getModalCoordinates(frames[0]);
    EXPECT_LT((body.getModalCoordinates(frames[4]) + first).normInf(), 1e-12);
    EXPECT_LT(body.getModalCoordinates(frames[2]).normInf(), 1e-9 * first.normInf());
    // The first mode alone moves one node by the amplitude.
    EXPECT_NEAR(body.calcLargestDisplacement(frames[0]), 0.01, 1e-6);
    EXPECT_THROW(calcModeStates(system, linear, modes[6], 0, 8), std::invalid_argument);
}

TEST(Linearization, RefusesNonholonomicConstraintsByName) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    MobilizedBody::Pin wheel(matter.Ground(), Transform(), makeTop(1, Vec3(0), 0.1, 0.1),
                             Transform());
    Constraint::ConstantSpeed speed(wheel, 3);
    const State state = system.realizeTopology();
    try {
        calcLinearization(system, state);
        FAIL() << "no exception";
    } catch (const std::invalid_argument& error) {
        EXPECT_NE(std::string(error.what()).find("Simbody constraint 0"), std::string::npos)
            << error.what();
    }
}

/** Random inputs and outputs. **/
LinearInputs makeInputs(int n, int m, int o, int count) {
    LinearInputs inputs{Matrix(n, count), Matrix(m, count), Matrix(o, count)};
    for (int k = 0; k < count; ++k) {
        for (int i = 0; i < n; ++i) inputs.forces(i, k) = std::cos(1.1 * i + k);
        for (int i = 0; i < m; ++i) inputs.drives(i, k) = 0;
        for (int i = 0; i < o; ++i) inputs.direct(i, k) = 0.3 * i - k;
    }
    return inputs;
}

LinearOutputs makeOutputs(int n, int m, int s) {
    constexpr int o = 3;
    LinearOutputs outputs{Matrix(o, n, 0.0), Matrix(o, n, 0.0), Matrix(o, n, 0.0),
                          Matrix(o, m, 0.0), Matrix(o, s, 0.0)};
    for (int i = 0; i < n; ++i) {
        outputs.byQ(0, i) = std::sin(0.7 * i);
        outputs.byU(1, i) = std::cos(0.4 * i + 1);
        outputs.byUDot(2, i) = 1 / (1.0 + i);
    }
    return outputs;
}

/** Solves (−ω²M + iωD + K) x + Gᵀλ = f directly. **/
Matrix_<Complex> calcDirectly(const Linearization& linear, Real omega, const LinearInputs& inputs,
                              const LinearOutputs& outputs) {
    const int n = linear.M.nrow(), m = linear.G.nrow(), p = inputs.forces.ncol(),
              o = outputs.byQ.nrow();
    Matrix_<Complex> A(n + m, n + m, Complex(0));
    for (int i = 0; i < n; ++i) {
        for (int j = 0; j < n; ++j)
            A(i, j) =
                Complex(linear.K(i, j) - omega * omega * linear.M(i, j), omega * linear.D(i, j));
        for (int k = 0; k < m; ++k) A(n + k, i) = A(i, n + k) = linear.G(k, i);
    }
    const FactorLU factors(A);
    Matrix_<Complex> transfer(o, p);
    for (int k = 0; k < p; ++k) {
        Vector_<Complex> b(n + m), x;
        for (int i = 0; i < n; ++i) b[i] = inputs.forces(i, k);
        for (int i = 0; i < m; ++i) b[n + i] = inputs.drives(i, k);
        factors.solve(b, x);
        for (int row = 0; row < o; ++row) {
            Complex sum = inputs.direct(row, k);
            for (int i = 0; i < n; ++i)
                sum += x[i] * (outputs.byQ(row, i) + Complex(0, omega) * outputs.byU(row, i) -
                               omega * omega * outputs.byUDot(row, i));
            for (int i = 0; i < m; ++i) sum += x[n + i] * outputs.byMultipliers(row, i);
            transfer(row, k) = sum;
        }
    }
    return transfer;
}

void expectSameTransfer(const Matrix_<Complex>& found, const Matrix_<Complex>& expected,
                        Real tolerance, Real omega) {
    for (int i = 0; i < expected.nrow(); ++i)
        for (int k = 0; k < expected.ncol(); ++k)
            EXPECT_LT(std::abs(found(i, k) - expected(i, k)), tolerance * std::abs(expected(i, k)))
                << i << ' ' << k << " at " << omega;
}

/** A flexible body on a pin with a damped spring, swinging about its equilibrium. **/
struct HangingPart {
    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    FlexibleBodySubsystem flexible{system, matter};
    FlexibleBody body;
    State state;

    HangingPart() : body(flexible, test::makePointMassPart().body) {
        Force::Gravity(forces, matter, Vec3(1, -9.81, 2));
        ModalDamping(flexible, body, 0.02);
        State placed = system.realizeTopology();
        body.setPoseByInterface(placed, "A", Transform());
        system.realize(placed, Stage::Position);
        Joint::Pin(flexible, matter.Ground(), body.interface("A"));
        placed = system.realizeTopology();
        body.setPoseByInterface(placed, "A", Transform());
        StaticEquilibrium equilibrium(system);
        equilibrium.solve(placed);
        state = equilibrium.getState();
        system.realize(state, Stage::Velocity);
    }
};

TEST(StateSpace, HasThePolesOfTheModes) {
    const HangingPart model;
    const Linearization linear = calcLinearization(model.system, model.state);
    const int n = linear.M.nrow(), m = linear.G.nrow();
    const LinearOutputs outputs = makeOutputs(n, m, 0);
    const StateSpace space = calcStateSpace(linear, makeInputs(n, m, 3, 2), outputs);
    std::vector<Eigenmode> modes = calcEigenmodes(linear);
    ASSERT_EQ(space.A.nrow(), int(2 * modes.size()));
    Vector_<Complex> poles;
    SimTK::Eigen(space.A).getAllEigenValues(poles);
    for (const Eigenmode& mode : modes) {
        Real nearest = Infinity;
        for (int k = 0; k < poles.size(); ++k)
            nearest = std::min(nearest, std::abs(poles[k] - mode.eigenvalue));
        EXPECT_LT(nearest, 1e-9 * std::abs(mode.eigenvalue)) << mode.frequency << " Hz";
    }
}

TEST(StateSpace, RespondsAsTheEquationsDo) {
    const HangingPart model;
    const Linearization linear = calcLinearization(model.system, model.state);
    const int n = linear.M.nrow(), m = linear.G.nrow();
    LinearOutputs outputs = makeOutputs(n, m, 0);
    for (int k = 0; k < m; ++k) outputs.byMultipliers(0, k) = 0.2 * k - 0.3;
    const LinearInputs inputs = makeInputs(n, m, 3, 2);
    const StateSpace space = calcStateSpace(linear, inputs, outputs);
    for (const Real omega : {0.5, 7.0, 40.0, 300.0})
        expectSameTransfer(space.calcTransfer(Complex(0, omega)),
                           calcDirectly(linear, omega, inputs, outputs), 1e-8, omega);
    EXPECT_EQ(space.D1.norm(), 0);
    EXPECT_EQ(space.D2.norm(), 0);
}

TEST(StateSpace, FollowsWhatConstraintsAreDrivenTo) {
    const HangingPart model;
    const Linearization linear = calcLinearization(model.system, model.state);
    const int n = linear.M.nrow(), m = linear.G.nrow();
    const LinearOutputs outputs = makeOutputs(n, m, 0);
    LinearInputs inputs = makeInputs(n, m, 3, 2);
    for (int k = 0; k < m; ++k) inputs.drives(k, 1) = std::cos(1.0 * k);
    const StateSpace space = calcStateSpace(linear, inputs, outputs);
    for (const Real omega : {0.5, 7.0, 40.0, 300.0})
        expectSameTransfer(space.calcTransfer(Complex(0, omega)),
                           calcDirectly(linear, omega, inputs, outputs), 1e-7, omega);
    EXPECT_GT(space.D1.norm(), 1e-3);
}

TEST(FrequencyResponse, BlockByBlockIsThatOfTheEquations) {
    const HangingPart model;
    const Linearization linear = calcLinearization(model.system, model.state);
    const FrequencyResponse response(model.system, model.state);
    EXPECT_EQ(response.describeImbalance(), "");
    const int n = linear.M.nrow(), m = linear.G.nrow();
    LinearOutputs outputs = makeOutputs(n, m, 0);
    for (int k = 0; k < m; ++k) outputs.byMultipliers(0, k) = 0.2 * k - 0.3;
    LinearInputs inputs = makeInputs(n, m, 3, 2);
    for (int k = 0; k < m; ++k) inputs.drives(k, 1) = std::cos(1.0 * k);
    const std::vector<Real> omegas{0.5, 7, 40, 300};
    const auto transfers = response.calcTransfers(omegas, inputs, outputs, 2);
    for (size_t k = 0; k < omegas.size(); ++k)
        expectSameTransfer(transfers[k], calcDirectly(linear, omegas[k], inputs, outputs), 1e-7,
                           omegas[k]);
}

TEST(FrequencyResponse, SaysWhatKeepsAStateFromBeingAnEquilibrium) {
    const SpringMounted model;
    const FrequencyResponse response(model.system, model.state);
    EXPECT_NE(response.describeImbalance(), "");
    EXPECT_NE(describeImbalance(model.system, calcLinearization(model.system, model.state)), "");
}

TEST(StateSpace, DifferencesOfWhatIsObservedAreItsDerivatives) {
    const HangingPart model;
    const Linearization linear = calcLinearization(model.system, model.state);
    const Real z = model.body.getFramePose(model.state).p()[2];
    const auto observe = [&](const State& state, const Vector& uDot, const Vector& multipliers) {
        const Vec3 p = model.body.getFramePose(state).p();
        const Vector xi = model.body.getModalCoordinates(state);
        return std::vector<double>{p[0] * p[0], 3 * state.getU()[0] + p[1], 2 * uDot[1] + xi[0],
                                   multipliers[2] * multipliers[2], std::sin(1000 * (p[2] - z))};
    };
    const LinearOutputs outputs = differentiateOutputs(model.system, linear, observe);
    const int first = model.body.getFrame().getFirstUIndex(model.state);
    const int mode = model.body.getModalMobilizer(0).getFirstUIndex(model.state);
    const Real x = model.body.getFramePose(model.state).p()[0];
    const Real lambda = linear.multipliers[2];
    Matrix byQ(5, linear.M.nrow(), 0.0);
    byQ(0, first + 3) = 2 * x;
    byQ(1, first + 4) = byQ(2, mode) = 1;
    byQ(4, first + 5) = 1000;
    for (int i = 0; i < byQ.nrow(); ++i)
        for (int k = 0; k < byQ.ncol(); ++k)
            EXPECT_NEAR(outputs.byQ(i, k), byQ(i, k), 1e-4 * (i == 4 ? 1000 : 1e-4)) << i << k;
    EXPECT_LT(std::abs(outputs.byU(1, 0) - 3), 1e-9);
    EXPECT_LT(std::abs(outputs.byUDot(2, 1) - 2), 1e-9);
    EXPECT_LT(std::abs(outputs.byMultipliers(3, 2) - 2 * lambda), 1e-8 * std::abs(lambda));
}

TEST(StateSpace, TheSizeOfWhatIsZeroHasNoDerivative) {
    const HangingPart model;
    const Linearization linear = calcLinearization(model.system, model.state);
    const Vec3 place = model.body.getFramePose(model.state).p();
    const Vec3 beside = place - Vec3(1e-5, 0, 0);  // far less than the difference step
    const auto observe = [&](const State& state, const Vector&, const Vector& multipliers) {
        const Vec3 p = model.body.getFramePose(state).p();
        return std::vector<double>{p[1],
                                   (p - place).norm(),
                                   (p - beside).norm(),
                                   std::abs(p[2] - place[2]),
                                   multipliers.norm(),
                                   (multipliers - linear.multipliers).norm()};
    };
    try {
        differentiateOutputs(model.system, linear, observe);
        FAIL() << "no exception";
    } catch (const NoDerivative& error) {
        EXPECT_EQ(error.outputs, (std::vector<int>{1, 3, 5}));
    }
    const LinearOutputs smooth = differentiateOutputs(
        model.system, linear, [&](const State& state, const Vector& uDot, const Vector& lambda) {
            const std::vector<double> all = observe(state, uDot, lambda);
            return std::vector<double>{all[2], all[4]};
        });
    const int first = model.body.getFrame().getFirstUIndex(model.state);
    EXPECT_NEAR(smooth.byQ(0, first + 3), 1, 1e-6);
    EXPECT_NEAR(smooth.byQ(0, first + 4), 0, 1e-6);
    for (int k = 0; k < linear.multipliers.size(); ++k)
        EXPECT_NEAR(smooth.byMultipliers(1, k), linear.multipliers[k] / linear.multipliers.norm(),
                    1e-9);
}

}  // namespace
}  // namespace simflex
