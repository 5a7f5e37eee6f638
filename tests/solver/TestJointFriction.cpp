// Joint friction: sticking without creep, sliding, and the cost of both.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <sstream>

#include "simflex/body/FlexibleBodySubsystem.h"
#include "simflex/body/Joint.h"
#include "simflex/forces/AttachmentForce.h"
#include "simflex/forces/JointFriction.h"
#include "simflex/forces/StateForces.h"
#include "simflex/forces/TwoPointSpringDamper.h"
#include "simflex/solver/BdfIntegrator.h"
#include "simflex/solver/BlockEliminationSolver.h"
#include "simflex/solver/Eigenmodes.h"
#include "simflex/solver/GeneralizedAlphaIntegrator.h"
#include "simflex/solver/Linearization.h"
#include "simflex/solver/RadauIntegrator.h"
#include "simflex/solver/StaticEquilibrium.h"
#include "solver/SliderCrankModel.h"
#include "support/NewtonReference.h"

namespace simflex::test {
namespace {

using namespace SimTK;

constexpr Real Weight = 9.81;

FrictionCoefficients makeCoefficients(Real coulomb, Real breakaway, Real radius = 0) {
    FrictionCoefficients made;
    made.coulomb = coulomb;
    made.breakaway = breakaway;
    made.radius = radius;
    return made;
}

/** Free bodies, constrained by joints only. **/
struct FrictionModel {
    explicit FrictionModel(const Vec3& pull = Vec3(0, -Weight, 0))
        : gravity(forces, matter, pull) {}

    MobilizedBody::Free addBody(Real mass, const Vec3& inertia) {
        return {matter.Ground(), Transform(),
                Body::Rigid(MassProperties(mass, Vec3(0), Inertia(inertia))), Transform()};
    }

    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    Force::Gravity gravity;
    FlexibleBodySubsystem flexible{system, matter};
};

/** A block of 2 kg on an incline along x. **/
struct Incline : FrictionModel {
    explicit Incline(Real angle, const FrictionCoefficients& coefficients)
        : FrictionModel(Weight * Vec3(std::sin(angle), -std::cos(angle), 0)),
          block(addBody(2, Vec3(0.01))),
          slide(flexible, matter.Ground(), block, "slide"),
          friction(flexible, slide, coefficients) {
        state = system.realizeTopology();
    }
    void start(Real speed) { block.setUToFitLinearVelocity(state, Vec3(speed, 0, 0)); }
    Real place(const ImplicitIntegrator& integrator) const {
        return block.getBodyOriginLocation(integrator.getState())[0];
    }
    Real speed(const ImplicitIntegrator& integrator) const {
        return block.getBodyOriginVelocity(integrator.getState())[0];
    }

    MobilizedBody::Free block;
    Joint::Slider slide;
    JointFriction friction;
    State state;
};

template <class Integrator>
class JointFrictions : public ::testing::Test {};
using Integrators = ::testing::Types<BdfIntegrator, GeneralizedAlphaIntegrator, RadauIntegrator>;
TYPED_TEST_SUITE(JointFrictions, Integrators);

TYPED_TEST(JointFrictions, BlockOnAnInclineSticksWithoutCreeping) {
    for (const Real coulomb : {0.3, 0.19}) {
        Incline model(std::atan(0.2), makeCoefficients(coulomb, 0.3));
        TypeParam integrator(model.system);
        integrator.initialize(model.state);
        integrator.stepTo(10);
        EXPECT_LT(std::abs(model.place(integrator)), 1e-12);
        EXPECT_LT(std::abs(model.speed(integrator)), 1e-12);
        // The friction force balances the pull and stays below its limit.
        const Real pull = 2 * Weight * std::sin(std::atan(0.2));
        const JointFriction::Contact contact = model.friction.calcContact(
            integrator.getState(), integrator.getMultipliers(model.slide),
            integrator.getFrictionForces(model.slide));
        EXPECT_NEAR(contact.force[0], -pull, 1e-9);
        EXPECT_NEAR(contact.load, 2 * Weight * std::cos(std::atan(0.2)), 1e-9);
        EXPECT_LT(integrator.getStatistics().stepsTaken, 200);
    }
}

TYPED_TEST(JointFrictions, BlockOnAnInclineSlidesFasterAndFaster) {
    const Real angle = std::atan(0.5), mu = 0.3;
    Incline model(angle, makeCoefficients(mu, 0.4));
    TypeParam integrator(model.system);
    integrator.initialize(model.state);
    const Real a = Weight * (std::sin(angle) - mu * std::cos(angle));
    EXPECT_NEAR(integrator.getUDot()[3], a, 1e-10);
    integrator.stepTo(2);
    EXPECT_NEAR(model.place(integrator), 0.5 * a * 4, 1e-6);
    EXPECT_NEAR(model.speed(integrator), 2 * a, 1e-6);
    const JointFriction::Contact contact =
        model.friction.calcContact(integrator.getState(), integrator.getMultipliers(model.slide),
                                   integrator.getFrictionForces(model.slide));
    EXPECT_NEAR(contact.force[0], -mu * contact.load, 1e-9);
    EXPECT_NEAR(contact.power, -mu * 2 * Weight * std::cos(angle) * 2 * a, 1e-4);
}

TYPED_TEST(JointFrictions, BlockOnAnInclineStopsWhereItShould) {
    const Real angle = std::atan(0.2), mu = 0.3, speed = 1.5;
    for (const Real accuracy : {1e-4, 1e-6}) {
        Incline model(angle, makeCoefficients(mu, 0.35));
        model.start(speed);
        TypeParam integrator(model.system);
        integrator.setAccuracy(accuracy);
        integrator.initialize(model.state);
        integrator.stepTo(5);
        const Real distance =
            square(speed) / (2 * Weight * (mu * std::cos(angle) - std::sin(angle)));
        EXPECT_NEAR(model.place(integrator), distance, 100 * accuracy);
        EXPECT_NEAR(model.place(integrator), distance, 1e-3 * distance);
        EXPECT_LT(std::abs(model.speed(integrator)), 1e-12);
        // Friction has dissipated the kinetic energy.
        const Real energy = model.system.calcEnergy(integrator.getState()),
                   start = 0.5 * 2 * square(speed);
        EXPECT_NEAR(energy - integrator.getWork(), start, 200 * accuracy);
    }
}

TYPED_TEST(JointFrictions, MassOnABeltSticksAndSlipsWithItsPeriod) {
    const Real stiffness = 50, mass = 1, belt = 0.1, coulomb = 0.2, breakaway = 0.3;
    FrictionModel model;
    MobilizedBody::Slider carrier(model.matter.Ground(), Transform(),
                                  Body::Rigid(MassProperties(1, Vec3(0), Inertia(1))), Transform());
    Motion::Steady(carrier, belt);
    MobilizedBody::Free block = model.addBody(mass, Vec3(0.01));
    Joint::Slider slide(model.flexible, carrier, block, "belt");
    JointFriction(model.flexible, slide, makeCoefficients(coulomb, breakaway));
    StateForce(model.flexible, block,
               {Signal::function({Signal::displacement(model.matter.Ground(), block, XAxis)},
                                 [=](Real, const Real* x, Real* slopes) {
                                     if (slopes) slopes[0] = -stiffness;
                                     return -stiffness * x[0];
                                 }),
                Signal(), Signal()});
    State state = model.system.realizeTopology();
    block.setUToFitLinearVelocity(state, Vec3(belt, 0, 0));
    TypeParam integrator(model.system);
    integrator.setAccuracy(1e-7);
    integrator.initialize(state);
    const auto displacement = [&] { return block.getBodyOriginLocation(integrator.getState())[0]; };
    // It breaks away at μ_s N/k.
    const Real tear = breakaway * Weight * mass / stiffness;
    const Real omega = std::sqrt(stiffness / mass),
               swing = (breakaway - coulomb) * Weight * mass / stiffness;
    const Real period = 2 * (Pi - std::atan(swing * omega / belt)) / omega + 2 * swing / belt;
    const Real first = tear / belt;
    std::vector<Real> tears;
    Real last = 0;
    for (int i = 1; i * 1e-3 < first + 4.2 * period; ++i) {
        integrator.stepTo(1e-3 * i);
        EXPECT_LT(displacement(), tear + swing);
        const Real speed = block.getBodyOriginVelocity(integrator.getState())[0];
        // The turning point of each swing.
        if (last > 0 && speed <= 0) tears.push_back(1e-3 * (i - 1) + 1e-3 * last / (last - speed));
        last = speed;
    }
    ASSERT_EQ(tears.size(), 5u);
    for (size_t k = 1; k < tears.size(); ++k)
        EXPECT_NEAR(tears[k] - tears[k - 1], period, 1e-3 * period) << k;
}

/** A block pushed back and forth by a force A sin(wt): piecewise closed form. **/
struct PushedBlock {
    static constexpr Real mass = 10, push = 60;
    Real coulomb, breakaway, w = 6 * Pi;

    Real calcForce(Real t) const { return push * std::sin(w * t); }
    /** Returns the first time after t at which `excess` becomes positive. **/
    template <class Excess>
    static Real findRoot(const Excess& excess, Real t, Real end) {
        constexpr Real Step = 1e-5;
        for (Real low = t + Step; low < end; low += Step) {
            Real high = low + Step;
            if (excess(low) > 0 || excess(high) <= 0) continue;
            for (int i = 0; i < 60; ++i) {
                const Real middle = 0.5 * (low + high);
                (excess(middle) > 0 ? high : low) = middle;
            }
            return high;
        }
        return Infinity;
    }
    /** Returns the position at time `end` and counts switches between sticking and sliding. **/
    Real calcPlace(Real end, int& switches) const {
        const Real load = mass * Weight;
        Real t = 0, x = 0, direction = 0;
        for (;;) {
            if (direction == 0) {
                t = findRoot([&](Real s) { return std::abs(calcForce(s)) - breakaway * load; }, t,
                             end);
                if (t > end) return x;
                direction = calcForce(t) > 0 ? 1 : -1;
                ++switches;
            }
            const Real a = push / mass, drag = direction * coulomb * Weight;
            const auto calcSpeed = [&](Real s) {
                return a / w * (std::cos(w * t) - std::cos(w * s)) - drag * (s - t);
            };
            const auto calcWay = [&](Real s) {
                return a / w *
                           ((s - t) * std::cos(w * t) - (std::sin(w * s) - std::sin(w * t)) / w) -
                       0.5 * drag * square(s - t);
            };
            const Real stop = findRoot([&](Real s) { return -direction * calcSpeed(s); }, t, end);
            if (stop > end) return x + calcWay(end);
            x += calcWay(stop);
            t = stop;
            ++switches;
            direction = std::abs(calcForce(t)) <= breakaway * load ? 0 : calcForce(t) > 0 ? 1 : -1;
        }
    }
};

TYPED_TEST(JointFrictions, ManySwitchesAreAsAccurateAsAskedForWhateverTheRows) {
    // The first block rests between slides; the second slides on in the other direction, with a
    // force jump at breakaway.
    for (const PushedBlock& block : {PushedBlock{0.3, 0.3}, PushedBlock{0.1, 0.3}}) {
        int switches = 0;
        const Real end = 3, expected = block.calcPlace(end, switches);
        EXPECT_GE(switches, 18);
        for (const Real accuracy : {1e-5, 1e-6, 1e-7})
            for (const Real interval : {0.3, 0.03, 0.003}) {
                FrictionModel model;
                MobilizedBody::Free body = model.addBody(PushedBlock::mass, Vec3(0.1));
                Joint::Slider slide(model.flexible, model.matter.Ground(), body, "plane");
                JointFriction(model.flexible, slide,
                              makeCoefficients(block.coulomb, block.breakaway));
                AttachmentForce(model.flexible, body, [&](Real t) {
                    return SpatialVec(Vec3(0), Vec3(block.calcForce(t), 0, 0));
                });
                TypeParam integrator(model.system);
                integrator.setAccuracy(accuracy);
                integrator.initialize(model.system.realizeTopology());
                for (int row = 1; row <= std::lround(end / interval); ++row)
                    integrator.stepTo(row * interval);
                // The other two methods are of order 2.
                const Real allowed = std::is_same_v<TypeParam, RadauIntegrator>
                                         ? 30 * accuracy
                                         : 10 * std::pow(accuracy, 2. / 3);
                EXPECT_NEAR(body.getBodyOriginLocation(integrator.getState())[0], expected, allowed)
                    << block.coulomb << " " << accuracy << " " << interval;
            }
    }
}

TYPED_TEST(JointFrictions, LoadedPinTurnsAgainstItsFrictionTorque) {
    const Real mass = 3, inertia = 0.02, radius = 0.05, mu = 0.15, axialRadius = 0.03;
    // Gravity has components across and along the axis z.
    FrictionModel model(Vec3(3, -8, 4));
    MobilizedBody::Free disc = model.addBody(mass, Vec3(0.05, 0.05, inertia));
    Joint::Pin pin(model.flexible, model.matter.Ground(), disc, "pin");
    FrictionCoefficients coefficients = makeCoefficients(mu, mu, radius);
    coefficients.axialRadius = axialRadius;
    coefficients.viscous = 0.01;
    const JointFriction friction(model.flexible, pin, coefficients);
    State state = model.system.realizeTopology();
    disc.setUToFitAngularVelocity(state, Vec3(0, 0, 20));
    TypeParam integrator(model.system);
    integrator.setAccuracy(1e-7);
    integrator.initialize(state);
    const Real torque = mu * mass * (radius * std::hypot(3, 8) + axialRadius * 4), c = 0.01;
    EXPECT_NEAR(integrator.getUDot()[2], -(torque + c * 20) / inertia, 1e-9);
    const Real time = 0.5;
    integrator.stepTo(time);
    // I ω' = −T − c ω
    const Real omega = (20 + torque / c) * std::exp(-c / inertia * time) - torque / c;
    EXPECT_NEAR(disc.getBodyAngularVelocity(integrator.getState())[2], omega, 1e-4);
    const JointFriction::Contact contact = friction.calcContact(
        integrator.getState(), integrator.getMultipliers(pin), integrator.getFrictionForces(pin));
    EXPECT_NEAR(contact.load, torque / mu, 1e-6);
    EXPECT_NEAR(contact.force[0], -(torque + c * omega), 1e-5);
    integrator.stepTo(3);
    EXPECT_LT(disc.getBodyAngularVelocity(integrator.getState()).norm(), 1e-12);
}

TYPED_TEST(JointFrictions, ScrewRaisesItsLoadAsATextbookHasIt) {
    // T = W r tan(β + φ) up, W r tan(φ − β) down, with tan β = p/r and tan φ = μ.
    const Real mass = 5, inertia = 0.03, radius = 0.02, pitch = 0.004, mu = 0.12, torque = 1.5;
    for (const Real direction : {1., -1.}) {
        FrictionModel model(Vec3(0, 0, -Weight));
        MobilizedBody::Free nut = model.addBody(mass, Vec3(inertia));
        Joint::Screw screw(model.flexible, model.matter.Ground(), nut, pitch, "screw");
        JointFriction(model.flexible, screw, makeCoefficients(mu, mu, radius));
        AttachmentForce(model.flexible, nut, SpatialVec(Vec3(0, 0, direction * torque), Vec3(0)));
        State state = model.system.realizeTopology();
        TypeParam integrator(model.system);
        integrator.initialize(state);
        integrator.stepTo(0.5);
        const Real alpha = integrator.getUDot()[2];
        const Real thrust = mass * (Weight + pitch * alpha);
        const Real beta = std::atan(pitch / radius), phi = std::atan(mu);
        const Real needed =
            thrust * radius * (direction > 0 ? std::tan(beta + phi) : std::tan(phi - beta));
        EXPECT_NEAR(direction * torque - direction * needed, inertia * alpha, 1e-7) << direction;
        EXPECT_GT(direction * alpha, 1);
    }
}

TYPED_TEST(JointFrictions, CylinderRubsAgainstItsWayAlongTheHelix) {
    // A single force μ N opposes the velocity (r θ', z') of the surface: with I = m r² the sliding
    // direction is constant.
    const Real mass = 2, radius = 0.1, mu = 0.2;
    FrictionModel model;
    MobilizedBody::Free shaft = model.addBody(mass, Vec3(0.03, 0.03, mass * square(radius)));
    Joint::Cylinder cylinder(model.flexible, model.matter.Ground(), shaft, "sleeve");
    const JointFriction friction(model.flexible, cylinder, makeCoefficients(mu, mu, radius));
    State state = model.system.realizeTopology();
    shaft.setUToFitAngularVelocity(state, Vec3(0, 0, 30));
    shaft.setUToFitLinearVelocity(state, Vec3(0, 0, 4));
    TypeParam integrator(model.system);
    integrator.initialize(state);
    EXPECT_NEAR(integrator.getUDot()[5], -mu * Weight * 0.8, 1e-9);
    const Real time = 1;
    integrator.stepTo(time);
    const Real speed = 5 - mu * Weight * time;
    EXPECT_NEAR(shaft.getBodyOriginVelocity(integrator.getState())[2], 0.8 * speed, 1e-5);
    EXPECT_NEAR(shaft.getBodyAngularVelocity(integrator.getState())[2], 0.6 * speed / radius, 1e-4);
    integrator.stepTo(4);
    EXPECT_NEAR(shaft.getBodyOriginLocation(integrator.getState())[2], 0.8 * 25 / (2 * mu * Weight),
                1e-4);
    EXPECT_LT(shaft.getBodyOriginVelocity(integrator.getState()).norm(), 1e-12);
}

TYPED_TEST(JointFrictions, BallTurnsAgainstItsAngularVelocity) {
    const Real mass = 2, inertia = 0.05, radius = 0.04, mu = 0.1;
    FrictionModel model;
    MobilizedBody::Free ball = model.addBody(mass, Vec3(inertia));
    Joint::Ball joint(model.flexible, model.matter.Ground(), ball, "ball");
    JointFriction(model.flexible, joint, makeCoefficients(mu, mu, radius));
    State state = model.system.realizeTopology();
    const Vec3 axis(UnitVec3(1, -2, 2));
    ball.setUToFitAngularVelocity(state, 3 * axis);
    TypeParam integrator(model.system);
    integrator.initialize(state);
    integrator.stepTo(1);
    const Real rate = mu * radius * mass * Weight / inertia;
    EXPECT_LT((ball.getBodyAngularVelocity(integrator.getState()) - (3 - rate) * axis).norm(),
              1e-5);
    integrator.stepTo(3);
    EXPECT_LT(ball.getBodyAngularVelocity(integrator.getState()).norm(), 1e-12);
}

TYPED_TEST(JointFrictions, UniversalRubsInEachOfItsBearings) {
    // It spins about F's x axis; the other bearing sticks.
    const Real mass = 2, inertia = 0.05, radius = 0.04, mu = 0.1;
    FrictionModel model;
    MobilizedBody::Free cross = model.addBody(mass, Vec3(inertia));
    Joint::Universal joint(model.flexible, model.matter.Ground(), cross, "cross");
    JointFriction(model.flexible, joint, makeCoefficients(mu, mu, radius));
    State state = model.system.realizeTopology();
    cross.setUToFitAngularVelocity(state, Vec3(5, 0, 0));
    TypeParam integrator(model.system);
    integrator.initialize(state);
    integrator.stepTo(1);
    const Vector rates = joint.calcCoordinateDots(integrator.getState());
    EXPECT_NEAR(rates[0], 5 - mu * radius * mass * Weight / inertia, 1e-5);
    EXPECT_LT(std::abs(rates[1]), 1e-12);
    const Vector forces = integrator.getFrictionForces(joint);
    ASSERT_EQ(forces.size(), 2);
    EXPECT_NEAR(forces[0], -mu * radius * mass * Weight, 1e-9);
    EXPECT_NEAR(forces[1], 0, 1e-9);
}

TYPED_TEST(JointFrictions, SeveralJointsThatHoldTheSameShareTheLoad) {
    // A pendulum between two pins, and an arm with two collinear joints: friction can hold in each
    // of the contacts.
    FrictionModel model;
    MobilizedBody::Free arm(model.matter.Ground(), Transform(),
                            Body::Rigid(MassProperties(1, Vec3(0.01, 0, 0), Inertia(0.02))),
                            Transform());
    Joint::Pin left(model.flexible, model.matter.Ground(), arm, "left");
    Joint::PointOnLine right(model.flexible,
                             Attachment(model.matter.Ground(), Transform(Vec3(0, 0, 0.2))),
                             Attachment(arm, Transform(Vec3(0, 0, 0.2))), "right");
    Joint::Pin middle(model.flexible, model.matter.Ground(), arm, "middle");
    for (const Joint* joint : {static_cast<Joint*>(&left), static_cast<Joint*>(&middle)})
        JointFriction(model.flexible, *joint, makeCoefficients(0.3, 0.3, 0.05));
    State state = model.system.realizeTopology();
    TypeParam integrator(model.system);
    integrator.initialize(state);
    integrator.stepTo(1);
    // At its radius of gyration.
    EXPECT_LT(std::abs(arm.getBodyAngularVelocity(integrator.getState())[2]), 1e-12);
    Real held = 0;
    for (const Joint* joint : {static_cast<Joint*>(&left), static_cast<Joint*>(&middle)})
        held += integrator.getFrictionForces(*joint)[0];
    EXPECT_NEAR(held, Weight * 0.01, 1e-9);
}

TYPED_TEST(JointFrictions, RedundantJointsOfAPlanarMechanismRubAsThoseThatAreNot) {
    // Four-bar linkages with four pins, or with pins, a ball and a point on a line that constrain
    // each freedom once.
    const auto run = [](bool isRedundant, Real accuracy) {
        FrictionModel model;
        const Vec3 places[] = {Vec3(0), Vec3(0.1, 0.17, 0), Vec3(0.5, 0.4, 0), Vec3(0.5, 0, 0)};
        std::vector<MobilizedBody::Free> bars;
        for (int i = 0; i < 3; ++i) bars.push_back(model.addBody(1, Vec3(0.01)));
        const auto frame = [&](int bar, int place) {
            return bar < 0 ? Attachment(model.matter.Ground(), Transform(places[place]))
                           : Attachment(
                                 bars[size_t(bar)],
                                 Transform(places[place] - 0.5 * (places[bar] + places[bar + 1])));
        };
        const FrictionCoefficients rubbing = makeCoefficients(0.2, 0.25, 0.02);
        std::vector<Joint> joints;
        for (int i = 0; i < 4; ++i) {
            const Attachment F = frame(i - 1, i), M = frame(i < 3 ? i : -1, i);
            if (i == 0 || isRedundant) {
                joints.push_back(Joint::Pin(model.flexible, F, M));
                JointFriction(model.flexible, joints.back(), rubbing);
            } else if (i == 1) {
                joints.push_back(Joint::Pin(model.flexible, F, M));
                JointFriction(model.flexible, joints.back(), rubbing);
            } else if (i == 2) {
                // About z in the plane, as for a pin.
                joints.push_back(Joint::Ball(model.flexible, F, M));
                JointFriction(model.flexible, joints.back(), rubbing);
            } else {
                joints.push_back(Joint::Cylinder(model.flexible, F, M));
            }
        }
        if (isRedundant) {
            FrictionCoefficients none;
            JointFriction(model.flexible, joints[3], none);
        }
        State state = model.system.realizeTopology();
        for (int i = 0; i < 3; ++i)
            bars[size_t(i)].setQToFitTranslation(state, 0.5 * (places[i] + places[i + 1]));
        TypeParam integrator(model.system);
        integrator.setAccuracy(accuracy);
        integrator.initialize(state);
        EXPECT_EQ(integrator.getStatistics().redundantConstraints > 0, isRedundant);
        for (const std::string& line : integrator.getRedundantConstraints())
            EXPECT_EQ(line.find("friction"), std::string::npos) << line;
        integrator.stepTo(0.35);
        return bars[1].getBodyOriginLocation(integrator.getState());
    };
    const Vec3 redundant = run(true, 1e-8), definite = run(false, 1e-8);
    // The middle joint reverses while the others move; steps end at, before and after the reversal.
    for (const Real accuracy : {4e-9, 2e-8})
        EXPECT_LT((run(false, accuracy) - definite).norm(), 3e-6);
    EXPECT_LT((redundant - definite).norm(), 3e-6);
    EXPECT_GT((redundant - Vec3(0.3, 0.285, 0)).norm(), 0.05);
}

TEST(JointFriction, WhatRedundantJointsLeaveUndeterminedIsNamed) {
    // A shaft in two pins: which of them carries the axial load is undetermined.
    FrictionModel model(Vec3(0, -Weight, 1));
    MobilizedBody::Free shaft = model.addBody(1, Vec3(0.01));
    std::vector<Joint> pins;
    for (const Real z : {-0.1, 0.1})
        pins.push_back(
            Joint::Pin(model.flexible, Attachment(model.matter.Ground(), Transform(Vec3(0, 0, z))),
                       Attachment(shaft, Transform(Vec3(0, 0, z))), z < 0 ? "left" : "right"));
    FrictionCoefficients coefficients = makeCoefficients(0.1, 0.1, 0.01);
    coefficients.axialRadius = 0.02;
    JointFriction(model.flexible, pins[0], coefficients);
    BdfIntegrator integrator(model.system);
    integrator.initialize(model.system.realizeTopology());
    std::string all;
    for (const std::string& line : integrator.getRedundantConstraints()) all += line + "\n";
    EXPECT_NE(all.find("the friction of 'left' depends on what it leaves undetermined"),
              std::string::npos)
        << all;
}

TEST(JointFriction, PositionEquationsRubAlike) {
    const Real angle = std::atan(0.2), mu = 0.3, speed = 1.5;
    Incline model(angle, makeCoefficients(mu, 0.35));
    model.start(speed);
    BdfIntegrator integrator(model.system);
    integrator.setFormulation(ImplicitIntegrator::Formulation::Index3);
    integrator.initialize(model.state);
    integrator.stepTo(5);
    EXPECT_NEAR(model.place(integrator),
                square(speed) / (2 * Weight * (mu * std::cos(angle) - std::sin(angle))), 1e-4);
    EXPECT_LT(std::abs(model.speed(integrator)), 1e-10);
}

TEST(JointFriction, ViscousFrictionAloneDampsNaturalModes) {
    FrictionModel model;
    MobilizedBody::Free mass = model.addBody(1, Vec3(0.01));
    const Rotation upright(Pi / 2, ZAxis);
    Joint::Slider slide(model.flexible, Attachment(model.matter.Ground(), Transform(upright)),
                        Attachment(mass, Transform(upright)), "slide");
    const Real stiffness = 400, damping = 4;
    TwoPointSpringDamper(model.flexible,
                         Attachment(model.matter.Ground(), Transform(Vec3(0, 1, 0))), mass,
                         stiffness, 0, 1);
    FrictionCoefficients viscous;
    viscous.viscous = damping;
    JointFriction(model.flexible, slide, viscous);
    const State state = model.system.realizeTopology();
    const auto modes = calcEigenmodes(calcLinearization(model.system, state));
    ASSERT_EQ(modes.size(), 1u);
    EXPECT_NEAR(modes[0].dampingRatio, damping / (2 * std::sqrt(stiffness)), 1e-6);
    // x = x₀ + A exp(−δt) cos …: at rest after a while.
    BdfIntegrator integrator(model.system);
    integrator.setAccuracy(1e-7);
    integrator.initialize(state);
    const Real delta = damping / 2, omega = std::sqrt(stiffness - square(delta)),
               sag = Weight / stiffness, time = 0.7;
    integrator.stepTo(time);
    EXPECT_NEAR(mass.getBodyOriginLocation(integrator.getState())[1],
                -sag + sag * std::exp(-delta * time) *
                           (std::cos(omega * time) + delta / omega * std::sin(omega * time)),
                3e-6);
}

TEST(JointFriction, WrongCoefficientsAreRefusedByName) {
    FrictionModel model;
    MobilizedBody::Free body = model.addBody(1, Vec3(0.01));
    const Attachment F = model.matter.Ground(), M = body;
    Joint::Pin pin(model.flexible, F, M, "hinge");
    Joint::Slider slider(model.flexible, F, M, "slide");
    Joint::Weld weld(model.flexible, F, M, "weld");
    Joint::Ball ball(model.flexible, F, M, "ball");
    FrictionCoefficients viscous = makeCoefficients(0.1, 0.1, 0.01);
    viscous.viscous = -1;
    FrictionCoefficients axial = makeCoefficients(0.1, 0.1, 0.01);
    axial.axialRadius = 0.01;
    struct {
        const Joint& joint;
        FrictionCoefficients coefficients;
        std::string expected;
    } cases[] = {
        {pin, makeCoefficients(-0.1, 0.1, 0.01), "Coulomb friction is -0.1"},
        {pin, makeCoefficients(0.2, 0.1, 0.01), "static friction is 0.1; it must not be below"},
        {pin, makeCoefficients(0.2, 0.3), "needs that of its bearing"},
        {ball, makeCoefficients(0.2, 0.3), "Ball with dry friction needs one"},
        {pin, viscous, "viscous friction is -1"},
        {ball, axial, "only a Pin has one"},
        {slider, makeCoefficients(0.2, 0.3, 0.1), "a Slider has none"},
        {slider, makeCoefficients(Infinity, Infinity), "Coulomb friction is inf"},
        {weld, makeCoefficients(0.1, 0.1), "a Weld has no friction"},
    };
    for (const auto& wrong : cases) {
        try {
            JointFriction(model.flexible, wrong.joint, wrong.coefficients);
            ADD_FAILURE() << wrong.expected;
        } catch (const std::invalid_argument& error) {
            EXPECT_NE(std::string(error.what()).find("'" + wrong.joint.getName() + "'"),
                      std::string::npos)
                << error.what();
            EXPECT_NE(std::string(error.what()).find(wrong.expected), std::string::npos)
                << error.what();
        }
    }
    EXPECT_THROW(JointFriction(model.flexible, pin), std::invalid_argument);
}

TEST(JointFriction, NativeRunsAreRefused) {
    Incline model(0.2, makeCoefficients(0.1, 0.1));
    EXPECT_THROW(model.flexible.initializeNative(model.state), std::invalid_argument);
    // Refused without that call, too: Simbody's accelerations would ignore friction.
    const auto refusalOf = [](const auto& act) -> std::string {
        try {
            act();
        } catch (const std::exception& error) {
            return error.what();
        }
        return "";
    };
    State state = model.state;
    model.system.realize(state, Stage::Velocity);
    EXPECT_NE(refusalOf([&] { model.system.realize(state, Stage::Dynamics); }).find("'slide'"),
              std::string::npos);
    const auto runNatively = [&](const State& from) {
        return refusalOf([&] {
            RungeKuttaMersonIntegrator native(model.system);
            SimTK::TimeStepper stepper(model.system, native);
            stepper.initialize(from);
            stepper.stepTo(from.getTime() + 0.1);
        });
    };
    EXPECT_NE(runNatively(model.state).find("friction"), std::string::npos);
    // A State shown by an integrator that supports friction can be realized further, but not
    // continued natively.
    RadauIntegrator integrator(model.system);
    integrator.initialize(model.state);
    integrator.stepTo(0.1);
    EXPECT_EQ(refusalOf([&] { model.system.realize(integrator.getState(), Stage::Acceleration); }),
              "");
    // Simbody's integrators mistake the refusal for a step that is too long.
    EXPECT_NE(runNatively(integrator.getState()), "");
    // A disabled joint has no friction.
    state = model.state;
    model.matter.getConstraint(model.slide.getConstraintIndex()).disable(state);
    EXPECT_EQ(runNatively(state), "");
}

// Handlers, reporters and triggers realize the States that they receive.
TEST(JointFriction, EventsOfEveryStageRunBesideIt) {
    struct Handler : TriggeredEventHandler {
        Handler(const Incline& of, Stage stage) : TriggeredEventHandler(stage), incline(of) {}
        Real getValue(const State& state) const override {
            return incline.block.getBodyOriginLocation(state)[0] - 0.1;
        }
        void handleEvent(State& state, Real, bool&) const override {
            incline.system.realize(state, Stage::Acceleration);
            ++count;
        }
        const Incline& incline;
        mutable int count = 0;
    };
    struct Reporter : PeriodicEventReporter {
        explicit Reporter(const Incline& of) : PeriodicEventReporter(0.05), incline(of) {}
        void handleEvent(const State& state) const override {
            incline.system.realize(state, Stage::Acceleration);
        }
        const Incline& incline;
    };
    for (const Stage stage : {Stage::Position, Stage::Dynamics, Stage::Acceleration}) {
        Incline model(0.5, makeCoefficients(0.1, 0.1));
        auto* handler = new Handler(model, stage);
        model.system.addEventHandler(handler);
        model.system.addEventReporter(new Reporter(model));
        model.start(0);
        const State state = model.system.realizeTopology();
        RadauIntegrator integrator(model.system);
        integrator.initialize(state);
        integrator.stepTo(0.5);
        EXPECT_EQ(handler->count, 1);
        const Real a = Weight * (std::sin(0.5) - 0.1 * std::cos(0.5));
        EXPECT_NEAR(model.place(integrator), 0.5 * a * 0.25, 1e-6);
    }
}

TEST(JointFriction, EquilibriaHaveNoneAndSmallMotionsAreHeld) {
    // A pendulum near its lowest position, held by bearing friction; a mass on a spring beside it.
    FrictionModel model;
    MobilizedBody::Free arm(model.matter.Ground(), Transform(),
                            Body::Rigid(MassProperties(1, Vec3(0, -0.3, 0), Inertia(0.2))),
                            Transform());
    MobilizedBody::Free mass = model.addBody(1, Vec3(0.01));
    Joint::Pin pin(model.flexible, model.matter.Ground(), arm, "pin");
    Joint::Slider slide(model.flexible,
                        Attachment(model.matter.Ground(), Transform(Rotation(Pi / 2, ZAxis))),
                        Attachment(mass, Transform(Rotation(Pi / 2, ZAxis))), "slide");
    const Real stiffness = 400;
    TwoPointSpringDamper(model.flexible,
                         Attachment(model.matter.Ground(), Transform(Vec3(0, 1, 0))), mass,
                         stiffness, 0, 1);
    JointFriction(model.flexible, pin, makeCoefficients(0.3, 0.3, 0.1));
    State state = model.system.realizeTopology();
    arm.setQToFitRotation(state, Rotation(0.02, ZAxis));
    const auto modes = calcEigenmodes(calcLinearization(model.system, state));
    ASSERT_EQ(modes.size(), 1u);
    EXPECT_NEAR(modes[0].frequency, std::sqrt(stiffness) / (2 * Pi), 1e-6);
    StaticEquilibrium equilibrium(model.system);
    equilibrium.solve(state);
    EXPECT_NEAR(pin.calcCoordinates(equilibrium.getState())[0], 0, 1e-8);
    arm.setUToFitAngularVelocity(state, Vec3(0, 0, 1));
    try {
        calcLinearization(model.system, state);
        ADD_FAILURE() << "sliding friction was linearised";
    } catch (const std::invalid_argument& error) {
        EXPECT_NE(std::string(error.what()).find("friction of joint 'pin'"), std::string::npos)
            << error.what();
    }
}

/** The flexible slider-crank with friction in its pins, driven by a torque or at a prescribed
speed. **/
struct RubbingCrank : FlexibleSliderCrank {
    explicit RubbingCrank(const SliderCrankOptions& options, bool rubs = true)
        : FlexibleSliderCrank(options), start(makeStart(rubs)) {}

    std::array<const Joint*, 3> pins() const { return {&mainBearing, &crankPin, &gudgeonPin}; }
    Real calcEnergy(const State& at) const {
        system.realize(at, Stage::Velocity);
        return flexible.calcKineticEnergy(at) + system.calcPotentialEnergy(at);
    }

    State start;

private:
    State makeStart(bool rubs) {
        for (const Joint* joint : pins())
            if (rubs) JointFriction(flexible, *joint, makeCoefficients(0.1, 0.12, 0.008));
        State made = system.realizeTopology();
        made.updQ() = state.getQ();
        return made;
    }
};

SliderCrankOptions makeOptions() {
    SliderCrankOptions options;
    options.dampingRatio = 0.01;
    return options;
}

TEST(JointFriction, FlexibleSliderCrankTakesFewMoreIterations) {
    SliderCrankOptions options = makeOptions();
    options.angle = [](Real t) {
        // From rest to 100 rad/s.
        const Real rise = 0.03, omega = 100, x = Pi * std::min(t, rise) / rise;
        return Vec3(0.5 + omega / 2 * (std::min(t, rise) - rise / Pi * std::sin(x)) +
                        omega * std::max(t - rise, 0.),
                    omega / 2 * (1 - std::cos(x)), omega / 2 * Pi / rise * std::sin(x));
    };
    long iterations[2];
    for (const bool rubs : {false, true}) {
        RubbingCrank model(options, rubs);
        BdfIntegrator integrator(model.system);
        integrator.initialize(model.start);
        integrator.stepTo(0.15);
        iterations[rubs] = integrator.getStatistics().newtonIterations;
    }
    RecordProperty("IterationsWithout", std::to_string(iterations[false]));
    RecordProperty("IterationsWith", std::to_string(iterations[true]));
    EXPECT_LE(Real(iterations[true]), 1.3 * Real(iterations[false]));
}

TEST(JointFriction, EnergyOfTheFlexibleSliderCrankIsAccountedFor) {
    Real last = Infinity;
    for (const Real accuracy : {1e-5, 1e-6, 1e-7}) {
        RubbingCrank model(makeOptions());
        BdfIntegrator integrator(model.system);
        integrator.setAccuracy(accuracy);
        integrator.initialize(model.start);
        integrator.stepTo(0.15);
        const Real gap = std::abs(model.calcEnergy(integrator.getState()) -
                                  model.calcEnergy(model.start) - integrator.getWork());
        EXPECT_LT(gap, 0.35 * last) << accuracy;
        last = gap;
    }
    EXPECT_LT(last, 0.01);
}

TEST(JointFriction, BlockEliminationAgreesWithDensePivoting) {
    for (const auto form : {BdfIntegrator::BlockForm::Arrow, BdfIntegrator::BlockForm::Dense}) {
        RubbingCrank model(makeOptions());
        std::vector<NewtonSystem> systems;
        int count = 0;
        BdfIntegrator integrator(model.system);
        integrator.setBlockForm(form);
        integrator.setNewtonSystemObserver([&](const NewtonSystem& system) {
            if (count++ % 5 == 0) systems.push_back(system);
        });
        integrator.initialize(model.start);
        integrator.stepTo(0.02);
        ASSERT_GT(systems.size(), 5u);
        for (const NewtonSystem& system : systems) {
            ASSERT_EQ(system.couplings.size(), 3u);
            BlockEliminationSolver solver(system);
            solver.factor(system);
            solver.solve(system);
            const int n = system.numSpeeds(), m = system.numMultipliers();
            const Eigen::VectorXd exact = solveDense(system);
            const Eigen::Map<const Eigen::VectorXd> deltaU(solver.getDeltaU().data(), n),
                deltaLambda(solver.getDeltaLambda(), m);
            EXPECT_LT((deltaU - exact.head(n)).norm(), 1e-8 * exact.head(n).norm());
            EXPECT_LT((deltaLambda - exact.tail(m)).norm(), 1e-8 * exact.tail(m).norm());
        }
    }
}

TYPED_TEST(JointFrictions, CheckpointsGoOnWithTheSameBits) {
    SliderCrankOptions options = makeOptions();
    options.torque = [](Real t) { return 0.2 * std::sin(200 * t); };
    RubbingCrank model(options);
    TypeParam whole(model.system);
    whole.initialize(model.start);
    std::vector<std::string> checkpoints;
    for (int i = 0; i < 20; ++i) {
        whole.stepTo(0.002 * (i + 1));
        std::stringstream stream;
        whole.writeCheckpoint(stream);
        checkpoints.push_back(stream.str());
    }
    for (const size_t from : {size_t(0), size_t(7), size_t(13)}) {
        TypeParam resumed(model.system);
        std::stringstream stream(checkpoints[from]);
        resumed.readCheckpoint(stream, model.start);
        for (size_t i = from + 1; i < 20; ++i) resumed.stepTo(0.002 * Real(i + 1));
        const Vector difference = resumed.getState().getY() - whole.getState().getY(),
                     multipliers = resumed.getMultipliers() - whole.getMultipliers();
        EXPECT_EQ(difference.normInf(), 0) << from;
        EXPECT_EQ(multipliers.normInf(), 0) << from;
        EXPECT_EQ(resumed.getStatistics().newtonIterations, whole.getStatistics().newtonIterations);
    }
}

}  // namespace
}  // namespace simflex::test
