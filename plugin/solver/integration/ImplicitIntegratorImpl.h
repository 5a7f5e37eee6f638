#pragma once
/** @file
Everything in an ImplicitIntegrator except the steps, which its Stepper takes (private header):

    IntegratorSettings.cpp    settings
    IntegratorStart.cpp       equations, consistent initial point
    EventLoop.cpp             time loop: steps, triggers, reports and handlers
    ReturnedEvents.cpp        events returned to the caller
    ShownState.cpp            States, accelerations and multipliers at a time
    IntegratorCheckpoint.cpp  writing and reading checkpoints **/

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <utility>

#include "simflex/base/SecondsSince.h"
#include "simflex/solver/ImplicitIntegrator.h"
#include "simflex/solver/equations/StateImage.h"
#include "simflex/solver/integration/EventDriver.h"
#include "simflex/solver/integration/Stepper.h"

namespace simflex {

class ImplicitIntegrator::Implementation {
public:
    /** @param integratorName  for messages **/
    Implementation(std::string integratorName, const SimTK::System& system,
                   std::unique_ptr<IntegrationScheme> integrationScheme);

    void initialize(const SimTK::State& state);
    void initialize(const SimTK::Array_<SimTK::State>& history, int order);
    StepStatus stepTo(SimTK::Real time);
    StepStatus stepOnce();
    SuccessfulStepStatus stepTo(SimTK::Real reportTime, SimTK::Real scheduledEventTime);
    /** For simflex::TimeStepper. **/
    SuccessfulStepStatus stepAsTimeStepper(SimTK::Real time, bool atEverySignificantState);
    void reinitialize(SimTK::Stage lowestChangedStage, bool shouldTerminate);
    void handle(const std::function<bool(SimTK::State&)>& handler);

    /** Events triggered in the last step, in order of their estimated times. **/
    struct TriggeredEvents {
        SimTK::Vec2 window{SimTK::NaN};
        SimTK::Array_<SimTK::EventId> ids;
        SimTK::Array_<SimTK::Real> times;
        SimTK::Array_<SimTK::Event::Trigger> transitions;
    };
    /** @throws std::logic_error unless events were returned and the integration has not
    continued. **/
    const TriggeredEvents& getTriggeredEvents(const char* method) const;

    bool isSimulationOver() const { return m_isTerminated || m_isFinished || m_isOver; }
    TerminationReason getTerminationReason() const;
    bool isStateInterpolated() const;
    const SimTK::State& getReturnedState();
    SimTK::State& updAdvancedState();
    const SimTK::State& showAdvancedState();
    SimTK::Real getPredictedNextStepSize() const {
        return m_stepper ? m_stepper->getNextLength() : 0;
    }
    bool isOf(const SimTK::System& system) const { return m_system.isSameSystem(system); }
    const IntegrationScheme& getScheme() const { return *m_scheme; }

    void writeCheckpoint(std::ostream& stream);
    void readCheckpoint(std::istream& stream, const SimTK::State& start);

    const SimTK::State& getState();
    SimTK::Vector calcUDot();
    std::vector<std::string> describeRedundancies() const {
        return m_stepper->getStep().describeRedundancies();
    }
    SimTK::Vector calcMultipliers(const Joint* joint);
    SimTK::Vector calcMultipliers(const SimTK::Constraint& constraint);
    SimTK::Vector calcFrictionForces(const Joint& joint);

    /** @name Which calls are allowed
    @throws std::logic_error naming the method **/
    /**@{**/
    void requireInitialized(const char* method) const;
    /** For methods that change or restart the integration: not if called by user code that runs
    within one of them (a reporter, handler, observer, force). **/
    void requireNotRunning(const char* method) const;
    /** Both. **/
    void requireReady(const char* method) const;
    /** For methods that would disturb an evaluation in progress: not if called from one, by a force
    or constraint, say. **/
    void requireNotEvaluating(const char* method) const;
    /** The same for methods that show the solution. **/
    void requireSolution(const char* method) const;
    /** For setters: not after initialize(). **/
    void requireNotInitialized(const char* method) const;
    /**@}**/

    /** Changes settings for the next initialize(). **/
    void set(const std::function<void(StepSettings&)>& change);
    /** Changes settings for the next step. **/
    void adjust(const std::function<void(AdjustableSettings&)>& change);
    void setFinalTime(SimTK::Real time);
    void setMinimumStep(SimTK::Real h);
    void setMaximumStep(SimTK::Real h);
    void setFixedStep(SimTK::Real h);

    /** The scheme, of the type it was constructed with. **/
    template <class Scheme>
    Scheme& updScheme() {
        return static_cast<Scheme&>(*m_scheme);
    }

    SimTK::Real getTime() const { return m_visible.t; }
    SimTK::Real getWork() const { return m_visible.work; }
    std::string getErrorSource() const;
    SimTK::Real getConstraintError() const { return m_visible.constraintError; }

    const std::string name;

    /** @name Settings **/
    /**@{**/
    StepSettings settings;  ///< in use; to change them: set(), adjust()
    SimTK::Real finalTime = SimTK::Infinity;
    bool projectInitialState = true;
    ProjectionNorm projectionNorm = ProjectionNorm::Automatic;
    int triggerSamples = 1;
    bool allowInterpolation = true;
    bool returnEveryInternalStep = false;
    int internalStepLimit = 0;  ///< 0: none
    /** Shared with the call in progress, which may replace it. **/
    std::shared_ptr<const std::function<bool(SimTK::Real)>> stepObserver;
    /**@}**/

    IntegratorStatistics statistics;
    IntegratorStatistics statisticsAtReset;
    /** Change of a figure since the reset. **/
    int count(long IntegratorStatistics::*figure) const {
        return int(statistics.*figure - statisticsAtReset.*figure);
    }
    StepsTaken stepsTaken;

private:
    /** What the current call of the integrator is doing. **/
    enum class Activity {
        None,        ///< there is none
        Evaluating,  ///< stepping or starting: the equations and States are in use
        Calling      ///< calling a reporter, handler or step observer
    };
    class Scope {
    public:
        Scope(Activity& activity, Activity now)
            : m_activity(activity), m_before(std::exchange(activity, now)) {}
        ~Scope() { m_activity = m_before; }
        Scope(const Scope&) = delete;
        Scope& operator=(const Scope&) = delete;

    private:
        Activity& m_activity;
        const Activity m_before;
    };
    bool isRunning() const { return m_activity != Activity::None; }
    /** Whether settings and the integration exist that a change could disturb. **/
    bool hasBegun() const { return m_isInitialized || isRunning(); }
    /** Runs the work of a public method, which is not called within another. **/
    void runAlone(const std::function<void()>& work);
    /** An end that was reached is none before another final time. **/
    void noteFinalTime();
    /** Puts what adjust() has changed to use. **/
    void takeAdjustments();

    // start
    /** Runs `work`, which makes an integration ready to step. **/
    void runStart(const std::function<void()>& work);
    /** @throws std::invalid_argument if no steps of this order can begin with it. **/
    void checkHistory(const SimTK::Array_<SimTK::State>& history, int order) const;
    void setUp(const SimTK::State& state);
    /** Builds equations and events for this State, as at the beginning. **/
    void prepare(const SimTK::State& state);
    void checkSettings(SimTK::Real startTime) const;
    /** Analyses the system at m_state; again after a handler has changed it. **/
    void buildEquations();
    Evaluation& updEquations() { return m_stepper->updEquations(); }
    const Evaluation& getEquations() const { return m_stepper->getEquations(); }
    enum class Occasion {
        Start,  ///< of a run: speeds were prescribed before, too
        Event   ///< the State has the speeds before an impact, which makes them consistent
    };
    /** Takes q, u and z from m_state, assembles joints and makes speeds consistent; at a start,
    only if enabled.
    @param forced  projects by weights even if the constraints are satisfied **/
    void takeState(Occasion occasion, bool forced = false);
    /** Copies t, q, u and z. **/
    void takePoint(const SimTK::State& state, SolutionPoint& point) const;
    static void takeZ(const SimTK::State& state, SolutionPoint& point);
    /** Sets prescribed speeds to their values before the handler. **/
    void takeSpeedsBeforeLocks(std::vector<double>& u) const;
    bool projectsByWeights() const;
    /** Projects m_state as SimTK::Integrator does, positions only at events. Returns false on
    failure, with m_state unchanged. **/
    bool projectStateByWeights(Occasion occasion, bool forced);
    /** Handles the Initialization event at m_visible's State; the equations follow.
    @returns whether handlers have reported a change **/
    bool initializeSystem();
    /** @throws std::runtime_error if assembly has deformed a body beyond its linear range. **/
    void checkAssembly(const FlexibleBodySubsystem& flexible);
    /** Begins the first step at m_visible's t, q, u and z. **/
    void start();
    /** Follows the Stepper's start at m_visible. **/
    void noteStart();

    // driving
    double getNewestTime() const { return m_stepper->getNewest().t; }
    /** Takes one accepted step that does not pass `limit`, and does what is due at its ends. **/
    void advanceInternally(double limit);
    /** Recipient of returns on the way. **/
    enum class Caller { User, TimeStepper, TimeStepperAtEveryState };
    StepStatus advance(SimTK::Real goal, Caller caller = Caller::User);
    /** Latest permitted end of the next step. **/
    double calcStepLimit(double eventTime, double reportTime) const;
    SuccessfulStepStatus advanceReturningEvents(SimTK::Real reportTime, SimTK::Real eventTime);
    /** Continues past a triggered event that was not handled. **/
    void passTrigger();
    void noteTriggeredEvents();
    /** Continues from the advanced State if it was changed. **/
    void acceptAdvancedState();
    void refreshAdvancedState();
    /** Runs an event handler on m_state; an exception leaves everything unchanged. **/
    void handleAsAWhole(const std::function<void()>& handler);
    /** Continues after handlers; restarts from their State if they changed anything. **/
    void takeOver(const EventDriver::Outcome& outcome);
    /** Restarts from the handlers' State; on failure only m_state has changed. **/
    void startFromHandlersState();
    SimTK::Real calcEnergy(const SimTK::State& state) const;
    /** Continues with the same equations, changed variables and `change`, which returns whether to
    do so; on failure only m_state has changed. **/
    void continueAfter(const std::function<bool()>& change);
    /** Continues where only forces or motions at a time can have changed: keeps the equations, and
    order and history if the change is too small to matter. **/
    void continueFromHandlersState();
    /** Whether only forces or motions at a time can have changed. **/
    bool keepsEquations(const EventDriver::Outcome& outcome) const;
    /** Restarts where only states z have changed, with the new forces.
    @returns false if more has changed **/
    bool continueWithOtherZ();
    /** Passes variables written by a handler to the equations and States. **/
    void takeLaterVariables(const SimTK::State& from);
    /** Copies m_state to m_kept. **/
    void keepState();
    /** Shortens the last step to the first sign change of a trigger function; false if there is
    none. **/
    bool locateTrigger();
    void calcTriggersAt(double t, SimTK::Vector& values);
    /** False if bodies, forces or events were added after initialize(). **/
    bool hasSameSystem() const;
    void requireSameSystem() const;
    /** Runs `work` and adds its wall time to the statistics. **/
    void runTimed(const std::function<void()>& work);

    // output
    /** Makes the point at t visible. **/
    void showPoint(double t);
    /** Gives the visible point its own u̇ and λ; costs an evaluation the first time. **/
    void balanceVisible();
    void writeState(const SolutionPoint& point, SimTK::State& state) const;
    /** Writes the State of a point to m_scratch. **/
    void writeScratch(const SolutionPoint& point);
    /** Swaps in the auto-update variables' values computed at this point. **/
    void updateDiscreteVariables(const SolutionPoint& point);
    void updateDiscreteVariablesAtStart();

    // checkpoints
    /** Identifies the model. **/
    void visitModel(Checkpoint& checkpoint) const;
    /** Whether `ours` are the settings of the run. **/
    void visitSettings(Checkpoint& checkpoint, const StepSettings& ours) const;
    /** Everything that determines later steps. **/
    void visitProgress(Checkpoint& checkpoint);

    const SimTK::MultibodySystem& m_system;
    SimTK::StageVersion m_topologyVersion = 0;  ///< of m_system at initialize()
    std::unique_ptr<IntegrationScheme> m_scheme;
    std::unique_ptr<Stepper> m_stepper;  ///< from initialize() on
    EventDriver m_events;

    SimTK::State m_state;
    bool m_stateIsCurrent = false;
    SimTK::State m_scratch;
    SimTK::State m_builtFrom;  ///< m_state when the equations were built
    SimTK::State m_kept;       ///< m_state before a handler
    std::vector<SimTK::DiscreteVarKey> m_laterVariables;
    bool m_isKept = false;  ///< m_kept has m_state's discrete variables
    StateImage m_image;
    SolutionPoint m_visible;
    bool m_isBalanced = false;  ///< m_visible's u̇ and λ are those of its own q, u and loads
    SolutionPoint m_trial;      ///< for evaluating triggers

    SimTK::Vector m_triggersBefore, m_triggersAfter, m_triggerTrial;
    bool m_hasTriggered = false, m_isTimeAdvancePending = false;
    bool m_isInitialized = false, m_isTerminated = false, m_isFinished = false;
    Activity m_activity = Activity::None;

    StepSettings m_waiting;      ///< the user's: taken by the next initialize()
    bool m_areAdjusted = false;  ///< the next step takes its AdjustableSettings

    // Returns pending for the last step.
    bool m_isIntervalStart = false;  ///< StartOfContinuousInterval is due
    bool m_isFinalTimeReturned = false, m_isOver = false;
    enum class Pending { Nothing, Step, Trigger, HandledTrigger };
    Pending m_pending = Pending::Nothing;
    TriggeredEvents m_triggered;

    /** The end of the last step, once requested, and its versions at that time. **/
    std::unique_ptr<SimTK::State> m_advanced;
    SimTK::Array_<SimTK::StageVersion> m_advancedVersions;

    bool m_isInterrupted = false;  ///< by the step observer in this call
};

}  // namespace simflex
