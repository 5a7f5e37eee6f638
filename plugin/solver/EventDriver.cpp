#include "simflex/solver/EventDriver.h"

#include <stdexcept>

namespace simflex {

using namespace SimTK;

void EventDriver::initialize(const State& state) {
    m_lastReport = m_lastEvent = NaN;
    m_system.realize(state, Stage::Instance);
    m_system.calcEventTriggerInfo(state, m_triggers);
    m_triggerStage = Stage::Time;
    for (Stage stage = Stage::Time; stage <= Stage::Acceleration; ++stage) {
        if (state.getNEventTriggersByStage(stage) == 0) continue;
        if (stage > Stage::Dynamics)
            throw std::invalid_argument(
                "BdfIntegrator: an event trigger needs Stage::Acceleration, which is not "
                "supported; let it depend on positions, speeds or forces");
        m_triggerStage = stage;
    }
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

Vector EventDriver::calcTriggers(const State& state) const {
    m_system.realize(state, m_triggerStage);
    Vector values(int(m_triggers.size()), Real(0));
    for (Stage stage = Stage::Time; stage <= m_triggerStage; ++stage) {
        const int count = state.getNEventTriggersByStage(stage);
        if (count == 0) continue;
        const Vector& ofStage = state.getEventTriggersByStage(stage);
        const int start = int(state.getEventTriggerStartByStage(stage));
        for (int k = 0; k < count; ++k) values[start + k] = ofStage[k];
    }
    return values;
}

Event::Trigger EventDriver::transitionOf(int trigger, const Vector& before,
                                         const Vector& after) const {
    return Event::maskTransition(
        Event::classifyTransition(sign(before[trigger]), sign(after[trigger])),
        m_triggers[unsigned(trigger)].calcTransitionMask());
}

bool EventDriver::isTriggered(const Vector& before, const Vector& after) const {
    for (int k = 0; k < before.size(); ++k)
        if (transitionOf(k, before, after) != Event::NoEventTrigger) return true;
    return false;
}

EventDriver::Outcome EventDriver::handleTriggered(State& state, const Vector& before,
                                                  const Vector& after, Real accuracy) {
    Array_<EventId> ids;
    for (int k = 0; k < before.size(); ++k)
        if (transitionOf(k, before, after) != Event::NoEventTrigger)
            ids.push_back(m_triggers[unsigned(k)].getEventId());
    return handle(state, Event::Cause::Triggered, ids, accuracy);
}

}  // namespace simflex
