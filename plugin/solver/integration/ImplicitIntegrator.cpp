#include "simflex/solver/ImplicitIntegrator.h"

#include <stdexcept>

#include "simflex/solver/integration/ImplicitIntegratorImpl.h"

namespace simflex {

using SimTK::Real;

namespace {

void requirePositive(Real value, const char* method) {
    if (!(value > 0))
        throw std::invalid_argument(std::string("ImplicitIntegrator::") + method +
                                    "(): " + std::to_string(value) + " given; it must be positive");
}

}  // namespace

ImplicitIntegrator::ImplicitIntegrator(std::unique_ptr<Implementation> implementation)
    : m_impl(std::move(implementation)) {}
ImplicitIntegrator::~ImplicitIntegrator() = default;
ImplicitIntegrator::ImplicitIntegrator(ImplicitIntegrator&&) noexcept = default;
ImplicitIntegrator& ImplicitIntegrator::operator=(ImplicitIntegrator&&) noexcept = default;

void ImplicitIntegrator::setAccuracy(Real accuracy) {
    requirePositive(accuracy, "setAccuracy");
    m_impl->setWaiting(&Implementation::Waiting::accuracy, accuracy);
}

void ImplicitIntegrator::setAccuracyNorm(AccuracyNorm norm) {
    m_impl->requireNotInitialized("setAccuracyNorm");
    m_impl->settings.accuracyNorm = norm;
}

void ImplicitIntegrator::setConstraintTolerance(Real tolerance) {
    requirePositive(tolerance, "setConstraintTolerance");
    m_impl->setWaiting(&Implementation::Waiting::constraintTolerance, tolerance);
    m_impl->settings.hasOwnConstraintTolerance = true;
}

void ImplicitIntegrator::setFormulation(Formulation formulation) {
    m_impl->requireNotInitialized("setFormulation");
    m_impl->settings.formulation = formulation;
}
void ImplicitIntegrator::setBlockForm(BlockForm form) {
    m_impl->requireNotInitialized("setBlockForm");
    m_impl->settings.blockForm = form;
}

void ImplicitIntegrator::setInitialStepSize(Real h) {
    requirePositive(h, "setInitialStepSize");
    m_impl->setWaiting(&Implementation::Waiting::initialStep, h);
}

void ImplicitIntegrator::setMaximumStepSize(Real h) {
    requirePositive(h, "setMaximumStepSize");
    m_impl->setMaximumStep(h);
}

void ImplicitIntegrator::setMinimumStepSize(Real h) {
    requirePositive(h, "setMinimumStepSize");
    m_impl->setMinimumStep(h);
}

void ImplicitIntegrator::setFixedStep(Real h) {
    requirePositive(h, "setFixedStep");
    m_impl->setFixedStep(h);
}

void ImplicitIntegrator::setNewtonTolerances(const NewtonTolerances& tolerances) {
    m_impl->requireNotInitialized("setNewtonTolerances");
    requirePositive(tolerances.displacement, "setNewtonTolerances: displacement");
    requirePositive(tolerances.multiplier, "setNewtonTolerances: multiplier");
    requirePositive(tolerances.maxIterations, "setNewtonTolerances: maxIterations");
    m_impl->settings.newtonTolerances = tolerances;
    m_impl->settings.hasOwnNewtonTolerances = true;
}

void ImplicitIntegrator::setFinalTime(Real time) {
    m_impl->setFinalTime(time);
}

void ImplicitIntegrator::setNumThreads(int threads) {
    requirePositive(threads, "setNumThreads");
    m_impl->setNumThreads(threads);
}

void ImplicitIntegrator::addBreakTimes(std::vector<Real> times) {
    m_impl->requireNotInitialized("addBreakTimes");
    m_impl->settings.breaks.add(std::move(times));
}

void ImplicitIntegrator::addBreakTimes(std::function<Real(Real time)> next) {
    m_impl->requireNotInitialized("addBreakTimes");
    if (!next) throw std::invalid_argument(m_impl->name + "::addBreakTimes(): an empty function");
    m_impl->settings.breaks.add(std::move(next));
}

void ImplicitIntegrator::setProjectInitialState(bool project) {
    m_impl->requireNotInitialized("setProjectInitialState");
    m_impl->projectInitialState = project;
}

void ImplicitIntegrator::setProjectionNorm(ProjectionNorm norm) {
    m_impl->requireNotInitialized("setProjectionNorm");
    m_impl->projectionNorm = norm;
}

void ImplicitIntegrator::setTriggerSamples(int count) {
    if (count < 1)
        throw std::invalid_argument(
            m_impl->name + "::setTriggerSamples(): " + std::to_string(count) + " is less than 1");
    m_impl->triggerSamples = count;
}

void ImplicitIntegrator::setAllowInterpolation(bool shouldInterpolate) {
    m_impl->allowInterpolation = shouldInterpolate;
}

void ImplicitIntegrator::setProjectInterpolatedStates(bool shouldProject) {
    m_impl->settings.projectInterpolatedStates = shouldProject;
}

void ImplicitIntegrator::setUseInfinityNorm(bool useInfinityNorm) {
    m_impl->settings.useInfinityNorm = useInfinityNorm;
}

bool ImplicitIntegrator::isInfinityNormInUse() const {
    return m_impl->settings.useInfinityNorm;
}

void ImplicitIntegrator::setForceFullNewton(bool forceFullNewton) {
    m_impl->setForceFullNewton(forceFullNewton);
}

void ImplicitIntegrator::setInternalStepLimit(int steps) {
    m_impl->internalStepLimit = std::max(steps, 0);
}

void ImplicitIntegrator::setReturnEveryInternalStep(bool shouldReturn) {
    m_impl->returnEveryInternalStep = shouldReturn;
}

void ImplicitIntegrator::addForceJacobian(const SimTK::Force& force,
                                          const std::vector<SimTK::MobilizedBodyIndex>& bodies) {
    m_impl->requireNotInitialized("addForceJacobian");
    if (force.isEmptyHandle())
        throw std::invalid_argument(m_impl->name + "::addForceJacobian(): an empty Force");
    m_impl->settings.differentiated.push_back({force, bodies});
}

void ImplicitIntegrator::addForceJacobian(const std::vector<SimTK::MobilizedBodyIndex>& bodies) {
    m_impl->requireNotInitialized("addForceJacobian");
    if (bodies.empty())
        throw std::invalid_argument(m_impl->name + "::addForceJacobian(): no bodies named");
    m_impl->settings.differentiated.push_back({SimTK::Force(), bodies});
}

void ImplicitIntegrator::setNewtonSystemObserver(
    std::function<void(const NewtonSystem&)> observer) {
    m_impl->setNewtonSystemObserver(std::move(observer));
}

void ImplicitIntegrator::setStepObserver(std::function<bool(Real time)> observer) {
    m_impl->stepObserver = std::move(observer);
}

void ImplicitIntegrator::initialize(const SimTK::State& state) {
    m_impl->initialize(state);
}
ImplicitIntegrator::StepStatus ImplicitIntegrator::stepTo(Real time) {
    m_impl->requireInitialized("stepTo");
    return m_impl->stepTo(time);
}

ImplicitIntegrator::StepStatus ImplicitIntegrator::stepOnce() {
    m_impl->requireInitialized("stepOnce");
    return m_impl->stepOnce();
}

ImplicitIntegrator::SuccessfulStepStatus ImplicitIntegrator::stepTo(Real reportTime,
                                                                    Real scheduledEventTime) {
    m_impl->requireInitialized("stepTo");
    return m_impl->stepTo(reportTime, scheduledEventTime);
}

ImplicitIntegrator::SuccessfulStepStatus ImplicitIntegrator::stepBy(Real interval,
                                                                    Real scheduledEventInterval) {
    m_impl->requireInitialized("stepBy");
    const Real now = m_impl->getTime();
    return m_impl->stepTo(now + interval, now + scheduledEventInterval);
}

void ImplicitIntegrator::reinitialize(SimTK::Stage lowestChangedStage, bool shouldTerminate) {
    m_impl->requireInitialized("reinitialize");
    m_impl->reinitialize(lowestChangedStage, shouldTerminate);
}

void ImplicitIntegrator::handle(const std::function<bool(SimTK::State&)>& handler) {
    m_impl->handle(handler);
}

SimTK::Vec2 ImplicitIntegrator::getEventWindow() const {
    return m_impl->getTriggeredEvents("getEventWindow").window;
}

const SimTK::Array_<SimTK::EventId>& ImplicitIntegrator::getTriggeredEvents() const {
    return m_impl->getTriggeredEvents("getTriggeredEvents").ids;
}

const SimTK::Array_<Real>& ImplicitIntegrator::getEstimatedEventTimes() const {
    return m_impl->getTriggeredEvents("getEstimatedEventTimes").times;
}

const SimTK::Array_<SimTK::Event::Trigger>& ImplicitIntegrator::getEventTransitionsSeen() const {
    return m_impl->getTriggeredEvents("getEventTransitionsSeen").transitions;
}

bool ImplicitIntegrator::isSimulationOver() const {
    return m_impl->isSimulationOver();
}

ImplicitIntegrator::TerminationReason ImplicitIntegrator::getTerminationReason() const {
    return m_impl->getTerminationReason();
}

void ImplicitIntegrator::writeCheckpoint(std::ostream& stream) {
    m_impl->requireInitialized("writeCheckpoint");
    m_impl->writeCheckpoint(stream);
}

void ImplicitIntegrator::readCheckpoint(std::istream& stream, const SimTK::State& start) {
    m_impl->readCheckpoint(stream, start);
}

const SimTK::State& ImplicitIntegrator::getState() const {
    m_impl->requireInitialized("getState");
    return m_impl->getReturnedState();
}

Real ImplicitIntegrator::getTime() const {
    return m_impl->getTime();
}

bool ImplicitIntegrator::isStateInterpolated() const {
    m_impl->requireInitialized("isStateInterpolated");
    return m_impl->isStateInterpolated();
}

SimTK::State& ImplicitIntegrator::updAdvancedState() {
    m_impl->requireInitialized("updAdvancedState");
    return m_impl->updAdvancedState();
}

const SimTK::State& ImplicitIntegrator::getAdvancedState() const {
    m_impl->requireInitialized("getAdvancedState");
    return m_impl->updAdvancedState();
}

Real ImplicitIntegrator::getAdvancedTime() const {
    return getAdvancedState().getTime();
}

SimTK::Vector ImplicitIntegrator::getUDot() const {
    m_impl->requireInitialized("getUDot");
    return m_impl->calcUDot();
}

SimTK::Vector ImplicitIntegrator::getMultipliers() const {
    m_impl->requireInitialized("getMultipliers");
    return m_impl->calcMultipliers(nullptr);
}

SimTK::Vector ImplicitIntegrator::getMultipliers(const SimTK::Constraint& constraint) const {
    m_impl->requireInitialized("getMultipliers");
    return m_impl->calcMultipliers(constraint);
}

SimTK::Vector ImplicitIntegrator::getMultipliers(const Joint& joint) const {
    m_impl->requireInitialized("getMultipliers");
    return m_impl->calcMultipliers(&joint);
}

SimTK::Vector ImplicitIntegrator::getFrictionForces(const Joint& joint) const {
    m_impl->requireInitialized("getFrictionForces");
    return m_impl->calcFrictionForces(joint);
}

Real ImplicitIntegrator::getLastStepSize() const {
    return m_impl->stepsTaken.lastLength;
}
int ImplicitIntegrator::getLastOrder() const {
    return m_impl->stepsTaken.lastOrder;
}
std::string ImplicitIntegrator::getErrorSource() const {
    return m_impl->getErrorSource();
}
Real ImplicitIntegrator::getWork() const {
    return m_impl->getWork();
}
Real ImplicitIntegrator::getLargestConstraintError() const {
    return m_impl->getConstraintError();
}
std::vector<std::string> ImplicitIntegrator::getRedundantConstraints() const {
    m_impl->requireInitialized("getRedundantConstraints");
    return m_impl->describeRedundancies();
}
const IntegratorStatistics& ImplicitIntegrator::getStatistics() const {
    return m_impl->statistics;
}

const char* ImplicitIntegrator::getMethodName() const {
    return m_impl->getScheme().getName();
}
int ImplicitIntegrator::getMethodMinOrder() const {
    return m_impl->getScheme().getLowestOrder();
}
int ImplicitIntegrator::getMethodMaxOrder() const {
    return m_impl->getScheme().getMaximumOrder();
}
Real ImplicitIntegrator::getAccuracyInUse() const {
    return m_impl->settings.accuracy;
}
Real ImplicitIntegrator::getConstraintToleranceInUse() const {
    return m_impl->settings.constraintTolerance;
}

void ImplicitIntegrator::resetAllStatistics() {
    m_impl->statisticsAtReset = m_impl->statistics;
}

Real ImplicitIntegrator::getActualInitialStepSizeTaken() const {
    return m_impl->stepsTaken.firstLength;
}
Real ImplicitIntegrator::getPredictedNextStepSize() const {
    return m_impl->getPredictedNextStepSize();
}
int ImplicitIntegrator::getNumStepsAttempted() const {
    return m_impl->count(&IntegratorStatistics::stepsAttempted);
}
int ImplicitIntegrator::getNumStepsTaken() const {
    return m_impl->count(&IntegratorStatistics::stepsTaken);
}
int ImplicitIntegrator::getNumRealizations() const {
    return getNumIterations() + getNumProjections() + m_impl->count(&IntegratorStatistics::starts);
}
int ImplicitIntegrator::getNumQProjections() const {
    return m_impl->count(&IntegratorStatistics::projections);
}
int ImplicitIntegrator::getNumUProjections() const {
    return 0;  // the equations of a step hold the speeds
}
int ImplicitIntegrator::getNumErrorTestFailures() const {
    return m_impl->count(&IntegratorStatistics::errorTestFailures);
}
int ImplicitIntegrator::getNumConvergenceTestFailures() const {
    return m_impl->count(&IntegratorStatistics::convergenceFailures) + getNumProjectionFailures() +
           getNumRealizationFailures();
}
int ImplicitIntegrator::getNumRealizationFailures() const {
    return m_impl->count(&IntegratorStatistics::nonFiniteFailures);
}
int ImplicitIntegrator::getNumQProjectionFailures() const {
    return m_impl->count(&IntegratorStatistics::projectionFailures);
}
int ImplicitIntegrator::getNumConvergentIterations() const {
    return getNumIterations() - getNumDivergentIterations();
}
int ImplicitIntegrator::getNumDivergentIterations() const {
    return m_impl->count(&IntegratorStatistics::divergentIterations);
}
int ImplicitIntegrator::getNumIterations() const {
    return m_impl->count(&IntegratorStatistics::newtonIterations);
}

}  // namespace simflex
