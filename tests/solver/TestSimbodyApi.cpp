// The interface of SimTK::Integrator and SimTK::TimeStepper, method by method, and the State from
// which a run starts.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <sstream>

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"
#include "simflex/solver/BdfIntegrator.h"
#include "simflex/solver/GeneralizedAlphaIntegrator.h"
#include "simflex/solver/TimeStepper.h"
#include "support/PointMassPart.h"

namespace simflex {
namespace {

using namespace SimTK;

//-------------------------------------------------------------------------------------------------
// every method

/** A pendulum of length 1 m on a pin about z, and a slider under gravity alone. **/
struct Pendulum {
    Pendulum()
        : matter(system),
          forces(system),
          gravity(forces, matter, -YAxis, 9.81),
          pin(matter.Ground(), Transform(), Body::Rigid(MassProperties(1, Vec3(0), Inertia(0.1))),
              Transform(Vec3(0, 1, 0))),
          lift(matter.Ground(), Transform(Rotation(Pi / 2, ZAxis)),
               Body::Rigid(MassProperties(2, Vec3(0), Inertia(1))), Transform()) {}
    State makeState(Real angle = 0, Real speed = 1) {
        State state = system.realizeTopology();
        pin.setOneQ(state, 0, angle);
        pin.setOneU(state, 0, speed);
        return state;
    }
    MultibodySystem system;
    SimbodyMatterSubsystem matter;
    GeneralForceSubsystem forces;
    Force::Gravity gravity;
    MobilizedBody::Pin pin;
    MobilizedBody::Slider lift;
};

/** Calls the methods of SimTK::Integrator. **/
template <class SomeIntegrator>
void useAllOf(SomeIntegrator& integ, const State& start) {
    integ.setFinalTime(0.5);
    integ.setInitialStepSize(1e-4);
    integ.setMinimumStepSize(1e-9);
    integ.setMaximumStepSize(0.05);
    integ.setAccuracy(1e-5);
    integ.setConstraintTolerance(1e-6);
    integ.setUseInfinityNorm(true);
    integ.setInternalStepLimit(1000);
    integ.setReturnEveryInternalStep(false);
    integ.setProjectEveryStep(true);
    integ.setAllowInterpolation(true);
    integ.setProjectInterpolatedStates(true);
    integ.setForceFullNewton(false);
    integ.initialize(start);
    EXPECT_TRUE(integ.isInfinityNormInUse());
    EXPECT_EQ(integ.getAccuracyInUse(), 1e-5);
    EXPECT_EQ(integ.getConstraintToleranceInUse(), 1e-6);
    EXPECT_FALSE(std::string(integ.getMethodName()).empty());
    EXPECT_LE(integ.getMethodMinOrder(), integ.getMethodMaxOrder());
    EXPECT_TRUE(integ.methodHasErrorControl());

    typename SomeIntegrator::SuccessfulStepStatus status = integ.stepTo(0.1, Infinity);
    EXPECT_EQ(status, SomeIntegrator::StartOfContinuousInterval);
    status = integ.stepTo(0.1, 0.2);
    EXPECT_EQ(status, SomeIntegrator::ReachedReportTime);
    EXPECT_EQ(SomeIntegrator::getSuccessfulStepStatusString(status), "ReachedReportTime");
    EXPECT_NEAR(integ.getTime(), 0.1, 1e-15);
    EXPECT_EQ(integ.getState().getTime(), integ.getTime());
    EXPECT_EQ(integ.isStateInterpolated(), integ.getTime() < integ.getAdvancedTime());
    EXPECT_EQ(integ.getAdvancedState().getTime(), integ.getAdvancedTime());
    EXPECT_EQ(integ.stepBy(0.01), SomeIntegrator::ReachedReportTime);
    EXPECT_NEAR(integ.getTime(), 0.11, 1e-15);
    EXPECT_EQ(integ.stepBy(0.2, 0.1), SomeIntegrator::ReachedScheduledEvent);
    EXPECT_NEAR(integ.getTime(), 0.21, 1e-15);
    EXPECT_THROW(integ.getEventWindow(), std::exception);
    EXPECT_THROW(integ.getTriggeredEvents(), std::exception);
    EXPECT_THROW(integ.getEstimatedEventTimes(), std::exception);
    EXPECT_THROW(integ.getEventTransitionsSeen(), std::exception);

    EXPECT_EQ(integ.getActualInitialStepSizeTaken(), 1e-4);
    EXPECT_GT(integ.getPreviousStepSizeTaken(), 1e-4);
    EXPECT_GT(integ.getPredictedNextStepSize(), 1e-4);
    EXPECT_GT(integ.getNumStepsTaken(), 4);
    EXPECT_GE(integ.getNumStepsAttempted(), integ.getNumStepsTaken());
    EXPECT_GE(integ.getNumRealizations(), integ.getNumStepsTaken());
    EXPECT_EQ(integ.getNumProjections(), integ.getNumQProjections() + integ.getNumUProjections());
    EXPECT_EQ(integ.getNumIterations(),
              integ.getNumConvergentIterations() + integ.getNumDivergentIterations());
    EXPECT_GE(integ.getNumErrorTestFailures() + integ.getNumConvergenceTestFailures(), 0);
    EXPECT_EQ(integ.getNumRealizationFailures(), 0);
    EXPECT_EQ(integ.getNumProjectionFailures(),
              integ.getNumQProjectionFailures() + integ.getNumUProjectionFailures());
    integ.resetAllStatistics();
    EXPECT_EQ(integ.getNumStepsTaken() + integ.getNumStepsAttempted() + integ.getNumRealizations() +
                  integ.getNumIterations(),
              0);

    integ.updAdvancedState().setU(start.getU());
    integ.reinitialize(Stage::Velocity, false);
    EXPECT_EQ(integ.stepTo(1, Infinity), SomeIntegrator::StartOfContinuousInterval);
    EXPECT_EQ((integ.getState().getU() - start.getU()).normInf(), 0);
    EXPECT_EQ(integ.stepTo(1, Infinity), SomeIntegrator::ReachedReportTime);
    EXPECT_EQ(integ.getTime(), 0.5);
    EXPECT_FALSE(integ.isSimulationOver());
    EXPECT_EQ(integ.stepTo(1, Infinity), SomeIntegrator::EndOfSimulation);
    EXPECT_TRUE(integ.isSimulationOver());
    EXPECT_EQ(integ.getTerminationReason(), SomeIntegrator::ReachedFinalTime);
    EXPECT_EQ(SomeIntegrator::getTerminationReasonString(integ.getTerminationReason()),
              "ReachedFinalTime");
    EXPECT_THROW(integ.stepTo(1, Infinity), std::exception);
}

TEST(SimbodyApi, OneTextRunsWithEitherIntegrator) {
    Pendulum model;
    const State state = model.makeState();
    RungeKuttaMersonIntegrator native(model.system);
    useAllOf(native, state);
    BdfIntegrator bdf(model.system);
    useAllOf(bdf, state);
    GeneralizedAlphaIntegrator alpha(model.system);
    useAllOf(alpha, state);
}

TEST(SimbodyApi, ARefIsEitherIntegrator) {
    Pendulum model;
    const State state = model.makeState();
    RungeKuttaMersonIntegrator native(model.system);
    BdfIntegrator bdf(model.system);
    IntegratorRef first(native), second(bdf);
    useAllOf(first, state);
    useAllOf(second, state);
    EXPECT_EQ(first.getNative(), &native);
    EXPECT_EQ(second.getImplicit(), &bdf);
    EXPECT_EQ(second.getNumStepsTaken(), bdf.getNumStepsTaken());

    struct Holder {
        explicit Holder(IntegratorRef either) : integ(either) {}
        IntegratorRef integ;
    };
    const auto count = [](const IntegratorRef& integ) { return integ.getNumStepsTaken(); };
    EXPECT_EQ(count(Holder(native).integ), native.getNumStepsTaken());
    EXPECT_EQ(count(bdf), bdf.getNumStepsTaken());
}

TEST(SimbodyApi, MethodsSayWhatTheyAre) {
    Pendulum model;
    BdfIntegrator bdf(model.system);
    bdf.setMaximumOrder(4);
    EXPECT_EQ(std::string(bdf.getMethodName()), "Bdf");
    EXPECT_EQ(bdf.getMethodMinOrder(), 2);
    EXPECT_EQ(bdf.getMethodMaxOrder(), 4);
    EXPECT_EQ(std::string(GeneralizedAlphaIntegrator(model.system).getMethodName()),
              "GeneralizedAlpha");
}

// -------------------------------------------------------------------------------------------------
// order of statuses

struct Passed {
    Integrator::SuccessfulStepStatus status;
    Real time;
};

std::string toText(const std::vector<Passed>& all) {
    std::string text;
    for (const Passed& one : all)
        text += std::string(Integrator::getSuccessfulStepStatusString(one.status)) + " " +
                std::to_string(one.time) + "\n";
    return text;
}

void expectSame(const std::vector<Passed>& ours, const std::vector<Passed>& simbodys) {
    ASSERT_EQ(ours.size(), simbodys.size()) << toText(ours) << "Simbody's:\n" << toText(simbodys);
    for (size_t i = 0; i < ours.size(); ++i) {
        EXPECT_EQ(ours[i].status, simbodys[i].status) << i;
        EXPECT_NEAR(ours[i].time, simbodys[i].time, 1e-5) << i;
    }
}

class AtAngle : public TriggeredEventHandler {
public:
    AtAngle(const MobilizedBody& body, Real angle)
        : TriggeredEventHandler(Stage::Position), m_body(body), m_angle(angle) {
        getTriggerInfo().setTriggerOnFallingSignTransition(false);
        getTriggerInfo().setRequiredLocalizationTimeWindow(1e-3);
    }
    Real getValue(const State& state) const override { return m_body.getOneQ(state, 0) - m_angle; }
    void handleEvent(State& state, Real, bool&) const override {
        m_body.setOneU(state, 0, -0.5 * m_body.getOneU(state, 0));
    }

private:
    const MobilizedBody& m_body;
    Real m_angle;
};

class Halved : public PeriodicEventHandler {
public:
    Halved(const MobilizedBody& body, Real interval)
        : PeriodicEventHandler(interval), m_body(body) {}
    void handleEvent(State& state, Real, bool&) const override {
        m_body.setOneU(state, 0, 0.5 * m_body.getOneU(state, 0));
        ++calls;
    }
    mutable int calls = 0;

private:
    const MobilizedBody& m_body;
};

class Look : public PeriodicEventReporter {
public:
    explicit Look(Real interval) : PeriodicEventReporter(interval) {}
    void handleEvent(const State&) const override { ++calls; }
    mutable int calls = 0;
};

TEST(SimbodyApi, ALoopThatHandlesItsOwnEventsSeesThoseOfSimbody) {
    const auto run = [](bool isSimbodys) {
        Pendulum model;
        model.system.addEventHandler(new AtAngle(model.pin, 0.2));
        const State start = model.makeState(0, 2);
        RungeKuttaMersonIntegrator native(model.system);
        BdfIntegrator bdf(model.system);
        IntegratorRef integ = isSimbodys ? IntegratorRef(native) : IntegratorRef(bdf);
        integ.setAccuracy(1e-9);
        integ.setFinalTime(1.5);
        integ.initialize(start);
        std::vector<Passed> passed;
        for (Real report = 0.05, event = 0.4;;) {
            const Integrator::SuccessfulStepStatus status = integ.stepTo(report, event);
            passed.push_back({status, integ.getTime()});
            if (status == Integrator::ReachedReportTime) report += 0.05;
            if (status == Integrator::ReachedScheduledEvent) event += 0.4;
            if (status == Integrator::ReachedEventTrigger) {
                EXPECT_EQ(integ.getTriggeredEvents().size(), 1u);
                EXPECT_NEAR(integ.getEventWindow()[0], integ.getTime(), 1e-12);
                EXPECT_NEAR(integ.getEventWindow()[1], integ.getAdvancedTime(), 1e-12);
                EXPECT_GT(integ.getEstimatedEventTimes()[0], integ.getEventWindow()[0]);
                EXPECT_LE(integ.getEstimatedEventTimes()[0], integ.getEventWindow()[1]);
                EXPECT_EQ(integ.getEventTransitionsSeen().size(), 1u);
                passed.push_back({status, Real(int(integ.getEventTransitionsSeen()[0]))});
                HandleEventsResults results;
                model.system.handleEvents(integ.updAdvancedState(), Event::Cause::Triggered,
                                          integ.getTriggeredEvents(), HandleEventsOptions(1e-8),
                                          results);
                integ.reinitialize(results.getLowestModifiedStage(), false);
            }
            if (status == Integrator::EndOfSimulation) break;
        }
        passed.push_back({Integrator::EndOfSimulation, integ.getState().getQ()[0]});
        return passed;
    };
    const std::vector<Passed> simbodys = run(true);
    EXPECT_GT(simbodys.size(), 30u);
    expectSame(run(false), simbodys);
}

TEST(SimbodyApi, ATimeStepperReturnsTheSignificantStatesOfSimbodys) {
    const auto run = [](bool isSimbodys, bool reportsAll) {
        Pendulum model;
        auto* look = new Look(0.1);
        auto* halved = new Halved(model.pin, 0.25);
        model.system.addEventReporter(look);
        model.system.addEventHandler(halved);
        model.system.addEventHandler(new AtAngle(model.pin, 0.2));
        const State start = model.makeState(0, 2);
        RungeKuttaMersonIntegrator native(model.system);
        BdfIntegrator bdf(model.system);
        IntegratorRef integ = isSimbodys ? IntegratorRef(native) : IntegratorRef(bdf);
        integ.setAccuracy(1e-8);
        integ.setFinalTime(1.0);
        simflex::TimeStepper ts(model.system, integ);
        ts.setReportAllSignificantStates(reportsAll);
        ts.initialize(start);
        std::vector<Passed> passed;
        for (Real time = 0.25; passed.size() < 200;) {
            const Integrator::SuccessfulStepStatus status = ts.stepTo(time);
            passed.push_back({status, ts.getTime()});
            if (ts.getTime() >= time) {
                passed.push_back({status, Real(halved->calls)});
                passed.push_back({status, Real(look->calls)});
                time += 0.25;
            }
            if (status == Integrator::EndOfSimulation) break;
        }
        EXPECT_EQ(ts.stepTo(3), Integrator::EndOfSimulation);
        EXPECT_TRUE(ts.getIntegrator().isSimulationOver());
        passed.push_back({Integrator::EndOfSimulation, ts.getState().getQ()[0]});
        return passed;
    };
    expectSame(run(false, false), run(true, false));
    const std::vector<Passed> all = run(true, true);
    EXPECT_GT(all.size(), 25u);
    expectSame(run(false, true), all);
}

TEST(SimbodyApi, ATimeStepperRefusesAnIntegratorOfAnotherSystem) {
    Pendulum one, other;
    BdfIntegrator bdf(one.system);
    EXPECT_THROW(simflex::TimeStepper(other.system, bdf), std::invalid_argument);
    simflex::TimeStepper ts(one.system);
    EXPECT_THROW(ts.stepTo(1), std::logic_error);
    ts.setIntegrator(bdf);
    ts.initialize(one.makeState());
    EXPECT_EQ(ts.stepTo(0.1), Integrator::ReachedReportTime);
    EXPECT_EQ(ts.updIntegrator().getTime(), 0.1);
}

//-------------------------------------------------------------------------------------------------
// settings

TEST(SimbodyApi, SettingsCountWhenSimbodysDo) {
    Pendulum model;
    const State state = model.makeState();
    BdfIntegrator integ(model.system);
    integ.setAccuracy(1e-3);
    integ.initialize(state);
    integ.setAccuracy(1e-7);
    integ.setConstraintTolerance(1e-9);
    integ.setInitialStepSize(1e-5);
    integ.stepTo(0.2);
    EXPECT_EQ(integ.getAccuracyInUse(), 1e-3);
    EXPECT_DOUBLE_EQ(integ.getConstraintToleranceInUse(), 1e-4);  // a tenth of the accuracy
    EXPECT_GT(integ.getActualInitialStepSizeTaken(), 1e-5);
    const int coarse = integ.getNumStepsTaken();
    integ.setMaximumStepSize(1e-3);  // takes effect at once
    integ.stepTo(0.3);
    EXPECT_LE(integ.getLastStepSize(), 1e-3);
    EXPECT_GE(integ.getNumStepsTaken() - coarse, 20);  // one of the long ones may end after 0.2

    integ.setMaximumStepSize(0.1);
    integ.initialize(state);
    integ.stepTo(0.2);
    EXPECT_EQ(integ.getAccuracyInUse(), 1e-7);
    EXPECT_EQ(integ.getActualInitialStepSizeTaken(), 1e-5);
    EXPECT_GT(integ.getNumStepsTaken(), 2 * coarse);
    integ.setFixedStepSize(0.01);
    integ.stepTo(0.4);
    EXPECT_NEAR(integ.getLastStepSize(), 0.01, 1e-12);
    EXPECT_THROW(integ.setMinimumStepSize(0.2), std::invalid_argument);
    EXPECT_THROW(integ.setMaximumStepSize(0.001), std::invalid_argument);
}

TEST(SimbodyApi, StepsAreReturnedOneByOneAndByTheLimit) {
    Pendulum model;
    const State state = model.makeState();
    BdfIntegrator integ(model.system);
    integ.setReturnEveryInternalStep(true);
    integ.initialize(state);
    int returned = 0;
    for (;;) {
        const Integrator::SuccessfulStepStatus status = integ.stepTo(0.3);
        if (status == Integrator::ReachedReportTime) break;
        ASSERT_EQ(status, Integrator::TimeHasAdvanced);
        EXPECT_EQ(integ.getNumStepsTaken(), ++returned);
        EXPECT_FALSE(integ.isStateInterpolated());
    }
    EXPECT_EQ(integ.getTime(), 0.3);
    EXPECT_GT(returned, 10);
    EXPECT_EQ(integ.stepTo(0.4), Integrator::TimeHasAdvanced);
    EXPECT_EQ(integ.getNumStepsTaken(), returned + 1);

    integ.setReturnEveryInternalStep(false);
    integ.setInternalStepLimit(3);
    integ.initialize(state);
    EXPECT_EQ(integ.stepTo(0.3), Integrator::ReachedStepLimit);
    EXPECT_EQ(integ.getNumStepsTaken(), 3);
    EXPECT_EQ(integ.stepTo(0.3, Infinity), Integrator::ReachedStepLimit);
    EXPECT_EQ(integ.getNumStepsTaken(), 6);
    integ.setInternalStepLimit(0);
    EXPECT_EQ(integ.stepTo(0.3), Integrator::ReachedReportTime);
}

TEST(SimbodyApi, WithoutInterpolationStepsEndAtReports) {
    Pendulum model;
    auto* look = new Look(0.031);
    model.system.addEventReporter(look);
    const State state = model.makeState();
    for (bool isAllowed : {true, false}) {
        BdfIntegrator integ(model.system);
        integ.setAllowInterpolation(isAllowed);
        integ.initialize(state);
        int interpolated = 0;
        for (int i = 1; i <= 20; ++i) {
            integ.stepTo(0.05 * i);
            interpolated += integ.isStateInterpolated();
        }
        EXPECT_EQ(interpolated > 0, isAllowed);
    }
    EXPECT_GT(look->calls, 60);
}

TEST(SimbodyApi, MatricesAreFormedInEveryIterationOfFullNewton) {
    Pendulum model;
    const State state = model.makeState();
    for (bool isFull : {false, true}) {
        BdfIntegrator integ(model.system);
        integ.setForceFullNewton(isFull);
        integ.initialize(state);
        integ.stepTo(1);
        const IntegratorStatistics& statistics = integ.getStatistics();
        EXPECT_EQ(statistics.factorizations >= statistics.newtonIterations, isFull);
    }
}

// -------------------------------------------------------------------------------------------------
// changes by the user

TEST(SimbodyApi, StepsBeginWithWhatWasChangedInTheAdvancedState) {
    Pendulum model;
    BdfIntegrator integ(model.system);
    integ.setAccuracy(1e-8);
    integ.initialize(model.makeState());
    State& state = integ.updAdvancedState();
    integ.stepTo(0.5);
    const Real t1 = integ.getAdvancedTime(), y1 = model.lift.getOneQ(state, 0),
               v1 = model.lift.getOneU(state, 0);
    EXPECT_EQ(state.getTime(), t1);
    EXPECT_NEAR(y1, -9.81 / 2 * t1 * t1, 1e-7);
    EXPECT_NEAR(v1, -9.81 * t1, 1e-7);
    // A speed, a force parameter and a lock: variables of three stages.
    model.lift.setOneU(state, 0, 3);
    model.gravity.setMagnitude(state, 5);
    model.pin.lock(state);
    const Real angle = model.pin.getOneQ(state, 0);
    integ.stepTo(1);
    const Real t = 1 - t1;
    EXPECT_NEAR(model.lift.getOneQ(integ.getState(), 0), y1 + 3 * t - 2.5 * t * t, 1e-7);
    EXPECT_NEAR(model.pin.getOneQ(integ.getState(), 0), angle, 1e-14);
    EXPECT_EQ(model.pin.getOneU(integ.getState(), 0), 0);
    EXPECT_EQ(&integ.updAdvancedState(), &state);
    // No restart without a change.
    const long starts = integ.getStatistics().starts;
    model.system.realize(state, Stage::Acceleration);
    integ.stepTo(1.2);
    EXPECT_EQ(integ.getStatistics().starts, starts);
    model.lift.setOneU(state, 0, 0);
    integ.stepTo(1.3);
    EXPECT_EQ(integ.getStatistics().starts, starts + 1);
}

TEST(SimbodyApi, ACheckpointHoldsWhatWasChangedInTheAdvancedState) {
    Pendulum model;
    const State start = model.makeState();
    BdfIntegrator integ(model.system), resumed(model.system);
    integ.initialize(start);
    integ.stepTo(0.5);
    model.lift.setOneU(integ.updAdvancedState(), 0, 3);
    std::stringstream stream;
    integ.writeCheckpoint(stream);
    resumed.readCheckpoint(stream, start);
    integ.stepTo(1);
    resumed.stepTo(1);
    EXPECT_EQ((integ.getState().getY() - resumed.getState().getY()).normInf(), 0);
    EXPECT_EQ(resumed.getNumStepsTaken(), integ.getNumStepsTaken());
    EXPECT_GT(model.lift.getOneU(integ.getState(), 0), 3 - 9.81 * 0.51);
    EXPECT_EQ(resumed.getStatistics().starts, integ.getStatistics().starts);
}

TEST(SimbodyApi, ReportersSeeTheAdvancedStateOfTheirTime) {
    class Reporter : public PeriodicEventReporter {
    public:
        Reporter() : PeriodicEventReporter(0.1) {}
        void handleEvent(const State& state) const override {
            if (!integ) return;
            const Real advanced = integ->getAdvancedTime();
            EXPECT_GE(advanced, state.getTime());
            EXPECT_LE(advanced - state.getTime(), integ->getLastStepSize());
            EXPECT_EQ(advanced, integ->showAdvancedState().getTime());
            ++calls;
        }
        ImplicitIntegrator* integ = nullptr;
        mutable int calls = 0;
    };
    Pendulum model;
    auto* reporter = new Reporter();
    model.system.addEventReporter(reporter);
    BdfIntegrator integ(model.system);
    integ.initialize(model.makeState());
    reporter->integ = &integ;
    integ.getAdvancedState();
    integ.stepTo(1);
    EXPECT_EQ(reporter->calls, 11);
}

//-------------------------------------------------------------------------------------------------
// the start

/** A four-bar of pins closed by a ball: crank 0.5 m, coupler 2 m, and a follower of 1 m, with
different masses. **/
struct OpenFourBar {
    OpenFourBar()
        : matter(system),
          forces(system),
          gravity(forces, matter, -YAxis, 9.81),
          crank(matter.Ground(), Transform(), makeBar(3, 0.5), Transform()),
          coupler(crank, Transform(Vec3(0.5, 0, 0)), makeBar(1, 2), Transform()),
          follower(matter.Ground(), Transform(Vec3(2, 0, 0)), makeBar(7, 1), Transform()),
          joint(coupler, Vec3(2, 0, 0), follower, Vec3(1, 0, 0)) {}
    static Body::Rigid makeBar(Real mass, Real length) {
        return Body::Rigid(
            MassProperties(mass, Vec3(length / 2, 0, 0),
                           mass * Inertia(0.01, length * length / 3, length * length / 3)));
    }
    MultibodySystem system;
    SimbodyMatterSubsystem matter;
    GeneralForceSubsystem forces;
    Force::Gravity gravity;
    MobilizedBody::Pin crank, coupler, follower;
    Constraint::Ball joint;
};

/** Returns the State from which Simbody's integrator starts. **/
State startNatively(const MultibodySystem& system, const State& state) {
    RungeKuttaMersonIntegrator native(system);
    native.setAccuracy(1e-9);
    native.setConstraintTolerance(1e-13);
    native.initialize(state);
    return native.getState();
}

TEST(Start, IsSimbodysWithoutFlexibleBodies) {
    OpenFourBar model;
    State state = model.system.realizeTopology();
    model.crank.setAngle(state, 1.1);
    model.coupler.setAngle(state, -0.8);
    model.follower.setAngle(state, 1.6);
    model.crank.setRate(state, 5);
    for (bool isWeighted : {false, true}) {
        if (isWeighted) {
            model.system.realizeModel(state);
            state.updUWeights()[0] = 10;
        }
        const State theirs = startNatively(model.system, state);
        BdfIntegrator integ(model.system);
        integ.initialize(state);
        EXPECT_LT((integ.getState().getQ() - theirs.getQ()).normInf(), 1e-9);
        EXPECT_LT((integ.getState().getU() - theirs.getU()).normInf(), 1e-9);
        EXPECT_LT(std::abs(model.crank.getRate(theirs)), 4.9);
        EXPECT_LE(integ.getLargestConstraintError(), 1e-10);
    }
}

TEST(Start, KeepsLocksAndMotionsAsSimbodyDoes) {
    OpenFourBar model;
    Motion::Sinusoid motion(model.crank, Motion::Velocity, 2, 3, 0.4);
    State state = model.system.realizeTopology();
    model.crank.setAngle(state, 1.1);
    model.coupler.setAngle(state, -0.8);
    model.follower.setAngle(state, 1.6);
    const State theirs = startNatively(model.system, state);
    BdfIntegrator integ(model.system);
    integ.initialize(state);
    EXPECT_LT((integ.getState().getQ() - theirs.getQ()).normInf(), 1e-9);
    EXPECT_LT((integ.getState().getU() - theirs.getU()).normInf(), 1e-9);
    EXPECT_NEAR(model.crank.getRate(integ.getState()), 2 * std::sin(0.4), 1e-14);
}

/** An impulse along the constraint yields the consistent speeds nearest in kinetic energy to the
given ones: the change is orthogonal to all consistent speeds. **/
TEST(Start, ByInertiaIsThatOfAnImpulse) {
    OpenFourBar model;
    State state = model.system.realizeTopology();
    model.crank.setAngle(state, 1.1);
    model.coupler.setAngle(state, -0.8);
    model.follower.setAngle(state, 1.6);
    state.updQ() = startNatively(model.system, state).getQ();
    model.crank.setRate(state, 5);
    BdfIntegrator integ(model.system);
    integ.setProjectionNorm(BdfIntegrator::ProjectionNorm::Inertia);
    integ.initialize(state);
    const State& start = integ.getState();
    model.system.realize(start, Stage::Velocity);
    EXPECT_LT(start.getUErr().normInf(), 1e-10);
    Vector impulse;
    model.matter.multiplyByM(start, Vector(start.getU() - state.getU()), impulse);
    EXPECT_NEAR(~impulse * start.getU(), 0, 1e-8 * impulse.norm() * start.getU().norm());
    EXPECT_GT((start.getU() - startNatively(model.system, state).getU()).normInf(), 0.1);
}

/** Joints between rigid bodies are Constraint::Custom and are projected with the others. **/
TEST(Start, IsSimbodysWithJointsAmongRigidBodies) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    FlexibleBodySubsystem flexible(system, matter);
    MobilizedBody::Free box(matter.Ground(), Transform(), OpenFourBar::makeBar(3, 0.5),
                            Transform());
    Joint::Pin(flexible, matter.Ground(), Attachment(box, Transform(Vec3(0.1, 0, 0))), "pin");
    State state = system.realizeTopology();
    box.setQToFitTransform(state, Transform(Rotation(0.3, XAxis), Vec3(0.2, 0.1, -0.3)));
    box.setUToFitVelocity(state, SpatialVec(Vec3(1, 2, 3), Vec3(-1, 1, 2)));
    const State theirs = startNatively(system, state);
    BdfIntegrator integ(system);
    integ.initialize(state);
    EXPECT_LT((integ.getState().getQ() - theirs.getQ()).normInf(), 1e-9);
    EXPECT_LT((integ.getState().getU() - theirs.getU()).normInf(), 1e-9);
}

/** A part held at one end whose other end must reach a point of its circle. **/
struct Swung {
    Swung()
        : matter(system),
          flexible(system, matter),
          rod(flexible, test::makePointMassPart().body, "rod"),
          pivot(flexible, matter.Ground(), rod.interface("A")),
          ball(flexible, rod.interface("B"), Attachment(matter.Ground(), findEnd(2))) {}
    /** Returns the location of B with the part rotated. **/
    Vec3 findEnd(Real angle) const {
        const auto& seats = rod.getPart().interfaces;
        const auto place = [&](const char* name) {
            for (const auto& seat : seats)
                if (seat.name == name)
                    return Vec3(seat.position[0], seat.position[1], seat.position[2]);
            return Vec3(NaN);
        };
        return Rotation(angle, ZAxis) * (place("B") - place("A"));
    }
    MultibodySystem system;
    SimbodyMatterSubsystem matter;
    FlexibleBodySubsystem flexible;
    FlexibleBody rod;
    Joint::Ball pivot, ball;
};

TEST(Start, ThatAnAssemblerHasBentIsRefusedAndALockedOneIsNot) {
    Swung model;
    State start = model.system.realizeTopology();
    model.rod.setPoseByInterface(start, "A", Transform());
    State bent = start, turned = start;
    Assembler assembler(model.system);
    assembler.assemble(bent);
    EXPECT_GT(model.rod.calcLargestDisplacement(bent), 0.2);
    BdfIntegrator integ(model.system);
    for (const std::function<void()>& use :
         {std::function<void()>([&] { integ.initialize(bent); }),
          std::function<void()>([&] { model.flexible.initializeNative(bent); })}) {
        try {
            use();
            ADD_FAILURE() << "was not refused";
        } catch (const std::invalid_argument& error) {
            const std::string text = error.what();
            for (const char* part :
                 {"initialize", "'rod'", "% of the part's size", "SimTK::Assembler", "lockModes"})
                EXPECT_NE(text.find(part), std::string::npos) << text;
        }
    }

    BdfIntegrator asItIs(model.system);
    asItIs.setProjectInitialState(false);
    EXPECT_NO_THROW(asItIs.initialize(bent));

    Assembler locked(model.system);
    model.flexible.lockModes(locked);
    locked.assemble(turned);
    EXPECT_EQ(model.rod.getModalCoordinates(turned).normInf(), 0);
    integ.initialize(turned);
    EXPECT_LT(model.rod.calcLargestDisplacement(integ.getState()), 1e-4);
    EXPECT_LT(
        (model.rod.interface("B").calcMotion(integ.getState()).X.p() - model.findEnd(2)).norm(),
        1e-9);
}

//-------------------------------------------------------------------------------------------------
// one link made flexible

/** A slider-crank from rest, driven by a crank torque, with any kind of rod. **/
struct SliderCrank {
    SliderCrank()
        : matter(system),
          forces(system),
          gravity(forces, matter, -YAxis, 9.81),
          crank(matter.Ground(), Transform(), makeBody(0.5, 1e-2), Transform()),
          slider(matter.Ground(), Transform(), makeBody(0.3, 1e-4), Transform()),
          motor(forces, crank, 0, 1) {}
    static Body::Rigid makeBody(Real mass, Real inertia) {
        return Body::Rigid(MassProperties(mass, Vec3(0), Inertia(inertia)));
    }
    static constexpr Real radius = 0.06;
    MultibodySystem system;
    SimbodyMatterSubsystem matter;
    GeneralForceSubsystem forces;
    Force::Gravity gravity;
    MobilizedBody::Pin crank;
    MobilizedBody::Slider slider;
    Force::MobilityConstantForce motor;
};

TEST(OneLink, HeldRigidMovesAsSimbodysRigidOne) {
    const std::shared_ptr<const ReducedBody> part = test::makePointMassPart().body;
    const auto locate = [&](const char* name) {
        for (const auto& seat : part->interfaces)
            if (seat.name == name)
                return Vec3(seat.position[0], seat.position[1], seat.position[2]);
        return Vec3(NaN);
    };
    const Vec3 A = locate("A"), B = locate("B"), span = B - A;
    const Real angle = -std::atan2(span[1], span[0]);
    const Real reach = SliderCrank::radius + std::hypot(span[0], span[1]);

    SliderCrank rigid;
    const auto& I = part->inertia;
    const Body::Rigid bar(
        MassProperties(part->mass, Vec3(0), Inertia(I[0], I[1], I[2], I[3], I[4], I[5])));
    MobilizedBody::Pin link(rigid.crank, Vec3(SliderCrank::radius, 0, 0), bar, A);
    Constraint::Ball end(link, B, rigid.slider, Vec3(0, 0, span[2]));
    State state = rigid.system.realizeTopology();
    link.setAngle(state, angle);
    rigid.slider.setLength(state, reach);
    RungeKuttaMersonIntegrator native(rigid.system);
    native.setAccuracy(1e-11);
    simflex::TimeStepper theirs(rigid.system, native);
    theirs.initialize(state);

    SliderCrank bending;
    FlexibleBodySubsystem flexible(bending.system, bending.matter);
    FlexibleBody rod(flexible, part);
    Joint::Pin bigEnd(flexible, Attachment(bending.crank, Vec3(SliderCrank::radius, 0, 0)),
                      rod.interface("A"));
    Joint::Ball smallEnd(flexible, rod.interface("B"),
                         Attachment(bending.slider, Vec3(0, 0, span[2])));
    state = bending.system.realizeTopology();
    bending.slider.setLength(state, reach);
    rod.setPoseByInterface(state, "A",
                           Transform(Rotation(angle, ZAxis), Vec3(SliderCrank::radius, 0, 0)));
    rod.setRigid(state);
    BdfIntegrator bdf(bending.system);
    bdf.setAccuracy(1e-10);
    bdf.setMaximumOrder(5);
    simflex::TimeStepper ours(bending.system, bdf);
    ours.initialize(state);

    for (Real time : {0.2, 0.4, 0.6}) {
        theirs.stepTo(time);
        ours.stepTo(time);
        EXPECT_NEAR(bending.slider.getLength(ours.getState()),
                    rigid.slider.getLength(theirs.getState()), 1e-6);
        EXPECT_NEAR(bending.crank.getAngle(ours.getState()),
                    rigid.crank.getAngle(theirs.getState()), 1e-6);
    }
    EXPECT_GT(std::abs(rigid.crank.getAngle(theirs.getState())), 2);
}

}  // namespace
}  // namespace simflex
