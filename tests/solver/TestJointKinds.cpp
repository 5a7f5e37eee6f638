/** @file
Every joint kind in motion between rigid bodies: against Simbody's mobilizers and constraints of the
same name, in native and implicit runs; prescribed motions against closed forms; hubs. **/

#include <gtest/gtest.h>

#include <cmath>

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Hub.h"
#include "simflex/solver/BdfIntegrator.h"
#include "support/PointMassPart.h"

namespace simflex::test {
namespace {

using namespace SimTK;

enum class Kind { Ball, Pin, Slider, Weld, Cylinder, Universal, Planar, Screw };
const Kind AllKinds[] = {Kind::Ball,     Kind::Pin,       Kind::Slider, Kind::Weld,
                         Kind::Cylinder, Kind::Universal, Kind::Planar, Kind::Screw};
const char* const KindNames[] = {"Ball",     "Pin",       "Slider", "Weld",
                                 "Cylinder", "Universal", "Planar", "Screw"};

void PrintTo(Kind kind, std::ostream* out) {
    *out << KindNames[int(kind)];
}

constexpr Real Pitch = 0.05;

Body::Rigid makeLink() {
    return Body::Rigid(
        MassProperties(1.5, Vec3(0.1, -0.2, 0.05),
                       Inertia(0.02, 0.03, 0.04).shiftFromMassCenter(-Vec3(0.1, -0.2, 0.05), 1.5)));
}

enum class Assembly { Mobilizers, Joints, JointsTurnedRound };

/** Two links, each attached to the previous one by the same kind of joint. **/
class Chain {
public:
    Chain(Kind kind, Assembly assembly)
        : m_kind(kind), m_matter(m_system), m_forces(m_system), m_flexible(m_system, m_matter) {
        m_matter.setShowDefaultGeometry(false);
        Force::Gravity(m_forces, m_matter, Vec3(2, -9, 3));
        MobilizedBody before = m_matter.Ground();
        for (int i = 0; i < 2; ++i) {
            if (assembly == Assembly::Mobilizers) {
                addMobilizer(before);
            } else {
                m_links.push_back(MobilizedBody::Free(m_matter.Ground(), makeLink()));
                addJoint(Attachment(before, m_X_PF), Attachment(m_links.back(), m_X_BM), assembly);
            }
            before = m_links.back();
        }
        m_state = m_system.realizeTopology();
        if (assembly == Assembly::Mobilizers) {
            for (int i = 0; i < m_state.getNQ(); ++i) m_state.updQ()[i] = 0.4 - 0.15 * i;
            for (int i = 0; i < m_state.getNU(); ++i) m_state.updU()[i] = std::cos(3.0 * i);
            m_system.realize(m_state, Stage::Position);
            m_matter.normalizeQuaternions(m_state);
        } else {
            const Chain other(kind, Assembly::Mobilizers);
            for (int i = 0; i < 2; ++i) {
                m_links[i].setQToFitTransform(m_state,
                                              other.m_links[i].getBodyTransform(other.m_state));
                m_links[i].setUToFitVelocity(m_state,
                                             other.m_links[i].getBodyVelocity(other.m_state));
            }
        }
        m_system.realize(m_state, Stage::Acceleration);
    }

    const MultibodySystem& getSystem() const { return m_system; }
    const State& getState() const { return m_state; }
    const MobilizedBody& getLink(int i) const { return m_links[i]; }
    const Joint& getJoint(int i) const { return m_joints[i]; }

    Vec3 getTip(const State& state) const {
        return m_links[1].findStationLocationInGround(state, Vec3(0.3, 0.1, -0.2));
    }

    State runNatively(Real time) const {
        RungeKuttaMersonIntegrator integrator(m_system);
        integrator.setAccuracy(1e-9);
        integrator.setConstraintTolerance(1e-10);
        TimeStepper stepper(m_system, integrator);
        stepper.initialize(m_state);
        stepper.stepTo(time);
        State state = stepper.getState();
        m_system.realize(state, Stage::Velocity);
        return state;
    }

    State runImplicitly(Real time, Real accuracy) const {
        BdfIntegrator integrator(m_system);
        integrator.setAccuracy(accuracy);
        integrator.initialize(m_state);
        integrator.stepTo(time);
        State state = integrator.getState();
        m_system.realize(state, Stage::Velocity);
        return state;
    }

private:
    void addMobilizer(MobilizedBody& parent) {
        const Body::Rigid link = makeLink();
        switch (m_kind) {
            case Kind::Ball:
                m_links.push_back(MobilizedBody::Ball(parent, m_X_PF, link, m_X_BM));
                return;
            case Kind::Pin:
                m_links.push_back(MobilizedBody::Pin(parent, m_X_PF, link, m_X_BM));
                return;
            case Kind::Slider:
                m_links.push_back(MobilizedBody::Slider(parent, m_X_PF, link, m_X_BM));
                return;
            case Kind::Weld:
                m_links.push_back(MobilizedBody::Weld(parent, m_X_PF, link, m_X_BM));
                return;
            case Kind::Cylinder:
                m_links.push_back(MobilizedBody::Cylinder(parent, m_X_PF, link, m_X_BM));
                return;
            case Kind::Universal:
                m_links.push_back(MobilizedBody::Universal(parent, m_X_PF, link, m_X_BM));
                return;
            case Kind::Planar:
                m_links.push_back(MobilizedBody::Planar(parent, m_X_PF, link, m_X_BM));
                return;
            case Kind::Screw:
                m_links.push_back(MobilizedBody::Screw(parent, m_X_PF, link, m_X_BM, Pitch));
                return;
        }
    }

    void addJoint(const Attachment& F, const Attachment& M, Assembly assembly) {
        if (assembly == Assembly::Joints) {
            m_joints.push_back(makeJoint(F, M));
            return;
        }
        // A quarter turn swaps Universal's x axis of F and y axis of M.
        const Transform turn =
            m_kind == Kind::Universal ? Transform(Rotation(Pi / 2, ZAxis)) : Transform();
        const Attachment turnedF(m_matter.getMobilizedBody(M.getMobilizedBodyIndex()),
                                 M.getFrame() * turn);
        const Attachment turnedM(m_matter.getMobilizedBody(F.getMobilizedBodyIndex()),
                                 F.getFrame() * turn);
        m_joints.push_back(makeJoint(turnedF, turnedM));
    }

    Joint makeJoint(const Attachment& F, const Attachment& M) {
        switch (m_kind) {
            case Kind::Ball:
                return Joint::Ball(m_flexible, F, M);
            case Kind::Pin:
                return Joint::Pin(m_flexible, F, M);
            case Kind::Slider:
                return Joint::Slider(m_flexible, F, M);
            case Kind::Weld:
                return Joint::Weld(m_flexible, F, M);
            case Kind::Cylinder:
                return Joint::Cylinder(m_flexible, F, M);
            case Kind::Universal:
                return Joint::Universal(m_flexible, F, M);
            case Kind::Planar:
                return Joint::Planar(m_flexible, F, M);
            case Kind::Screw:
                return Joint::Screw(m_flexible, F, M, Pitch);
        }
        throw std::logic_error("no such joint");
    }

    const Kind m_kind;
    const Transform m_X_PF{Rotation(0.5, UnitVec3(1, -1, 2)), Vec3(0.2, 0.1, 0)};
    const Transform m_X_BM{Rotation(-0.3, UnitVec3(2, 1, 0)), Vec3(0, 0.15, 0.1)};
    MultibodySystem m_system;
    SimbodyMatterSubsystem m_matter;
    GeneralForceSubsystem m_forces;
    FlexibleBodySubsystem m_flexible;
    std::vector<MobilizedBody> m_links;
    std::vector<Joint> m_joints;
    State m_state;
};

class JointKindsTest : public ::testing::TestWithParam<Kind> {
protected:
    static constexpr Real Time = 0.4;
    const Chain mobilizers{GetParam(), Assembly::Mobilizers}, joints{GetParam(), Assembly::Joints};
};

INSTANTIATE_TEST_SUITE_P(Joints, JointKindsTest, ::testing::ValuesIn(AllKinds),
                         [](const auto& tested) { return KindNames[int(tested.param)]; });

/** Reactions depend on the accelerations; Simbody computes them by its recursion. **/
TEST_P(JointKindsTest, ReactionsAreThoseOfSimbodysMobilizers) {
    BdfIntegrator integrator(joints.getSystem());
    integrator.initialize(joints.getState());
    for (int i = 0; i < 2; ++i) {
        const State& reference = mobilizers.getState();
        const SpatialVec onM =
            mobilizers.getLink(i).findMobilizerReactionOnBodyAtMInGround(reference);
        const SpatialVec onF =
            mobilizers.getLink(i).findMobilizerReactionOnParentAtFInGround(reference);
        using Side = Joint::Side;
        const Joint& joint = joints.getJoint(i);
        const SpatialVec native[] = {joint.calcReaction(joints.getState(), Side::M, Side::M),
                                     joint.calcReaction(joints.getState(), Side::F, Side::F)};
        const State& state = integrator.getState();
        const Vector lambda = integrator.getMultipliers(joint);
        const SpatialVec implicit[] = {joint.calcReaction(state, lambda, Side::M, Side::M),
                                       joint.calcReaction(state, lambda, Side::F, Side::F)};
        for (const SpatialVec* found : {native, implicit})
            for (int part = 0; part < 2; ++part) {
                EXPECT_LT((found[0][part] - onM[part]).norm(), 1e-9) << i << onM << found[0];
                EXPECT_LT((found[1][part] - onF[part]).norm(), 1e-9) << i << onF << found[1];
            }
    }
}

TEST_P(JointKindsTest, NativeRunFollowsSimbodysMobilizers) {
    const State expected = mobilizers.runNatively(Time), found = joints.runNatively(Time);
    EXPECT_LT((joints.getTip(found) - mobilizers.getTip(expected)).norm(), 1e-7);
    EXPECT_GT((mobilizers.getTip(expected) - mobilizers.getTip(mobilizers.getState())).norm(),
              GetParam() == Kind::Weld ? -1 : 0.05);
}

/** With order 2 the error falls as accuracy^(2/3): by a factor of 21 for an accuracy a hundred
times tighter. **/
TEST_P(JointKindsTest, ImplicitRunApproachesSimbodysMobilizers) {
    const Vec3 expected = mobilizers.getTip(mobilizers.runNatively(Time));
    const Real coarse = (joints.getTip(joints.runImplicitly(Time, 1e-5)) - expected).norm();
    const Real fine = (joints.getTip(joints.runImplicitly(Time, 1e-7)) - expected).norm();
    EXPECT_LT(fine, 2e-5);
    EXPECT_LT(fine, coarse / 8 + 1e-9) << coarse;
}

TEST_P(JointKindsTest, TurnedRoundItMovesTheSame) {
    const Chain turned(GetParam(), Assembly::JointsTurnedRound);
    EXPECT_LT(
        (turned.getTip(turned.runNatively(Time)) - joints.getTip(joints.runNatively(Time))).norm(),
        1e-7);
}

/** Simbody constraints without a mobilizer of the same name. **/
enum class PointKind { PointOnLine, PointInPlane, Rod };

const char* const PointKindNames[] = {"PointOnLine", "PointInPlane", "Rod"};

void PrintTo(PointKind kind, std::ostream* out) {
    *out << PointKindNames[int(kind)];
}

class PointJointsTest : public ::testing::TestWithParam<PointKind> {};

INSTANTIATE_TEST_SUITE_P(Joints, PointJointsTest,
                         ::testing::Values(PointKind::PointOnLine, PointKind::PointInPlane,
                                           PointKind::Rod),
                         [](const auto& tested) { return PointKindNames[int(tested.param)]; });

TEST_P(PointJointsTest, MovesAsSimbodysConstraint) {
    const Transform F(Rotation(0.7, UnitVec3(1, 3, -1)), Vec3(0.1, -0.2, 0.3));
    const Vec3 M(0.2, 0.1, -0.1);
    const Vec3 z(F.z());
    Vec3 tips[3];
    for (int run = 0; run < 3; ++run) {
        MultibodySystem system;
        SimbodyMatterSubsystem matter(system);
        matter.setShowDefaultGeometry(false);
        GeneralForceSubsystem forces(system);
        Force::Gravity(forces, matter, Vec3(0, -9.81, 0));
        FlexibleBodySubsystem flexible(system, matter);
        MobilizedBody::Free base(matter.Ground(), makeLink()),
            follower(matter.Ground(), makeLink());
        const bool own = run > 0;
        const Attachment onBase(base, F), onFollower(follower, Transform(M));
        Vec3 offset;  // of M's origin, in F
        switch (GetParam()) {
            case PointKind::PointOnLine:
                offset = Vec3(0, 0, 0.4);
                if (own)
                    Joint::PointOnLine(flexible, onBase, onFollower);
                else
                    Constraint::PointOnLine(base, F.z(), F.p(), follower, M);
                break;
            case PointKind::PointInPlane:
                offset = Vec3(0.3, -0.2, 0);
                if (own)
                    Joint::PointInPlane(flexible, onBase, onFollower);
                else
                    Constraint::PointInPlane(base, F.z(), ~F.p() * z, follower, M);
                break;
            case PointKind::Rod:
                offset = Vec3(0.3, 0, 0.4);
                if (own)
                    Joint::Rod(flexible, onBase, onFollower, 0.5);
                else
                    Constraint::Rod(base, F.p(), follower, M, 0.5);
                break;
        }
        State state = system.realizeTopology();
        const Rotation R(1.0, UnitVec3(1, 1, 0));
        follower.setQToFitTransform(state, Transform(R, F * offset - R * M));
        base.setUToFitAngularVelocity(state, Vec3(1, -2, 3));
        system.realize(state, Stage::Velocity);
        // The follower moves with the base and also rotates about M.
        const Vec3 v = base.findStationVelocityInGround(state, F * offset), omega(-2, 1, 1);
        follower.setUToFitVelocity(state, SpatialVec(omega, v - omega % (R * M)));
        system.realize(state, Stage::Velocity);
        if (run < 2) {
            RungeKuttaMersonIntegrator integrator(system);
            integrator.setAccuracy(1e-9);
            integrator.setConstraintTolerance(1e-10);
            TimeStepper stepper(system, integrator);
            stepper.initialize(state);
            stepper.stepTo(0.4);
            system.realize(stepper.getState(), Stage::Velocity);
            tips[run] = follower.getBodyOriginLocation(stepper.getState());
        } else {
            BdfIntegrator integrator(system);
            integrator.setAccuracy(1e-8);
            integrator.initialize(state);
            integrator.stepTo(0.4);
            system.realize(integrator.getState(), Stage::Velocity);
            tips[run] = follower.getBodyOriginLocation(integrator.getState());
        }
    }
    EXPECT_LT((tips[1] - tips[0]).norm(), 1e-7);
    EXPECT_LT((tips[2] - tips[0]).norm(), 1e-5);
}

/** A lift of mass m driven along s(t) needs m (g + s̈); the work equals its energy gain. **/
TEST(PrescribedMotionOfJoints, LiftIsDrivenByItsWeightAndInertia) {
    const Real m = 1.5, g = 9.81;
    const auto motion = [](Real t) {
        return Vec3(0.2 * (1 - std::cos(3 * t)), 0.6 * std::sin(3 * t), 1.8 * std::cos(3 * t));
    };
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    Force::Gravity gravity(forces, matter, Vec3(0, 0, -g));
    FlexibleBodySubsystem flexible(system, matter);
    MobilizedBody::Free lift(matter.Ground(), makeLink());
    const Joint::Cylinder guide(flexible, matter.Ground(), lift);
    const Joint::PrescribedRotation straight(flexible, matter.Ground(), lift,
                                             [](Real) { return Vec3(0); });
    const Joint::PrescribedTranslation drive(flexible, matter.Ground(), lift, ZAxis, motion,
                                             "drive");
    State state = system.realizeTopology();

    Real imbalance[2] = {0, 0};  // largest difference between energy and work
    for (int run = 0; run < 2; ++run) {
        BdfIntegrator integrator(system);
        integrator.setAccuracy(run == 0 ? 1e-5 : 1e-7);
        integrator.initialize(state);
        const auto calcEnergy = [&] {
            system.realize(integrator.getState(), Stage::Dynamics);
            return flexible.calcEnergy(integrator.getState());
        };
        const Real energyAtStart = calcEnergy();
        for (const Real t : {0.2, 0.5, 0.9}) {
            integrator.stepTo(t);
            const State& now = integrator.getState();
            EXPECT_NEAR(drive.calcCoordinates(now)[0], motion(t)[0], 1e-9);
            EXPECT_NEAR(drive.calcCoordinateDots(now)[0], motion(t)[1], 1e-9);
            // A native State at this time has the exact force and the power of the energy gain.
            State native = now;
            system.realize(native, Stage::Acceleration);
            const Real force = drive.calcDrivingForces(drive.getMultipliers(native))[0];
            EXPECT_NEAR(force, m * (g + motion(t)[2]), 1e-8);
            EXPECT_NEAR(drive.calcDrivingForces(integrator.getMultipliers(drive))[0], force,
                        run == 0 ? 0.5 : 0.02);
            imbalance[run] = std::max(
                imbalance[run], std::abs(integrator.getWork() - (calcEnergy() - energyAtStart)));
        }
        const Real gained = calcEnergy() - energyAtStart;
        const Real speed = motion(0.9)[1], speedAtStart = motion(0)[1];
        EXPECT_NEAR(
            gained,
            m * g * motion(0.9)[0] + 0.5 * m * (speed * speed - speedAtStart * speedAtStart), 1e-8);
    }
    EXPECT_LT(imbalance[0], 2e-3);
    EXPECT_LT(imbalance[1], imbalance[0] / 8);
}

/** Guiding a body's centre of mass along a circle needs m (a − g), at any position. **/
TEST(PrescribedMotionOfJoints, PointIsLedAlongACircle) {
    const auto circle = [](Real t) {
        const Real c = std::cos(2 * t), s = std::sin(2 * t);
        return std::array<Vec3, 3>{0.3 * Vec3(c, s, 0), 0.6 * Vec3(-s, c, 0),
                                   1.2 * Vec3(-c, -s, 0)};
    };
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    Force::Gravity gravity(forces, matter, Vec3(0, 0, -9.81));
    FlexibleBodySubsystem flexible(system, matter);
    MobilizedBody::Free body(matter.Ground(), makeLink());
    const Joint::PrescribedPosition lead(
        flexible, matter.Ground(), Attachment(body, Transform(Vec3(0.1, -0.2, 0.05))), circle);
    State state = system.realizeTopology();
    body.setUToFitAngularVelocity(state, Vec3(1, 2, 3));
    BdfIntegrator integrator(system);
    integrator.setAccuracy(1e-7);
    integrator.initialize(state);
    integrator.stepTo(0.5);
    State now = integrator.getState();
    system.realize(now, Stage::Acceleration);
    EXPECT_LT((lead.calcCoordinates(now) - Vector(circle(0.5)[0])).norm(), 1e-9);
    const Vec3 force = 1.5 * (circle(0.5)[2] + Vec3(0, 0, 9.81));
    EXPECT_LT((lead.calcDrivingForces(lead.getMultipliers(now)) - Vector(force)).norm(), 1e-7);
}

/** Returns a pose that rotates about a non-symmetry axis and translates. The inverse motion is that
of F seen from M.
**/
FrameMotion poseAt(Real t) {
    const Vec3 axis(UnitVec3(1, -2, 2));
    FrameMotion pose;
    pose.X = Transform(Rotation(0.4 + std::sin(3 * t), UnitVec3(axis)),
                       Vec3(0.2 * std::cos(2 * t), 0.3, 0.1 * t * t));
    pose.V = {3 * std::cos(3 * t) * axis, Vec3(-0.4 * std::sin(2 * t), 0, 0.2 * t)};
    pose.A = {-9 * std::sin(3 * t) * axis, Vec3(-0.8 * std::cos(2 * t), 0, 0.2)};
    return pose;
}
FrameMotion inversePoseAt(Real t) {
    const FrameMotion pose = poseAt(t);
    const Rotation R = pose.X.R().invert();
    const Vec3 &omega = pose.V[0], &p = pose.X.p(), v = pose.V[1] - omega % p;
    FrameMotion inverse;
    inverse.X = pose.X.invert();
    inverse.V = {-(R * omega), -(R * v)};
    inverse.A = {-(R * pose.A[0]),
                 -(R * (pose.A[1] - pose.A[0] % p - omega % pose.V[1] - omega % v))};
    return inverse;
}

/** Newton-Euler: m (a − g) through the centre of mass, I α + ω × I ω about it. **/
TEST(PrescribedMotionOfJoints, PoseIsDrivenByWeightAndInertia) {
    const Vec3 g(1, -9, 3);
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    Force::Gravity(forces, matter, g);
    FlexibleBodySubsystem flexible(system, matter);
    const MobilizedBody::Free body(matter.Ground(), makeLink());
    const Transform F(Rotation(0.7, UnitVec3(1, 1, 3)), Vec3(0.3, 0.2, 0.1)),
        M(Rotation(-0.5, UnitVec3(2, 0, 1)), Vec3(0.05, 0.1, -0.2));
    const Joint::PrescribedPose drive(flexible, Attachment(matter.Ground(), F), Attachment(body, M),
                                      poseAt, "hexapod");
    EXPECT_EQ(drive.getNumEquations(), 6);
    State state = system.realizeTopology();
    body.setQToFitTransform(state, F * poseAt(0).X * M.invert());
    BdfIntegrator integrator(system);
    integrator.setAccuracy(1e-7);
    integrator.initialize(state);
    for (const Real t : {0.1, 0.37, 0.8}) {
        integrator.stepTo(t);
        State now = integrator.getState();
        system.realize(now, Stage::Acceleration);
        const FrameMotion pose = poseAt(t);
        const Transform X = F * pose.X;
        EXPECT_LT((body.getBodyTransform(now).p() - (X * M.invert()).p()).norm(), 1e-9);
        EXPECT_LT((body.getBodyRotation(now).asMat33() - (X * M.invert()).R().asMat33()).norm(),
                  1e-9);
        const Vec3 omega = F.R() * pose.V[0], alpha = F.R() * pose.A[0];
        const MassProperties mass = makeLink().getDefaultRigidBodyMassProperties();
        const Rotation R_GB = X.R() * M.R().invert();
        const Vec3 r = R_GB * (mass.getMassCenter() - M.p());
        const Vec3 a = F.R() * pose.A[1] + alpha % r + omega % (omega % r);
        const Mat33 I = R_GB.asMat33() * mass.calcCentralInertia().toMat33() * (~R_GB).asMat33();
        const Vec3 force = mass.getMass() * (a - g);
        const Vec3 torque = I * alpha + omega % (I * omega) + r % force;
        const SpatialVec onM = drive.calcReaction(now, Joint::Side::M, Joint::Side::M);
        EXPECT_LT((onM[1] - force).norm(), 1e-7) << t;
        EXPECT_LT((onM[0] - torque).norm(), 1e-7) << t;
        const Vector driving = drive.calcDrivingForces(drive.getMultipliers(now));
        const Vec3 forceInM = ~X.R() * force, torqueInM = ~X.R() * torque;
        for (int i = 0; i < 3; ++i) {
            EXPECT_NEAR(driving[i], forceInM[i], 1e-7);
            EXPECT_NEAR(driving[3 + i], torqueInM[i], 1e-7);
        }
    }
}

/** The drive acts between two free bodies: momentum is conserved, energy equals the drive's work,
and the motion is the same seen from the other body. **/
TEST(PrescribedMotionOfJoints, PoseBetweenFreeBodiesKeepsMomentumAndEnergyLessItsWork) {
    const Transform F(Rotation(0.7, UnitVec3(1, 1, 3)), Vec3(0.3, 0.2, 0.1)),
        M(Rotation(-0.5, UnitVec3(2, 0, 1)), Vec3(0.05, 0.1, -0.2));
    Real imbalance[2];
    Vec3 ends[3];
    for (int run = 0; run < 3; ++run) {
        MultibodySystem system;
        SimbodyMatterSubsystem matter(system);
        FlexibleBodySubsystem flexible(system, matter);
        const MobilizedBody::Free first(matter.Ground(), makeLink()),
            second(matter.Ground(), makeLink());
        const Attachment onFirst(first, F), onSecond(second, M);
        if (run < 2)
            Joint::PrescribedPose(flexible, onFirst, onSecond, poseAt);
        else
            Joint::PrescribedPose(flexible, onSecond, onFirst, inversePoseAt);
        const Joint drive = flexible.getJoint(JointIndex(0));
        State state = system.realizeTopology();
        const Transform X = F * poseAt(0).X * M.invert();
        second.setQToFitTransform(state, X);
        const FrameMotion relative = poseAt(0);
        const Vec3 omega = F.R() * relative.V[0];
        first.setUToFitAngularVelocity(state, Vec3(1, -0.5, 0.2));
        const Vec3 turn = Vec3(1, -0.5, 0.2);
        second.setUToFitVelocity(
            state, SpatialVec(turn + omega,
                              turn % X.p() + F.R() * relative.V[1] - omega % (X.R() * M.p())));
        BdfIntegrator integrator(system);
        integrator.setAccuracy(run == 0 ? 1e-5 : 1e-7);
        integrator.setMaximumOrder(2);
        integrator.initialize(state);
        const Real energyAtStart = flexible.calcKineticEnergy(integrator.getState());
        const SpatialVec momentumAtStart = flexible.calcMomentum(integrator.getState());
        integrator.stepTo(0.6);
        const State& now = integrator.getState();
        ends[run] = second.findStationLocationInGround(now, Vec3(0.2, -0.1, 0.3));
        const SpatialVec lost = flexible.calcMomentum(now) - momentumAtStart;
        EXPECT_LT(lost[0].norm() + lost[1].norm(), run == 0 ? 1e-2 : 5e-4);
        const Real gained = flexible.calcKineticEnergy(now) - energyAtStart;
        EXPECT_GT(std::abs(gained), 0.05);
        if (run < 2) imbalance[run] = std::abs(gained - integrator.getWork());
        EXPECT_LT(drive.calcPositionErrors(now).normInf(), 1e-9);
    }
    EXPECT_LT(imbalance[0], 0.02);
    EXPECT_LT(imbalance[1], imbalance[0] / 8);
    EXPECT_LT((ends[2] - ends[1]).norm(), 1e-5);
}

/** A bending beam driven about its bearing: the integral of torque times rate, by Simpson's rule
over exact multipliers, equals its energy gain. **/
TEST(PrescribedMotionOfJoints, DrivingTorquesPowerIsTheEnergyGained) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    Force::Gravity(forces, matter, Vec3(0, -9.81, 0));
    FlexibleBodySubsystem flexible(system, matter);
    const FlexibleBody beam(flexible, makePointMassPart().body, "beam");
    const Joint::Pin bearing(flexible, matter.Ground(), beam.interface("A"));
    const auto angle = std::make_shared<Function::Sinusoid>(0.6, 8, -Pi / 2);
    const Joint::PrescribedRotation motor(flexible, matter.Ground(), beam.interface("A"), angle,
                                          "motor");
    State state = system.realizeTopology();
    beam.setPoseByInterface(state, "A", Transform(Rotation(-0.6, ZAxis)));
    BdfIntegrator integrator(system);
    integrator.setAccuracy(1e-8);
    integrator.initialize(state);
    const auto calcEnergy = [&] {
        system.realize(integrator.getState(), Stage::Dynamics);
        return flexible.calcEnergy(integrator.getState());
    };
    const auto calcPower = [&] {
        State native = integrator.getState();
        system.realize(native, Stage::Acceleration);
        const Real rate = 4.8 * std::cos(8 * native.getTime() - Pi / 2);
        EXPECT_NEAR(motor.calcCoordinateDots(native)[0], rate, 1e-9);
        return motor.calcDrivingForces(motor.getMultipliers(native))[0] * rate;
    };
    const Real atStart = calcEnergy();
    const int intervals = 400;
    const Real h = 0.2 / intervals;
    Real work = calcPower(), largest = 0;
    for (int k = 1; k <= intervals; ++k) {
        integrator.stepTo(k * h);
        work += (k == intervals ? 1 : k % 2 ? 4 : 2) * calcPower();
        largest = std::max(largest, std::abs(calcEnergy() - atStart));
    }
    work *= h / 3;
    const Real gained = calcEnergy() - atStart;
    EXPECT_GT(largest, 0.3);
    EXPECT_NEAR(work, gained, 1e-3 * largest);
    EXPECT_NEAR(integrator.getWork(), gained, 1e-3 * largest);
}

/** A nut on a frictionless screw: the angle counts all turns and stays equal to displacement over
pitch. **/
TEST(ScrewJoint, CountsManyTurns) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    FlexibleBodySubsystem flexible(system, matter);
    MobilizedBody::Free nut(matter.Ground(),
                            Body::Rigid(MassProperties(1, Vec3(0), Inertia(0.01))));
    const Joint::Screw screw(flexible, matter.Ground(), nut, 0.002);
    State state = system.realizeTopology();
    nut.setUToFitVelocity(state, SpatialVec(Vec3(0, 0, 80), Vec3(0, 0, 0.16)));
    // No force acts along the thread, so it turns uniformly at 80 rad/s.
    Real error[2];
    for (int run = 0; run < 2; ++run) {
        BdfIntegrator integrator(system);
        integrator.setAccuracy(run == 0 ? 1e-6 : 1e-8);
        integrator.initialize(state);
        integrator.stepTo(1);
        const State& now = integrator.getState();
        const Real angle = screw.calcCoordinates(now)[0];
        error[run] = std::abs(angle - 80);
        EXPECT_NEAR(screw.calcCoordinateDots(now)[0], 80, 1e-8);
        EXPECT_NEAR(nut.getBodyOriginLocation(now)[2], 0.002 * angle, 1e-9);
        // A run from the saved State continues on the same turn.
        BdfIntegrator second(system);
        second.setAccuracy(1e-8);
        second.initialize(now);
        second.stepTo(1.5);
        EXPECT_NEAR(screw.calcCoordinates(second.getState())[0], angle + 40, 0.01);
    }
    EXPECT_LT(error[0], 0.1);
    EXPECT_LT(error[1], error[0] / 8);

    RungeKuttaMersonIntegrator integrator(system);
    integrator.setAccuracy(1e-8);
    TimeStepper stepper(system, integrator);
    stepper.initialize(state);
    stepper.stepTo(1);
    system.realize(stepper.getState(), Stage::Velocity);
    EXPECT_NEAR(screw.calcCoordinates(stepper.getState())[0], 80, 1e-4);
}

/** A pendulum on a hub on a bending part: energy is conserved and the weld holds. **/
TEST(HubTest, CarriesStockMobilizers) {
    Real drift[2];
    for (int run = 0; run < 2; ++run) {
        MultibodySystem system;
        SimbodyMatterSubsystem matter(system);
        matter.setShowDefaultGeometry(false);
        GeneralForceSubsystem forces(system);
        Force::Gravity gravity(forces, matter, Vec3(0, -9.81, 0));
        FlexibleBodySubsystem flexible(system, matter);
        const FlexibleBody beam(flexible, makePointMassPart().body, "beam");
        const Joint::Pin bearing(flexible, matter.Ground(), beam.interface("A"));
        Hub hub(flexible, matter, beam.interface("B"),
                Body::Rigid(MassProperties(0.3, Vec3(0), Inertia(0.001))), "hub",
                Transform(Rotation(0.3, XAxis), Vec3(0, 0.01, 0)));
        MobilizedBody::Universal arm(hub.updBody(), Transform(Vec3(0, -0.05, 0)), makeLink(),
                                     Transform(Vec3(0, 0.3, 0)));
        State state = system.realizeTopology();
        beam.setPoseByInterface(state, "A", Transform());
        arm.setOneU(state, 0, 2);
        hub.setStateToFit(state);
        EXPECT_LT(hub.getWeld().calcPositionErrors(state).norm(), 1e-14);

        BdfIntegrator integrator(system);
        integrator.setAccuracy(run == 0 ? 1e-5 : 1e-7);
        integrator.initialize(state);
        const auto calcEnergy = [&] {
            system.realize(integrator.getState(), Stage::Dynamics);
            return flexible.calcEnergy(integrator.getState());
        };
        const Real atStart = calcEnergy();
        integrator.stepTo(0.2);
        drift[run] = std::abs(calcEnergy() - atStart);
        EXPECT_LT(hub.getWeld().calcPositionErrors(integrator.getState()).norm(), 1e-9);
        EXPECT_GT(std::abs(arm.getOneQ(integrator.getState(), 0)), 0.1);
    }
    EXPECT_LT(drift[1], 2e-3);
    EXPECT_LT(drift[1], drift[0] / 5);
}

}  // namespace
}  // namespace simflex::test
