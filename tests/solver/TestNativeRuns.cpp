// Simbody's own integrators under TimeStepper on soft flexible bodies, against conservation laws
// (against BDF: validation/TestDoublePendulum).

#include <gtest/gtest.h>

#include <cmath>
#include <thread>

#include "SliderCrankModel.h"
#include "simflex/body/FlexibleBodySubsystemGuts.h"
#include "simflex/solver/BdfIntegrator.h"
#include "simflex/solver/RadauIntegrator.h"
#include "simflex/solver/StaticEquilibrium.h"
#include "support/DoublePendulum.h"
#include "support/NativeReference.h"

namespace simflex::test {
namespace {

using namespace SimTK;

/** A free soft body, deformed and tumbling. **/
struct Tumbling {
    Tumbling()
        : matter(system), flexible(system, matter), item{FlexibleBody(flexible, part.body), part} {}

    State makeState() {
        State state = system.realizeTopology();
        const FlexibleBody& body = item.body;
        body.setFramePose(state, Transform(Vec3(1, 2, 3)));
        body.setFrameVelocity(state, SpatialVec(Vec3(4, 3, -2), Vec3(0.3, -0.2, 0.1)));
        Vector xi(7), xiDot(7);
        for (int i = 0; i < 7; ++i) {
            xi[i] = 4e-3 * std::cos(1.0 + i);
            xiDot[i] = 0.1 * std::sin(2.0 + i);
        }
        body.setModalCoordinates(state, xi);
        body.setModalSpeeds(state, xiDot);
        flexible.initializeNative(state);
        return state;
    }

    MultibodySystem system;
    SimbodyMatterSubsystem matter;
    FlexibleBodySubsystem flexible;
    const PointMassPart part = makeSoftPart(5, 7);
    FlexibleMasses item;
};

struct Drift {
    Real energy, angularMomentum, linearMomentum;
};

/** Returns the relative changes in 0.25 s with fixed steps, by sums over the masses. **/
Drift calcDrift(Real h) {
    Tumbling model;
    RungeKuttaMersonIntegrator integrator(model.system);
    integrator.setFixedStepSize(h);
    integrator.setAccuracy(0.9);
    TimeStepper stepper(model.system, integrator);
    stepper.initialize(model.makeState());
    const auto measure = [&](Real& energy, Eigen::Vector3d& angular, Eigen::Vector3d& linear) {
        const State& state = stepper.getState();
        model.system.realize(state, Stage::Velocity);
        const PointMassMotion motion = getMotion(model.item, state);
        energy = calcKineticEnergy(model.part, motion) + model.item.body.calcStrainEnergy(state);
        angular = calcAngularMomentum(model.part, motion);
        linear = calcLinearMomentum(model.part, motion);
    };
    Real before, after;
    Eigen::Vector3d angular[2], linear[2];
    measure(before, angular[0], linear[0]);
    stepper.stepTo(0.25);
    measure(after, angular[1], linear[1]);
    return {std::abs(after - before) / before, (angular[1] - angular[0]).norm() / angular[0].norm(),
            (linear[1] - linear[0]).norm() / linear[0].norm()};
}

TEST(NativeRuns, TumblingBodyKeepsEnergyAndMomentumToTheOrderOfTheIntegrator) {
    const Drift coarse = calcDrift(2e-3), fine = calcDrift(1e-3);
    // Order 4 gives a factor of 16; energy errors may cancel in part.
    EXPECT_GT(coarse.energy / fine.energy, 14);
    EXPECT_NEAR(std::log2(coarse.angularMomentum / fine.angularMomentum), 4, 0.4);
    EXPECT_LT(fine.energy, 1e-5);
    EXPECT_LT(fine.angularMomentum, 1e-6);
    EXPECT_LT(fine.linearMomentum, 1e-14);
}

TEST(NativeRuns, EnergyAndMomentumOfTheSystemAreThoseOfItsMassesInBothModes) {
    Tumbling model;
    MobilizedBody::Free brick(
        model.matter.Ground(),
        Body::Rigid(
            MassProperties(3, Vec3(0.1, -0.2, 0.3),
                           3 * UnitInertia(1, 2, 2.5).shiftFromCentroid(Vec3(0.1, -0.2, 0.3)))));
    State state = model.makeState();
    brick.setQToFitTransform(state, Transform(Rotation(0.4, UnitVec3(1, 2, 3)), Vec3(1, -1, 2)));
    brick.setUToFitVelocity(state, SpatialVec(Vec3(1, 2, 3), Vec3(4, 5, 6)));
    RungeKuttaMersonIntegrator integrator(model.system);
    TimeStepper stepper(model.system, integrator);
    stepper.initialize(state);
    stepper.stepTo(0.05);
    BdfIntegrator bdf(model.system);
    bdf.initialize(state);
    bdf.stepTo(0.05);
    for (const State& reached : {stepper.getState(), bdf.getState()}) {
        State now = reached;
        for (bool isNative : {true, false}) {
            model.flexible.getGuts().setNativeForcesEnabled(now, isNative);
            model.system.realize(now, Stage::Dynamics);
            const PointMassMotion motion = getMotion(model.item, now);
            const SpatialVec own = brick.calcBodyMomentumAboutBodyMassCenterInGround(now);
            const Vec3 c = brick.findMassCenterLocationInGround(now),
                       v = brick.findStationVelocityInGround(now, Vec3(0.1, -0.2, 0.3)),
                       omega = brick.getBodyAngularVelocity(now);
            const double T = calcKineticEnergy(model.part, motion) + 1.5 * v.normSqr() +
                             0.5 * dot(omega, own[0]);
            EXPECT_NEAR(model.flexible.calcKineticEnergy(now), T, 1e-12 * T);
            const double V = model.item.body.calcStrainEnergy(now);
            EXPECT_NEAR(model.flexible.calcPotentialEnergy(now), V, 1e-14 * V);
            EXPECT_NEAR(model.flexible.calcEnergy(now), T + V, 1e-12 * T);
            const SpatialVec momentum = model.flexible.calcMomentum(now);
            const Vec3 linear = toSimTK(calcLinearMomentum(model.part, motion)) + 3 * v,
                       angular =
                           toSimTK(calcAngularMomentum(model.part, motion)) + own[0] + c % (3 * v);
            EXPECT_LT((momentum[1] - linear).norm(), 1e-12 * linear.norm());
            EXPECT_LT((momentum[0] - angular).norm(), 1e-12 * angular.norm());
        }
    }
}

// No GeneralForceSubsystem: that of Simbody 3.7 keeps data shared by all States of a system and
// gives occasional wrong forces when several threads realize theirs.
TEST(NativeRuns, StatesInSeveralThreadsHaveTheSameAccelerationsToTheBit) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    FlexibleBodySubsystem flexible(system, matter);
    const auto part = makePointMassPart().body;
    const FlexibleBody first(flexible, part, "first"), second(flexible, part, "second");
    Joint::Ball(flexible, matter.Ground(), first.interface("A"));
    Joint::Ball(flexible, first.interface("B"), second.interface("A"));
    const State start = system.realizeTopology();
    constexpr int NumStates = 40;
    std::vector<State> states(NumStates, start);
    for (int k = 0; k < NumStates; ++k)
        for (int i = 0; i < start.getNU(); ++i)
            states[size_t(k)].updU()[i] = std::sin(1 + i) * (1 + 0.1 * k);
    const auto calcAt = [&](int k) {
        State& state = states[size_t(k)];
        state.updU();  // invalidates the cache
        system.realize(state, Stage::Acceleration);
        return Vector(state.getUDot());
    };
    std::vector<Vector> together(NumStates);
    std::vector<std::thread> threads;
    for (int t = 0; t < 4; ++t)
        threads.emplace_back([&, t] {
            for (int k = t; k < NumStates; k += 4) together[size_t(k)] = calcAt(k);
        });
    for (std::thread& thread : threads) thread.join();
    for (int k = 0; k < NumStates; ++k) {
        const Vector alone = calcAt(k);
        for (int i = 0; i < alone.size(); ++i) EXPECT_EQ(together[size_t(k)][i], alone[i]);
    }
}

/** The rod of a slider-crank starts 0.27 m away from its pins. **/
TEST(InitializeNative, AssemblesJointsWithoutStrainingTheParts) {
    FlexibleSliderCrank model;
    State apart = model.state;
    model.system.realize(apart, Stage::Position);
    Transform X_GB = model.rod.getFramePose(apart);
    X_GB.updP() += Vec3(0.2, -0.1, 0.15);
    model.rod.setFramePose(apart, X_GB);
    const auto calcStrainEnergy = [&](const State& state) {
        return model.crank.calcStrainEnergy(state) + model.rod.calcStrainEnergy(state);
    };
    const auto calcErrors = [&](const State& state) {
        Real largest = 0;
        for (const Joint* joint : std::initializer_list<const Joint*>{
                 &model.mainBearing, &model.crankPin, &model.gudgeonPin})
            largest = std::max(largest, joint->calcPositionErrors(state).normInf());
        return largest;
    };
    model.system.realize(apart, Stage::Velocity);
    EXPECT_NEAR(calcErrors(apart), 0.2, 0.01);

    State plain = apart;
    model.system.project(plain, 1e-10);
    EXPECT_GT(calcStrainEnergy(plain), 10);  // with Simbody's default weights

    State state = apart;
    model.flexible.initializeNative(state);
    EXPECT_LT(calcErrors(state), 1e-10);
    EXPECT_LT(calcStrainEnergy(state), 1e-9);
}

// Among all assembled shapes the equilibrium has the least strain energy.
TEST(InitializeNative, StrainsPartsAsLittleAsTheirJointsAllow) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    FlexibleBodySubsystem flexible(system, matter);
    const FlexibleBody body(flexible, makePointMassPart().body, "body");
    State state = system.realizeTopology();
    body.setPoseByInterface(state, "A", Transform());
    system.realize(state, Stage::Velocity);
    const Vec3 end = body.interface("B").calcMotion(state).X.p();
    Joint::Weld(flexible, matter.Ground(), body.interface("A"), "clamp");
    Joint::Ball far(flexible, Attachment(matter.Ground(), 1.001 * end), body.interface("B"), "far");

    state = system.realizeTopology();
    body.setPoseByInterface(state, "A", Transform());
    StaticEquilibrium equilibrium(system);
    equilibrium.solve(state);
    const Real least = body.calcStrainEnergy(equilibrium.getState());
    flexible.initializeNative(state);
    EXPECT_LT(far.calcPositionErrors(state).norm(), 1e-9);
    EXPECT_GT(least, 1e-3);
    EXPECT_NEAR(body.calcStrainEnergy(state), least, 1e-3 * least);
}

TEST(InitializeNative, SpeedsKeepShapesAndAreThoseOfImplicitRuns) {
    FlexibleSliderCrank model;
    State state = model.state;
    model.system.realize(state, Stage::Position);
    model.crank.setFrameVelocity(state, SpatialVec(Vec3(0, 0, 10), Vec3(0)));
    State start = state;
    model.flexible.initializeNative(start);
    EXPECT_LT(start.getUErr().normInf(), 1e-9);
    RadauIntegrator integrator(model.system);
    integrator.initialize(state);
    EXPECT_LT((integrator.getState().getQ() - start.getQ()).normInf(), 1e-10);
    EXPECT_LT((integrator.getState().getU() - start.getU()).normInf(),
              1e-8 * start.getU().normInf());
    // The nearest consistent speeds: the jump is orthogonal to all of them in kinetic energy.
    State before = start, jump = start;
    before.updU() = state.getU();
    jump.updU() = start.getU() - state.getU();
    const auto calcEnergy = [&](State& moving) {
        model.system.realize(moving, Stage::Velocity);
        return model.flexible.calcKineticEnergy(moving);
    };
    const Real energy = calcEnergy(start), energyBefore = calcEnergy(before);
    EXPECT_GT(energy, 1e-6);
    EXPECT_LT(energy, 0.99 * energyBefore);
    EXPECT_NEAR(energyBefore, energy + calcEnergy(jump), 1e-9 * energyBefore);
}

TEST(InitializeNative, WeightsAreTheDisplacementsThatSpeedsCause) {
    Tumbling model;
    const State state = model.makeState();
    const FlexibleBody& body = model.item.body;
    const Vector& weights = state.getUWeights();
    // Unit motions of the undeformed body's masses.
    const auto calcLargest = [&](const PointMassMotion& motion) {
        return std::sqrt(calcMassVelocities(model.part, motion).colwise().squaredNorm().maxCoeff());
    };
    for (int i = 0; i < body.getNumModes(); ++i) {
        PointMassMotion motion(body.getNumModes());
        motion.xiDot[i] = 1;
        const int u = int(body.getModalMobilizer(i / 6).getFirstUIndex(state)) + i % 6;
        EXPECT_NEAR(weights[u], calcLargest(motion), 1e-12);
    }
    const int first = int(body.getFrame().getFirstUIndex(state));
    Real radius = 0;
    for (int node = 0; node < body.getPart().mesh.numNodes(); ++node) {
        const auto s = body.getPart().mesh.position(node);
        radius = std::max(radius, Vec3(s[0], s[1], s[2]).norm());
    }
    for (int a = 0; a < 3; ++a) {
        EXPECT_NEAR(weights[first + a], radius, 1e-12);
        EXPECT_EQ(weights[first + 3 + a], 1);
    }
}

TEST(InitializeNative, LockedAndPrescribedCoordinatesKeepTheirValues) {
    DoublePendulum model;
    Motion::Sinusoid(
        model.matter.updMobilizedBody(model.lower.getModalMobilizer(0).getMobilizedBodyIndex()),
        Motion::Position, 0.003, 5, 0.7);
    State state = model.makeState();
    const MobilizedBody& carrier = model.upper.getModalMobilizer(0);
    carrier.setOneQ(state, 2, 0.004);
    carrier.lock(state);
    model.flexible.initializeNative(state);
    EXPECT_EQ(carrier.getOneQ(state, 2), 0.004);
    EXPECT_NEAR(model.lower.getModalMobilizer(0).getOneQ(state, 1), 0.003 * std::sin(0.7), 1e-15);
    EXPECT_LT(model.knee.calcPositionErrors(state).norm(), 1e-9);
}

TEST(InitializeNative, WhatCannotBeAssembledIsAnError) {
    DoublePendulum model;
    Constraint::Rod(model.matter.Ground(), Vec3(0),
                    model.matter.updMobilizedBody(model.lower.getFrame().getMobilizedBodyIndex()),
                    Vec3(0), 9);
    try {
        model.makeState();
        FAIL() << "assembled";
    } catch (const std::runtime_error& error) {
        EXPECT_NE(std::string(error.what()).find("initializeNative"), std::string::npos);
    }
}

}  // namespace
}  // namespace simflex::test
