// Reporters and handlers are called as SimTK::TimeStepper calls them.

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace simflex
