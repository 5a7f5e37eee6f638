#pragma once
/** @file
The state of a BdfIntegrator (private header). **/

#include "simflex/solver/BdfHistory.h"
#include "simflex/solver/BdfIntegrator.h"
#include "simflex/solver/EventDriver.h"
#include "simflex/solver/ImplicitStep.h"

namespace simflex {

class BdfIntegrator::Implementation {
public:
    explicit Implementation(const SimTK::MultibodySystem& system);

    void initialize(const SimTK::State& state);
    void initialize(const SimTK::Array_<SimTK::State>& history);
    StepStatus stepTo(SimTK::Real time);
    StepStatus stepOnce();

    const SimTK::State& getState() const;
    SimTK::Vector calcUDot() const;
    SimTK::Vector calcMultipliers(const Joint* joint) const;
    SimTK::Vector calcMultipliers(const SimTK::Constraint& constraint) const;
    void requireInitialized(const char* method) const;

    /** @name Settings **/
    /**@{**/
    SimTK::Real accuracy = 1e-6, constraintTolerance = 1e-10;
    SimTK::Real initialStep = 0, maximumStep = SimTK::Infinity, minimumStep = 1e-12, fixedStep = 0;
    SimTK::Real finalTime = SimTK::Infinity;
    int maximumOrder = 2, fixedOrder = 0, numThreads = 0;
    bool projectInitialState = true;
    Formulation formulation = Formulation::StabilizedIndex2;
    BlockForm blockForm = BlockForm::Automatic;
    NewtonTolerances newtonTolerances;
    std::function<void(const NewtonSystem&)> observer;
    /**@}**/

    IntegratorStatistics statistics;
    SimTK::Real visibleTime = 0, visibleWork = 0, constraintError = 0;
    SimTK::Real lastStep = 0;
    int lastOrder = 0;

private:
    void setUp(const SimTK::State& state);
    void checkSettings(SimTK::Real startTime) const;
    /** Analyses the system at m_state; again after a handler changed it. **/
    void buildEquations();
    /** After handlers ran: goes on if they changed nothing, else starts again from what they left.
     * **/
    void takeOver(const EventDriver::Outcome& outcome);
    /** Assembles (if asked), finds accelerations and starts a new history from the State. **/
    void restart(bool project);
    void pushPoint(double t, double work, double error, const std::vector<double>& q,
                   const std::vector<double>& u, const std::vector<double>& lambda,
                   const std::vector<double>& uDot);
    SimTK::Real chooseInitialStep(const std::vector<double>& uDot) const;

    /** One accepted step that does not pass `limit`. **/
    void takeStep(double limit);
    bool attemptStep(double h, int order, double* error);
    void chooseNextStep(double error, double h, int order);
    double calcError(int order) const;
    [[noreturn]] void failStep(double h, const std::string& reason) const;
    StepStatus advance(SimTK::Real goal);
    /** Moves phase times from the solver and the equations into the statistics. **/
    void bookPhases();
    /** Runs `work` and books its time; on an exception makes the last good point visible. **/
    template <class Work>
    StepStatus runTimed(Work work);

    /** Makes the point at t visible: interpolated inside the last step, projected onto the joints.
     * **/
    void showPoint(double t);
    /** Shortens the last step to where a trigger function changes sign, if one does; true if so.
     * **/
    bool locateTrigger(const SimTK::Vector& before, double tBefore);
    void writeState(double t, const std::vector<double>& q, const std::vector<double>& u,
                    SimTK::State& state) const;

    const SimTK::MultibodySystem& m_system;
    std::unique_ptr<MultibodyEquations> m_equations;
    std::unique_ptr<ImplicitStep> m_step;
    EventDriver m_events;
    BdfHistory m_history;
    int m_realPoints = 0;  ///< points of the history that are solutions, not extrapolated backwards

    SimTK::State m_state;
    std::vector<double> m_visibleQ, m_visibleU, m_visibleLambda, m_visibleUDot;
    mutable bool m_stateIsCurrent = false;
    mutable SimTK::State m_scratch;

    double m_nextStep = 0;
    int m_order = 1, m_stepsAtOrder = 0;
    SimTK::Vector m_triggersBefore, m_triggersAfter;
    bool m_hasTriggered = false, m_isInitialized = false, m_isTerminated = false;

    // The step being attempted.
    double m_newTime = 0, m_newWork = 0, m_newConstraintError = 0;
    int m_worstProjectedRow = -1;
    std::vector<double> m_q, m_u, m_lambda, m_uDot, m_qHist, m_uHist, m_qPredicted, m_uPredicted;
    mutable std::vector<double> m_errorQ, m_errorU;
    ImplicitStep::Outcome m_outcome;
};

}  // namespace simflex
