// Reporters and handlers are called as by SimTK::TimeStepper.

#include <gtest/gtest.h>

#include <cstdio>

#include "simflex/body/FlexibleBodySubsystem.h"
#include "simflex/solver/BdfIntegrator.h"

namespace simflex {
namespace {

using namespace SimTK;

class Recorder : public PeriodicEventReporter {
public:
    Recorder(const MobilizedBody& body, Real interval)
        : PeriodicEventReporter(interval), m_body(body) {}
    void handleEvent(const State& state) const override {
        times.push_back(state.getTime());
        heights.push_back(m_body.getBodyOriginLocation(state)[1]);
    }
    mutable std::vector<Real> times, heights;

private:
    const MobilizedBody& m_body;
};

class Kick : public ScheduledEventHandler {
public:
    Kick(const MobilizedBody& body, Real time) : m_body(body), m_time(time) {}
    Real getNextEventTime(const State& state, bool includeCurrent) const override {
        return state.getTime() < m_time || (includeCurrent && state.getTime() == m_time) ? m_time
                                                                                         : Infinity;
    }
    void handleEvent(State& state, Real, bool&) const override { m_body.setOneU(state, 1, 5.0); }

private:
    const MobilizedBody& m_body;
    Real m_time;
};

class Floor : public TriggeredEventHandler {
public:
    explicit Floor(const MobilizedBody& body)
        : TriggeredEventHandler(Stage::Position), m_body(body) {
        getTriggerInfo().setTriggerOnRisingSignTransition(false);
    }
    Real getValue(const State& state) const override {
        return m_body.getBodyOriginLocation(state)[1] + 1;
    }
    void handleEvent(State& state, Real, bool& terminate) const override {
        times.push_back(state.getTime());
        m_body.setOneU(state, 1, -m_body.getOneU(state, 1));
        terminate = times.size() == 3;
    }
    mutable std::vector<Real> times;

private:
    const MobilizedBody& m_body;
};

/** A stone on a Translation mobilizer, falling from rest at height 0: y = −½gt². **/
struct FallingStone {
    FallingStone()
        : matter(system),
          forces(system),
          gravity(forces, matter, -YAxis, g),
          stone(matter.Ground(), Body::Rigid(MassProperties(1, Vec3(0), Inertia(1)))) {}
    static constexpr Real g = 9.81;
    MultibodySystem system;
    SimbodyMatterSubsystem matter;
    GeneralForceSubsystem forces;
    Force::Gravity gravity;
    MobilizedBody::Translation stone;
};

TEST(Events, ReportersSeeInterpolatedStatesAtTheirTimes) {
    FallingStone model;
    auto* recorder = new Recorder(model.stone, 0.05);
    model.system.addEventReporter(recorder);
    BdfIntegrator integrator(model.system);
    integrator.setAccuracy(1e-8);
    integrator.initialize(model.system.realizeTopology());
    EXPECT_EQ(integrator.stepTo(0.21), BdfIntegrator::StepStatus::ReachedTime);
    ASSERT_EQ(recorder->times.size(), 5u);
    for (int i = 0; i < 5; ++i) {
        EXPECT_NEAR(recorder->times[i], 0.05 * i, 1e-12);
        EXPECT_NEAR(recorder->heights[i], -0.5 * model.g * square(0.05 * i), 1e-6);
    }
}

TEST(Events, AScheduledHandlerChangesTheStateAtItsTime) {
    FallingStone model;
    model.system.addEventHandler(new Kick(model.stone, 0.1));
    BdfIntegrator integrator(model.system);
    integrator.setAccuracy(1e-8);
    integrator.initialize(model.system.realizeTopology());
    integrator.stepTo(0.3);
    const Real expected = -0.5 * model.g * 0.01 + 5 * 0.2 - 0.5 * model.g * 0.04;
    EXPECT_NEAR(model.stone.getBodyOriginLocation(integrator.getState())[1], expected, 2e-6);
}

TEST(Events, ATriggeredHandlerIsLocatedAndMayTerminate) {
    FallingStone model;
    auto* floor = new Floor(model.stone);
    model.system.addEventHandler(floor);
    BdfIntegrator integrator(model.system);
    integrator.setAccuracy(1e-9);
    integrator.initialize(model.system.realizeTopology());
    EXPECT_EQ(integrator.stepTo(10), BdfIntegrator::StepStatus::Terminated);
    const Real first = std::sqrt(2 / model.g);
    ASSERT_EQ(floor->times.size(), 3u);
    for (int bounce = 0; bounce < 3; ++bounce)
        EXPECT_NEAR(floor->times[bounce], (2 * bounce + 1) * first, 1e-5);
    EXPECT_NEAR(integrator.getTime(), 5 * first, 1e-5);
}

class SwitchGravityOff : public ScheduledEventHandler {
public:
    SwitchGravityOff(const Force::Gravity& gravity, Real time) : m_gravity(gravity), m_time(time) {}
    Real getNextEventTime(const State& state, bool includeCurrent) const override {
        return state.getTime() < m_time || (includeCurrent && state.getTime() == m_time) ? m_time
                                                                                         : Infinity;
    }
    void handleEvent(State& state, Real, bool&) const override { m_gravity.setMagnitude(state, 0); }

private:
    const Force::Gravity& m_gravity;
    Real m_time;
};

TEST(Events, AHandlerMayChangeInstanceVariables) {
    FallingStone model;
    model.system.addEventHandler(new SwitchGravityOff(model.gravity, 0.1));
    BdfIntegrator integrator(model.system);
    integrator.setAccuracy(1e-8);
    integrator.initialize(model.system.realizeTopology());
    integrator.stepTo(0.3);
    const Real expected = -0.5 * model.g * 0.01 - model.g * 0.1 * 0.2;
    EXPECT_NEAR(model.stone.getBodyOriginLocation(integrator.getState())[1], expected, 2e-6);
}

TEST(Events, TimesThatCannotBeReachedAreRefused) {
    FallingStone model;
    BdfIntegrator integrator(model.system);
    integrator.initialize(model.system.realizeTopology());
    integrator.stepTo(0.1);
    EXPECT_THROW(integrator.stepTo(0.05), std::invalid_argument);
    EXPECT_THROW(integrator.stepTo(NaN), std::invalid_argument);
}

TEST(Events, FinalTimeIsNeverPassed) {
    FallingStone model;
    BdfIntegrator integrator(model.system);
    integrator.setFinalTime(0.123);
    integrator.initialize(model.system.realizeTopology());
    EXPECT_EQ(integrator.stepTo(1), BdfIntegrator::StepStatus::ReachedFinalTime);
    EXPECT_EQ(integrator.getTime(), 0.123);
}

TEST(Events, SingleStepsAdvanceToTheSameResult) {
    FallingStone model;
    BdfIntegrator integrator(model.system);
    integrator.setFinalTime(0.2);
    integrator.setAccuracy(1e-8);
    integrator.initialize(model.system.realizeTopology());
    Real before = 0;
    while (integrator.stepOnce() != BdfIntegrator::StepStatus::ReachedFinalTime) {
        ASSERT_GT(integrator.getTime(), before);
        before = integrator.getTime();
    }
    EXPECT_NEAR(model.stone.getBodyOriginLocation(integrator.getState())[1], -0.5 * model.g * 0.04,
                1e-6);
}

TEST(Events, BounceTimesOfAFallingStoneAreExactToANanosecond) {
    // BDF2 started by the trapezoidal rule is exact for parabolas.
    FallingStone model;
    auto* floor = new Floor(model.stone);
    model.system.addEventHandler(floor);
    BdfIntegrator integrator(model.system);
    integrator.setAccuracy(1e-8);
    integrator.initialize(model.system.realizeTopology());
    EXPECT_EQ(integrator.stepTo(10), BdfIntegrator::StepStatus::Terminated);
    const Real first = std::sqrt(2 / model.g);
    ASSERT_EQ(floor->times.size(), 3u);
    for (int bounce = 0; bounce < 3; ++bounce)
        EXPECT_NEAR(floor->times[bounce], (2 * bounce + 1) * first, 1e-9);
}

/** Records when a coordinate passes zero, and changes nothing. **/
class ZeroCrossing : public TriggeredEventHandler {
public:
    ZeroCrossing(const MobilizedBody& body, Real window)
        : TriggeredEventHandler(Stage::Position), m_body(body) {
        getTriggerInfo().setRequiredLocalizationTimeWindow(window);
    }
    Real getValue(const State& state) const override { return m_body.getOneQ(state, 0); }
    void handleEvent(State& state, Real, bool&) const override { times.push_back(state.getTime()); }
    mutable std::vector<Real> times;

private:
    const MobilizedBody& m_body;
};

TEST(Events, ZeroesOfAnOscillationAreLocatedToANanosecondAndDoNotDisturbIt) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    MobilizedBody::Slider mass(matter.Ground(),
                               Body::Rigid(MassProperties(1, Vec3(0), Inertia(1))));
    const Real omega = 7;
    Force::MobilityLinearSpring(forces, mass, MobilizerQIndex(0), omega * omega, 0);
    auto* crossing = new ZeroCrossing(mass, 1e-2);
    system.addEventHandler(crossing);
    State state = system.realizeTopology();
    mass.setOneQ(state, 0, 1);
    BdfIntegrator integrator(system);
    integrator.setMaximumOrder(5);
    integrator.setAccuracy(1e-13);
    integrator.initialize(state);
    integrator.stepTo(1);
    ASSERT_EQ(crossing->times.size(), 2u);
    for (int i = 0; i < 2; ++i)
        EXPECT_NEAR(crossing->times[i], (i + 0.5) * Pi / omega, 1e-9) << "crossing " << i;
    EXPECT_NEAR(mass.getOneQ(integrator.getState(), 0), std::cos(omega), 1e-8);
}

TEST(Events, RequiredLocalizationWindowsAreHonoured) {
    for (Real window : {1e-6, 1.0}) {
        FallingStone model;
        auto* floor = new Floor(model.stone);
        floor->getTriggerInfo().setRequiredLocalizationTimeWindow(window);
        model.system.addEventHandler(floor);
        BdfIntegrator integrator(model.system);
        integrator.setAccuracy(1e-3);
        integrator.initialize(model.system.realizeTopology());
        integrator.stepTo(0.5);
        ASSERT_EQ(floor->times.size(), 1u);
        // Located after the root, within a window in units of accuracy times the system's time
        // scale.
        const Real late = floor->times[0] - std::sqrt(2 / model.g);
        EXPECT_GE(late, -1e-12);
        EXPECT_LE(late, window * 1e-3 * model.system.getDefaultTimeScale() + 1e-12);
    }
}

/** A subsystem that counts the calls it receives. **/
class Witness : public Subsystem {
public:
    struct Counts {
        int initialization = 0, timeAdvanced = 0, termination = 0;
    };
    class CountingGuts : public Guts {
    public:
        explicit CountingGuts(Counts& counts) : Guts("Witness", "1"), m_counts(counts) {}
        CountingGuts* cloneImpl() const override { return new CountingGuts(m_counts); }
        void handleEventsImpl(State&, Event::Cause cause, const Array_<EventId>&,
                              const HandleEventsOptions&, HandleEventsResults&) const override {
            if (cause == Event::Cause::Initialization) ++m_counts.initialization;
            if (cause == Event::Cause::TimeAdvanced) ++m_counts.timeAdvanced;
            if (cause == Event::Cause::Termination) ++m_counts.termination;
        }

    private:
        Counts& m_counts;
    };
    Witness(System& system, Counts& counts) {
        adoptSubsystemGuts(new CountingGuts(counts));
        system.adoptSubsystem(*this);
    }
};

TEST(Events, InitializationTimeAdvancedAndTerminationAreAnnouncedOnceEach) {
    FallingStone model;
    Witness::Counts counts;
    Witness witness(model.system, counts);
    model.system.setHasTimeAdvancedEvents(true);
    BdfIntegrator integrator(model.system);
    integrator.setFinalTime(0.3);
    integrator.initialize(model.system.realizeTopology());
    EXPECT_EQ(counts.initialization, 1);
    EXPECT_EQ(counts.timeAdvanced, 0);
    for (int i = 1; i <= 3; ++i) integrator.stepTo(0.1 * i);
    EXPECT_EQ(counts.timeAdvanced, integrator.getStatistics().stepsTaken);
    EXPECT_EQ(counts.termination, 1);
    integrator.stepTo(1);
    EXPECT_EQ(counts.initialization, 1);
    EXPECT_EQ(counts.termination, 1);
}

/** Every call as "kind time", with times rounded to 1e-5 s. **/
using Log = std::vector<std::string>;

void record(Log& log, const char* kind, Real time) {
    char line[40];
    std::snprintf(line, sizeof line, "%s %.5f", kind, time);
    log.push_back(line);
}

class LoggingReporter : public PeriodicEventReporter {
public:
    LoggingReporter(Log& log, Real interval) : PeriodicEventReporter(interval), m_log(log) {}
    void handleEvent(const State& state) const override {
        record(m_log, "report", state.getTime());
    }

private:
    Log& m_log;
};

class LoggingFloor : public Floor {
public:
    LoggingFloor(Log& log, const MobilizedBody& body) : Floor(body), m_log(log) {}
    void handleEvent(State& state, Real accuracy, bool& terminate) const override {
        Floor::handleEvent(state, accuracy, terminate);
        record(m_log, "bounce", state.getTime());
    }

private:
    Log& m_log;
};

class LoggingKick : public PeriodicEventHandler {
public:
    LoggingKick(Log& log, const MobilizedBody& body, Real interval)
        : PeriodicEventHandler(interval), m_log(log), m_body(body) {}
    void handleEvent(State& state, Real, bool&) const override {
        record(m_log, "kick", state.getTime());
        m_body.setOneU(state, 1, m_body.getOneU(state, 1) + 0.5);
    }

private:
    Log& m_log;
    const MobilizedBody& m_body;
};

TEST(Events, ComeInTheSameOrderAtTheSameTimesAsFromSimbodysTimeStepper) {
    const auto run = [](bool isSimbody) {
        Log log;
        FallingStone model;
        model.system.addEventReporter(new LoggingReporter(log, 0.05));
        model.system.addEventHandler(new LoggingKick(log, model.stone, 0.1));
        model.system.addEventHandler(new LoggingFloor(log, model.stone));
        const State state = model.system.realizeTopology();
        if (isSimbody) {
            RungeKuttaMersonIntegrator integrator(model.system);
            integrator.setAccuracy(1e-8);
            TimeStepper stepper(model.system, integrator);
            stepper.initialize(state);
            stepper.stepTo(5);
        } else {
            BdfIntegrator integrator(model.system);
            integrator.setAccuracy(1e-8);
            integrator.initialize(state);
            EXPECT_EQ(integrator.stepTo(5), BdfIntegrator::StepStatus::Terminated);
        }
        return log;
    };
    const Log simbody = run(true), ours = run(false);
    EXPECT_EQ(ours, simbody);
    EXPECT_GT(ours.size(), 20u);
}

TEST(Events, StatisticsTellWhatHappened) {
    FallingStone model;
    model.system.addEventReporter(new Recorder(model.stone, 0.05));
    model.system.addEventHandler(new Kick(model.stone, 0.1));
    model.system.addEventHandler(new Floor(model.stone));
    BdfIntegrator integrator(model.system);
    integrator.initialize(model.system.realizeTopology());
    integrator.stepTo(0.81);
    const IntegratorStatistics& statistics = integrator.getStatistics();
    EXPECT_EQ(statistics.reports, 17);
    EXPECT_EQ(statistics.scheduledEvents, 1);
    EXPECT_EQ(statistics.starts, 2 + statistics.triggeredEvents);
    EXPECT_EQ(statistics.stepsAttempted - statistics.stepsTaken,
              statistics.errorTestFailures + statistics.convergenceFailures +
                  statistics.projectionFailures + statistics.nonFiniteFailures);
    EXPECT_LE(statistics.smallestStep, statistics.calcMeanStep());
    EXPECT_GE(statistics.largestStep, statistics.calcMeanStep());
    const std::string text = statistics.toString();
    for (const char* label : {"steps taken", "of order 2", "largest step", "Newton iterations",
                              "scheduled events", "reports", "total"})
        EXPECT_NE(text.find(label), std::string::npos) << label;
}

}  // namespace
}  // namespace simflex
