#pragma once
/** @file
Steps of an integration (private header): attempts, their error, order and length of the next one,
and dense output within the last. Independent of events and reports; driven by
ImplicitIntegrator::Implementation.

    Stepper.cpp          start, dense output
    StepTaking.cpp       a step
    FrictionSwitch.cpp   location of stick–slip switches of joint friction
    UnseenError.cpp      errors of loads and motions inside a step **/

#include <functional>
#include <memory>
#include <optional>
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

/** Settings that may change between steps. **/
struct AdjustableSettings {
    SimTK::Real maximumStep = 0, minimumStep = 1e-12, fixedStep = 0;
    int numThreads = 0;
    bool forceFullNewton = false, projectInterpolatedStates = true;
    std::function<void(const NewtonSystem&)> observer;
};

/** Settings of the steps. **/
struct StepSettings : AdjustableSettings {
    SimTK::Real accuracy = 1e-6, initialStep = 0;
    /** Those of the user; otherwise they depend on the system. **/
    std::optional<SimTK::Real> ownConstraintTolerance;
    std::optional<ImplicitIntegrator::NewtonTolerances> ownNewtonTolerances;
    /** In use, chosen by the Stepper. **/
    SimTK::Real constraintTolerance = 1e-10;
    bool useInfinityNorm = false;
    ImplicitIntegrator::Formulation formulation = ImplicitIntegrator::Formulation::StabilizedIndex2;
    ImplicitIntegrator::BlockForm blockForm = ImplicitIntegrator::BlockForm::Automatic;
    ImplicitIntegrator::AccuracyNorm accuracyNorm = ImplicitIntegrator::AccuracyNorm::Automatic;
    std::vector<ForceSelection> differentiated;
    BreakTimes breaks;
};

/** Record of an integration's steps, which outlives its Steppers. **/
struct StepsTaken {
    SimTK::Real firstLength = SimTK::NaN, lastLength = 0;
    int lastOrder = 0;
    int worstBlock = -1;  ///< block with the largest error
};

class Stepper {
public:
    /** Analyses the system, its State realized to Stage::Velocity.
    @param name      for messages
    @param settings  must outlive this, like the other references; the constraint tolerance in use
        is written to it
    @throws std::invalid_argument that names an unsupported element **/
    Stepper(std::string name, const SimTK::MultibodySystem& system, const SimTK::State& state,
            IntegrationScheme& scheme, StepSettings& settings, StepsTaken& taken,
            IntegratorStatistics& statistics);

    Evaluation& updEquations() { return *m_equations; }
    const Evaluation& getEquations() const { return *m_equations; }
    ImplicitStep& updStep() { return *m_step; }
    const ImplicitStep& getStep() const { return *m_step; }
    void resize(SolutionPoint& point) const;

    /** True if forces or Measures have variables that are updated by steps and used by later
    ones. **/
    bool hasMemory() const { return m_hasMemory; }

    /** Computes derivatives, multipliers, power and error of a point from its t, q, u and z. **/
    void complete(SolutionPoint& point);
    /** Starts a new history with exact accelerations at t, q, u and z of this point, which is
    completed. **/
    void start(SolutionPoint& point);
    /** Starts a history of such points, oldest first, for steps of fixed length and this order. **/
    void startFrom(std::vector<SolutionPoint>& points, int order);
    /** Restarts at the newest point, without a discontinuity. **/
    void restart();
    /** Restricts the evaluation of functions of time to the span between breaks around `time`. **/
    void enterSmoothSpan(double time);

    /** Takes one accepted step that does not pass `limit`.
    @throws std::runtime_error if none can be taken; the newest point stays. **/
    void takeStep(double limit);
    /** Shortens the last step to end here, which may be its end. **/
    void endLastStep(double end);

    const SolutionPoint& getNewest() const { return m_history[0]; }
    SolutionPoint& updNewest() { return m_history.newest(); }
    /** Start of the last step. **/
    double getLastStart() const { return m_history[solvesStages() ? radau::NumStages : 1].t; }
    /** The point at t: interpolated inside the last step, projected onto the joints. **/
    void calcPoint(double t, SolutionPoint& point);
    /** Computes u̇ and λ of such a point with the loads there: see PointBalance. calcPoint() gives
    those of the polynomials. **/
    void balance(SolutionPoint& point);

    double getNextLength() const { return m_nextLength; }
    /** Follows changes of the AdjustableSettings, between steps. **/
    void takeAdjustments();

    /** Moves phase times from the solver and the equations into the statistics. **/
    void bookPhases();
    /** Saves or restores everything that determines later steps. **/
    void visit(Checkpoint& checkpoint);

private:
    using Formulation = ImplicitIntegrator::Formulation;
    using AccuracyNorm = ImplicitIntegrator::AccuracyNorm;

    OneStageScheme& updFormulas() { return m_formulas ? *m_formulas : m_fallback; }
    /** True if the step being attempted, or taken last, has stages. **/
    bool solvesStages() const { return !m_formulas && !m_solvesPositions; }
    /** m_step of a method with stages. **/
    RadauStep& updStages() { return static_cast<RadauStep&>(*m_step); }

    /** Chooses settings that are not set and depend on the system. **/
    void chooseSettings();
    double calcLongestLength() const;
    /** @param longest  allowed length **/
    double chooseFirstLength(const SolutionPoint& point, double longest);
    /** Returns to the lowest order without history. **/
    void forgetPast();

    /** Continues past a break at the newest point: restarts there if there is a jump. **/
    void passBreak();
    void stepWithin(double limit);
    void cutLastStep(double end);
    /** The speed errors caused by switching contacts act beyond the step, for about as long as the
    preceding phase. Returns the resulting error in units of the accuracy; 0 if none has
    switched. **/
    double calcSwitchError(double h);
    /** Cuts the last step, in which contacts were held, at the first switch. **/
    void endAtSwitch();
    /** Continues past a switch at the newest point. **/
    void passSwitch();
    /** @returns false if the equations cannot be solved or evaluated **/
    bool tryStep(double h, int order, double* error);
    bool attemptStep(double h, int order, double* error);
    /** Predicts λ at the point's time for Newton's method. **/
    void predictLambda(int points, SolutionPoint& point);
    /** The same for a method with stages. **/
    bool attemptStages(double h, double* error);
    /** True if the end of a step must be evaluated, for projection, power, loads or the pose. **/
    bool isEndAskedFor() const;
    /** Projects m_new's positions onto the joints. @returns false if it cannot. **/
    bool projectNew(ImplicitStep::Start from);
    /** Work up to the step's end, where power is known. **/
    double calcWork(int order) const;
    void acceptStep(double h, int order);
    void chooseNextStep(double error, double h, int order);
    /** Size of m_error in units of the accuracy. **/
    double calcErrorSize(double h);
    double calcError(int order);
    double calcFirstError();
    /** Error of loads and motions inside the step that its end and earlier ends do not show: their
    distance from the polynomial of the step's order at interior points. Otherwise a load that
    begins and ends within a step would go unnoticed. **/
    double calcUnseenError(int order);
    double calcUnseenLoads(int order);
    double calcUnseenMotions(int order);
    /** q and u of the polynomial through the step's end. **/
    void interpolateNew(int order, double t, SolutionPoint& point);
    /** Why an attempt does not end in a usable point. **/
    enum class Failure { ErrorTest, Convergence, Positions, Speeds, Count };
    /** @param error  of the last attempt, in units of the accuracy **/
    [[noreturn]] void failStep(double h, Failure failure, double error);

    const std::string m_name;
    const SimTK::MultibodySystem& m_system;
    IntegrationScheme& m_scheme;
    OneStageScheme* m_formulas;  ///< the same, if its steps have one stage; else null
    /** Otherwise for steps near singular positions: see ImplicitStep::solveNearSingularity(). **/
    BdfScheme m_fallback;
    StepSettings& m_settings;
    StepsTaken& m_taken;
    IntegratorStatistics& m_statistics;
    std::unique_ptr<Evaluation> m_equations;
    std::unique_ptr<ImplicitStep> m_step;
    bool m_hasMemory = false;
    bool m_keepsMatrices = false;  ///< of a method with stages, at the start
    int m_numRedundantAtStart = 0;

    PointBalance m_balance;
    BreakTimes m_breaks;
    SolutionHistory m_history;
    StepController m_controller;
    double m_nextLength = 0;
    /** Time during which speed errors act, for methods with stages: at least the length of earlier
    steps, because a short step at a jump is followed by long ones. **/
    double m_speedTime = 0;
    int m_order = 1, m_stepsAtOrder = 0;

    // The step being attempted.
    StepFormula m_formula;
    SolutionPoint m_new, m_trial;
    bool m_solvesPositions = false;  ///< position constraints in Newton's method, speeds projected
    int m_worstProjectedRow = -1;
    Failure m_failure = Failure::Convergence;  ///< of an attempt that was not solved
    ImplicitStep::Outcome m_outcome;
    ErrorNorm::Error m_error;
    std::string m_fault;  ///< message of a failed evaluation; else empty

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
