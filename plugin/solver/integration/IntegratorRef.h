#pragma once
/** @file
A reference to one of Simbody's or simflex's integrators, for code that takes an `Integrator&`:

    void report(const IntegratorRef& integ) { printf("%d steps\n", integ.getNumStepsTaken()); }

    report(rungeKutta);       // a SimTK::RungeKuttaMersonIntegrator
    report(bdf);              // a simflex::BdfIntegrator

A lightweight value, converted implicitly, whose integrator must outlive it; it can also be a class
member. All methods have the names and meaning of SimTK::Integrator's; stepTo() and stepBy() return
events to the caller with either integrator. **/

#include "simflex/solver/ImplicitIntegrator.h"

namespace simflex {

class IntegratorRef : public IntegratorStatuses {
public:
    IntegratorRef(SimTK::Integrator& native) : m_native(&native) {}
    IntegratorRef(ImplicitIntegrator& implicit) : m_implicit(&implicit) {}

    /** The integrator itself, null if it is of the other kind. **/
    SimTK::Integrator* getNative() const { return m_native; }
    ImplicitIntegrator* getImplicit() const { return m_implicit; }

    void initialize(const SimTK::State& state) {
        m_native ? m_native->initialize(state) : m_implicit->initialize(state);
    }
    void reinitialize(SimTK::Stage lowestChangedStage, bool shouldTerminate) {
        m_native ? m_native->reinitialize(lowestChangedStage, shouldTerminate)
                 : m_implicit->reinitialize(lowestChangedStage, shouldTerminate);
    }
    SuccessfulStepStatus stepTo(SimTK::Real reportTime,
                                SimTK::Real scheduledEventTime = SimTK::Infinity) {
        return m_native ? m_native->stepTo(reportTime, scheduledEventTime)
                        : m_implicit->stepTo(reportTime, scheduledEventTime);
    }
    SuccessfulStepStatus stepBy(SimTK::Real interval,
                                SimTK::Real scheduledEventInterval = SimTK::Infinity) {
        return m_native ? m_native->stepBy(interval, scheduledEventInterval)
                        : m_implicit->stepBy(interval, scheduledEventInterval);
    }
    SimTK::State& updAdvancedState() {
        return m_native ? m_native->updAdvancedState() : m_implicit->updAdvancedState();
    }
    void resetAllStatistics() {
        m_native ? m_native->resetAllStatistics() : m_implicit->resetAllStatistics();
    }

    const char* getMethodName() const {
        return m_native ? m_native->getMethodName() : m_implicit->getMethodName();
    }
    int getMethodMinOrder() const {
        return m_native ? m_native->getMethodMinOrder() : m_implicit->getMethodMinOrder();
    }
    int getMethodMaxOrder() const {
        return m_native ? m_native->getMethodMaxOrder() : m_implicit->getMethodMaxOrder();
    }
    bool methodHasErrorControl() const {
        return m_native ? m_native->methodHasErrorControl() : m_implicit->methodHasErrorControl();
    }

    const SimTK::State& getState() const {
        return m_native ? m_native->getState() : m_implicit->getState();
    }
    SimTK::Real getTime() const { return m_native ? m_native->getTime() : m_implicit->getTime(); }
    bool isStateInterpolated() const {
        return m_native ? m_native->isStateInterpolated() : m_implicit->isStateInterpolated();
    }
    const SimTK::State& getAdvancedState() const {
        return m_native ? m_native->getAdvancedState() : m_implicit->getAdvancedState();
    }
    SimTK::Real getAdvancedTime() const {
        return m_native ? m_native->getAdvancedTime() : m_implicit->getAdvancedTime();
    }
    SimTK::Real getAccuracyInUse() const {
        return m_native ? m_native->getAccuracyInUse() : m_implicit->getAccuracyInUse();
    }
    SimTK::Real getConstraintToleranceInUse() const {
        return m_native ? m_native->getConstraintToleranceInUse()
                        : m_implicit->getConstraintToleranceInUse();
    }
    bool isInfinityNormInUse() const {
        return m_native ? m_native->isInfinityNormInUse() : m_implicit->isInfinityNormInUse();
    }

    SimTK::Vec2 getEventWindow() const {
        return m_native ? m_native->getEventWindow() : m_implicit->getEventWindow();
    }
    const SimTK::Array_<SimTK::EventId>& getTriggeredEvents() const {
        return m_native ? m_native->getTriggeredEvents() : m_implicit->getTriggeredEvents();
    }
    const SimTK::Array_<SimTK::Real>& getEstimatedEventTimes() const {
        return m_native ? m_native->getEstimatedEventTimes() : m_implicit->getEstimatedEventTimes();
    }
    const SimTK::Array_<SimTK::Event::Trigger>& getEventTransitionsSeen() const {
        return m_native ? m_native->getEventTransitionsSeen()
                        : m_implicit->getEventTransitionsSeen();
    }
    bool isSimulationOver() const {
        return m_native ? m_native->isSimulationOver() : m_implicit->isSimulationOver();
    }
    TerminationReason getTerminationReason() const {
        return m_native ? m_native->getTerminationReason() : m_implicit->getTerminationReason();
    }

    SimTK::Real getActualInitialStepSizeTaken() const {
        return m_native ? m_native->getActualInitialStepSizeTaken()
                        : m_implicit->getActualInitialStepSizeTaken();
    }
    SimTK::Real getPreviousStepSizeTaken() const {
        return m_native ? m_native->getPreviousStepSizeTaken()
                        : m_implicit->getPreviousStepSizeTaken();
    }
    SimTK::Real getPredictedNextStepSize() const {
        return m_native ? m_native->getPredictedNextStepSize()
                        : m_implicit->getPredictedNextStepSize();
    }
    int getNumStepsAttempted() const {
        return m_native ? m_native->getNumStepsAttempted() : m_implicit->getNumStepsAttempted();
    }
    int getNumStepsTaken() const {
        return m_native ? m_native->getNumStepsTaken() : m_implicit->getNumStepsTaken();
    }
    int getNumRealizations() const {
        return m_native ? m_native->getNumRealizations() : m_implicit->getNumRealizations();
    }
    int getNumQProjections() const {
        return m_native ? m_native->getNumQProjections() : m_implicit->getNumQProjections();
    }
    int getNumUProjections() const {
        return m_native ? m_native->getNumUProjections() : m_implicit->getNumUProjections();
    }
    int getNumProjections() const {
        return m_native ? m_native->getNumProjections() : m_implicit->getNumProjections();
    }
    int getNumErrorTestFailures() const {
        return m_native ? m_native->getNumErrorTestFailures()
                        : m_implicit->getNumErrorTestFailures();
    }
    int getNumConvergenceTestFailures() const {
        return m_native ? m_native->getNumConvergenceTestFailures()
                        : m_implicit->getNumConvergenceTestFailures();
    }
    int getNumRealizationFailures() const {
        return m_native ? m_native->getNumRealizationFailures()
                        : m_implicit->getNumRealizationFailures();
    }
    int getNumQProjectionFailures() const {
        return m_native ? m_native->getNumQProjectionFailures()
                        : m_implicit->getNumQProjectionFailures();
    }
    int getNumUProjectionFailures() const {
        return m_native ? m_native->getNumUProjectionFailures()
                        : m_implicit->getNumUProjectionFailures();
    }
    int getNumProjectionFailures() const {
        return m_native ? m_native->getNumProjectionFailures()
                        : m_implicit->getNumProjectionFailures();
    }
    int getNumConvergentIterations() const {
        return m_native ? m_native->getNumConvergentIterations()
                        : m_implicit->getNumConvergentIterations();
    }
    int getNumDivergentIterations() const {
        return m_native ? m_native->getNumDivergentIterations()
                        : m_implicit->getNumDivergentIterations();
    }
    int getNumIterations() const {
        return m_native ? m_native->getNumIterations() : m_implicit->getNumIterations();
    }

    void setFinalTime(SimTK::Real time) {
        m_native ? m_native->setFinalTime(time) : m_implicit->setFinalTime(time);
    }
    void setInitialStepSize(SimTK::Real h) {
        m_native ? m_native->setInitialStepSize(h) : m_implicit->setInitialStepSize(h);
    }
    void setMinimumStepSize(SimTK::Real h) {
        m_native ? m_native->setMinimumStepSize(h) : m_implicit->setMinimumStepSize(h);
    }
    void setMaximumStepSize(SimTK::Real h) {
        m_native ? m_native->setMaximumStepSize(h) : m_implicit->setMaximumStepSize(h);
    }
    void setFixedStepSize(SimTK::Real h) {
        m_native ? m_native->setFixedStepSize(h) : m_implicit->setFixedStepSize(h);
    }
    void setAccuracy(SimTK::Real accuracy) {
        m_native ? m_native->setAccuracy(accuracy) : m_implicit->setAccuracy(accuracy);
    }
    void setConstraintTolerance(SimTK::Real tolerance) {
        m_native ? m_native->setConstraintTolerance(tolerance)
                 : m_implicit->setConstraintTolerance(tolerance);
    }
    void setUseInfinityNorm(bool shouldUse) {
        m_native ? m_native->setUseInfinityNorm(shouldUse)
                 : m_implicit->setUseInfinityNorm(shouldUse);
    }
    void setInternalStepLimit(int steps) {
        m_native ? m_native->setInternalStepLimit(steps) : m_implicit->setInternalStepLimit(steps);
    }
    void setReturnEveryInternalStep(bool shouldReturn) {
        m_native ? m_native->setReturnEveryInternalStep(shouldReturn)
                 : m_implicit->setReturnEveryInternalStep(shouldReturn);
    }
    void setProjectEveryStep(bool shouldProject) {
        m_native ? m_native->setProjectEveryStep(shouldProject)
                 : m_implicit->setProjectEveryStep(shouldProject);
    }
    void setAllowInterpolation(bool shouldInterpolate) {
        m_native ? m_native->setAllowInterpolation(shouldInterpolate)
                 : m_implicit->setAllowInterpolation(shouldInterpolate);
    }
    void setProjectInterpolatedStates(bool shouldProject) {
        m_native ? m_native->setProjectInterpolatedStates(shouldProject)
                 : m_implicit->setProjectInterpolatedStates(shouldProject);
    }
    void setForceFullNewton(bool shouldForce) {
        m_native ? m_native->setForceFullNewton(shouldForce)
                 : m_implicit->setForceFullNewton(shouldForce);
    }

private:
    SimTK::Integrator* m_native = nullptr;
    ImplicitIntegrator* m_implicit = nullptr;
};

}  // namespace simflex
