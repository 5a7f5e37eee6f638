#pragma once
/** @file
What an ImplicitIntegrator does besides the steps that its Stepper takes (private header):

    IntegratorSettings.cpp    what may be set when
    IntegratorStart.cpp       equations, a consistent point
    EventLoop.cpp             time goes on: steps, triggers, reports and handlers
    ReturnedEvents.cpp        for programs that handle events themselves
    ShownState.cpp            States, accelerations and multipliers at a time
    IntegratorCheckpoint.cpp  an integration written and read **/

#include <algorithm>
#include <chrono>
#include <cmath>

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

    /** What the last step triggered, in order of the estimated times. **/
    struct TriggeredEvents {
        SimTK::Vec2 window{SimTK::NaN};
        SimTK::Array_<SimTK::EventId> ids;
        SimTK::Array_<SimTK::Real> times;
        SimTK::Array_<SimTK::Event::Trigger> transitions;
    };
    /** @throws std::logic_error unless events were returned and not gone on from. **/
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
    void requireInitialized(const char* method) const;
    /** @throws std::logic_error naming the method where a reporter, a handler, an observer or a
    force of a step that is being taken calls it. **/
    void requireNotRunning(const char* method) const;
    /** @throws std::logic_error naming the setter after initialize(). **/
    void requireNotInitialized(const char* method) const;
    void setFinalTime(SimTK::Real time);
    void setNumThreads(int threads);
    void setMinimumStep(SimTK::Real h);
    void setMaximumStep(SimTK::Real h);
    void setFixedStep(SimTK::Real h);
    void setForceFullNewton(bool force);
    /** Settings that wait for the next initialize(). **/
    struct Waiting {
        SimTK::Real accuracy = 1e-6, constraintTolerance = 1e-10, initialStep = 0;
    };
    void setWaiting(SimTK::Real Waiting::*setting, SimTK::Real value);
    void setNewtonSystemObserver(std::function<void(const NewtonSystem&)> newObserver);

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
    StepSettings settings;
    SimTK::Real finalTime = SimTK::Infinity;
    bool projectInitialState = true;
    ProjectionNorm projectionNorm = ProjectionNorm::Automatic;
    int triggerSamples = 1;
    bool allowInterpolation = true;
    bool returnEveryInternalStep = false;
    int internalStepLimit = 0;  ///< 0: none
    std::function<bool(SimTK::Real)> stepObserver;
    /**@}**/

    IntegratorStatistics statistics;
    IntegratorStatistics statisticsAtReset;
    /** Of one figure, since the reset. **/
    int count(long IntegratorStatistics::*figure) const {
        return int(statistics.*figure - statisticsAtReset.*figure);
    }
    StepsTaken stepsTaken;

private:
    /** Takes over what waited. **/
    void adoptSettings();

    // start
    void setUp(const SimTK::State& state);
    /** Equations and events for this State, as at the beginning. **/
    void prepare(const SimTK::State& state);
    void checkSettings(SimTK::Real startTime) const;
    /** Analyses the system at m_state; again after a handler changed it. **/
    void buildEquations();
    Evaluation& updEquations() { return m_stepper->updEquations(); }
    const Evaluation& getEquations() const { return m_stepper->getEquations(); }
    enum class Occasion {
        Start,  ///< of a run: prescribed speeds have been so before
        Event   ///< the State's speeds are those that the motion had; an impact makes them fit
    };
    /** Takes q, u and z from m_state, assembles joints and makes speeds fit, at a start if asked.
    @param forced  projects by weights also if the constraints hold already **/
    void takeState(Occasion occasion, bool forced = false);
    /** Of those that are prescribed, as they were before the handler. **/
    void takeSpeedsBeforeLocks(std::vector<double>& u) const;
    bool projectsByWeights() const;
    /** Projects m_state as SimTK::Integrator does, at events its positions alone; false if that
    fails, m_state is what it was then. **/
    bool projectStateByWeights(Occasion occasion, bool forced);
    /** Handles the Initialization event. **/
    void initializeSystem();
    /** @throws std::runtime_error if assembly has deformed a body beyond its linear range. **/
    void checkAssembly(const FlexibleBodySubsystem& flexible);
    /** The first step begins at m_visible's t, q, u and z. **/
    void start();

    // driving
    double getNewestTime() const { return m_stepper->getNewest().t; }
    /** One accepted step that does not pass `limit`, with what belongs to its ends. **/
    void advanceInternally(double limit);
    /** Who is told of what happens on the way. **/
    enum class Caller { User, TimeStepper, TimeStepperAtEveryState };
    StepStatus advance(SimTK::Real goal, Caller caller = Caller::User);
    /** End of the next step at the latest. **/
    double calcStepLimit(double eventTime, double reportTime) const;
    SuccessfulStepStatus advanceReturningEvents(SimTK::Real reportTime, SimTK::Real eventTime);
    /** Leaves a triggered event behind that nobody has handled. **/
    void passTrigger();
    void noteTriggeredEvents();
    /** Goes on from the advanced State if that was changed. **/
    void acceptAdvancedState();
    void refreshAdvancedState();
    /** Runs a handler of events on m_state; after an exception all is as before. **/
    void handleAsAWhole(const std::function<void()>& handler);
    /** Goes on after handlers ran; starts again from what they left if they changed something. **/
    void takeOver(const EventDriver::Outcome& outcome);
    /** The same; if it cannot be started from, nothing has changed but m_state. **/
    void startFromHandlersState();
    SimTK::Real calcEnergy(const SimTK::State& state) const;
    /** Goes on with the equations, changed variables and `change`, which says whether to; if that
    fails, nothing has changed but m_state. **/
    void continueAfter(const std::function<bool()>& change);
    /** The same where no more than forces or motions at a time can have changed: the equations
    stay, and order and history where what has changed is too small to be felt. **/
    void continueFromHandlersState();
    /** Whether no more than forces or motions at a time can have changed. **/
    bool keepsEquations(const EventDriver::Outcome& outcome) const;
    /** The same where states z alone have changed: it starts again with these forces.
    @returns false if more has changed **/
    bool continueWithOtherZ();
    /** Equations and States see what a handler has written into this State. **/
    void takeLaterVariables(const SimTK::State& from);
    /** m_kept becomes what m_state is. **/
    void keepState();
    /** Shortens the last step to where a trigger function changes sign, if one does; true if so.
     * **/
    bool locateTrigger();
    void calcTriggersAt(double t, SimTK::Vector& values);
    /** False if bodies, forces or events have come since initialize(). **/
    bool hasSameSystem() const;
    void requireSameSystem() const;
    /** Runs `work` and books its time. **/
    void runTimed(const std::function<void()>& work);

    // output
    /** Makes the point at t visible. **/
    void showPoint(double t);
    /** What is shown has u̇ and λ of its own from now on; costs an evaluation, the first time. **/
    void balanceVisible();
    void writeState(const SolutionPoint& point, SimTK::State& state) const;
    /** m_scratch becomes the State there. **/
    void writeScratch(const SolutionPoint& point);
    /** Swaps auto-update variables' values in, those computed at this point. **/
    void updateDiscreteVariables(const SolutionPoint& point);
    void updateDiscreteVariablesAtStart();

    // checkpoints
    /** What tells this model from others. **/
    void visitModel(Checkpoint& checkpoint) const;
    void visitSettings(Checkpoint& checkpoint) const;
    /** What decides on the steps to come. **/
    void visitProgress(Checkpoint& checkpoint);

    const SimTK::MultibodySystem& m_system;
    SimTK::StageVersion m_topologyVersion = 0;  ///< of m_system, that was initialized
    std::unique_ptr<IntegrationScheme> m_scheme;
    std::unique_ptr<Stepper> m_stepper;  ///< from initialize() on
    EventDriver m_events;

    SimTK::State m_state;
    bool m_stateIsCurrent = false;
    SimTK::State m_scratch;
    SimTK::State m_builtFrom;  ///< m_state as the equations found it
    SimTK::State m_kept;       ///< m_state before a handler
    std::vector<SimTK::DiscreteVarKey> m_laterVariables;
    bool m_isKept = false;  ///< m_kept's discrete variables are m_state's
    StateImage m_image;
    SolutionPoint m_visible;
    bool m_isBalanced = false;  ///< m_visible's u̇ and λ are of its own q, u and loads
    SolutionPoint m_trial;      ///< where triggers are evaluated

    SimTK::Vector m_triggersBefore, m_triggersAfter, m_triggerTrial;
    bool m_hasTriggered = false, m_isTimeAdvancePending = false;
    bool m_isInitialized = false, m_isTerminated = false, m_isFinished = false;
    bool m_isRunning = false;

    Waiting m_waiting;

    // What has been returned of the last step.
    bool m_isIntervalStart = false;  ///< StartOfContinuousInterval is due
    bool m_isFinalTimeReturned = false, m_isOver = false;
    enum class Pending { Nothing, Step, StepLimit, Trigger, HandledTrigger };
    Pending m_pending = Pending::Nothing;
    TriggeredEvents m_triggered;

    /** The end of the last step, once somebody has asked for it, and its versions then. **/
    std::unique_ptr<SimTK::State> m_advanced;
    SimTK::Array_<SimTK::StageVersion> m_advancedVersions;

    bool m_isInterrupted = false;
};

}  // namespace simflex
