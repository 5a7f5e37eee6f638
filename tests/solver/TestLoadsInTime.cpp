// Loads and motions that begin, end or jump at some time are resolved, whether the time is known or
// not.

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <map>
#include <sstream>

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"
#include "simflex/forces/AttachmentForce.h"
#include "simflex/forces/ContactStop.h"
#include "simflex/forces/DistributedLoad.h"
#include "simflex/solver/BdfIntegrator.h"
#include "simflex/solver/GeneralizedAlphaIntegrator.h"
#include "simflex/solver/RadauIntegrator.h"
#include "simflex/solver/equations/FunctionsOfTime.h"
#include "support/PointMassPart.h"

namespace simflex {
namespace {

using namespace SimTK;
using Function = std::function<Real(Real)>;

/** A force along x on one body as a Simbody force element. **/
class NativeForce : public Force::Custom::Implementation {
public:
    NativeForce(const MobilizedBody& body, Function force) : m_body(body), m_force(force) {}
    void calcForce(const State& state, Vector_<SpatialVec>& bodyForces, Vector_<Vec3>&,
                   Vector&) const override {
        m_body.applyBodyForce(state, SpatialVec(Vec3(0), Vec3(m_force(state.getTime()), 0, 0)),
                              bodyForces);
    }
    Real calcPotentialEnergy(const State&) const override { return 0; }

private:
    const MobilizedBody& m_body;
    Function m_force;
};

enum class Kind { Attached, Native };

/** 1 kg on a slide, at rest. **/
struct Slide {
    Slide(Kind kind, const Function& force)
        : mass(matter.Ground(), Body::Rigid(MassProperties(1, Vec3(0), Inertia(1)))) {
        if (kind == Kind::Native)
            Force::Custom(forces, new NativeForce(mass, force));
        else
            AttachmentForce(flexible, Attachment(mass),
                            [force](Real t) { return SpatialVec(Vec3(0), Vec3(force(t), 0, 0)); });
        state = system.realizeTopology();
    }

    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    FlexibleBodySubsystem flexible{system, matter};
    MobilizedBody::Slider mass;
    State state;
};

Real twentyNewtons(Real t) {
    return t >= 0.5 && t < 0.6 ? 20 : 0;
}
Real twentyNewtonsClosedAtTheEnd(Real t) {
    return t > 0.5 && t <= 0.6 ? 20 : 0;
}

template <class Integrator>
class LoadsInTime : public testing::Test {};
using Integrators = testing::Types<BdfIntegrator, GeneralizedAlphaIntegrator, RadauIntegrator>;
TYPED_TEST_SUITE(LoadsInTime, Integrators);

TYPED_TEST(LoadsInTime, APulseOfKnownTimesGivesItsMomentumToRoundOff) {
    for (const Kind kind : {Kind::Attached, Kind::Native})
        for (const auto& force : {twentyNewtons, twentyNewtonsClosedAtTheEnd}) {
            const Slide slide(kind, force);
            TypeParam integrator(slide.system);
            integrator.addBreakTimes({0.6, 0.5});
            integrator.initialize(slide.state);
            integrator.stepTo(1);
            EXPECT_NEAR(slide.mass.getRate(integrator.getState()), 2, 1e-10);
            EXPECT_NEAR(slide.mass.getLength(integrator.getState()), 0.1 + 2 * 0.4, 1e-10);
            EXPECT_NEAR(integrator.getWork(), kind == Kind::Attached ? 2 : 0, 1e-9);
            EXPECT_EQ(integrator.getStatistics().errorTestFailures, 0);
        }
}

TYPED_TEST(LoadsInTime, BreaksWithoutEndAreAskedForOneByOne) {
    // 10 N in the first 0.3 ms of every 10 ms.
    const auto train = [](Real t) { return std::fmod(t, 0.01) < 0.0003 ? 10.0 : 0.0; };
    const Slide slide(Kind::Native, train);
    TypeParam integrator(slide.system);
    integrator.addBreakTimes([](Real t) {
        for (Real n = std::floor(t / 0.01);; ++n)
            for (const Real next : {0.01 * n, 0.01 * n + 0.0003})
                if (next > t) return next;
    });
    integrator.initialize(slide.state);
    integrator.stepTo(0.995);
    EXPECT_NEAR(slide.mass.getRate(integrator.getState()), 100 * 0.0003 * 10, 1e-9);
}

TYPED_TEST(LoadsInTime, AStepEndsAtEveryBreakAndOnlyAJumpStartsAgain) {
    // A table with a kink every 10 ms, from 1 N.
    const auto zigzag = [](Real t) { return 1 + std::abs(std::fmod(t, 0.02) - 0.01); };
    const Slide slide(Kind::Attached, zigzag);
    TypeParam integrator(slide.system);
    std::vector<Real> breaks, ends;
    for (int i = 1; i < 20; ++i) breaks.push_back(0.01 * i);
    integrator.addBreakTimes(breaks);
    integrator.setStepObserver([&](Real time) {
        ends.push_back(time);
        return true;
    });
    integrator.initialize(slide.state);
    integrator.stepTo(0.2);
    for (const Real time : breaks)
        EXPECT_TRUE(std::any_of(ends.begin(), ends.end(), [&](Real end) {
            return std::abs(end - time) < 1e-15;
        })) << time;
    EXPECT_EQ(integrator.getStatistics().starts, 1);
}

TYPED_TEST(LoadsInTime, ARunResumedBetweenBreaksGoesOnWithTheSameBits) {
    const Slide slide(Kind::Attached, twentyNewtons);
    TypeParam whole(slide.system), first(slide.system), second(slide.system);
    for (TypeParam* integrator : {&whole, &first, &second}) integrator->addBreakTimes({0.5, 0.6});
    whole.initialize(slide.state);
    first.initialize(slide.state);
    for (const Real time : {0.5, 0.55}) {
        first.stepTo(time);
        std::stringstream file;
        first.writeCheckpoint(file);
        second.readCheckpoint(file, slide.state);
        second.stepTo(1);
        whole.stepTo(1);
        EXPECT_EQ(second.getState().getQ()[0], whole.getState().getQ()[0]);
        EXPECT_EQ(second.getState().getU()[0], whole.getState().getU()[0]);
    }
}

TYPED_TEST(LoadsInTime, AnEmptyFunctionOfBreaksIsRefused) {
    const Slide slide(Kind::Attached, twentyNewtons);
    TypeParam integrator(slide.system);
    EXPECT_THROW(integrator.addBreakTimes(std::function<Real(Real)>()), std::invalid_argument);
}

TYPED_TEST(LoadsInTime, ALoadOnASystemAtRestIsSeenUntold) {
    for (const Kind kind : {Kind::Attached, Kind::Native}) {
        const Slide slide(kind, twentyNewtons);
        TypeParam integrator(slide.system);
        integrator.initialize(slide.state);
        integrator.stepTo(10);
        EXPECT_NEAR(slide.mass.getRate(integrator.getState()), 2, 5e-3);
    }
}

TYPED_TEST(LoadsInTime, ABumpOfAThirdOfTheLongestStepIsSeen) {
    // At any position within a step.
    for (const Real start : {0.5, 0.502, 0.504, 0.506, 0.508}) {
        const Real width = 0.003;
        const auto bump = [&](Real t) {
            const Real x = (t - start) / width;
            return x > 0 && x < 1 ? 2000 * square(std::sin(Pi * x)) : 0.0;
        };
        for (const Kind kind : {Kind::Attached, Kind::Native}) {
            const Slide slide(kind, bump);
            TypeParam integrator(slide.system);
            integrator.setMaximumStepSize(0.01);
            integrator.setAccuracy(1e-7);
            integrator.initialize(slide.state);
            integrator.stepTo(1);
            EXPECT_NEAR(slide.mass.getRate(integrator.getState()), 1000 * width, 0.03) << start;
        }
    }
}

TYPED_TEST(LoadsInTime, TheDefaultOfTheLongestStepIsTheSystemsTimeScale) {
    for (const Real scale : {0.1, 0.03}) {
        Slide slide(Kind::Attached, [](Real) { return 1; });
        slide.system.setDefaultTimeScale(scale);
        TypeParam integrator(slide.system);
        integrator.initialize(slide.state);
        integrator.stepTo(10);
        EXPECT_NEAR(integrator.getStatistics().largestStep, scale, 1e-12);
    }
}

TYPED_TEST(LoadsInTime, ASmoothLoadCostsNoFurtherSteps) {
    const auto force = [](Real t) { return std::sin(20 * t); };
    const Slide slide(Kind::Attached, force);
    TypeParam integrator(slide.system);
    integrator.initialize(slide.state);
    integrator.stepTo(2);
    EXPECT_NEAR(slide.mass.getRate(integrator.getState()), (1 - std::cos(40)) / 20, 1e-3);
    EXPECT_LE(integrator.getStatistics().calcRejectedFraction(), 0.05);
}

/** An acceleration along x prescribed by a Motion or a constraint. **/
class Accelerator : public Motion::Custom::Implementation {
public:
    explicit Accelerator(Function acceleration) : m_acceleration(acceleration) {}
    Implementation* clone() const override { return new Accelerator(*this); }
    Motion::Level getLevel(const State&) const override { return Motion::Acceleration; }
    void calcPrescribedAcceleration(const State& state, int, Real* uDot) const override {
        *uDot = m_acceleration(state.getTime());
    }

private:
    Function m_acceleration;
};

/** Constrains the speed or acceleration of a slide to a function of time. **/
class Pacer : public Constraint::Custom::Implementation {
public:
    enum class Level { Velocity, Acceleration };

    /** @param speed, acceleration  functions of time **/
    Pacer(MobilizedBody& body, Level level, Function speed, Function acceleration)
        : Implementation(body.updMatterSubsystem(), 0, level == Level::Velocity ? 1 : 0,
                         level == Level::Acceleration ? 1 : 0),
          m_speed(speed),
          m_acceleration(acceleration),
          m_mobilizer(addConstrainedMobilizer(body)) {}
    Implementation* clone() const override { return new Pacer(*this); }
    void calcVelocityErrors(const State& state, const Array_<SpatialVec, ConstrainedBodyIndex>&,
                            const Array_<Real, ConstrainedUIndex>& u,
                            Array_<Real>& errors) const override {
        errors[0] = getOneU(state, u, m_mobilizer, MobilizerUIndex(0)) - m_speed(state.getTime());
    }
    void calcVelocityDotErrors(const State& state, const Array_<SpatialVec, ConstrainedBodyIndex>&,
                               const Array_<Real, ConstrainedUIndex>& uDot,
                               Array_<Real>& errors) const override {
        calcAccelerationErrors(state, {}, uDot, errors);
    }
    void calcAccelerationErrors(const State& state, const Array_<SpatialVec, ConstrainedBodyIndex>&,
                                const Array_<Real, ConstrainedUIndex>& uDot,
                                Array_<Real>& errors) const override {
        errors[0] = getOneUDot(state, uDot, m_mobilizer, MobilizerUIndex(0)) -
                    m_acceleration(state.getTime());
    }
    void addInVelocityConstraintForces(const State& state, const Array_<Real>& multipliers,
                                       Array_<SpatialVec, ConstrainedBodyIndex>&,
                                       Array_<Real, ConstrainedUIndex>& forces) const override {
        addInOneMobilityForce(state, m_mobilizer, MobilizerUIndex(0), multipliers[0], forces);
    }
    void addInAccelerationConstraintForces(const State& state, const Array_<Real>& multipliers,
                                           Array_<SpatialVec, ConstrainedBodyIndex>& bodyForces,
                                           Array_<Real, ConstrainedUIndex>& forces) const override {
        addInVelocityConstraintForces(state, multipliers, bodyForces, forces);
    }

private:
    Function m_speed, m_acceleration;
    ConstrainedMobilizerIndex m_mobilizer;
};

enum class Drive { Motion, Speed, Acceleration };

TYPED_TEST(LoadsInTime, ABriefDriveOfASystemAtRestIsSeen) {
    // A push forth and back again, lasting a third of the longest step.
    for (const Drive drive : {Drive::Motion, Drive::Speed, Drive::Acceleration})
        for (const Real start : {0.5, 0.502, 0.504, 0.506, 0.508}) {
            const Real width = 0.003;
            const auto shift = [&](Real t) { return std::clamp((t - start) / width, 0.0, 1.0); };
            // Up to 10 m/s; the displacement is ∫ 10 sin²(πx) dx or similar.
            const auto speed = [&](Real t) { return 10 * square(std::sin(Pi * shift(t))); };
            const auto acceleration = [&](Real t) {
                return 10 * Pi / width * std::sin(2 * Pi * shift(t));
            };
            Slide slide(Kind::Attached, [](Real) { return 0; });
            if (drive == Drive::Motion)
                Motion::Custom(slide.mass, new Accelerator(acceleration));
            else
                Constraint::Custom(new Pacer(
                    slide.mass,
                    drive == Drive::Speed ? Pacer::Level::Velocity : Pacer::Level::Acceleration,
                    speed, acceleration));
            const State state = slide.system.realizeTopology();
            TypeParam integrator(slide.system);
            integrator.setMaximumStepSize(0.01);
            integrator.initialize(state);
            integrator.stepTo(start + 2 * width);
            const Real moved = slide.mass.getLength(integrator.getState());
            EXPECT_NEAR(moved, 5 * width, 3e-4) << int(drive) << " at " << start;
        }
}

/** 10 mm in the first half second of every twenty. **/
Vec3 calcLobe(Real t) {
    const Real inTurn = std::fmod(t, 20);
    const Real phase = 2 * Pi * std::min(inTurn, 0.5), s = std::sin(phase), c = std::cos(phase);
    const Real height = 0.01, rate = 2 * Pi;
    return {height * std::pow(s, 4), height * 4 * std::pow(s, 3) * c * rate,
            height * (12 * s * s * c * c - 4 * std::pow(s, 4)) * rate * rate};
}

class Lobes : public Motion::Custom::Implementation {
public:
    Implementation* clone() const override { return new Lobes(*this); }
    Motion::Level getLevel(const State&) const override { return Motion::Position; }
    void calcPrescribedPosition(const State& state, int, Real* q) const override {
        *q = calcLobe(state.getTime())[0];
    }
    void calcPrescribedPositionDot(const State& state, int, Real* qDot) const override {
        *qDot = calcLobe(state.getTime())[1];
    }
    void calcPrescribedPositionDotDot(const State& state, int, Real* qDotDot) const override {
        *qDotDot = calcLobe(state.getTime())[2];
    }
};

/** A cam with a dwell, and a follower pressed against it by a spring and a damper. **/
struct Cam {
    explicit Cam(Kind kind) {
        if (kind == Kind::Native)
            Motion::Custom(cam, new Lobes);
        else
            Joint::PrescribedTranslation(flexible, Attachment(matter.Ground()), Attachment(cam),
                                         XAxis, Joint::MotionFunction(calcLobe));
        Force::MobilityLinearSpring(forces, follower, MobilizerQIndex(0), 50, 0);
        Force::MobilityLinearDamper(forces, follower, MobilizerUIndex(0), 4.5);
        const Transform facing(Rotation(Pi / 2, YAxis));
        ContactStop(flexible, Attachment(cam, facing), Attachment(follower), 1e5, 1);
        state = system.realizeTopology();
    }

    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    FlexibleBodySubsystem flexible{system, matter};
    Body::Rigid body{MassProperties(0.1, Vec3(0), Inertia(1))};
    MobilizedBody::Slider cam{matter.Ground(), body}, follower{matter.Ground(), body};
    State state;
};

TYPED_TEST(LoadsInTime, EveryLobeOfACamLiftsItsFollower) {
    for (const Kind kind : {Kind::Attached, Kind::Native}) {
        const Cam model(kind);
        TypeParam integrator(model.system);
        integrator.initialize(model.state);
        for (int lobe = 0; lobe < 3; ++lobe) {
            integrator.stepTo(20 * lobe + 0.25);
            const State& top = integrator.getState();
            EXPECT_NEAR(model.cam.getLength(top), 0.01, 1e-9);
            EXPECT_GT(model.follower.getLength(top), 0.0098) << "lobe " << lobe;
            integrator.stepTo(20 * lobe + 19.9);
            EXPECT_LT(model.follower.getLength(integrator.getState()), 1e-4);
        }
    }
}

/** Records the times at which a model's functions are evaluated. **/
class Asked {
public:
    /** Wraps a function of the model without changing its results. **/
    template <class Function>
    auto watch(Function function) {
        m_times.emplace_back();
        return [this, function, index = m_times.size() - 1](Real time) {
            m_isAlone = m_isAlone && !m_isBusy.exchange(true);
            ++m_times[index][time];
            const auto value = function(time);
            m_isBusy = false;
            return value;
        };
    }
    /** Returns the number of evaluations of each function by time. **/
    const std::vector<std::map<Real, int>>& getTimes() const { return m_times; }
    /** Returns true if no two evaluations overlapped. **/
    bool isAlone() const { return m_isAlone; }

private:
    std::vector<std::map<Real, int>> m_times;
    std::atomic<bool> m_isBusy{false}, m_isAlone{true};
};

/** A flexible body driven at its interface, rigid ones driven by a point and by an angle, and
loads. **/
struct LedBodies {
    LedBodies()
        : body(flexible, test::makePointMassPart().body, "body"),
          brick(matter.updGround(), rigid),
          wheel(matter.updGround(), rigid) {
        const Attachment ground(matter.Ground());
        Joint::PrescribedPose(flexible, ground, body.interface("A"), asked.watch([](Real t) {
            FrameMotion pose;
            pose.X = Transform(Rotation(std::sin(3 * t), ZAxis), Vec3(0.1 * std::sin(5 * t), 0, 0));
            pose.V = {Vec3(0, 0, 3 * std::cos(3 * t)), Vec3(0.5 * std::cos(5 * t), 0, 0)};
            pose.A = {Vec3(0, 0, -9 * std::sin(3 * t)), Vec3(-2.5 * std::sin(5 * t), 0, 0)};
            return pose;
        }));
        Joint::PrescribedPosition(flexible, ground, Attachment(brick), asked.watch([](Real t) {
            return std::array<Vec3, 3>{Vec3(std::sin(t), 0, t * t), Vec3(std::cos(t), 0, 2 * t),
                                       Vec3(-std::sin(t), 0, 2)};
        }));
        Joint::PrescribedRotation(flexible, ground, Attachment(wheel), asked.watch([](Real t) {
            return Vec3(std::sin(7 * t), 7 * std::cos(7 * t), -49 * std::sin(7 * t));
        }));
        AttachmentForce(flexible, body.interface("B"), asked.watch([](Real t) {
            return SpatialVec(Vec3(0), Vec3(20 * std::sin(30 * t), 5, 0));
        }));
        DistributedLoad(flexible, body, LoadShape::fromModalForces(Vector(body.getNumModes(), 1.0)),
                        asked.watch([](Real t) { return std::cos(20 * t); }));
        state = system.realizeTopology();
    }

    Asked asked;
    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    FlexibleBodySubsystem flexible{system, matter};
    Body::Rigid rigid{MassProperties(1, Vec3(0.1, 0, 0), UnitInertia(0.05))};
    FlexibleBody body;
    MobilizedBody::Free brick;
    MobilizedBody::Pin wheel;
    State state;
};

TYPED_TEST(LoadsInTime, FunctionsAreAskedOnceForEveryTimeOneAfterAnother) {
    LedBodies model;
    TypeParam integrator(model.system);
    integrator.setNumThreads(3);
    integrator.initialize(model.state);
    integrator.stepTo(0.4);
    const IntegratorStatistics& statistics = integrator.getStatistics();
    EXPECT_GT(statistics.stepsTaken, 30);
    EXPECT_GT(statistics.newtonIterations, 1.5 * statistics.stepsTaken);
    for (const std::map<Real, int>& times : model.asked.getTimes()) {
        for (const auto& [time, count] : times)
            EXPECT_EQ(count, time > 0 ? 1 : count) << "at t = " << time;
        // The end of a step or its stages, four times inside it, and a few at the start.
        const int timesOfAStep = std::is_same<TypeParam, RadauIntegrator>::value ? 7 : 5;
        EXPECT_LE(int(times.size()), timesOfAStep * statistics.stepsAttempted + 5);
    }
    EXPECT_TRUE(model.asked.isAlone());
}

TEST(FunctionsOfTime, SimbodysOwnStagesAskJointsOnceForEveryTime) {
    LedBodies model;
    model.state.setTime(0.3);
    model.system.realize(model.state, Stage::Velocity);
    model.state.updU() = 0.1;
    model.system.realize(model.state, Stage::Velocity);
    Matrix G;
    model.matter.calcG(model.state, G);
    for (int joint : {0, 1, 2})
        EXPECT_EQ(model.asked.getTimes()[size_t(joint)].at(0.3), 1) << "joint " << joint;
}

TEST(FunctionsOfTime, KeepTheLastTimesUntilTheyAreForgotten) {
    int count = 0;
    const JointEquations drive = JointEquations::makePrescribedRotation([&](Real t) {
        ++count;
        if (t < 0) throw std::runtime_error("before the start");
        return Vec3(t, 1, 0);
    });
    FunctionsOfTime functions;
    EXPECT_EQ(functions.add(JointEquations::makePin()), 0);
    const size_t place = size_t(functions.add(drive));
    functions.moveTo(3);
    for (int repeat = 0; repeat < 2; ++repeat)
        for (const Real time : {0.0, 1.0, 2.0})
            EXPECT_EQ(functions.calc(time).drives[place].motions[0], Vec3(time, 1, 0));
    EXPECT_EQ(count, 4);
    // Other evaluations do not change the current time.
    for (int k = 0; k < 100; ++k) functions.calc(4 + k);
    EXPECT_EQ(functions.get().drives[place].motions[0], Vec3(3, 1, 0));
    EXPECT_THROW(functions.moveTo(-1), std::runtime_error);
    EXPECT_EQ(functions.get().time, 3);
    count = 0;
    functions.moveTo(3);
    EXPECT_EQ(count, 0);
    functions.forget();
    functions.moveTo(3);
    EXPECT_EQ(count, 1);
}

}  // namespace
}  // namespace simflex
