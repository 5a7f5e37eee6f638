// Time goes on: steps, event triggers, reporters and handlers in their order.
#include <tuple>

#include "simflex/base/FlushDenormals.h"
#include "simflex/solver/ImplicitIntegratorImpl.h"
#include "simflex/solver/TriggerSearch.h"

namespace simflex {

using SimTK::Real;
using SimTK::Stage;
using SimTK::State;
using SimTK::Vector;
using Clock = std::chrono::steady_clock;

void ImplicitIntegrator::Implementation::calcTriggersAt(double t, Vector& values) {
    calcPoint(t, m_trial);
    if (m_events.hasAutoUpdates()) m_scratch = m_state;
    writeState(m_trial, m_scratch);
    m_events.calcTriggers(m_scratch, values);
}

bool ImplicitIntegrator::Implementation::locateTrigger() {
    calcTriggersAt(m_history[0].t, m_triggerTrial);
    if (!m_events.isTriggered(m_triggersBefore, m_triggerTrial)) {
        m_triggersBefore = m_triggerTrial;
        return false;
    }
    // The root is sought on the step's own polynomial; no step is repeated.
    TriggerSearch search(m_events, m_history[1].t, m_triggersBefore, m_history[0].t, m_triggerTrial,
                         accuracy * m_system.getDefaultTimeScale());
    while (!search.isDone()) {
        const double t = search.calcTrialTime();
        calcTriggersAt(t, m_triggerTrial);
        search.take(t, m_triggerTrial);
    }
    m_triggersBefore = search.getValuesAtLow();
    m_triggersAfter = search.getValuesAtHigh();
    calcPoint(search.getHigh(), m_trial);
    m_history.newest() = m_trial;
    return true;
}

template <class Handler>
void ImplicitIntegrator::Implementation::handleAsAWhole(const Handler& handler) {
    getState();
    const State before = m_state;
    const Real lastEventTime = m_events.getLastEventTime();
    try {
        handler();
    } catch (...) {
        m_events.setLastEventTime(lastEventTime);
        m_state = makeFreshState(m_system, before);
        m_system.realize(m_state, Stage::Velocity);
        m_stateIsCurrent = true;
        throw;
    }
}

void ImplicitIntegrator::Implementation::takeOver(const EventDriver::Outcome& outcome) {
    m_system.realize(m_state, Stage::Velocity);
    if (outcome.hasChangedState) {
        startFromHandlersState();
    } else if (m_hasTriggered) {
        restartAtNewest();
        showPoint(m_history[0].t);
        m_events.calcTriggers(getState(), m_triggersBefore);
    }
    m_isTerminated = outcome.shouldTerminate;
    m_hasTriggered = m_isTimeAdvancePending = false;
}

void ImplicitIntegrator::Implementation::startFromHandlersState() {
    const auto progress = [this] {
        return std::tie(m_history, m_visible, m_trial, m_new, m_formula, m_errorQ, m_errorU,
                        m_errorZ, m_builtFrom, breaks, m_controller, m_nextStep, m_order,
                        m_stepsAtOrder, m_numRedundantAtStart, m_triggersBefore);
    };
    auto kept =
        std::apply([](const auto&... part) { return std::make_tuple(part...); }, progress());
    bookPhases();
    auto equations = std::move(m_equations);
    auto step = std::move(m_step);
    try {
        const double work = m_visible.work;
        buildEquations();  // discrete variables may have changed at any stage
        m_visible.work = work;
        takeState(true);
        start();
    } catch (...) {
        m_equations = std::move(equations);
        m_step = std::move(step);
        progress() = std::move(kept);
        m_scratch = m_builtFrom;
        throw;
    }
}

void ImplicitIntegrator::Implementation::advanceInternally(double limit) {
    if (m_events.hasAutoUpdates() && statistics.stepsTaken > 0)
        updateDiscreteVariables(m_history[0]);
    if (breaks.isAtEnd(m_history[0].t)) passBreak();
    try {
        takeStep(std::min(limit, breaks.getEnd()));
    } catch (...) {
        showPoint(m_history[0].t);
        throw;
    }
    m_isTimeAdvancePending = m_events.hasTimeAdvancedEvents();
    if (m_events.hasTriggers()) m_hasTriggered = locateTrigger();
    if (stepObserver && !stepObserver(m_history[0].t)) m_isInterrupted = true;
}

ImplicitIntegrator::StepStatus ImplicitIntegrator::Implementation::advance(Real goal) {
    while (!m_isTerminated) {
        const auto eventStart = Clock::now();
        const State& state = getState();
        Real reportTime = m_events.calcNextReportTime(state);
        const Real eventTime = m_events.calcNextEventTime(state);
        // Both at once, whatever round-off says: the report first, at the handlers' time.
        if (!isLater(reportTime, eventTime) && !isLater(eventTime, reportTime))
            reportTime = eventTime;
        statistics.simbodySeconds += secondsSince(eventStart);
        const Real target = std::min({goal, reportTime, eventTime});
        const Real limit = std::min(eventTime, finalTime);
        while (isLater(m_history[0].t, target) && !m_hasTriggered && !m_isTimeAdvancePending &&
               !m_isInterrupted)
            advanceInternally(limit);
        // What is shown stays, so that reports and events before the step's end are not missed.
        if (std::exchange(m_isInterrupted, false)) return StepStatus::Interrupted;
        const double newestTime = m_history[0].t;
        const bool isReached = target <= newestTime || !isLater(newestTime, target);
        const double visible = isReached ? target : newestTime;
        const bool isAtNewest = !isLater(visible, newestTime);
        showPoint(visible);

        if (reportTime <= visible) {
            const auto reportStart = Clock::now();
            m_events.report(getState());
            ++statistics.reports;
            statistics.outputSeconds += secondsSince(reportStart);
        }
        const bool isTriggered = m_hasTriggered && isAtNewest;
        const bool isScheduled = !isTriggered && eventTime <= visible;
        const bool isTimeAdvanced =
            !isTriggered && !isScheduled && m_isTimeAdvancePending && isAtNewest;
        if (isTriggered || isScheduled || isTimeAdvanced) {
            const auto handlerStart = Clock::now();
            handleAsAWhole([&] {
                const EventDriver::Outcome outcome =
                    isTriggered   ? m_events.handleTriggered(m_state, m_triggersBefore,
                                                             m_triggersAfter, accuracy)
                    : isScheduled ? m_events.handleScheduled(m_state, accuracy)
                                  : m_events.handleTimeAdvanced(m_state, accuracy);
                ++(isTriggered   ? statistics.triggeredEvents
                   : isScheduled ? statistics.scheduledEvents
                                 : statistics.timeAdvancedEvents);
                statistics.simbodySeconds += secondsSince(handlerStart);
                takeOver(outcome);
            });
            continue;
        }
        if (isReached && target >= goal) break;
    }
    if (m_isTerminated) return StepStatus::Terminated;
    if (getTime() < finalTime) return StepStatus::ReachedTime;
    if (!m_isFinished) {
        handleAsAWhole([&] { m_events.handleTermination(m_state, accuracy); });
        m_isFinished = true;
    }
    return StepStatus::ReachedFinalTime;
}

void ImplicitIntegrator::Implementation::bookPhases() {
    m_step->addInTiming();
    // Asking Simbody happens within evaluations.
    const double simbody = m_equations->takeSimbodySeconds();
    statistics.simbodySeconds += simbody;
    statistics.evaluationSeconds -= simbody;
}

template <class Work>
ImplicitIntegrator::StepStatus ImplicitIntegrator::Implementation::runTimed(Work work) {
    const StandardArithmetic standard;
    const auto start_ = Clock::now();
    m_isRunning = true;
    const auto book = [&] {
        m_isRunning = false;
        bookPhases();
        statistics.totalSeconds += secondsSince(start_);
    };
    try {
        const StepStatus status = work();
        book();
        return status;
    } catch (...) {
        book();
        throw;
    }
}

ImplicitIntegrator::StepStatus ImplicitIntegrator::Implementation::stepTo(Real time) {
    if (!(time >= m_visible.t))
        throw std::invalid_argument(name + "::stepTo(): time " + std::to_string(time) +
                                    " s is before " + std::to_string(m_visible.t) +
                                    " s, which is reached already");
    return runTimed([&] { return advance(std::min(time, finalTime)); });
}

ImplicitIntegrator::StepStatus ImplicitIntegrator::Implementation::stepOnce() {
    return runTimed([&] {
        // What is due at this time comes first.
        const StepStatus status = advance(m_visible.t);
        if (status != StepStatus::ReachedTime) return status;
        if (!isLater(m_visible.t, m_history[0].t))
            advanceInternally(std::min(m_events.calcNextEventTime(getState()), finalTime));
        m_isInterrupted = false;
        return advance(std::min(finalTime, Real(m_history[0].t)));
    });
}

}  // namespace simflex
