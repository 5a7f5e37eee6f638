// Steps that return reports and events to the caller, as SimTK::Integrator does, and States changed
// by the caller.
#include "simflex/body/FlexibleBodySubsystem.h"
#include "simflex/solver/integration/ImplicitIntegratorImpl.h"

namespace simflex {

using SimTK::Real;
using SimTK::Stage;
using SimTK::State;

ImplicitIntegrator::SuccessfulStepStatus ImplicitIntegrator::Implementation::stepTo(
    Real reportTime, Real scheduledEventTime) {
    const auto require = [&](Real time, const char* what) {
        if (SimTK::isNaN(time) || isLater(time, m_visible.t))
            throw std::invalid_argument(name + "::stepTo(): " + what + " " + std::to_string(time) +
                                        " s is before " + std::to_string(m_visible.t) +
                                        " s, which has been reached already");
    };
    require(reportTime, "time of the report");
    require(scheduledEventTime, "time of the scheduled event");
    if (isSimulationOver())
        throw std::logic_error(name +
                               "::stepTo(): the end of the simulation was returned already; "
                               "initialize() starts another");
    SuccessfulStepStatus status = InvalidSuccessfulStepStatus;
    runTimed([&] { status = advanceReturningEvents(reportTime, scheduledEventTime); });
    return status;
}

ImplicitIntegrator::SuccessfulStepStatus ImplicitIntegrator::Implementation::advanceReturningEvents(
    Real reportTime, Real eventTime) {
    if (std::exchange(m_isIntervalStart, false)) {
        showPoint(getNewestTime());
        m_pending = Pending::Nothing;
        return StartOfContinuousInterval;
    }
    for (int steps = 0;; ++steps) {
        const double newestTime = getNewestTime();
        if (m_pending == Pending::Trigger) {
            if (reportTime <= m_triggered.window[0]) {
                showPoint(reportTime);
                return ReachedReportTime;
            }
            noteTriggeredEvents();
            showPoint(m_triggered.window[0]);
            m_pending = Pending::HandledTrigger;
            return ReachedEventTrigger;
        }
        if (m_pending != Pending::Nothing) {
            const bool isAtNewest = !isLater(reportTime, newestTime);
            const bool isEventFirst = eventTime < reportTime && !isLater(newestTime, eventTime);
            if (!isLater(newestTime, reportTime) && !isEventFirst) {
                showPoint(reportTime);
                if (isAtNewest) m_pending = Pending::Nothing;
                return ReachedReportTime;
            }
            const bool hasAdvanced =
                returnEveryInternalStep || m_isTimeAdvancePending || m_isInterrupted;
            const SuccessfulStepStatus reason =
                !isLater(newestTime, eventTime)                       ? ReachedScheduledEvent
                : hasAdvanced                                         ? TimeHasAdvanced
                : !isLater(newestTime, finalTime)                     ? ReachedReportTime
                : internalStepLimit > 0 && steps >= internalStepLimit ? ReachedStepLimit
                                                                      : InvalidSuccessfulStepStatus;
            if (reason != InvalidSuccessfulStepStatus) {
                showPoint(reason == ReachedScheduledEvent ? eventTime : newestTime);
                m_isTimeAdvancePending = false;
                m_pending = Pending::Nothing;
                return reason;
            }
        } else if (!isLater(newestTime, finalTime)) {
            showPoint(newestTime);
            m_isOver = true;
            return EndOfSimulation;
        } else if (!isLater(newestTime, std::min(reportTime, eventTime))) {
            showPoint(std::min(reportTime, eventTime));
            return reportTime <= eventTime ? ReachedReportTime : ReachedScheduledEvent;
        }
        passTrigger();
        advanceInternally(calcStepLimit(eventTime, reportTime));
    }
}

void ImplicitIntegrator::Implementation::noteTriggeredEvents() {
    struct Seen {
        Real time;
        SimTK::EventId id;
        SimTK::Event::Trigger transition;
    };
    const Real low = m_triggered.window[0], width = m_triggered.window[1] - low;
    std::vector<Seen> all;
    for (int k = 0; k < m_events.getNumTriggers(); ++k) {
        if (!m_events.isTriggered(k, m_triggersBefore, m_triggersAfter)) continue;
        const Real before = m_triggersBefore[k], after = m_triggersAfter[k];
        const Real share = after == 0 || before == after ? 1 : before / (before - after);
        all.push_back({share > 0 ? low + share * width : m_triggered.window[1],
                       m_events.getEventId(k),
                       m_events.getTransition(k, m_triggersBefore, m_triggersAfter)});
    }
    std::sort(all.begin(), all.end(), [](const Seen& a, const Seen& b) {
        return a.time < b.time || (a.time == b.time && a.id < b.id);
    });
    m_triggered.ids.clear();
    m_triggered.times.clear();
    m_triggered.transitions.clear();
    for (const Seen& seen : all) {
        m_triggered.ids.push_back(seen.id);
        m_triggered.times.push_back(seen.time);
        m_triggered.transitions.push_back(seen.transition);
    }
}

const ImplicitIntegrator::Implementation::TriggeredEvents&
ImplicitIntegrator::Implementation::getTriggeredEvents(const char* method) const {
    if (m_pending != Pending::HandledTrigger)
        throw std::logic_error(name + "::" + method +
                               "(): no event has triggered; stepTo() says ReachedEventTrigger when "
                               "one has");
    return m_triggered;
}

void ImplicitIntegrator::Implementation::reinitialize(Stage lowestChangedStage,
                                                      bool shouldTerminate) {
    if (lowestChangedStage < Stage::Report) {
        runTimed([&] { showPoint(getNewestTime()); });
        m_isIntervalStart = true;
    }
    m_isTerminated = m_isTerminated || shouldTerminate;
}

ImplicitIntegrator::TerminationReason ImplicitIntegrator::Implementation::getTerminationReason()
    const {
    return m_isTerminated       ? EventHandlerRequestedTermination
           : isSimulationOver() ? IntegratorStatuses::ReachedFinalTime
                                : InvalidTerminationReason;
}

bool ImplicitIntegrator::Implementation::isStateInterpolated() const {
    return isLater(m_visible.t, getNewestTime());
}

const State& ImplicitIntegrator::Implementation::getReturnedState() {
    return m_advanced && !isStateInterpolated() ? *m_advanced : getState();
}

State& ImplicitIntegrator::Implementation::updAdvancedState() {
    if (!m_advanced) {
        m_advanced = std::make_unique<State>();
        refreshAdvancedState();
    } else if (isRunning()) {
        refreshAdvancedState();  // as far as the call in progress has come
    }
    // Simbody's integrators realize it this far; with flexible bodies that is expensive.
    const FlexibleBodySubsystem* flexible = FlexibleBodySubsystem::find(m_system);
    if (!flexible || flexible->getNumBodies() == 0)
        m_system.realize(*m_advanced, Stage::Acceleration);
    return *m_advanced;
}

const State& ImplicitIntegrator::Implementation::showAdvancedState() {
    writeScratch(m_stepper->getNewest());
    return m_scratch;
}

void ImplicitIntegrator::Implementation::refreshAdvancedState() {
    if (!m_advanced) return;
    if (isStateInterpolated()) {
        *m_advanced = makeFreshState(m_system, m_state);
        writeState(m_stepper->getNewest(), *m_advanced);
    } else {
        *m_advanced = makeFreshState(m_system, getState());
        m_system.realize(*m_advanced, Stage::Velocity);
    }
    m_advanced->getSystemStageVersions(m_advancedVersions);
}

void ImplicitIntegrator::Implementation::acceptAdvancedState() {
    if (!m_advanced ||
        m_advanced->getLowestSystemStageDifference(m_advancedVersions) == Stage::Infinity)
        return;
    showPoint(getNewestTime());
    handleAsAWhole([&] {
        m_state = makeFreshState(m_system, *m_advanced);
        m_system.realize(m_state, Stage::Velocity);
        startFromHandlersState();
    });
    if (m_pending != Pending::Nothing) m_pending = Pending::Step;
    refreshAdvancedState();
}

}  // namespace simflex
