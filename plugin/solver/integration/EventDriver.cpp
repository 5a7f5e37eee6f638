#include "simflex/solver/integration/EventDriver.h"

#include <algorithm>
#include <stdexcept>

#include "simflex/base/Checkpoint.h"
#include "simflex/body/FlexibleBodySubsystem.h"
#include "simflex/body/StateCopy.h"
#include "simflex/solver/equations/StateImage.h"

namespace simflex {

using namespace SimTK;

EventDriver::Outcome EventDriver::handleInitialization(State& state, Real accuracy) {
    const Outcome outcome = handle(state, Event::Cause::Initialization, {}, accuracy);
    if (outcome.shouldTerminate)
        throw std::runtime_error("an Initialization event handler asked for termination at t = " +
                                 std::to_string(state.getTime()) + " s");
    return outcome;
}

void EventDriver::initialize(const State& state) {
    m_lastReport = m_lastEvent = m_reportTime = NaN;
    m_system.realize(state, Stage::Instance);
    m_system.calcEventTriggerInfo(state, m_triggers);
    m_triggerStage = Stage::Time;
    for (Stage stage = Stage::Time; stage <= Stage::Acceleration; ++stage)
        if (state.getNEventTriggersByStage(stage) > 0) m_triggerStage = stage;
    m_autoUpdates = listAutoUpdates(state);
    const FlexibleBodySubsystem* flexible = FlexibleBodySubsystem::find(m_system);
    const bool isRigid = !flexible || flexible->getNumBodies() == 0;
    m_handlerStage = isRigid ? Stage::Acceleration : Stage::Velocity;
}

void EventDriver::updateDiscreteVariables(State& state) const {
    m_system.realize(state, Stage::Acceleration);
    state.autoUpdateDiscreteVariables();
}

void EventDriver::findNextReport(const State& state) {
    m_reportTime = Infinity;
    m_reports.clear();
    m_system.realize(state, Stage::Time);
    m_system.calcTimeOfNextScheduledReport(state, m_reportTime, m_reports,
                                           state.getTime() != m_lastReport);
    if (m_reports.empty()) m_reportTime = Infinity;
}

Real EventDriver::calcNextReportTime(const State& state) {
    findNextReport(state);
    if (m_reportTime <= m_lastReport) {
        // This report was already made, at the time of a handler that was earlier by round-off.
        State later = copyState(state);
        later.setTime(m_lastReport);
        findNextReport(later);
    }
    return m_reportTime;
}

Real EventDriver::calcNextEventTime(const State& state) {
    Real time = Infinity;
    m_events.clear();
    m_system.realize(state, Stage::Time);
    m_system.calcTimeOfNextScheduledEvent(state, time, m_events, state.getTime() != m_lastEvent);
    return m_events.empty() ? Infinity : time;
}

void EventDriver::report(const State& state) {
    m_lastReport = std::max(state.getTime(), m_reportTime);
    m_system.reportEvents(state, Event::Cause::Scheduled, m_reports);
}

EventDriver::Outcome EventDriver::handleScheduled(State& state, Real accuracy) {
    m_lastEvent = state.getTime();
    m_system.realize(state, m_handlerStage);
    return handle(state, Event::Cause::Scheduled, m_events, accuracy);
}

EventDriver::Outcome EventDriver::handleTimeAdvanced(State& state, Real accuracy) {
    m_system.realize(state, m_handlerStage);
    return handle(state, Event::Cause::TimeAdvanced, {}, accuracy);
}

void EventDriver::handleTermination(State& state, Real accuracy) {
    m_system.realize(state, m_handlerStage);
    handle(state, Event::Cause::Termination, {}, accuracy);
}

EventDriver::Outcome EventDriver::handle(State& state, Event::Cause cause,
                                         const Array_<EventId>& ids, Real accuracy) const {
    HandleEventsResults results;
    Array_<StageVersion> versions;
    state.getSystemStageVersions(versions);
    m_system.handleEvents(state, cause, ids, HandleEventsOptions(accuracy), results);
    if (results.getExitStatus() == HandleEventsResults::Failed)
        throw std::runtime_error("an event handler failed at t = " +
                                 std::to_string(state.getTime()) + " s: " + results.getMessage());
    // Some subsystems with events of their own, such as cables, do not report their changes. Stage
    // versions show those of variables that belong to realized stages.
    const Stage said = results.getLowestModifiedStage(),
                found = state.getLowestSystemStageDifference(versions);
    const Stage lowest = said < found ? said : found;
    const bool hasChanged = results.getAnyChangeMade() || !ids.empty() || lowest < Stage::Report;
    return {results.getExitStatus() == HandleEventsResults::ShouldTerminate, hasChanged, lowest};
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

Event::Trigger EventDriver::getTransition(int trigger, const Vector& before,
                                          const Vector& after) const {
    const Event::Trigger transition =
        Event::classifyTransition(sign(before[trigger]), sign(after[trigger]));
    return Event::maskTransition(transition, m_triggers[unsigned(trigger)].calcTransitionMask());
}

bool EventDriver::isTriggered(int trigger, const Vector& before, const Vector& after) const {
    return getTransition(trigger, before, after) != Event::NoEventTrigger;
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
    m_system.realize(state, std::max(m_handlerStage, m_triggerStage));
    return handle(state, Event::Cause::Triggered, ids, accuracy);
}

void EventDriver::visit(Checkpoint& checkpoint) {
    checkpoint.visit(m_lastReport, m_lastEvent);
}

}  // namespace simflex
