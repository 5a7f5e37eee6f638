// Simbody's accelerations, multipliers and reactions of systems with flexible bodies are exact:
// compared with one dense matrix made from point masses and with block elimination.

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "SliderCrankModel.h"
#include "simflex/body/FlexibleBodySubsystemGuts.h"
#include "simflex/body/Hub.h"
#include "simflex/forces/AttachmentForce.h"
#include "simflex/forces/ModalDamping.h"
#include "support/NativeReference.h"

namespace simflex::test {
namespace {

using namespace SimTK;

PointMassPart makePart(unsigned seed, int numModes) {
    PointMassPartOptions options;
    options.seed = seed;
    options.numModes = numModes;
    options.numInterfaces = 3;
    return makePointMassPart(options);
}

Body::Rigid makeBrick(Real mass) {
    return Body::Rigid(
        MassProperties(mass, Vec3(0.02, -0.01, 0.03),
                       mass * UnitInertia(0.01, 0.012, 0.008).shiftFromCentroid(Vec3(0.02))));
}

/** Two flexible bodies and a rigid arm of three mobilizers in a closed loop of joints and stock
constraints, with stock forces on everything. **/
struct Loop {
    explicit Loop(int numModes = 8)
        : matter(system),
          forces(system),
          gravity(forces, matter, Vec3(1, -9.81, 2)),
          flexible(system, matter),
          bodies{make("first", 3, numModes, 0.02), make("second", 4, numModes + 3, 0)},
          shoulder(matter.Ground(), Transform(Vec3(0.9, 0, 0)), makeBrick(1), Transform()),
          elbow(shoulder, Transform(Vec3(0, 0.3, 0)), makeBrick(0.7), Transform(Vec3(0.1, 0, 0))),
          wrist(elbow, Transform(Vec3(0, 0.2, 0.1)), makeBrick(0.4), Transform(Vec3(0, 0.1, 0))) {
        Force::TwoPointLinearSpring(forces, frame(0), Vec3(0.1, 0, 0), wrist, Vec3(0), 50, 0.2);
        Force::MobilityLinearSpring(forces, modes(1, 0), MobilizerQIndex(2), 5, 0.2);
        Force::MobilityLinearDamper(forces, modes(0, 1), MobilizerUIndex(0), 2);
        Force::MobilityConstantForce(forces, frame(1), MobilizerUIndex(1), 0.7);
        Force::GlobalDamper(forces, matter, 0.1);
    }

    void closeLoop() {
        const FlexibleBody &a = bodies[0].body, &b = bodies[1].body;
        Joint::Pin(flexible, matter.Ground(), a.interface("A"), "root");
        Joint::Ball(flexible, a.interface("B"), b.interface("A"), "knee");
        Joint::Slider(flexible, b.interface("B", Transform(Rotation(0.4, YAxis))),
                      Attachment(wrist, Transform(Vec3(0.1, 0, 0))), "slide");
    }

    void addStockConstraints() {
        Constraint::Rod(frame(0), Vec3(0.1, 0.05, 0), shoulder, Vec3(0, 0.1, 0), 0.6);
        Constraint::ConstantSpeed(modes(0, 1), MobilizerUIndex(1), 0.02);
        Constraint::CoordinateCoupler(
            matter, new Function::Linear(Vector(Vec4(1, -2, 0.01, 0))),
            Array_<MobilizedBodyIndex>{modes(1, 0), modes(1, 1), shoulder},
            Array_<MobilizerQIndex>{MobilizerQIndex(2), MobilizerQIndex(0), MobilizerQIndex(0)});
        Constraint::ConstantAcceleration(wrist, MobilizerUIndex(1), 0.4);
    }

    MobilizedBody& frame(int k) {
        return matter.updMobilizedBody(bodies[size_t(k)].body.getFrame().getMobilizedBodyIndex());
    }
    MobilizedBody& modes(int k, int carrier) {
        return matter.updMobilizedBody(
            bodies[size_t(k)].body.getModalMobilizer(carrier).getMobilizedBodyIndex());
    }

    /** Returns a State with all speeds nonzero and deformed bodies. Joints are not assembled, which
    does not affect accelerations.
    **/
    State makeState(bool useEulerAngles = false) {
        State state = system.realizeTopology();
        matter.setUseEulerAngles(state, useEulerAngles);
        system.realizeModel(state);
        std::mt19937 random(7);
        std::uniform_real_distribution<double> unit(-1, 1);
        for (int i = 0; i < state.getNQ(); ++i) state.updQ()[i] = 0.5 * unit(random);
        for (int i = 0; i < state.getNU(); ++i) state.updU()[i] = unit(random);
        for (const FlexibleMasses& item : bodies)
            item.body.setModalCoordinates(state, 0.06 * item.body.getModalCoordinates(state));
        system.realize(state, Stage::Position);
        matter.normalizeQuaternions(state);
        system.prescribe(state);
        return state;
    }

    /** Compares Simbody's solution with that of the dense matrix. **/
    void expectExact(State state) {
        system.realize(state, Stage::Acceleration);
        const Vector uDot = state.getUDot(), multipliers = state.getMultipliers();
        const NativeReference expected = calcNativeReference(system, flexible, bodies, state, uDot);
        Real scale = 0, difference = 0;
        for (int i = 0; i < uDot.size(); ++i) {
            scale = std::max(scale, std::abs(expected.uDot[i]));
            difference = std::max(difference, std::abs(uDot[i] - expected.uDot[i]));
        }
        EXPECT_LT(difference, 1e-10 * scale);
        Real multiplierScale = 0, multiplierDifference = 0;
        ASSERT_EQ(multipliers.size(), expected.multipliers.size());
        for (int i = 0; i < multipliers.size(); ++i) {
            multiplierScale = std::max(multiplierScale, std::abs(expected.multipliers[i]));
            multiplierDifference =
                std::max(multiplierDifference, std::abs(multipliers[i] - expected.multipliers[i]));
        }
        EXPECT_LE(multiplierDifference, 1e-10 * multiplierScale);
        // Without the coupling subsystem they differ widely.
        flexible.getGuts().setNativeForcesEnabled(state, false);
        system.realize(state, Stage::Acceleration);
        EXPECT_GT((state.getUDot() - uDot).normInf(), 0.01 * scale);
    }

    /** Compares Simbody's solution with block elimination. **/
    void expectSameByBlockElimination(State state) const {
        BdfIntegrator integrator(system);
        integrator.setProjectInitialState(false);
        integrator.initialize(state);
        system.realize(state, Stage::Acceleration);
        const Vector uDot = state.getUDot(), multipliers = state.getMultipliers();
        EXPECT_LT((uDot - integrator.getUDot()).normInf(), 1e-10 * uDot.normInf());
        EXPECT_LT((multipliers - integrator.getMultipliers()).normInf(),
                  1e-10 * multipliers.normInf());
    }

    FlexibleMasses make(const char* name, unsigned seed, int numModes, double damping) {
        const PointMassPart part = makePart(seed, numModes);
        const FlexibleBody body(flexible, part.body, name);
        if (damping > 0) ModalDamping(flexible, body, damping);
        return {body, part, damping};
    }

    MultibodySystem system;
    SimbodyMatterSubsystem matter;
    GeneralForceSubsystem forces;
    Force::Gravity gravity;
    FlexibleBodySubsystem flexible;
    std::vector<FlexibleMasses> bodies;
    MobilizedBody::Pin shoulder;
    MobilizedBody::Universal elbow;
    MobilizedBody::Ball wrist;
};

TEST(NativeAccelerations, FreeBodiesUnderForcesMoveAsTheirMasses) {
    Loop model;
    model.expectExact(model.makeState());
}

TEST(NativeAccelerations, EulerAnglesMakeNoDifference) {
    Loop model;
    model.closeLoop();
    model.expectExact(model.makeState(true));
}

TEST(NativeAccelerations, ClosedLoopOfJointsIsExact) {
    Loop model;
    model.closeLoop();
    model.expectExact(model.makeState());
}

TEST(NativeAccelerations, StockConstraintsOfEveryLevelAreExact) {
    Loop model;
    model.closeLoop();
    model.addStockConstraints();
    model.expectExact(model.makeState());
}

TEST(NativeAccelerations, LockedModesFramesAndRigidBodiesAreExact) {
    Loop model;
    model.closeLoop();
    for (Motion::Level level : {Motion::Position, Motion::Velocity, Motion::Acceleration}) {
        State state = model.makeState();
        model.modes(0, 0).lock(state, level);
        model.system.prescribe(state);
        model.expectExact(state);
        model.elbow.lock(state, level);
        model.system.prescribe(state);
        model.expectExact(state);
    }
    State state = model.makeState();
    model.wrist.lockAt(state, Vec3(1, 2, 3), Motion::Acceleration);
    model.expectExact(state);
}

TEST(NativeAccelerations, LockedFrameIsExact) {
    Loop model;
    Joint::Ball(model.flexible, model.bodies[0].body.interface("B"),
                model.bodies[1].body.interface("A"));
    State state = model.makeState();
    model.frame(0).lock(state, Motion::Velocity);
    model.expectExact(state);
}

TEST(NativeAccelerations, MotionsOfRigidBodiesAndModesAreExact) {
    Loop model;
    model.closeLoop();
    Motion::Sinusoid(model.shoulder, Motion::Position, 0.4, 3, 0.2);
    Motion::Sinusoid(model.modes(1, 1), Motion::Velocity, 0.03, 20, 0.1);
    State state = model.makeState();
    state.setTime(0.3);
    model.system.prescribe(state);
    model.expectExact(state);
}

TEST(NativeAccelerations, DisabledJointsAndConstraintsStayOut) {
    Loop model;
    model.closeLoop();
    model.addStockConstraints();
    State state = model.makeState();
    model.expectExact(state);
    for (ConstraintIndex i : {ConstraintIndex(1), ConstraintIndex(4)}) {
        model.matter.getConstraint(i).disable(state);
        model.expectExact(state);
    }
    // The first configuration again, from a new State.
    model.expectExact(model.makeState());
}

TEST(NativeAccelerations, RedundantJointsLeaveThemExactAndMultipliersSmallest) {
    Loop model;
    model.closeLoop();
    const FlexibleBody &a = model.bodies[0].body, &b = model.bodies[1].body;
    Joint::Ball(model.flexible, a.interface("B"), b.interface("A"), "knee again");
    Joint::Ball(model.flexible, a.interface("B"), b.interface("A"), "knee once more");
    State state = model.makeState();
    model.expectExact(state);
}

TEST(NativeAccelerations, TreeThatOnlySimbodyKnowsIsExact) {
    Loop model;
    MobilizedBody::Ellipsoid egg(model.matter.Ground(), Transform(Vec3(0.2, 0.3, 0)),
                                 makeBrick(0.8), Transform(), Vec3(0.1, 0.2, 0.3));
    MobilizedBody::Pin backwards(egg, Transform(Vec3(0.1, 0, 0)), makeBrick(0.3), Transform(),
                                 MobilizedBody::Reverse);
    Joint::Ball(model.flexible, model.bodies[0].body.interface("B"), backwards);
    Joint::Ball(model.flexible, model.bodies[1].body.interface("A"), egg);
    model.expectExact(model.makeState());
}

/** A gear and a coupler acting on flexible bodies, a rigid tree and Ground. **/
TEST(NativeAccelerations, CouplersOfJointsAreExact) {
    Loop model;
    model.closeLoop();
    const FlexibleBody &a = model.bodies[0].body, &b = model.bodies[1].body;
    const Joint::Pin wheel(model.flexible, a.interface("C"), Attachment(model.elbow), "wheel");
    const Joint::Cylinder guide(model.flexible, b.interface("C"), Attachment(model.shoulder));
    using Coordinate = Joint::Coordinate;
    Joint::Gear(model.flexible, wheel, 20, Coordinate(guide, 0), -31, "gear");
    Joint::Coupler(model.flexible,
                   {{Coordinate(guide, 1), 3},
                    {Coordinate::makeDisplacement(a.interface("B"), b.node(4), YAxis), -1.5},
                    {Coordinate::makeAngle(model.matter.Ground(), a.interface("A")), 0.1}},
                   "coupler");
    const State state = model.makeState();
    model.expectExact(state);
    model.expectSameByBlockElimination(state);
}

TEST(NativeAccelerations, PrescribedPosesAreExact) {
    Loop model;
    Joint::PrescribedPose(
        model.flexible, model.bodies[0].body.interface("B"), model.bodies[1].body.interface("A"),
        [](Real t) {
            const Vec3 axis(UnitVec3(1, 2, -1));
            FrameMotion pose;
            pose.X = Transform(Rotation(std::sin(5 * t), UnitVec3(axis)),
                               Vec3(0.1 * std::cos(3 * t), 0, t * t));
            pose.V = {5 * std::cos(5 * t) * axis, Vec3(-0.3 * std::sin(3 * t), 0, 2 * t)};
            pose.A = {-25 * std::sin(5 * t) * axis, Vec3(-0.9 * std::cos(3 * t), 0, 2)};
            return pose;
        });
    State state = model.makeState();
    state.setTime(0.3);
    model.expectExact(state);
    model.expectSameByBlockElimination(state);
}

/** Simbody mobilizers, forces, constraints and a lock on a hub. **/
TEST(NativeAccelerations, HubsCarryStockElementsExactly) {
    Loop model;
    model.closeLoop();
    Hub hub(model.flexible, model.matter, model.bodies[0].body.interface("C"), makeBrick(0.6),
            "hub", Transform(Rotation(0.3, XAxis), Vec3(0, 0.02, 0)));
    MobilizedBody::Universal arm(hub.updBody(), Transform(Vec3(0.1, 0, 0)), makeBrick(0.5),
                                 Transform(Vec3(0, 0.2, 0)));
    MobilizedBody::Pin flap(arm, Transform(Vec3(0, -0.2, 0)), makeBrick(0.2),
                            Transform(Vec3(0, 0.1, 0)));
    Force::MobilityLinearSpring(model.forces, flap, MobilizerQIndex(0), 4, 0.1);
    Force::TwoPointLinearDamper(model.forces, arm, Vec3(0.1, 0, 0), model.shoulder, Vec3(0), 3);
    Force::ConstantForce(model.forces, hub.getBody(), Vec3(0.1, 0.2, 0), Vec3(1, 2, 3));
    Constraint::Rod(hub.updBody(), Vec3(0, 0.1, 0), model.wrist, Vec3(0.1, 0, 0), 0.5);
    Constraint::ConstantSpeed(flap, 0.3);
    State state = model.makeState();
    model.expectExact(state);
    model.expectSameByBlockElimination(state);
    arm.lock(state, Motion::Velocity);
    model.system.prescribe(state);
    model.expectExact(state);
    model.expectSameByBlockElimination(state);
}

/** Block elimination as used by the integrators, on a model with real parts. **/
TEST(NativeAccelerations, SliderCrankHasThoseOfBlockElimination) {
    SliderCrankOptions options;
    options.dampingRatio = 0.01;
    FlexibleSliderCrank model(options);
    AttachmentForce(model.flexible, model.rod.interface("big_end"),
                    SpatialVec(Vec3(0.1, 0.2, 0.3), Vec3(10, -20, 30)),
                    AttachmentForce::Axes::Attachment);
    State state = model.system.realizeTopology();
    state.updQ() = model.state.getQ();
    BdfIntegrator integrator(model.system);
    integrator.setAccuracy(1e-8);
    integrator.initialize(state);
    integrator.stepTo(0.013);
    State now = integrator.getState();
    for (int i = 0; i < now.getNU(); ++i) now.updU()[i] += 0.02 * std::cos(1.3 * i);
    BdfIntegrator elimination(model.system);
    elimination.setProjectInitialState(false);
    elimination.initialize(now);
    model.system.realize(now, Stage::Acceleration);
    const Vector uDot = now.getUDot(), multipliers = now.getMultipliers();
    EXPECT_LT((uDot - elimination.getUDot()).normInf(), 1e-10 * uDot.normInf());
    EXPECT_LT((multipliers - elimination.getMultipliers()).normInf(),
              1e-10 * multipliers.normInf());
}

/** A mobilizer's reaction, including its mobility forces, equals the inertia forces of its masses
minus the forces on its body. **/
TEST(NativeAccelerations, ReactionOnALockedFrameIsWhatHoldsIt) {
    Loop model;
    State state = model.makeState();
    const FlexibleMasses& item = model.bodies[0];
    model.gravity.setGravityVector(state, Vec3(0, 0, -5));
    model.frame(0).lock(state, Motion::Velocity);
    model.system.realize(state, Stage::Acceleration);
    PointMassMotion motion = getMotion(item, state);
    const Vector uDot = state.getUDot();
    for (int i = 0; i < item.body.getNumModes(); ++i)
        motion.xiDotDot[i] =
            uDot[int(item.body.getModalMobilizer(i / 6).getFirstUIndex(state)) + i % 6];
    const Eigen::VectorXd inertia = calcInertiaForces(item.part, motion);
    Vector_<SpatialVec> reactions;
    model.matter.calcMobilizerReactionForces(state, reactions);
    // Forces of the stock elements on the frame.
    State foreign = state;
    model.flexible.getGuts().setNativeForcesEnabled(foreign, false);
    model.system.realize(foreign, Stage::Dynamics);
    const MobilizedBodyIndex frame = model.frame(0).getMobilizedBodyIndex();
    const SpatialVec& applied = model.system.getRigidBodyForces(foreign, Stage::Dynamics)[frame];
    const Eigen::Vector3d torque = motion.R_GB * inertia.head<3>();
    for (int k = 0; k < 3; ++k) {
        EXPECT_NEAR(reactions[frame][0][k], torque[k] - applied[0][k], 1e-10 * torque.norm());
        EXPECT_NEAR(reactions[frame][1][k], inertia[3 + k] - applied[1][k], 1e-10 * torque.norm());
    }
}

}  // namespace
}  // namespace simflex::test
