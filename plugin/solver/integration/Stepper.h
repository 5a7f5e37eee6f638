#pragma once
/** @file
Steps of an integration (private header): tries, their error, order and length of the next one,
and the polynomial that the solution follows inside of the last. It knows nothing of events,
reports, or who looks on; ImplicitIntegrator::Implementation drives it.

    Stepper.cpp          from a consistent point to what is seen between steps
    StepTaking.cpp       a step
    FrictionSwitch.cpp   where it ends as a joint begins to stick or to slide
    UnseenError.cpp      what loads and motions do inside of it **/

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "simflex/solver/ImplicitIntegrator.h"
#include "simflex/solver/integration/BdfScheme.h"
#include "simflex/solver/integration/BreakTimes.h"
#include "simflex/solver/integration/ImplicitStep.h"
#include "simflex/solver/integration/IntegrationScheme.h"
#include "simflex/solver/integration/PointBalance.h"
#include "simflex/solver/integration/RadauStep.h"
#include "simflex/solver/integration/StepController.h"

namespace simflex {

/** What is asked of steps. **/
struct StepSettings {
    SimTK::Real accuracy = 1e-6, constraintTolerance = 1e-10;
    SimTK::Real initialStep = 0, maximumStep = 0, minimumStep = 1e-12, fixedStep = 0;
    int numThreads = 0;
    bool useInfinityNorm = false, forceFullNewton = false;
    bool projectInterpolatedStates = true;
    ImplicitIntegrator::Formulation formulation = ImplicitIntegrator::Formulation::StabilizedIndex2;
    ImplicitIntegrator::BlockForm blockForm = ImplicitIntegrator::BlockForm::Automatic;
    ImplicitIntegrator::NewtonTolerances newtonTolerances;
    ImplicitIntegrator::AccuracyNorm accuracyNorm = ImplicitIntegrator::AccuracyNorm::Automatic;
    bool hasOwnConstraintTolerance = false, hasOwnNewtonTolerances = false;
    std::function<void(const NewtonSystem&)> observer;
    std::vector<ForceSelection> differentiated;
    BreakTimes breaks;
};

/** Of an integration, whatever Stepper has taken its steps. **/
struct StepsTaken {
    SimTK::Real firstLength = SimTK::NaN, lastLength = 0;
    int lastOrder = 0;
    int worstBlock = -1;  ///< whose error was largest
};

class Stepper {
public:
    /** Analyses the system, its State realized to Stage::Velocity.
    @param name      for messages
    @param settings  must outlive this, as the other references; constraintTolerance is chosen
        unless somebody has set it
    @throws std::invalid_argument that names what cannot be supported **/
    Stepper(std::string name, const SimTK::MultibodySystem& system, const SimTK::State& state,
            IntegrationScheme& scheme, StepSettings& settings, StepsTaken& taken,
            IntegratorStatistics& statistics);

    Evaluation& updEquations() { return *m_equations; }
    const Evaluation& getEquations() const { return *m_equations; }
    ImplicitStep& updStep() { return *m_step; }
    const ImplicitStep& getStep() const { return *m_step; }
    void resize(SolutionPoint& point) const;

    /** True if forces or Measures have variables that steps update and the next step remembers. **/
    bool hasMemory() const { return m_hasMemory; }

    /** Derivatives, multipliers, power and error of a point from its t, q, u and z. **/
    void complete(SolutionPoint& point);
    /** A new history, from exact accelerations at the t, q, u and z of this point, which is
    completed. **/
    void start(SolutionPoint& point);
    /** A history of such points, oldest first, for steps of fixed length and this order. **/
    void startFrom(std::vector<SolutionPoint>& points, int order);
    /** Starts again at the newest point, which is smooth with what was before. **/
    void restart();
    /** Lets the equations evaluate functions of time between the breaks about this one only. **/
    void enterSmoothSpan(double time);

    /** One accepted step that does not pass `limit`.
    @throws std::runtime_error if none can be taken; the newest point stays. **/
    void takeStep(double limit);
    /** The last step ends here, inside of what it was, or at its end. **/
    void endLastStep(double end);

    const SolutionPoint& getNewest() const { return m_history[0]; }
    SolutionPoint& updNewest() { return m_history.newest(); }
    /** Where the last step began. **/
    double getLastStart() const { return m_history[solvesStages() ? radau::NumStages : 1].t; }
    /** The point at t: interpolated inside the last step, projected onto the joints. **/
    void calcPoint(double t, SolutionPoint& point);
    /** u̇ and λ of such a point, with the loads there: see PointBalance. calcPoint() leaves those of
    polynomials. **/
    void balance(SolutionPoint& point);

    double getNextLength() const { return m_nextLength; }
    void setNextLength(double h) { m_nextLength = h; }

    /** Moves phase times from the solver and the equations into the statistics. **/
    void bookPhases();
    /** What decides on the steps to come. **/
    void visit(Checkpoint& checkpoint);

private:
    using Formulation = ImplicitIntegrator::Formulation;
    using AccuracyNorm = ImplicitIntegrator::AccuracyNorm;

    OneStageScheme& updFormulas() { return m_formulas ? *m_formulas : m_fallback; }
    /** True if the step being attempted, or taken last, has stages. **/
    bool solvesStages() const { return !m_formulas && !m_solvesPositions; }
    /** m_step of a method with stages. **/
    RadauStep& updStages() { return static_cast<RadauStep&>(*m_step); }

    /** What nobody has set and depends on what the equations are like. **/
    void chooseSettings();
    double calcLongestLength() const;
    /** @param longest  allowed **/
    double chooseFirstLength(const SolutionPoint& point, double longest);
    /** Lowest order, no past. **/
    void forgetPast();

    /** Goes on beyond a break at the newest point: starts again there if something jumps. **/
    void passBreak();
    void stepWithin(double limit);
    void cutLastStep(double end);
    /** What switching contacts leave wrong in speeds acts for longer than the step, for about as
    long as what they did last: their error by then, in units of the accuracy; 0 where none has
    switched.
    **/
    double calcSwitchError(double h);
    /** Cuts the last step, over which contacts were held, where the first of them switches. **/
    void endAtSwitch();
    /** Goes on beyond a switch at the newest point. **/
    void passSwitch();
    /** @returns false if the equations cannot be solved, or not even evaluated **/
    bool tryStep(double h, int order, double* error);
    bool attemptStep(double h, int order, double* error);
    /** λ at the point's time, where a Newton iteration begins. **/
    void predictLambda(int points, SolutionPoint& point);
    /** The same of a method with stages. **/
    bool attemptStages(double h, double* error);
    /** True if a step's end has to be evaluated: positions projected, power, loads or the pose
    looked at. **/
    bool isEndAskedFor() const;
    /** Brings m_new's positions onto the joints. @returns false if it cannot. **/
    bool projectNew(ImplicitStep::Start from);
    /** Work until the step's end, of which power is known. **/
    double calcWork(int order) const;
    void acceptStep(double h, int order);
    void chooseNextStep(double error, double h, int order);
    /** Size of m_error in units of the accuracy. **/
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

    const std::string m_name;
    const SimTK::MultibodySystem& m_system;
    IntegrationScheme& m_scheme;
    OneStageScheme* m_formulas;  ///< the same, if its steps have one stage
    /** Else of steps near singular positions: see ImplicitStep::solveNearSingularity(). **/
    BdfScheme m_fallback;
    StepSettings& m_settings;
    StepsTaken& m_taken;
    IntegratorStatistics& m_statistics;
    std::unique_ptr<Evaluation> m_equations;
    std::unique_ptr<ImplicitStep> m_step;
    bool m_hasMemory = false;
    int m_numRedundantAtStart = 0;

    PointBalance m_balance;
    BreakTimes m_breaks;
    SolutionHistory m_history;
    StepController m_controller;
    double m_nextLength = 0;
    /** For which errors of speeds act, of methods with stages: no less than the steps before, as
    after a short one, where something jumps, long ones follow. **/
    double m_speedTime = 0;
    int m_order = 1, m_stepsAtOrder = 0;

    // The step being attempted.
    StepFormula m_formula;
    SolutionPoint m_new, m_trial;
    bool m_solvesPositions = false;  ///< position equations in Newton's iteration, speeds projected
    int m_worstProjectedRow = -1;
    ImplicitStep::Outcome m_outcome;
    ErrorNorm::Error m_error;
    std::string m_fault;  ///< what was said where equations could not be evaluated; else empty

    /** Loads and motions at points inside of a step. **/
    struct Samples {
        static constexpr int Count = 4;
        std::vector<double> loads[Count], atNodes[6], unseen;
        std::vector<double> q, u;

        void resize(int numQ, int numU, int numMultipliers);
    };
    Samples m_samples;
};

}  // namespace simflex
