// Locked mobilizers and Simbody's Motions inside BdfIntegrator.

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"
#include "simflex/solver/BdfIntegrator.h"
#include "simflex/solver/GeneralizedAlphaIntegrator.h"
#include "simflex/solver/RadauIntegrator.h"
#include "support/PointMassPart.h"

namespace simflex {
namespace {

using namespace SimTK;

MassProperties makeMass(Real mass) {
    return MassProperties(mass, Vec3(0.05, -0.02, 0.03),
                          Inertia(mass * Vec3(0.02, 0.03, 0.025), mass * Vec3(1e-3, -2e-3, 5e-4)));
}

/** A tree of arm, ball and universal joint, and a free box attached to it by a rod. **/
struct Rigid {
    Rigid()
        : matter(system),
          forces(system),
          gravity(forces, matter, Vec3(1, -9.81, 2)),
          arm(matter.Ground(), Transform(Rotation(0.3, XAxis), Vec3(0)), Body::Rigid(makeMass(1)),
              Transform(Vec3(0, 0.3, 0))),
          fore(arm, Transform(Vec3(0.1, -0.3, 0)), Body::Rigid(makeMass(0.7)),
               Transform(Vec3(0, 0.2, 0))),
          hand(fore, Transform(Vec3(-0.1, -0.3, 0.1)), Body::Rigid(makeMass(0.5)),
               Transform(Vec3(0, 0.2, 0.05))),
          box(matter.Ground(), Transform(Rotation(0.2, YAxis)), Body::Rigid(makeMass(1.5)),
              Transform(Vec3(0.1, 0, 0))),
          rod(hand, Vec3(0, -0.1, 0), box, Vec3(-0.1, 0, 0.1), 0.9) {}

    State makeState() {
        State state = system.realizeTopology();
        system.realizeModel(state);
        for (int i = 0; i < state.getNU(); ++i) state.updU()[i] = 0.4 * std::cos(1.7 * i);
        box.setQToFitTransform(state, Transform(Rotation(0.2, ZAxis), Vec3(0.5, -0.2, 0.2)));
        arm.setOneQ(state, 0, 0.2);
        return state;
    }

    MultibodySystem system;
    SimbodyMatterSubsystem matter;
    GeneralForceSubsystem forces;
    Force::Gravity gravity;
    MobilizedBody::Pin arm;
    MobilizedBody::Ball fore;
    MobilizedBody::Universal hand;
    MobilizedBody::Free box;
    Constraint::Rod rod;
};

/** The acceleration depends on time and state, so neither Simbody nor simflex knows it in
advance. **/
class StateDependent : public Motion::Custom::Implementation {
public:
    explicit StateDependent(Motion::Level level) : m_level(level) {}
    Implementation* clone() const override { return new StateDependent(*this); }
    Motion::Level getLevel(const State&) const override { return m_level; }
    void calcPrescribedPosition(const State& state, int nq, Real* q) const override {
        for (int i = 0; i < nq; ++i) q[i] = 0.2 + 0.3 * std::sin(4 * state.getTime() + i);
    }
    void calcPrescribedPositionDot(const State& state, int nq, Real* qDot) const override {
        for (int i = 0; i < nq; ++i) qDot[i] = 1.2 * std::cos(4 * state.getTime() + i);
    }
    void calcPrescribedPositionDotDot(const State& state, int nq, Real* qDotDot) const override {
        for (int i = 0; i < nq; ++i) qDotDot[i] = -4.8 * std::sin(4 * state.getTime() + i);
    }
    void calcPrescribedVelocity(const State& state, int nu, Real* u) const override {
        for (int i = 0; i < nu; ++i) u[i] = 0.5 + std::sin(3 * state.getTime() + i);
    }
    void calcPrescribedVelocityDot(const State& state, int nu, Real* uDot) const override {
        for (int i = 0; i < nu; ++i) uDot[i] = 3 * std::cos(3 * state.getTime() + i);
    }
    void calcPrescribedAcceleration(const State& state, int nu, Real* uDot) const override {
        for (int i = 0; i < nu; ++i)
            uDot[i] = 2 * std::cos(3 * state.getTime() + i) - 0.8 * state.getU()[0];
    }

private:
    Motion::Level m_level;
};

struct Case {
    const char* name;
    std::function<void(Rigid&)> addMotion;
    std::function<void(Rigid&, State&)> lock;
};

std::vector<Case> makeCases() {
    const auto none = [](Rigid&) {};
    const auto noLock = [](Rigid&, State&) {};
    return {
        {"SinusoidalPosition",
         [](Rigid& r) { Motion::Sinusoid(r.arm, Motion::Position, 0.3, 6, 0.2); }, noLock},
        {"SinusoidalSpeed",
         [](Rigid& r) { Motion::Sinusoid(r.arm, Motion::Velocity, 0.8, 6, 0.2); }, noLock},
        {"SinusoidalAcceleration",
         [](Rigid& r) { Motion::Sinusoid(r.arm, Motion::Acceleration, 5, 6, 0.2); }, noLock},
        {"SteadyBall", [](Rigid& r) { Motion::Steady(r.fore, Vec3(1, -0.5, 2)); }, noLock},
        {"CustomPosition",
         [](Rigid& r) { Motion::Custom(r.hand, new StateDependent(Motion::Position)); }, noLock},
        {"CustomSpeed",
         [](Rigid& r) { Motion::Custom(r.fore, new StateDependent(Motion::Velocity)); }, noLock},
        {"CustomAccelerationFromTheState",
         [](Rigid& r) { Motion::Custom(r.hand, new StateDependent(Motion::Acceleration)); },
         noLock},
        {"LockedArm", none, [](Rigid& r, State& s) { r.arm.lockAt(s, 0.35); }},
        {"LockedBallAndHand", none,
         [](Rigid& r, State& s) {
             r.fore.lock(s);
             r.hand.lockAt(s, Vec2(0.1, -0.2));
         }},
        {"LockedSpeed", none,
         [](Rigid& r, State& s) { r.fore.lockAt(s, Vec3(0.3, 1, -2), Motion::Velocity); }},
        {"LockedAcceleration", none,
         [](Rigid& r, State& s) {
             r.arm.lockAt(s, 3, Motion::Acceleration);
             r.hand.lock(s, Motion::Acceleration);
         }},
        {"LockedBox", none, [](Rigid& r, State& s) { r.box.lock(s); }},
        {"ALockOverridesAMotion",
         [](Rigid& r) { Motion::Sinusoid(r.arm, Motion::Position, 0.3, 6, 0.2); },
         [](Rigid& r, State& s) { r.arm.lock(s); }},
    };
}

class Prescribed : public testing::TestWithParam<Case> {};

TEST_P(Prescribed, AccelerationsMultipliersAndMotionAreSimbodysAndWorkIsCounted) {
    Rigid rigid;
    GetParam().addMotion(rigid);
    State state = rigid.makeState();
    GetParam().lock(rigid, state);
    rigid.system.project(state, 1e-13);

    BdfIntegrator integrator(rigid.system);
    integrator.setAccuracy(1e-8);
    integrator.setConstraintTolerance(1e-12);
    integrator.setMaximumOrder(4);
    integrator.initialize(state);
    State ours = integrator.getState();
    rigid.system.realize(ours, Stage::Acceleration);
    EXPECT_LT((ours.getQ() - state.getQ()).normInf(), 1e-11);
    EXPECT_LT((ours.getU() - state.getU()).normInf(), 1e-11);
    EXPECT_LT((integrator.getUDot() - ours.getUDot()).normInf(),
              1e-10 * (1 + ours.getUDot().normInf()));
    const Real expected = rigid.rod.getMultipliersAsVector(ours)[0];
    EXPECT_NEAR(integrator.getMultipliers(rigid.rod)[0], expected,
                1e-10 * (1 + std::abs(expected)));
    const Real energy = rigid.system.calcEnergy(ours);
    const Real kineticEnergy = rigid.system.calcKineticEnergy(ours);

    RungeKuttaMersonIntegrator reference(rigid.system);
    reference.setAccuracy(1e-9);
    reference.setConstraintTolerance(1e-11);
    TimeStepper stepper(rigid.system, reference);
    stepper.initialize(state);
    stepper.stepTo(0.25);
    integrator.stepTo(0.25);
    ours = integrator.getState();
    State theirs = stepper.getState();
    rigid.system.realize(ours, Stage::Dynamics);
    rigid.system.realize(theirs, Stage::Velocity);
    for (MobilizedBodyIndex i(1); i < rigid.matter.getNumBodies(); ++i) {
        const MobilizedBody& body = rigid.matter.getMobilizedBody(i);
        const Transform a = body.getBodyTransform(ours), b = body.getBodyTransform(theirs);
        EXPECT_LT((a.p() - b.p()).norm(), 2e-6) << "body " << int(i);
        EXPECT_LT((a.R().asMat33() - b.R().asMat33()).norm(), 2e-5) << "body " << int(i);
    }
    EXPECT_NEAR(rigid.system.calcEnergy(ours) - integrator.getWork(), energy,
                2e-5 * (1 + kineticEnergy));
    // Prescribed values are met exactly, at the end and in between.
    integrator.stepTo(0.2512);
    ours = integrator.getState();
    rigid.system.realize(ours, Stage::Velocity);
    EXPECT_LT(rigid.matter.calcMotionErrors(ours, Stage::Position).normInf(), 1e-13);
    EXPECT_LT(rigid.matter.calcMotionErrors(ours, Stage::Velocity).normInf(), 1e-13);
}

INSTANTIATE_TEST_SUITE_P(All, Prescribed, testing::ValuesIn(makeCases()),
                         [](const testing::TestParamInfo<Case>& test) {
                             return std::string(test.param.name);
                         });

class Unlock : public ScheduledEventHandler {
public:
    Unlock(const MobilizedBody& locked, const MobilizedBody& free, Real time)
        : m_locked(locked), m_free(free), m_time(time) {}
    Real getNextEventTime(const State& state, bool includeCurrent) const override {
        return state.getTime() < m_time || (includeCurrent && state.getTime() == m_time) ? m_time
                                                                                         : Infinity;
    }
    void handleEvent(State& state, Real, bool&) const override {
        m_locked.unlock(state);
        m_free.lock(state, Motion::Velocity);
    }

private:
    const MobilizedBody &m_locked, &m_free;
    Real m_time;
};

template <class Integrator>
class DrivenWork : public testing::Test {};
using DrivingIntegrators =
    testing::Types<BdfIntegrator, GeneralizedAlphaIntegrator, RadauIntegrator>;
TYPED_TEST_SUITE(DrivenWork, DrivingIntegrators);

TYPED_TEST(DrivenWork, BalancesEnergyWhereAllMotionIsPrescribed) {
    // A 1 kg mass moves back and forth: the prescribed motion is exact, and steps are as long as it
    // allows.
    for (const Real accuracy : {1e-4, 1e-6, 1e-8}) {
        MultibodySystem system;
        SimbodyMatterSubsystem matter(system);
        MobilizedBody::Slider mass(matter.Ground(), Transform(),
                                   Body::Rigid(MassProperties(1, Vec3(0), Inertia(1))),
                                   Transform());
        Motion::Sinusoid(mass, Motion::Position, 0.1, 20, 0);
        TypeParam integrator(system);
        integrator.setAccuracy(accuracy);
        integrator.initialize(system.realizeTopology());
        const Real start = system.calcEnergy(integrator.getState());
        for (int row = 1; row <= 30; ++row) {
            integrator.stepTo(0.1 * row);
            const Real energy = system.calcEnergy(integrator.getState()) - start;
            // The energy scale is 2 J.
            EXPECT_NEAR(energy, integrator.getWork(), 2 * std::pow(accuracy, 0.6)) << accuracy;
        }
    }
}

TEST(PrescribedMotion, HandlersMayLockAndUnlock) {
    Rigid rigid;
    rigid.system.addEventHandler(new Unlock(rigid.arm, rigid.fore, 0.1));
    State state = rigid.makeState();
    rigid.arm.lock(state);
    rigid.system.project(state, 1e-13);
    RungeKuttaMersonIntegrator reference(rigid.system);
    reference.setAccuracy(1e-9);
    reference.setConstraintTolerance(1e-11);
    TimeStepper stepper(rigid.system, reference);
    stepper.initialize(state);
    stepper.stepTo(0.25);
    BdfIntegrator integrator(rigid.system);
    integrator.setAccuracy(1e-8);
    integrator.setMaximumOrder(4);
    integrator.initialize(state);
    integrator.stepTo(0.25);
    const State& ours = integrator.getState();
    State theirs = stepper.getState();
    rigid.system.realize(theirs, Stage::Velocity);
    EXPECT_GT(std::abs(rigid.arm.getAngle(ours) - rigid.arm.getAngle(state)), 0.01);
    for (MobilizedBodyIndex i(1); i < rigid.matter.getNumBodies(); ++i) {
        const MobilizedBody& body = rigid.matter.getMobilizedBody(i);
        EXPECT_LT((body.getBodyOriginLocation(ours) - body.getBodyOriginLocation(theirs)).norm(),
                  3e-6)
            << "body " << int(i);
    }
}

TEST(PrescribedMotion, PositionsCanBeSolvedInTheNewtonSystemToo) {
    for (const char* name : {"SinusoidalPosition", "CustomSpeed", "LockedAcceleration"}) {
        const std::vector<Case> cases = makeCases();
        const Case& which = *std::find_if(cases.begin(), cases.end(), [&](const Case& candidate) {
            return std::string(candidate.name) == name;
        });
        std::vector<Vec3> places;
        for (auto formulation :
             {BdfIntegrator::Formulation::StabilizedIndex2, BdfIntegrator::Formulation::Index3}) {
            Rigid rigid;
            which.addMotion(rigid);
            // Nonholonomic and acceleration-only rows in addition to the holonomic rod.
            Constraint::ConstantSpeed(rigid.box, MobilizerUIndex(0), 0.4);
            Constraint::ConstantAcceleration(rigid.box, MobilizerUIndex(4), -2);
            State state = rigid.makeState();
            which.lock(rigid, state);
            rigid.system.project(state, 1e-13);
            BdfIntegrator integrator(rigid.system);
            integrator.setAccuracy(1e-8);
            integrator.setMaximumOrder(3);
            integrator.setFormulation(formulation);
            integrator.initialize(state);
            integrator.stepTo(0.2);
            places.push_back(rigid.box.getBodyOriginLocation(integrator.getState()));
        }
        EXPECT_LT((places[0] - places[1]).norm(), 5e-6) << name;
    }
}

TEST(PrescribedMotion, LocksThatContradictAConstraintNameIt) {
    Rigid rigid;
    State state = rigid.makeState();
    for (const MobilizedBody* body : {static_cast<const MobilizedBody*>(&rigid.arm),
                                      static_cast<const MobilizedBody*>(&rigid.fore),
                                      static_cast<const MobilizedBody*>(&rigid.hand),
                                      static_cast<const MobilizedBody*>(&rigid.box)})
        body->lock(state);
    BdfIntegrator integrator(rigid.system);
    try {
        integrator.initialize(state);
        FAIL();
    } catch (const std::runtime_error& error) {
        for (const char* word : {"cannot be assembled", "(Rod) on bodies (3, 4)"})
            EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
    }
}

//---------------------------------------------------------------------------------------------------------
// flexible bodies

struct Flexible {
    Flexible()
        : matter(system),
          forces(system),
          gravity(forces, matter, Vec3(1, -9.81, 2)),
          flexible(system, matter),
          boom(flexible, test::makePointMassPart(options()).body, "boom") {}

    static test::PointMassPartOptions options() {
        test::PointMassPartOptions options;
        options.numModes = 8;
        options.lowestFrequency = 15;
        options.highestFrequency = 60;
        return options;
    }
    MobilizedBody& frame() {
        return matter.updMobilizedBody(boom.getFrame().getMobilizedBodyIndex());
    }
    MobilizedBody& modes(int k) {
        return matter.updMobilizedBody(boom.getModalMobilizer(k).getMobilizedBodyIndex());
    }

    MultibodySystem system;
    SimbodyMatterSubsystem matter;
    GeneralForceSubsystem forces;
    Force::Gravity gravity;
    FlexibleBodySubsystem flexible;
    FlexibleBody boom;
};

TEST(PrescribedMotion, ABodyWithItsModesLockedIsRigid) {
    Flexible model;
    const Joint::Ball hinge(model.flexible, model.matter.Ground(), model.boom.interface("A"));
    State state = model.system.realizeTopology();
    const Rotation tilt(0.7, ZAxis);
    model.boom.setPoseByInterface(state, "A", Transform(tilt));
    for (int k = 0; k < model.boom.getNumModalMobilizers(); ++k) model.modes(k).lock(state);
    BdfIntegrator integrator(model.system);
    integrator.setAccuracy(1e-9);
    integrator.setMaximumOrder(4);
    integrator.initialize(state);
    integrator.stepTo(0.4);
    EXPECT_EQ(model.boom.getModalCoordinates(integrator.getState()).normInf(), 0);

    const auto& part = model.boom.getPart();
    const auto& position = part.getInterface("A").position;
    const Vec3 hook(position[0], position[1], position[2]);
    MultibodySystem plain;
    SimbodyMatterSubsystem matter(plain);
    GeneralForceSubsystem forces(plain);
    Force::Gravity gravity(forces, matter, Vec3(1, -9.81, 2));
    MobilizedBody::Ball ball(matter.Ground(), Transform(),
                             Body::Rigid(model.boom.getFrame().getBodyMassProperties(state)),
                             Transform(hook));
    State plainState = plain.realizeTopology();
    ball.setQToFitRotation(plainState, tilt);
    RungeKuttaMersonIntegrator reference(plain);
    reference.setAccuracy(1e-10);
    TimeStepper stepper(plain, reference);
    stepper.initialize(plainState);
    stepper.stepTo(0.4);
    const State& end = stepper.getState();
    plain.realize(end, Stage::Velocity);
    const Transform a = model.boom.getFramePose(integrator.getState()),
                    b = ball.getBodyTransform(end);
    EXPECT_LT((a.p() - b.p()).norm(), 1e-6);
    EXPECT_LT((a.R().asMat33() - b.R().asMat33()).norm(), 1e-5);
    EXPECT_NEAR(integrator.getWork(), 0, 1e-12);
}

TEST(PrescribedMotion, LockedFrameLeavesUncoupledOscillators) {
    // With B at rest each mode is ξ̈ + Ω²ξ = 0: uniform gravity does not excite it.
    Flexible model;
    State state = model.system.realizeTopology();
    Vector xi(8);
    for (int i = 0; i < 8; ++i) xi[i] = 1e-3 * (i + 1);
    model.boom.setModalCoordinates(state, xi);
    model.boom.setFramePose(state, Transform(Rotation(0.4, XAxis), Vec3(0.1, 0.2, 0.3)));
    model.frame().lock(state);
    BdfIntegrator integrator(model.system);
    integrator.setAccuracy(1e-11);
    integrator.setMaximumOrder(4);
    integrator.initialize(state);
    integrator.stepTo(0.05);
    const Vector found = model.boom.getModalCoordinates(integrator.getState());
    for (int i = 0; i < 8; ++i)
        EXPECT_NEAR(
            found[i],
            xi[i] * std::cos(std::sqrt(model.boom.getPart().omegaSquared[size_t(i)]) * 0.05), 1e-8)
            << "mode " << i;
    EXPECT_LT((model.boom.getFramePose(integrator.getState()).p() - Vec3(0.1, 0.2, 0.3)).norm(),
              1e-14);
}

TEST(PrescribedMotion, ADrivenModeAndFrameConserveEnergyLessWork) {
    Flexible model;
    Motion::Sinusoid(model.modes(1), Motion::Position, 2e-3, 40, 0.3);
    Motion::Steady(model.frame(), Vec6(2, -1, 3, 0.1, 0.2, -0.3));
    const State state = model.system.realizeTopology();
    BdfIntegrator integrator(model.system);
    integrator.setAccuracy(1e-9);
    integrator.setMaximumOrder(4);
    integrator.initialize(state);
    model.system.realize(integrator.getState(), Stage::Dynamics);
    const Real energy = model.flexible.calcEnergy(integrator.getState());
    integrator.stepTo(0.1);
    const State& now = integrator.getState();
    model.system.realize(now, Stage::Dynamics);
    const Real work = integrator.getWork();
    EXPECT_GT(std::abs(work), 0.1);
    EXPECT_NEAR(model.flexible.calcEnergy(now) - work, energy, 1e-4 * std::abs(work));
    EXPECT_NEAR(model.boom.getModalCoordinates(now)[6], 2e-3 * std::sin(40 * 0.1 + 0.3), 1e-15);
    const SpatialVec V = model.boom.getFrameVelocity(now);
    EXPECT_LT((V[0] - Vec3(2, -1, 3)).norm() + (V[1] - Vec3(0.1, 0.2, -0.3)).norm(), 1e-12);
}

/** The frame moves on a circle in the xy-plane and turns with it: angle 0.5 sin 4t. **/
class Swing : public Motion::Custom::Implementation {
public:
    Implementation* clone() const override { return new Swing(*this); }
    Motion::Level getLevel(const State&) const override { return Motion::Position; }
    void calcPrescribedPosition(const State& state, int, Real* q) const override {
        const Real a = calcAngle(state.getTime(), 0);
        put(Vec7(std::cos(a / 2), 0, 0, std::sin(a / 2), std::cos(a), std::sin(a), 0.1), q);
    }
    void calcPrescribedPositionDot(const State& state, int, Real* qDot) const override {
        put(calcRate(state.getTime()), qDot);
    }
    void calcPrescribedPositionDotDot(const State& state, int, Real* qDotDot) const override {
        constexpr Real Step = 1e-5;
        const Real t = state.getTime();
        put((calcRate(t + Step) - calcRate(t - Step)) / (2 * Step), qDotDot);
    }
    static Real calcAngle(Real t, int derivative) {
        return derivative == 0 ? 0.5 * std::sin(4 * t) : 2 * std::cos(4 * t);
    }

private:
    using Vec7 = Vec<7>;
    static Vec7 calcRate(Real t) {
        const Real a = calcAngle(t, 0), rate = calcAngle(t, 1);
        return rate *
               Vec7(-std::sin(a / 2) / 2, 0, 0, std::cos(a / 2) / 2, -std::sin(a), std::cos(a), 0);
    }
    static void put(const Vec7& values, Real* q) {
        for (int k = 0; k < 7; ++k) q[k] = values[k];
    }
};

TEST(PrescribedMotion, AFrameMovesThroughPosesAndDrivesItsModes) {
    Flexible model;
    Motion::Custom(model.frame(), new Swing);
    const State state = model.system.realizeTopology();
    BdfIntegrator integrator(model.system);
    integrator.setAccuracy(1e-9);
    integrator.setMaximumOrder(4);
    integrator.initialize(state);
    model.system.realize(integrator.getState(), Stage::Dynamics);
    const Real energy = model.flexible.calcEnergy(integrator.getState());
    integrator.stepTo(0.1);
    const State& now = integrator.getState();
    model.system.realize(now, Stage::Dynamics);
    const Real angle = Swing::calcAngle(0.1, 0), rate = Swing::calcAngle(0.1, 1);
    const Transform X = model.boom.getFramePose(now);
    EXPECT_LT((X.p() - Vec3(std::cos(angle), std::sin(angle), 0.1)).norm(), 1e-13);
    EXPECT_LT((X.R().asMat33() - Rotation(angle, ZAxis).asMat33()).norm(), 1e-13);
    EXPECT_LT((model.boom.getFrameVelocity(now)[0] - Vec3(0, 0, rate)).norm(), 1e-12);
    EXPECT_GT(model.boom.getModalCoordinates(now).normInf(), 1e-6);
    const Real work = integrator.getWork();
    EXPECT_NEAR(model.flexible.calcEnergy(now) - work, energy, 1e-5 * std::abs(work));
}

TEST(PrescribedMotion, ALockedFrameSpeedTurnsAboutAFixedAxis) {
    Flexible model;
    State state = model.system.realizeTopology();
    model.frame().lockAt(state, Vec6(0, 0, 3, 0.1, 0, 0), Motion::Velocity);
    model.modes(0).lock(state, Motion::Velocity);
    BdfIntegrator integrator(model.system);
    integrator.setAccuracy(1e-9);
    integrator.setMaximumOrder(4);
    integrator.initialize(state);
    integrator.stepTo(0.3);
    const Transform X = model.boom.getFramePose(integrator.getState());
    EXPECT_LT((X.R().asMat33() - Rotation(0.9, ZAxis).asMat33()).norm(), 1e-7);
    EXPECT_LT((X.p() - Vec3(0.03, 0, 0)).norm(), 1e-10);
}

}  // namespace
}  // namespace simflex
