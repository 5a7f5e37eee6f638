#pragma once
/** @file
The state of an ImplicitIntegrator, and what it does (private header):

    IntegratorSettings.cpp    what may be set when
    IntegratorStart.cpp       equations, a consistent point, the first step's length
    StepTaking.cpp            a step: tries, their error, order and length of the next one
    UnseenError.cpp           what loads and motions do inside of a step
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
#include "simflex/solver/integration/BdfScheme.h"
#include "simflex/solver/integration/BreakTimes.h"
#include "simflex/solver/integration/EventDriver.h"
#include "simflex/solver/integration/ImplicitStep.h"
#include "simflex/solver/integration/IntegrationScheme.h"
#include "simflex/solver/integration/RadauStep.h"
#include "simflex/solver/integration/StepController.h"

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
    const SimTK::State& getReturnedState() const;
    const SimTK::State& getAdvancedState() const;
    SimTK::State& updAdvancedState();
    SimTK::Real getPredictedNextStepSize() const { return m_nextStep; }
    bool isOf(const SimTK::System& system) const { return m_system.isSameSystem(system); }
    const IntegrationScheme& getScheme() const { return *m_scheme; }

    void writeCheckpoint(std::ostream& stream);
    void readCheckpoint(std::istream& stream, const SimTK::State& start);

    const SimTK::State& getState() const;
    SimTK::Vector calcUDot() const;
    std::vector<std::string> describeRedundancies() const { return m_step->describeRedundancies(); }
    SimTK::Vector calcMultipliers(const Joint* joint) const;
    SimTK::Vector calcMultipliers(const SimTK::Constraint& constraint) const;
    SimTK::Vector calcFrictionForces(const Joint& joint) const;
    void requireInitialized(const char* method) const;
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
    SimTK::Real accuracy = Waiting().accuracy, constraintTolerance = Waiting().constraintTolerance;
    SimTK::Real initialStep = 0, maximumStep = 0, minimumStep = 1e-12, fixedStep = 0;
    SimTK::Real finalTime = SimTK::Infinity;
    int numThreads = 0;
    bool projectInitialState = true;
    ProjectionNorm projectionNorm = ProjectionNorm::Automatic;
    int triggerSamples = 1;
    bool useInfinityNorm = false, forceFullNewton = false;
    bool allowInterpolation = true, projectInterpolatedStates = true;
    bool returnEveryInternalStep = false;
    int internalStepLimit = 0;  ///< 0: none
    Formulation formulation = Formulation::StabilizedIndex2;
    BlockForm blockForm = BlockForm::Automatic;
    NewtonTolerances newtonTolerances;
    AccuracyNorm accuracyNorm = AccuracyNorm::Automatic;
    bool hasOwnConstraintTolerance = false, hasOwnNewtonTolerances = false;
    std::function<void(const NewtonSystem&)> observer;
    std::function<bool(SimTK::Real)> stepObserver;
    std::vector<ForceSelection> differentiated;
    BreakTimes breaks;
    /**@}**/

    IntegratorStatistics statistics;
    IntegratorStatistics statisticsAtReset;
    /** Of one figure, since the reset. **/
    int count(long IntegratorStatistics::*figure) const {
        return int(statistics.*figure - statisticsAtReset.*figure);
    }
    SimTK::Real firstStep = SimTK::NaN, lastStep = 0;
    int lastOrder = 0;

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
    /** What nobody has set and depends on what the equations are like. **/
    void chooseSettings();
    /** Takes q, u and z from m_state and assembles if asked.
    @param forced  also if the constraints hold already **/
    void takeState(bool project, bool forced = false);
    bool projectsByWeights() const;
    /** Projects m_state as SimTK::Integrator does; false if that fails, m_state is what it was
     * then.
     * **/
    bool projectStateByWeights(bool forced);
    /** Handles the Initialization event. **/
    void initializeSystem();
    /** Starts a new history at m_visible's t, q, u and z, from exact accelerations. **/
    void start();
    /** Starts again at the newest point, which is smooth with what was before. **/
    void restartAtNewest();
    /** Derivatives, multipliers, power and error of a point from its t, q, u and z. **/
    void completeStart(SolutionPoint& point);
    /** @param longest  allowed **/
    SimTK::Real chooseInitialStep(const SolutionPoint& point, SimTK::Real longest);
    /** Lets the equations evaluate functions of time between the breaks about this one only. **/
    void enterSmoothSpan(double time);

    // steps
    /** One accepted step that does not pass `limit`, with what belongs to its ends. **/
    void advanceInternally(double limit);
    /** Goes on beyond a break at the newest point: starts again there if something jumps. **/
    void passBreak();
    void takeStep(double limit);
    bool attemptStep(double h, int order, double* error);
    /** λ at the point's time, where a Newton iteration begins. **/
    void predictLambda(int points, SolutionPoint& point);
    /** The same of a method with stages. **/
    bool attemptStages(double h, double* error);
    /** True if a step's end has to be evaluated: positions projected, power, loads or the pose
    looked at. **/
    bool isEndAskedFor() const;
    /** Brings m_new's positions onto the joints. @returns false if it cannot. **/
    bool projectNew();
    void acceptStep(double h, int order);
    void chooseNextStep(double error, double h, int order);
    /** Size of m_errorQ, m_errorU and m_errorZ in units of the accuracy. **/
    double calcErrorSize(double h);
    double calcError(int order);
    double calcFirstError();
    /** The same of what loads and motions do inside of the step that the ends of it and of those
    before do not show: their distance from the polynomial of the step's order, at points between.
    A load that begins and ends within a step would be passed over without a trace. **/
    double calcUnseenError(int order);
    double calcUnseenLoads(int order);
    double calcUnseenMotions(int order);
    /** q and u of the polynomial that the step's end lies on. **/
    void interpolateNew(int order, double t, SolutionPoint& point);
    enum class Failure { ErrorTest, Convergence, Projection };
    /** @param error  of the last try, in units of the accuracy **/
    [[noreturn]] void failStep(double h, Failure failure, double error);

    // driving
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
    /** The same where no more than forces or motions at a time can have changed: the equations
    stay, and order and history where what has changed is too small to be felt. **/
    void continueFromHandlersState();
    /** Equations and States see what a handler has written into this State. **/
    void takeLaterVariables(const SimTK::State& from);
    /** m_kept becomes what m_state is. **/
    void keepState();
    /** Shortens the last step to where a trigger function changes sign, if one does; true if so.
     * **/
    bool locateTrigger();
    /** The last step ends here, inside of what it was. **/
    void cutLastStep(double end);
    void calcTriggersAt(double t, SimTK::Vector& values);
    /** Moves phase times from the solver and the equations into the statistics. **/
    void bookPhases();
    /** False if bodies, forces or events have come since initialize(). **/
    bool hasSameSystem() const;
    void requireSameSystem() const;
    /** Runs `work` and books its time. **/
    void runTimed(const std::function<void()>& work);

    // output
    /** The point at t: interpolated inside the last step, projected onto the joints. **/
    void calcPoint(double t, SolutionPoint& point);
    /** Makes it visible. **/
    void showPoint(double t);
    void writeState(const SolutionPoint& point, SimTK::State& state) const;
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
    OneStageScheme* m_formulas;  ///< the same, if its steps have one stage
    /** Else of steps near singular positions: see ImplicitStep::solveNearSingularity(). **/
    BdfScheme m_fallback;
    OneStageScheme& updFormulas() { return m_formulas ? *m_formulas : m_fallback; }
    /** True if the step being attempted, or taken last, has stages. **/
    bool solvesStages() const { return !m_formulas && !m_solvesPositions; }
    std::unique_ptr<Evaluation> m_equations;
    std::unique_ptr<ImplicitStep> m_step;
    /** m_step of a method with stages. **/
    RadauStep& updStages() { return static_cast<RadauStep&>(*m_step); }
    EventDriver m_events;
    SolutionHistory m_history;
    StepController m_controller;

    SimTK::State m_state;
    mutable bool m_stateIsCurrent = false;
    SimTK::State m_scratch;
    SimTK::State m_builtFrom;  ///< m_state as the equations found it
    SimTK::State m_kept;       ///< m_state before a handler
    std::vector<SimTK::DiscreteVarKey> m_laterVariables;
    bool m_remembers = false;  ///< forces or Measures have variables that steps update
    bool m_isKept = false;     ///< m_kept's discrete variables are m_state's
    StateImage m_image;
    SolutionPoint m_visible;
    SolutionPoint m_trial;  ///< where triggers are evaluated

    double m_longestStep = 0;  ///< allowed
    double m_nextStep = 0;
    /** For which errors of speeds act, of methods with stages: no less than the steps before, as
    after a short one, where something jumps, long ones follow. **/
    double m_speedTime = 0;
    int m_order = 1, m_stepsAtOrder = 0;
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
    mutable std::unique_ptr<SimTK::State> m_advanced;
    mutable SimTK::Array_<SimTK::StageVersion> m_advancedVersions;

    // The step being attempted.
    StepFormula m_formula;
    SolutionPoint m_new;
    bool m_solvesPositions = false;  ///< position equations in Newton's iteration, speeds projected
    int m_worstProjectedRow = -1;
    int m_numRedundantAtStart = 0;
    ImplicitStep::Outcome m_outcome;
    std::vector<double> m_errorQ, m_errorU, m_errorZ;
    int m_worstErrorBlock = -1;

    /** Loads and motions at points inside of a step. **/
    struct Samples {
        static constexpr int Count = 4;
        std::vector<double> loads[Count], atNodes[6], unseen;
        std::vector<double> q, u;

        void resize(int numQ, int numU, int numMultipliers);
    };
    Samples m_samples;
    bool m_isInterrupted = false;
};

}  // namespace simflex
