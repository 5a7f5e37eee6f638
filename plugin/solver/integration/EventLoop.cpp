// Time loop: steps, event triggers, reporters and handlers in their order.
#include <tuple>

#include "simflex/base/FlushDenormals.h"
#include "simflex/body/StateCopy.h"
#include "simflex/solver/integration/ImplicitIntegratorImpl.h"
#include "simflex/solver/integration/TriggerSearch.h"

namespace simflex {

using SimTK::Real;
using SimTK::Stage;
using SimTK::State;
using SimTK::Vector;
using Clock = std::chrono::steady_clock;

void ImplicitIntegrator::Implementation::writeScratch(const SolutionPoint& point) {
    if (m_events.hasAutoUpdates()) copyState(m_state, m_scratch);
    writeState(point, m_scratch);
}

void ImplicitIntegrator::Implementation::calcTriggersAt(double t, Vector& values) {
    m_stepper->calcPoint(t, m_trial);
    writeScratch(m_trial);
    m_events.calcTriggers(m_scratch, values);
}

bool ImplicitIntegrator::Implementation::locateTrigger() {
    const double start = m_stepper->getLastStart(), end = getNewestTime();
    double low = start, high = start;
    bool isFound = false;
    for (int k = 1; k <= triggerSamples && !isFound; ++k) {
        low = std::exchange(high,
                            k < triggerSamples ? start + k * (end - start) / triggerSamples : end);
        calcTriggersAt(high, m_triggerTrial);
        isFound = m_events.isTriggered(m_triggersBefore, m_triggerTrial);
        if (!isFound) m_triggersBefore = m_triggerTrial;
    }
    if (!isFound) return false;
    // The root is sought on the step's own polynomial; no step is repeated.
    TriggerSearch search(m_events, low, m_triggersBefore, high, m_triggerTrial,
                         settings.accuracy * m_system.getDefaultTimeScale());
    while (!search.isDone()) {
        const double t = search.calcTrialTime();
        calcTriggersAt(t, m_triggerTrial);
        search.take(t, m_triggerTrial);
    }
    m_triggersBefore = search.getValuesAtLow();
    m_triggersAfter = search.getValuesAtHigh();
    m_triggered.window = SimTK::Vec2(search.getLow(), search.getHigh());
    m_stepper->endLastStep(search.getHigh());
    return true;
}

void ImplicitIntegrator::Implementation::keepState() {
    const State& state = getState();
    if (m_isKept && !m_events.hasAutoUpdates()) {
        // A full copy costs more than a step.
        m_kept.setTime(state.getTime());
        m_kept.updY() = state.getY();
        return;
    }
    copyState(state, m_kept);
    m_isKept = true;
}

void ImplicitIntegrator::Implementation::handleAsAWhole(const std::function<void()>& handler) {
    keepState();
    const Real lastEventTime = m_events.getLastEventTime();
    try {
        handler();
    } catch (...) {
        m_events.setLastEventTime(lastEventTime);
        m_state = makeFreshState(m_system, m_kept);
        m_isKept = false;
        m_system.realize(m_state, Stage::Velocity);
        m_stateIsCurrent = true;
        throw;
    }
}

bool ImplicitIntegrator::Implementation::keepsEquations(const EventDriver::Outcome& outcome) const {
    // Values of Motions may have jumped.
    return outcome.lowestChange > Stage::Instance && m_state.getTime() == m_kept.getTime() &&
           !getEquations().getSimbody().getPrescribed() && !m_stepper->hasMemory();
}

void ImplicitIntegrator::Implementation::takeOver(const EventDriver::Outcome& outcome) {
    m_system.realize(m_state, Stage::Velocity);
    if (outcome.hasChangedState && keepsEquations(outcome)) {
        continueFromHandlersState();
        m_isIntervalStart = true;
    } else if (outcome.hasChangedState) {
        m_isKept = false;
        startFromHandlersState();
        m_isIntervalStart = true;
    } else {
        passTrigger();
    }
    m_isTerminated = outcome.shouldTerminate;
    m_hasTriggered = m_isTimeAdvancePending = false;
    m_pending = Pending::Nothing;
}

void ImplicitIntegrator::Implementation::passTrigger() {
    if (!m_hasTriggered) return;
    m_stepper->restart();
    showPoint(m_visible.t);
    m_events.calcTriggers(getState(), m_triggersBefore);
    m_hasTriggered = false;
}

void ImplicitIntegrator::Implementation::takeLaterVariables(const State& from) {
    updEquations().takeVariables(m_laterVariables, from);
    for (State* state : {&m_scratch, &m_builtFrom}) copyVariables(m_laterVariables, from, *state);
}

void ImplicitIntegrator::Implementation::continueAfter(const std::function<bool()>& change) {
    const SolutionPoint newest = m_stepper->getNewest();
    try {
        takeLaterVariables(m_state);
        if (!change()) return;
        showPoint(m_visible.t);
        if (m_events.hasTriggers()) m_events.calcTriggers(getState(), m_triggersBefore);
        copyVariables(m_laterVariables, m_state, m_kept);
    } catch (...) {
        m_stepper->updNewest() = newest;
        takeLaterVariables(m_kept);
        throw;
    }
}

bool ImplicitIntegrator::Implementation::continueWithOtherZ() {
    const Vector &now = m_state.getY(), &before = m_kept.getY();
    const int numOthers = m_state.getNQ() + m_state.getNU();
    for (int i = 0; i < numOthers; ++i)
        if (now[i] != before[i]) return false;
    continueAfter([&] {
        std::copy(&now[0] + numOthers, &now[0] + now.size(), m_stepper->updNewest().z.begin());
        m_stepper->restart();
        return true;
    });
    m_hasTriggered = false;
    m_pending = Pending::Nothing;
    return true;
}

void ImplicitIntegrator::Implementation::continueFromHandlersState() {
    const Vector &now = m_state.getY(), &before = m_kept.getY();
    bool isSame = !isLater(m_visible.t, getNewestTime());
    for (int i = 0; i < now.size(); ++i) isSame = isSame && now[i] == before[i];
    continueAfter([&] {
        const ImplicitStep::Imbalance imbalance =
            isSame ? m_stepper->updStep().calcImbalance(m_stepper->getNewest())
                   : ImplicitStep::Imbalance();
        if (imbalance.positionError > settings.constraintTolerance ||
            imbalance.speedError > ImplicitStep::LargestSpeedError) {
            // Motions have changed, not only forces.
            startFromHandlersState();
            return false;
        }
        // Changes below the accuracy in a step do not justify a restart.
        constexpr double Small = 0.1;
        if (m_hasTriggered || !(imbalance.displacement <= Small * settings.accuracy))
            m_stepper->restart();
        return true;
    });
}

Real ImplicitIntegrator::Implementation::calcEnergy(const State& state) const {
    m_system.realize(state, Stage::Velocity);
    const FlexibleBodySubsystem* flexible = FlexibleBodySubsystem::find(m_system);
    return flexible ? flexible->calcEnergy(state) : m_system.calcEnergy(state);
}

void ImplicitIntegrator::Implementation::startFromHandlersState() {
    auto before = std::make_tuple(m_visible, m_builtFrom, m_triggersBefore);
    m_stepper->bookPhases();
    std::unique_ptr<Stepper> stepper = std::move(m_stepper);
    try {
        const double work = m_visible.work, energy = calcEnergy(m_kept);
        buildEquations();  // discrete variables may have changed at any stage
        takeState(Occasion::Event);
        writeState(m_visible, m_scratch);
        m_visible.work = work + calcEnergy(m_scratch) - energy;
        start();
    } catch (...) {
        m_stepper = std::move(stepper);
        std::tie(m_visible, m_builtFrom, m_triggersBefore) = std::move(before);
        copyState(m_builtFrom, m_scratch);
        throw;
    }
}

void ImplicitIntegrator::Implementation::advanceInternally(double limit) {
    takeAdjustments();
    // An observer that interrupts steps sees the previously visible State.
    if (stepObserver) balanceVisible();
    if (m_events.hasAutoUpdates() && statistics.stepsTaken > 0)
        updateDiscreteVariables(m_stepper->getNewest());
    try {
        m_stepper->takeStep(limit);
    } catch (...) {
        showPoint(getNewestTime());
        throw;
    }
    m_isTimeAdvancePending = m_events.hasTimeAdvancedEvents();
    if (m_events.hasTriggers()) m_hasTriggered = locateTrigger();
    m_pending = m_hasTriggered ? Pending::Trigger : Pending::Step;
    if (const auto observer = stepObserver) {
        const Scope scope(m_activity, Activity::Calling);
        m_isInterrupted = !(*observer)(getNewestTime());
    }
}

double ImplicitIntegrator::Implementation::calcStepLimit(double eventTime,
                                                         double reportTime) const {
    return std::min(
        {eventTime, double(finalTime), allowInterpolation ? double(SimTK::Infinity) : reportTime});
}

ImplicitIntegrator::StepStatus ImplicitIntegrator::Implementation::advance(Real goal,
                                                                           Caller caller) {
    const bool isStepper = caller != Caller::User;
    const bool atEveryState = caller == Caller::TimeStepperAtEveryState;
    const auto reach = [](SuccessfulStepStatus status) {
        return StepStatus(StepStatus::ReachedTime, status);
    };
    if (std::exchange(m_isIntervalStart, false) && atEveryState)
        return reach(StartOfContinuousInterval);
    const bool returnsSteps = returnEveryInternalStep && caller != Caller::TimeStepper;
    const int mostSteps = caller == Caller::TimeStepper ? 0 : internalStepLimit;
    int steps = 0;
    const auto isStepDue = [&] {
        return m_pending == Pending::Step &&
               (returnsSteps || (mostSteps > 0 && steps >= mostSteps));
    };
    while (!m_isTerminated && !(isStepper && m_isFinalTimeReturned)) {
        const auto eventStart = Clock::now();
        const State& state = getState();
        Real reportTime = m_events.calcNextReportTime(state);
        const Real eventTime = m_events.calcNextEventTime(state);
        // Simultaneous within round-off: the report comes first, at the handlers' time.
        if (!isLater(reportTime, eventTime) && !isLater(eventTime, reportTime))
            reportTime = eventTime;
        statistics.simbodySeconds += secondsSince(eventStart);
        Real target = std::min({goal, finalTime, reportTime, eventTime});
        while (isLater(getNewestTime(), target) && !m_hasTriggered && !m_isTimeAdvancePending &&
               !m_isInterrupted && !isStepDue()) {
            advanceInternally(calcStepLimit(eventTime, target));
            ++steps;
            target = std::min(target, finalTime);  // which the observer may have changed
        }
        // The visible State stays, so that reports and events before the step's end are not missed.
        if (std::exchange(m_isInterrupted, false))
            return StepStatus(StepStatus::Interrupted, TimeHasAdvanced);
        const double newestTime = getNewestTime();
        const bool isReached = target <= newestTime || !isLater(newestTime, target);
        const double visible = isReached ? target : newestTime;
        const bool isAtNewest = !isLater(visible, newestTime);
        showPoint(visible);

        if (reportTime <= visible) {
            const auto reportStart = Clock::now();
            const State& shown = getState();
            {
                const Scope scope(m_activity, Activity::Calling);
                m_events.report(shown);
            }
            ++statistics.reports;
            statistics.outputSeconds += secondsSince(reportStart);
        }
        // SimTK::TimeStepper leaves events at this time to its next call, and ends with the report
        // at the final time.
        const bool isGoal = isReached && target >= goal;
        if (isStepper && (isGoal || reportTime <= visible)) {
            if (isAtNewest && m_pending == Pending::Step) m_pending = Pending::Nothing;
            m_isFinalTimeReturned = !(visible < finalTime);
            if (isGoal || atEveryState) return reach(ReachedReportTime);
            if (m_isFinalTimeReturned) break;
        }
        const bool isTriggered = m_hasTriggered && isAtNewest;
        const bool isScheduled = !isTriggered && eventTime <= visible;
        const bool isTimeAdvanced =
            !isTriggered && !isScheduled && m_isTimeAdvancePending && isAtNewest;
        if (isTriggered || isScheduled || isTimeAdvanced) {
            const auto handlerStart = Clock::now();
            handleAsAWhole([&] {
                const EventDriver::Outcome outcome = [&] {
                    const Scope scope(m_activity, Activity::Calling);
                    return isTriggered ? m_events.handleTriggered(m_state, m_triggersBefore,
                                                                  m_triggersAfter,
                                                                  settings.constraintTolerance)
                           : isScheduled
                               ? m_events.handleScheduled(m_state, settings.constraintTolerance)
                               : m_events.handleTimeAdvanced(m_state, settings.constraintTolerance);
                }();
                ++(isTriggered   ? statistics.triggeredEvents
                   : isScheduled ? statistics.scheduledEvents
                                 : statistics.timeAdvancedEvents);
                statistics.simbodySeconds += secondsSince(handlerStart);
                takeOver(outcome);
            });
            if (atEveryState)
                return reach(isTriggered   ? ReachedEventTrigger
                             : isScheduled ? ReachedScheduledEvent
                                           : TimeHasAdvanced);
            continue;
        }
        const bool isStepReturned = isAtNewest && isStepDue();
        if (isAtNewest) m_pending = Pending::Nothing;
        if (isReached && target >= std::min(goal, finalTime)) break;
        if (isStepReturned)
            return StepStatus(StepStatus::Interrupted,
                              returnsSteps ? TimeHasAdvanced : ReachedStepLimit);
    }
    if (m_isTerminated) return StepStatus(StepStatus::Terminated, EndOfSimulation);
    if (getTime() < finalTime) return reach(ReachedReportTime);
    if (!m_isFinished) {
        handleAsAWhole([&] {
            const Scope scope(m_activity, Activity::Calling);
            m_events.handleTermination(m_state, settings.constraintTolerance);
        });
        m_isFinished = true;
    }
    const bool wasReturned = std::exchange(m_isFinalTimeReturned, true);
    return StepStatus(StepStatus::ReachedFinalTime,
                      wasReturned || isStepper ? EndOfSimulation : ReachedReportTime);
}

bool ImplicitIntegrator::Implementation::hasSameSystem() const {
    return m_system.systemTopologyHasBeenRealized() &&
           m_system.getSystemTopologyCacheVersion() == m_topologyVersion;
}

void ImplicitIntegrator::Implementation::requireSameSystem() const {
    if (hasSameSystem()) return;
    throw std::logic_error(
        name +
        ": the system is not the one that was initialized: a body, force, constraint, reporter or "
        "handler was added or changed since. Call realizeTopology() and initialize() with its "
        "State, the coordinates and speeds of getState() copied into it");
}

void ImplicitIntegrator::Implementation::runAlone(const std::function<void()>& work) {
    const StandardArithmetic standard;
    try {
        const Scope scope(m_activity, Activity::Evaluating);
        work();
    } catch (...) {
        takeAdjustments();
        throw;
    }
    takeAdjustments();
}

void ImplicitIntegrator::Implementation::runTimed(const std::function<void()>& work) {
    requireSameSystem();
    m_isInterrupted = false;
    runAlone([&] {
        const auto start_ = Clock::now();
        const auto book = [&] {
            m_stepper->bookPhases();
            refreshAdvancedState();
            statistics.totalSeconds += secondsSince(start_);
        };
        try {
            acceptAdvancedState();
            work();
            book();
        } catch (...) {
            book();
            throw;
        }
    });
}

ImplicitIntegrator::StepStatus ImplicitIntegrator::Implementation::stepTo(Real time) {
    if (!(time >= m_visible.t))
        throw std::invalid_argument(name + "::stepTo(): time " + std::to_string(time) +
                                    " s is before " + std::to_string(m_visible.t) +
                                    " s, which has been reached already");
    StepStatus status;
    runTimed([&] { status = advance(time); });
    return status;
}

ImplicitIntegrator::StepStatus ImplicitIntegrator::Implementation::stepOnce() {
    StepStatus status;
    runTimed([&] {
        // Events due at this time come first.
        status = advance(m_visible.t);
        if (status != StepStatus::ReachedTime) return;
        if (!isLater(m_visible.t, getNewestTime())) {
            const State& state = getState();
            advanceInternally(calcStepLimit(m_events.calcNextEventTime(state),
                                            m_events.calcNextReportTime(state)));
        }
        m_isInterrupted = false;
        status = advance(getNewestTime());
    });
    return status;
}

void ImplicitIntegrator::Implementation::handle(const std::function<bool(State&)>& handler) {
    if (isStateInterpolated())
        throw std::logic_error(name + "::handle() within a step: nothing can be changed there");
    runTimed([&] {
        handleAsAWhole([&] {
            SimTK::Array_<SimTK::StageVersion> versions;
            m_state.getSystemStageVersions(versions);
            EventDriver::Outcome outcome;
            {
                const Scope scope(m_activity, Activity::Calling);
                outcome.shouldTerminate = handler(m_state);
            }
            outcome.lowestChange = m_state.getLowestSystemStageDifference(versions);
            outcome.hasChangedState = true;  // versions show only realized stages
            m_system.realize(m_state, Stage::Velocity);
            if (!keepsEquations(outcome) || !continueWithOtherZ()) takeOver(outcome);
            m_isTerminated = outcome.shouldTerminate;
        });
    });
}

ImplicitIntegrator::SuccessfulStepStatus ImplicitIntegrator::Implementation::stepAsTimeStepper(
    Real time, bool atEverySignificantState) {
    if (isSimulationOver()) return EndOfSimulation;
    if (!(time >= m_visible.t))
        throw std::invalid_argument("TimeStepper::stepTo(): time " + std::to_string(time) +
                                    " s is before " + std::to_string(m_visible.t) +
                                    " s, which has been reached already");
    StepStatus status;
    runTimed([&] {
        status = advance(
            time, atEverySignificantState ? Caller::TimeStepperAtEveryState : Caller::TimeStepper);
    });
    return status;
}

}  // namespace simflex
