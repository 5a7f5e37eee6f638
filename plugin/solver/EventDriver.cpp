#include "simflex/solver/EventDriver.h"

#include <stdexcept>

#include "simflex/solver/Checkpoint.h"

namespace simflex {

using namespace SimTK;

EventDriver::Outcome EventDriver::handleInitialization(State& state, Real accuracy) {
    const Outcome outcome = handle(state, Event::Cause::Initialization, {}, accuracy);
    if (outcome.shouldTerminate)
        throw std::runtime_error("an Initialization event handler asked for termination at t = " +
                                 std::to_string(state.getTime()) + " s");
    return outcome;
}

void EventDriver::initialize(const State& state, const std::string& owner) {
    m_lastReport = m_lastEvent = NaN;
    m_system.realize(state, Stage::Instance);
    m_system.calcEventTriggerInfo(state, m_triggers);
    m_triggerStage = Stage::Time;
    for (Stage stage = Stage::Time; stage <= Stage::Acceleration; ++stage) {
        if (state.getNEventTriggersByStage(stage) == 0) continue;
        if (stage > Stage::Dynamics)
            throw std::invalid_argument(
                owner + ": " + std::to_string(state.getNEventTriggersByStage(stage)) +
                " event trigger(s) need Stage::Acceleration, which is not supported; let them "
                "depend on positions, speeds or forces");
        m_triggerStage = stage;
    }
    m_hasAutoUpdates = findAutoUpdates(state);
}

bool EventDriver::findAutoUpdates(const State& state) const {
    // A State does not say how many discrete variables it has: a new one's index does. (Measures
    // allocate theirs with the topology.)
    State copy = state;
    copy.invalidateAll(Stage::Model);
    for (SubsystemIndex s(0); s < copy.getNumSubsystems(); ++s) {
        const int count = int(copy.allocateDiscreteVariable(s, Stage::Report, new Value<int>(0)));
        for (int i = 0; i < count; ++i)
            if (copy.getDiscreteVarUpdateIndex(s, DiscreteVariableIndex(i)).isValid()) return true;
    }
    return false;
}

void EventDriver::updateDiscreteVariables(State& state) const {
    m_system.realize(state, Stage::Acceleration);
    state.autoUpdateDiscreteVariables();
}

Real EventDriver::calcNextReportTime(const State& state) {
    Real time = Infinity;
    m_reports.clear();
    m_system.realize(state, Stage::Time);
    m_system.calcTimeOfNextScheduledReport(state, time, m_reports, state.getTime() != m_lastReport);
    return m_reports.empty() ? Infinity : time;
}

Real EventDriver::calcNextEventTime(const State& state) {
    Real time = Infinity;
    m_events.clear();
    m_system.realize(state, Stage::Time);
    m_system.calcTimeOfNextScheduledEvent(state, time, m_events, state.getTime() != m_lastEvent);
    return m_events.empty() ? Infinity : time;
}

void EventDriver::report(const State& state) {
    m_lastReport = state.getTime();
    m_system.reportEvents(state, Event::Cause::Scheduled, m_reports);
}

EventDriver::Outcome EventDriver::handleScheduled(State& state, Real accuracy) {
    m_lastEvent = state.getTime();
    return handle(state, Event::Cause::Scheduled, m_events, accuracy);
}

EventDriver::Outcome EventDriver::handleTimeAdvanced(State& state, Real accuracy) {
    return handle(state, Event::Cause::TimeAdvanced, {}, accuracy);
}

void EventDriver::handleTermination(State& state, Real accuracy) {
    handle(state, Event::Cause::Termination, {}, accuracy);
}

EventDriver::Outcome EventDriver::handle(State& state, Event::Cause cause,
                                         const Array_<EventId>& ids, Real accuracy) const {
    HandleEventsResults results;
    m_system.handleEvents(state, cause, ids, HandleEventsOptions(accuracy), results);
    if (results.getExitStatus() == HandleEventsResults::Failed)
        throw std::runtime_error("an event handler failed at t = " +
                                 std::to_string(state.getTime()) + " s: " + results.getMessage());
    return {results.getExitStatus() == HandleEventsResults::ShouldTerminate,
            results.getAnyChangeMade()};
}

void EventDriver::calcTriggers(const State& state, Vector& values) const {
    m_system.realize(state, m_triggerStage);
    values.resize(int(m_triggers.size()));
    values = 0;
    for (Stage stage = Stage::Time; stage <= m_triggerStage; ++stage) {
        const int count = state.getNEventTriggersByStage(stage);
        if (count == 0) continue;
        const Vector& ofStage = state.getEventTriggersByStage(stage);
        const int start = int(state.getEventTriggerStartByStage(stage));
        for (int k = 0; k < count; ++k) values[start + k] = ofStage[k];
    }
}

bool EventDriver::isTriggered(int trigger, const Vector& before, const Vector& after) const {
    const Event::Trigger transition =
        Event::classifyTransition(sign(before[trigger]), sign(after[trigger]));
    return Event::maskTransition(transition, m_triggers[unsigned(trigger)].calcTransitionMask()) !=
           Event::NoEventTrigger;
}

bool EventDriver::isTriggered(const Vector& before, const Vector& after) const {
    for (int k = 0; k < before.size(); ++k)
        if (isTriggered(k, before, after)) return true;
    return false;
}

EventDriver::Outcome EventDriver::handleTriggered(State& state, const Vector& before,
                                                  const Vector& after, Real accuracy) {
    Array_<EventId> ids;
    for (int k = 0; k < before.size(); ++k)
        if (isTriggered(k, before, after)) ids.push_back(m_triggers[unsigned(k)].getEventId());
    return handle(state, Event::Cause::Triggered, ids, accuracy);
}

void EventDriver::visit(Checkpoint& checkpoint) {
    checkpoint.visit(m_lastReport, m_lastEvent);
}

}  // namespace simflex
