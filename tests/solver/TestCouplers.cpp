/** @file
Gears and couplers in motion: closed forms, Simbody's CoordinateCoupler, many turns, energy; in
native and implicit runs. **/

#include <gtest/gtest.h>

#include <cmath>

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"
#include "simflex/forces/TorsionSpring.h"
#include "simflex/solver/BdfIntegrator.h"
#include "simflex/solver/Eigenmodes.h"
#include "simflex/solver/GeneralizedAlphaIntegrator.h"
#include "simflex/solver/StaticEquilibrium.h"
#include "support/PointMassPart.h"

namespace simflex::test {
namespace {

using namespace SimTK;
using Coordinate = Joint::Coordinate;
using Side = Joint::Side;

Body::Rigid makeWheel(Real inertia) {
    return Body::Rigid(MassProperties(2, Vec3(0), Inertia(inertia, inertia, inertia)));
}

/** Two wheels on parallel axes, a torque on the first. **/
struct GearPair {
    enum class Order { AThenB, BThenA, BearingAReversed };
    static constexpr int TeethA = 17, TeethB = 43;
    static constexpr Real InertiaA = 0.02, InertiaB = 0.7;

    explicit GearPair(Order order = Order::AThenB, Real torque = 3) {
        Force::ConstantTorque(forces, A, Vec3(0, 0, torque));
        const Attachment groundA(matter.Ground(), Transform(Vec3(-0.1, 0, 0))),
            groundB(matter.Ground(), Transform(Vec3(0.2, 0, 0)));
        const bool isReversed = order == Order::BearingAReversed;
        bearingA = std::make_unique<Joint::Pin>(flexible, isReversed ? A : groundA,
                                                isReversed ? groundA : A);
        bearingB = std::make_unique<Joint::Pin>(flexible, groundB, B);
        const int teethA = isReversed ? -TeethA : TeethA;
        gear = std::make_unique<Joint::Gear>(
            order == Order::BThenA
                ? Joint::Gear(flexible, *bearingB, TeethB, *bearingA, teethA, "gear")
                : Joint::Gear(flexible, *bearingA, teethA, *bearingB, TeethB, "gear"));
        state = system.realizeTopology();
        A.setQToFitTranslation(state, Vec3(-0.1, 0, 0));
        B.setQToFitTranslation(state, Vec3(0.2, 0, 0));
    }

    void setSpeed(Real omegaA) {
        A.setUToFitAngularVelocity(state, Vec3(0, 0, omegaA));
        B.setUToFitAngularVelocity(state, Vec3(0, 0, -omegaA * TeethA / TeethB));
    }

    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    FlexibleBodySubsystem flexible{system, matter};
    MobilizedBody::Free A{matter.Ground(), makeWheel(InertiaA)},
        B{matter.Ground(), makeWheel(InertiaB)};
    std::unique_ptr<Joint> bearingA, bearingB, gear;
    State state;
};

/** J_A α + (n_A/n_B)² J_B α = T; each wheel's gear torque is its inertia torque less the applied
one. **/
TEST(Gear, SpeedsUpAndLoadsItsTeethAsTheReducedInertiaHasIt) {
    const Real T = 3, ratio = Real(GearPair::TeethA) / GearPair::TeethB;
    const Real alpha = T / (GearPair::InertiaA + GearPair::InertiaB * ratio * ratio);
    const Real torqueA = GearPair::InertiaA * alpha - T,
               torqueB = -GearPair::InertiaB * alpha * ratio;
    const GearPair model(GearPair::Order::AThenB, T);
    State native = model.state;
    model.system.realize(native, Stage::Acceleration);
    BdfIntegrator integrator(model.system);
    integrator.setAccuracy(1e-8);
    integrator.initialize(model.state);
    const Vector nativeLambda = model.gear->getMultipliers(native),
                 lambda = integrator.getMultipliers(*model.gear);
    const Vector nativeUDot = native.getUDot(), uDot = integrator.getUDot();
    for (const Vector& accelerations : {nativeUDot, uDot}) {
        const int a = int(model.A.getFirstUIndex(native)), b = int(model.B.getFirstUIndex(native));
        EXPECT_NEAR(accelerations[a + 2], alpha, 1e-10 * alpha);
        EXPECT_NEAR(accelerations[b + 2], -alpha * ratio, 1e-10 * alpha);
    }
    for (const Vector& multipliers : {nativeLambda, lambda}) {
        const Vector torques = model.gear->calcCouplingForces(multipliers);
        ASSERT_EQ(torques.size(), 2);
        EXPECT_NEAR(torques[0], torqueA, 1e-10 * T);
        EXPECT_NEAR(torques[1], torqueB, 1e-10 * T);
        // The reactions on the wheels are the same, and opposite on the carrier.
        const SpatialVec onA =
            model.gear->calcReaction(native, multipliers, Side::M, Side::M, Joint::Axes::M, 0);
        const SpatialVec onB =
            model.gear->calcReaction(native, multipliers, Side::M, Side::M, Joint::Axes::M, 1);
        const SpatialVec onCarrier =
            model.gear->calcReaction(native, multipliers, Side::F, Side::F, Joint::Axes::F, 1);
        EXPECT_LT((onA[0] - Vec3(0, 0, torqueA)).norm(), 1e-10 * T);
        EXPECT_LT((onB[0] - Vec3(0, 0, torqueB)).norm(), 1e-10 * T);
        EXPECT_LT((onCarrier[0] + onB[0]).norm(), 1e-10 * T);
        EXPECT_EQ(onA[1].norm() + onB[1].norm(), 0);
    }
    integrator.stepTo(0.2);
    const State& now = integrator.getState();
    EXPECT_NEAR(model.bearingA->calcCoordinateDots(now)[0], alpha * 0.2, 1e-8);
    EXPECT_NEAR(model.gear->calcCoordinateDots(now)[1], -alpha * 0.2 * ratio, 1e-8);
    EXPECT_NEAR(model.gear->calcCoordinates(now)[0], 0.5 * alpha * 0.04, 1e-3);
    EXPECT_LT(std::abs(model.gear->calcPositionErrors(now)[0]), 1e-10);
    EXPECT_EQ(integrator.getWork(), 0);
}

TEST(Gear, MovesTheSameWithItsWheelsExchangedOrABearingReversed) {
    Real angles[3];
    for (int k = 0; k < 3; ++k) {
        GearPair model{GearPair::Order(k)};
        model.setSpeed(2);
        RungeKuttaMersonIntegrator integrator(model.system);
        integrator.setAccuracy(1e-9);
        integrator.setConstraintTolerance(1e-10);
        TimeStepper stepper(model.system, integrator);
        stepper.initialize(model.state);
        stepper.stepTo(0.2);
        State state = stepper.getState();
        model.system.realize(state, Stage::Velocity);
        angles[k] = model.bearingB->calcCoordinates(state)[0];
    }
    EXPECT_GT(std::abs(angles[0]), 0.2);
    EXPECT_NEAR(angles[1], angles[0], 1e-8);
    EXPECT_NEAR(angles[2], angles[0], 1e-8);
}

/** Counts a hundred turns by the wheel angles at every step: no tooth is skipped, and a run from a
saved State continues in mesh. **/
TEST(Gear, StaysInMeshForAHundredTurns) {
    GearPair model(GearPair::Order::AThenB, 0);
    model.setSpeed(100);
    Real turnedA = 0, turnedB = 0, lastA = 0, lastB = 0, largest = 0;
    int steps = 0;
    const auto count = [&](const State& now) {
        const Vector angles = model.gear->calcCoordinates(now);
        turnedA += std::remainder(angles[0] - lastA, 2 * Pi);
        turnedB += std::remainder(angles[1] - lastB, 2 * Pi);
        lastA = angles[0], lastB = angles[1];
        largest =
            std::max(largest, std::abs(turnedA * GearPair::TeethA + turnedB * GearPair::TeethB));
        ++steps;
    };
    State saved = model.state;
    for (const Real end : {3.0, 2 * Pi + 0.02}) {
        BdfIntegrator integrator(model.system);
        integrator.setAccuracy(1e-4);
        integrator.initialize(saved);
        while (integrator.getTime() < end) {
            integrator.stepOnce();
            count(integrator.getState());
        }
        saved = integrator.getState();
    }
    EXPECT_GT(turnedA, 100 * 2 * Pi);
    EXPECT_LT(largest, 1e-7);
    EXPECT_LT(steps, 40000);

    RungeKuttaMersonIntegrator native(model.system);
    native.setAccuracy(1e-6);
    native.setConstraintTolerance(1e-9);
    TimeStepper stepper(model.system, native);
    stepper.initialize(saved);
    for (int k = 1; k <= 200; ++k) {
        stepper.stepTo(saved.getTime() + 0.01 * k);
        State state = stepper.getState();
        model.system.realize(state, Stage::Velocity);
        count(state);
    }
    EXPECT_GT(turnedA, 131 * 2 * Pi);
    EXPECT_LT(largest, 1e-6);
}

/** For accuracies as loose as a turn, steps are cut until no tooth can be skipped. **/
TEST(Gear, LosesNoToothHoweverCoarseTheAccuracy) {
    using Formulation = BdfIntegrator::Formulation;
    for (const Formulation formulation : {Formulation::StabilizedIndex2, Formulation::Index3})
        for (const Real accuracy : {1.0, 0.1, 0.01}) {
            const GearPair model;
            BdfIntegrator integrator(model.system);
            integrator.setAccuracy(accuracy);
            integrator.setFormulation(formulation);
            integrator.initialize(model.state);
            Real teeth = 0;
            Vector last(2, Real(0));
            while (integrator.getTime() < 2) {
                integrator.stepOnce();
                const Vector angles = model.gear->calcCoordinates(integrator.getState());
                teeth += (GearPair::TeethA * std::remainder(angles[0] - last[0], 2 * Pi) +
                          GearPair::TeethB * std::remainder(angles[1] - last[1], 2 * Pi)) /
                         (2 * Pi);
                last = angles;
                ASSERT_LT(std::abs(teeth), 1e-3) << accuracy << " " << integrator.getTime();
            }
        }
}

TEST(Gear, FixedStepsThatMayLoseAToothAreRefused) {
    GearPair model;
    model.setSpeed(2);
    BdfIntegrator integrator(model.system);
    integrator.setFixedStep(0.4);
    integrator.initialize(model.state);
    try {
        integrator.stepTo(4);
        FAIL() << "no exception";
    } catch (const std::runtime_error& error) {
        EXPECT_NE(std::string(error.what()).find("too long to count the teeth"), std::string::npos)
            << error.what();
    }
}

/** A torque T on wheel A against a spring k on wheel B: k θ_B = −T n_B/n_A; frequency there ω² =
k/(J_B + J_A (n_B/n_A)²). **/
TEST(Gear, EquilibriumAndFrequencyAreThoseOfTheReducedSystem) {
    const Real T = 0.3, k = 2, ratio = Real(GearPair::TeethB) / GearPair::TeethA;
    GearPair model(GearPair::Order::AThenB, T);
    TorsionSpring(model.flexible, model.bearingB->getFrameF(), model.bearingB->getFrameM(), k);
    State state = model.system.realizeTopology();
    state.updQ() = model.state.getQ();
    StaticEquilibrium equilibrium(model.system);
    equilibrium.solve(state);
    const Vector angles = model.gear->calcCoordinates(equilibrium.getState());
    EXPECT_NEAR(angles[1], -T * ratio / k, 1e-8);
    EXPECT_NEAR(angles[0], T * ratio * ratio / k, 1e-7);
    EXPECT_NEAR(model.gear->calcCouplingForces(equilibrium.getMultipliers(*model.gear))[0], -T,
                1e-8);
    const std::vector<Eigenmode> modes =
        calcEigenmodes(calcLinearization(model.system, equilibrium.getState()));
    ASSERT_EQ(modes.size(), 1u);
    EXPECT_NEAR(modes[0].frequency,
                std::sqrt(k / (GearPair::InertiaB + GearPair::InertiaA * ratio * ratio)) / (2 * Pi),
                1e-7);
}

/** Assembly meshes the nearest teeth; a phase shifts the mesh. **/
TEST(Gear, IsAssembledInTheNearestTooth) {
    for (const Real phase : {0.0, 1.2}) {
        MultibodySystem system;
        SimbodyMatterSubsystem matter(system);
        FlexibleBodySubsystem flexible(system, matter);
        const MobilizedBody::Free A(matter.Ground(), makeWheel(0.02)),
            B(matter.Ground(), makeWheel(0.7));
        const Joint::Pin bearingA(flexible, matter.Ground(), A),
            bearingB(flexible, matter.Ground(), B);
        const Joint::Gear gear(flexible, bearingA, 20, bearingB, -30, phase);
        State state = system.realizeTopology();
        A.setQToFitRotation(state, Rotation(1.0, ZAxis));
        B.setQToFitRotation(state, Rotation(2.0, ZAxis));
        BdfIntegrator integrator(system);
        integrator.initialize(state);
        flexible.initializeNative(state);
        for (State assembled : {integrator.getState(), state}) {
            system.realize(assembled, Stage::Velocity);
            const Vector angles = gear.calcCoordinates(assembled);
            const Real teeth = (20 * angles[0] - 30 * angles[1] - phase) / (2 * Pi);
            EXPECT_NEAR(teeth, std::round((20 * 1.0 - 30 * 2.0 - phase) / (2 * Pi)), 1e-8);
            EXPECT_LT(std::abs(angles[0] - 1), Pi / 20);
        }
    }
}

/** x = rθ on a rack that slides down: (m + J/r²) ẍ = m g, through many turns of the pinion. **/
TEST(Coupler, RackRollsOnItsPinion) {
    const Real r = 0.01, J = 3e-4, m = 2, g = 9.81, a = m * g / (m + J / (r * r));
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    Force::Gravity(forces, matter, Vec3(g, 0, 0));
    FlexibleBodySubsystem flexible(system, matter);
    const MobilizedBody::Free rack(matter.Ground(), makeWheel(0.1)),
        pinion(matter.Ground(), makeWheel(J));
    const Joint::Slider slide(flexible, matter.Ground(), rack);
    const Joint::Pin bearing(flexible, matter.Ground(), pinion);
    const Joint::Coupler coupler(flexible, {{slide, 1}, {bearing, -r}}, 0.3, "rack");
    State state = system.realizeTopology();
    rack.setQToFitTranslation(state, Vec3(0.3, 0, 0));
    State native = state;
    system.realize(native, Stage::Acceleration);
    const Vector forcesAlong = coupler.calcCouplingForces(coupler.getMultipliers(native));
    EXPECT_NEAR(forcesAlong[0], m * (a - g), 1e-9);
    EXPECT_NEAR(forcesAlong[1], J * a / r, 1e-9);
    Real error[2];
    for (int run = 0; run < 2; ++run) {
        GeneralizedAlphaIntegrator integrator(system);
        integrator.setAccuracy(run == 0 ? 1e-5 : 1e-7);
        integrator.initialize(state);
        integrator.stepTo(0.5);
        const State& now = integrator.getState();
        const Real x = slide.calcCoordinates(now)[0] - 0.3;
        error[run] = std::abs(x - 0.5 * a * 0.25);
        // The pinion has made 7.8 turns.
        EXPECT_NEAR(std::remainder(bearing.calcCoordinates(now)[0] - x / r, 2 * Pi), 0, 1e-7);
        EXPECT_NEAR(slide.calcCoordinateDots(now)[0], r * bearing.calcCoordinateDots(now)[0], 1e-9);
    }
    EXPECT_LT(error[0], 1e-3);
    EXPECT_LT(error[1], error[0] / 8 + 1e-7);
}

/** A planetary set with fixed ring and two planets on the carrier: the sun turns 1 + n_R/n_S times
as fast as the carrier. The gear of ring and planet uses angles relative to the carrier. **/
TEST(Coupler, PlanetarySetHasItsRatioAndReducedInertia) {
    const int sunTeeth = 24, planetTeeth = 18, ringTeeth = 60;
    const Real sunInertia = 0.01, planetInertia = 0.004, carrierInertia = 0.3, planetMass = 2,
               radius = 0.21, T = 1.5;
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    FlexibleBodySubsystem flexible(system, matter);
    const MobilizedBody::Free sun(matter.Ground(), makeWheel(sunInertia)),
        carrier(matter.Ground(), makeWheel(carrierInertia));
    Force::ConstantTorque(forces, sun, Vec3(0, 0, T));
    const Joint::Pin sunBearing(flexible, matter.Ground(), sun),
        carrierBearing(flexible, matter.Ground(), carrier);
    std::vector<MobilizedBody::Free> planets;
    for (int k = 0; k < 2; ++k) {
        planets.emplace_back(matter.Ground(), makeWheel(planetInertia));
        const Transform seat(Vec3(k == 0 ? radius : -radius, 0, 0));
        const Joint::Pin bearing(flexible, Attachment(carrier, seat), planets.back());
        Joint::Gear(flexible, Coordinate::makeAngle(carrier, sun), sunTeeth, bearing, planetTeeth);
        Joint::Gear(flexible, Coordinate::makeAngle(carrier, matter.Ground()), ringTeeth, bearing,
                    -planetTeeth);
    }
    State state = system.realizeTopology();
    for (int k = 0; k < 2; ++k)
        planets[size_t(k)].setQToFitTranslation(state, Vec3(k == 0 ? radius : -radius, 0, 0));
    const Real ratio = 1 + Real(ringTeeth) / sunTeeth;          // sun over carrier
    const Real planetRate = 1 - Real(ringTeeth) / planetTeeth;  // planet over carrier
    const Real reduced =
        sunInertia * ratio * ratio + carrierInertia +
        2 * (planetInertia * planetRate * planetRate + planetMass * radius * radius);
    const Real alpha = T * ratio / reduced;
    State native = state;
    system.realize(native, Stage::Acceleration);
    BdfIntegrator integrator(system);
    integrator.setAccuracy(1e-7);
    integrator.initialize(state);
    const int s = int(sun.getFirstUIndex(native)), c = int(carrier.getFirstUIndex(native));
    for (const Vector& uDot : {Vector(native.getUDot()), integrator.getUDot()}) {
        EXPECT_NEAR(uDot[c + 2], alpha, 1e-9 * alpha);
        EXPECT_NEAR(uDot[s + 2], alpha * ratio, 1e-9 * alpha);
    }
    EXPECT_LT((native.getMultipliers() - integrator.getMultipliers()).normInf(),
              1e-10 * native.getMultipliers().normInf());
    // The second planet's constraint is redundant.
    EXPECT_EQ(integrator.getRedundantConstraints().size(), 1u);
    Real error[2];
    for (int run = 0; run < 2; ++run) {
        BdfIntegrator motion(system);
        motion.setAccuracy(run == 0 ? 1e-5 : 1e-7);
        motion.initialize(state);
        motion.stepTo(0.6);
        const State& now = motion.getState();
        error[run] = std::abs(carrierBearing.calcCoordinateDots(now)[0] - 0.6 * alpha);
        EXPECT_NEAR(sunBearing.calcCoordinateDots(now)[0],
                    ratio * carrierBearing.calcCoordinateDots(now)[0], 1e-8);
    }
    EXPECT_LT(error[0], 1e-2);
    EXPECT_LT(error[1], error[0] / 8);
}

/** Between stock mobilizers it equals Simbody's CoordinateCoupler. **/
TEST(Coupler, IsSimbodysCouplerOfStockMobilizers) {
    const Real c[] = {2, -3, 0.4}, constant = 0.25;
    Vector uDot[3], lambda[3];
    for (int run = 0; run < 3; ++run) {
        MultibodySystem system;
        SimbodyMatterSubsystem matter(system);
        GeneralForceSubsystem forces(system);
        Force::Gravity(forces, matter, Vec3(1, -9, 4));
        FlexibleBodySubsystem flexible(system, matter);
        const Body::Rigid body(
            MassProperties(1.5, Vec3(0.1, 0.2, 0),
                           Inertia(0.02, 0.03, 0.04).shiftFromMassCenter(-Vec3(0.1, 0.2, 0), 1.5)));
        const Transform P(Rotation(0.5, UnitVec3(1, -1, 2)), Vec3(0.2, 0.1, 0)),
            X(Rotation(-0.3, UnitVec3(2, 1, 0)), Vec3(0, 0.15, 0.1));
        MobilizedBody::Pin first(matter.Ground(), P, body, X);
        MobilizedBody::Pin second(first, P, body, X);
        MobilizedBody::Slider third(second, P, body, X);
        if (run == 0) {
            Vector coefficients(4);
            for (int i = 0; i < 3; ++i) coefficients[i] = c[i];
            coefficients[3] = -constant;
            Constraint::CoordinateCoupler(
                matter, new Function::Linear(coefficients),
                Array_<MobilizedBodyIndex>{first, second, third},
                Array_<MobilizerQIndex>{MobilizerQIndex(0), MobilizerQIndex(0),
                                        MobilizerQIndex(0)});
        } else {
            Joint::Coupler(flexible,
                           {{Coordinate::makeAngle({matter.Ground(), P}, {first, X}), c[0]},
                            {Coordinate::makeAngle({first, P}, {second, X}), c[1]},
                            {Coordinate::makeDisplacement({second, P}, {third, X}, XAxis), c[2]}},
                           constant);
        }
        State state = system.realizeTopology();
        const Real q[] = {0.3, 0.2, (constant - c[0] * 0.3 - c[1] * 0.2) / c[2]};
        const Real u[] = {1, 2, (-c[0] * 1 - c[1] * 2) / c[2]};
        for (int i = 0; i < 3; ++i) state.updQ()[i] = q[i], state.updU()[i] = u[i];
        if (run == 2) {
            BdfIntegrator integrator(system);
            integrator.initialize(state);
            uDot[run] = integrator.getUDot();
            lambda[run] = integrator.getMultipliers();
        } else {
            system.realize(state, Stage::Acceleration);
            uDot[run] = state.getUDot();
            lambda[run] = state.getMultipliers();
        }
    }
    for (int run : {1, 2}) {
        EXPECT_LT((uDot[run] - uDot[0]).normInf(), 1e-10 * uDot[0].normInf());
        EXPECT_LT((lambda[run] - lambda[0]).normInf(), 1e-10 * lambda[0].normInf());
    }
}

/** Flexible wheels on flexible carriers, all four in one gear, swinging under gravity. **/
struct FlexibleGears {
    FlexibleGears() {
        matter.setShowDefaultGeometry(false);
        Force::Gravity(forces, matter, Vec3(2, -9.81, 1));
        for (int k = 0; k < 4; ++k) {
            PointMassPartOptions options;
            options.seed = unsigned(k + 1);
            options.numModes = 7 + k;
            bodies.emplace_back(flexible, makePointMassPart(options).body,
                                "body " + std::to_string(k));
        }
        for (int k : {0, 2}) {
            Joint::Pin(flexible, Attachment(matter.Ground(), Transform(Vec3(0, 0, 0.5 * k))),
                       bodies[size_t(k)].interface("A"));
            bearings.push_back(Joint::Pin(flexible, bodies[size_t(k)].interface("B"),
                                          bodies[size_t(k + 1)].interface("A")));
        }
        gear = std::make_unique<Joint::Gear>(flexible, bearings[0], 19, bearings[1], -31, "gear");
        state = system.realizeTopology();
        for (int k : {0, 2}) {
            bodies[size_t(k)].setPoseByInterface(state, "A", Transform(Vec3(0, 0, 0.5 * k)));
            system.realize(state, Stage::Velocity);
            bodies[size_t(k + 1)].setPoseByInterface(
                state, "A", bodies[size_t(k)].interface("B").calcMotion(state).X);
        }
        system.realize(state, Stage::Velocity);
    }

    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    FlexibleBodySubsystem flexible{system, matter};
    std::vector<FlexibleBody> bodies;
    std::vector<Joint> bearings;
    std::unique_ptr<Joint> gear;
    State state;
};

TEST(FlexibleGears, TakeOneFreedom) {
    const FlexibleGears model;
    Matrix G;
    model.matter.calcG(model.state, G);
    FactorSVD svd(G);
    Vector singular;
    svd.getSingularValues(singular);
    ASSERT_EQ(G.nrow(), 21);
    EXPECT_GT(min(singular), 1e-6 * max(singular));
}

TEST(FlexibleGears, NativeAccelerationsAndMultipliersAreThoseOfBlockElimination) {
    const FlexibleGears model;
    BdfIntegrator motion(model.system);
    motion.setAccuracy(1e-7);
    motion.initialize(model.state);
    motion.stepTo(0.05);
    const State now = motion.getState();
    BdfIntegrator integrator(model.system);
    integrator.setProjectInitialState(false);
    integrator.initialize(now);
    State native = now;
    model.system.realize(native, Stage::Acceleration);
    EXPECT_LT((native.getUDot() - integrator.getUDot()).normInf(),
              1e-10 * native.getUDot().normInf());
    EXPECT_LT((native.getMultipliers() - integrator.getMultipliers()).normInf(),
              1e-10 * native.getMultipliers().normInf());
    EXPECT_GT(std::abs(model.gear->getMultipliers(native)[0]), 0.1);
}

TEST(FlexibleGears, ConserveEnergyAndDoNoWork) {
    const FlexibleGears model;
    Real drift[2];
    for (int run = 0; run < 2; ++run) {
        BdfIntegrator integrator(model.system);
        integrator.setAccuracy(run == 0 ? 1e-5 : 1e-7);
        integrator.initialize(model.state);
        const auto calcEnergy = [&] {
            model.system.realize(integrator.getState(), Stage::Dynamics);
            return model.flexible.calcEnergy(integrator.getState());
        };
        const Real atStart = calcEnergy();
        integrator.stepTo(0.3);
        drift[run] = std::abs(calcEnergy() - atStart);
        EXPECT_EQ(integrator.getWork(), 0);
        const State& now = integrator.getState();
        EXPECT_LT(std::abs(model.gear->calcPositionErrors(now)[0]), 1e-9);
        EXPECT_GT(std::abs(model.gear->calcCoordinateDots(now)[0]), 0.3);
        // The power of the reactions on all four frames.
        const Vector lambda = integrator.getMultipliers(*model.gear);
        Real power = 0, largest = 0;
        for (int k = 0; k < 2; ++k)
            for (const Side side : {Side::F, Side::M}) {
                const SpatialVec force =
                    model.gear->calcReaction(now, lambda, side, side, Joint::Axes::Ground, k);
                const Attachment& frame =
                    side == Side::F ? model.gear->getFrameF(k) : model.gear->getFrameM(k);
                const SpatialVec V = frame.calcMotion(now).V;
                const Real part = ~force[0] * V[0] + ~force[1] * V[1];
                power += part;
                largest = std::max(largest, std::abs(part));
            }
        EXPECT_LT(std::abs(power), 1e-8 * largest);
        EXPECT_GT(largest, 0.01);
    }
    EXPECT_LT(drift[1], 2e-3);
    EXPECT_LT(drift[1], drift[0] / 5);
}

TEST(FlexibleGears, RunsAreTheSameToTheBitForAnyNumberOfThreads) {
    const FlexibleGears model;
    Vector reference;
    for (int threads : {1, 2, 4}) {
        BdfIntegrator integrator(model.system);
        integrator.setNumThreads(threads);
        integrator.initialize(model.state);
        integrator.stepTo(0.05);
        const Vector found = integrator.getState().getY();
        if (threads == 1) reference = found;
        for (int i = 0; i < found.size(); ++i) ASSERT_EQ(found[i], reference[i]);
    }
}

/** With position equations in the Newton system the result is the same. **/
TEST(FlexibleGears, Index3ApproachesStabilizedIndex2) {
    const FlexibleGears model;
    Vec3 ends[2];
    for (int k = 0; k < 2; ++k) {
        BdfIntegrator integrator(model.system);
        integrator.setAccuracy(1e-7);
        if (k == 1) integrator.setFormulation(BdfIntegrator::Formulation::Index3);
        integrator.initialize(model.state);
        integrator.stepTo(0.1);
        ends[k] = model.bodies[3].interface("B").calcMotion(integrator.getState()).X.p();
    }
    EXPECT_LT((ends[1] - ends[0]).norm(), 2e-5);
}

TEST(Gear, ASecondOneOnTheSameWheelsIsRedundant) {
    GearPair model;
    const Joint::Gear again(model.flexible, *model.bearingA, 34, *model.bearingB, 86, "again");
    const Joint::Gear other(model.flexible, *model.bearingB, 43, *model.bearingA, 17, "other");
    State state = model.system.realizeTopology();
    state.updQ() = model.state.getQ();
    BdfIntegrator integrator(model.system);
    integrator.initialize(state);
    integrator.stepTo(0.01);
    const std::vector<std::string> redundant = integrator.getRedundantConstraints();
    ASSERT_EQ(redundant.size(), 2u);
    for (const std::string& line : redundant)
        EXPECT_NE(line.find("follows from"), std::string::npos) << line;
    const Real ratio = Real(GearPair::TeethA) / GearPair::TeethB;
    const Real alpha = 3 / (GearPair::InertiaA + GearPair::InertiaB * ratio * ratio);
    EXPECT_NEAR(model.bearingA->calcCoordinateDots(integrator.getState())[0], 0.01 * alpha, 1e-8);
}

}  // namespace
}  // namespace simflex::test
