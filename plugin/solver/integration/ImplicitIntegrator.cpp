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

ImplicitIntegrator::Implementation& ImplicitIntegrator::updImpl() const {
    if (!m_impl)
        throw std::logic_error(
            "this integrator has been moved from: its integration goes on in the other one");
    return *m_impl;
}

void ImplicitIntegrator::setAccuracy(Real accuracy) {
    requirePositive(accuracy, "setAccuracy");
    updImpl().set([&](StepSettings& s) { s.accuracy = accuracy; });
}

void ImplicitIntegrator::setAccuracyNorm(AccuracyNorm norm) {
    updImpl().requireNotInitialized("setAccuracyNorm");
    updImpl().set([&](StepSettings& s) { s.accuracyNorm = norm; });
}

void ImplicitIntegrator::setConstraintTolerance(Real tolerance) {
    requirePositive(tolerance, "setConstraintTolerance");
    updImpl().set([&](StepSettings& s) { s.ownConstraintTolerance = tolerance; });
}

void ImplicitIntegrator::setFormulation(Formulation formulation) {
    updImpl().requireNotInitialized("setFormulation");
    updImpl().set([&](StepSettings& s) { s.formulation = formulation; });
}
void ImplicitIntegrator::setBlockForm(BlockForm form) {
    updImpl().requireNotInitialized("setBlockForm");
    updImpl().set([&](StepSettings& s) { s.blockForm = form; });
}

void ImplicitIntegrator::setInitialStepSize(Real h) {
    requirePositive(h, "setInitialStepSize");
    updImpl().set([&](StepSettings& s) { s.initialStep = h; });
}

void ImplicitIntegrator::setMaximumStepSize(Real h) {
    requirePositive(h, "setMaximumStepSize");
    updImpl().setMaximumStep(h);
}

void ImplicitIntegrator::setMinimumStepSize(Real h) {
    requirePositive(h, "setMinimumStepSize");
    updImpl().setMinimumStep(h);
}

void ImplicitIntegrator::setFixedStep(Real h) {
    requirePositive(h, "setFixedStep");
    updImpl().setFixedStep(h);
}

void ImplicitIntegrator::setNewtonTolerances(const NewtonTolerances& tolerances) {
    updImpl().requireNotInitialized("setNewtonTolerances");
    requirePositive(tolerances.displacement, "setNewtonTolerances: displacement");
    requirePositive(tolerances.multiplier, "setNewtonTolerances: multiplier");
    requirePositive(tolerances.maxIterations, "setNewtonTolerances: maxIterations");
    updImpl().set([&](StepSettings& s) { s.ownNewtonTolerances = tolerances; });
}

void ImplicitIntegrator::setFinalTime(Real time) {
    updImpl().setFinalTime(time);
}

void ImplicitIntegrator::setNumThreads(int threads) {
    requirePositive(threads, "setNumThreads");
    updImpl().adjust([&](AdjustableSettings& s) { s.numThreads = threads; });
}

void ImplicitIntegrator::addBreakTimes(std::vector<Real> times) {
    updImpl().requireNotInitialized("addBreakTimes");
    updImpl().set([&](StepSettings& s) { s.breaks.add(std::move(times)); });
}

void ImplicitIntegrator::addBreakTimes(std::function<Real(Real time)> next) {
    updImpl().requireNotInitialized("addBreakTimes");
    if (!next) throw std::invalid_argument(updImpl().name + "::addBreakTimes(): an empty function");
    updImpl().set([&](StepSettings& s) { s.breaks.add(std::move(next)); });
}

void ImplicitIntegrator::setProjectInitialState(bool project) {
    updImpl().requireNotInitialized("setProjectInitialState");
    updImpl().projectInitialState = project;
}

void ImplicitIntegrator::setProjectionNorm(ProjectionNorm norm) {
    updImpl().requireNotInitialized("setProjectionNorm");
    updImpl().projectionNorm = norm;
}

void ImplicitIntegrator::setTriggerSamples(int count) {
    updImpl().requireNotInitialized("setTriggerSamples");
    if (count < 1)
        throw std::invalid_argument(
            updImpl().name + "::setTriggerSamples(): " + std::to_string(count) + " is less than 1");
    updImpl().triggerSamples = count;
}

void ImplicitIntegrator::setAllowInterpolation(bool shouldInterpolate) {
    updImpl().allowInterpolation = shouldInterpolate;
}

void ImplicitIntegrator::setProjectInterpolatedStates(bool shouldProject) {
    updImpl().adjust([&](AdjustableSettings& s) { s.projectInterpolatedStates = shouldProject; });
}

void ImplicitIntegrator::setUseInfinityNorm(bool useInfinityNorm) {
    updImpl().set([&](StepSettings& s) { s.useInfinityNorm = useInfinityNorm; });
}

bool ImplicitIntegrator::isInfinityNormInUse() const {
    return updImpl().settings.useInfinityNorm;
}

void ImplicitIntegrator::setForceFullNewton(bool forceFullNewton) {
    updImpl().adjust([&](AdjustableSettings& s) { s.forceFullNewton = forceFullNewton; });
}

void ImplicitIntegrator::setInternalStepLimit(int steps) {
    updImpl().internalStepLimit = std::max(steps, 0);
}

void ImplicitIntegrator::setReturnEveryInternalStep(bool shouldReturn) {
    updImpl().returnEveryInternalStep = shouldReturn;
}

void ImplicitIntegrator::addForceJacobian(const SimTK::Force& force,
                                          const std::vector<SimTK::MobilizedBodyIndex>& bodies) {
    updImpl().requireNotInitialized("addForceJacobian");
    if (force.isEmptyHandle())
        throw std::invalid_argument(updImpl().name + "::addForceJacobian(): an empty Force");
    updImpl().set([&](StepSettings& s) { s.differentiated.push_back({force, bodies}); });
}

void ImplicitIntegrator::addForceJacobian(const std::vector<SimTK::MobilizedBodyIndex>& bodies) {
    updImpl().requireNotInitialized("addForceJacobian");
    if (bodies.empty())
        throw std::invalid_argument(updImpl().name + "::addForceJacobian(): no bodies named");
    updImpl().set([&](StepSettings& s) { s.differentiated.push_back({SimTK::Force(), bodies}); });
}

void ImplicitIntegrator::setNewtonSystemObserver(
    std::function<void(const NewtonSystem&)> observer) {
    updImpl().adjust([&](AdjustableSettings& s) { s.observer = std::move(observer); });
}

void ImplicitIntegrator::setStepObserver(std::function<bool(Real time)> observer) {
    updImpl().stepObserver =
        observer ? std::make_shared<const std::function<bool(Real)>>(std::move(observer)) : nullptr;
}

void ImplicitIntegrator::initialize(const SimTK::State& state) {
    updImpl().initialize(state);
}
ImplicitIntegrator::StepStatus ImplicitIntegrator::stepTo(Real time) {
    updImpl().requireReady("stepTo");
    return updImpl().stepTo(time);
}

ImplicitIntegrator::StepStatus ImplicitIntegrator::stepOnce() {
    updImpl().requireReady("stepOnce");
    return updImpl().stepOnce();
}

ImplicitIntegrator::SuccessfulStepStatus ImplicitIntegrator::stepTo(Real reportTime,
                                                                    Real scheduledEventTime) {
    updImpl().requireReady("stepTo");
    return updImpl().stepTo(reportTime, scheduledEventTime);
}

ImplicitIntegrator::SuccessfulStepStatus ImplicitIntegrator::stepBy(Real interval,
                                                                    Real scheduledEventInterval) {
    updImpl().requireReady("stepBy");
    const Real now = updImpl().getTime();
    return updImpl().stepTo(now + interval, now + scheduledEventInterval);
}

void ImplicitIntegrator::reinitialize(SimTK::Stage lowestChangedStage, bool shouldTerminate) {
    updImpl().requireReady("reinitialize");
    updImpl().reinitialize(lowestChangedStage, shouldTerminate);
}

void ImplicitIntegrator::handle(const std::function<bool(SimTK::State&)>& handler) {
    updImpl().requireReady("handle");
    updImpl().handle(handler);
}

SimTK::Vec2 ImplicitIntegrator::getEventWindow() const {
    return updImpl().getTriggeredEvents("getEventWindow").window;
}

const SimTK::Array_<SimTK::EventId>& ImplicitIntegrator::getTriggeredEvents() const {
    return updImpl().getTriggeredEvents("getTriggeredEvents").ids;
}

const SimTK::Array_<Real>& ImplicitIntegrator::getEstimatedEventTimes() const {
    return updImpl().getTriggeredEvents("getEstimatedEventTimes").times;
}

const SimTK::Array_<SimTK::Event::Trigger>& ImplicitIntegrator::getEventTransitionsSeen() const {
    return updImpl().getTriggeredEvents("getEventTransitionsSeen").transitions;
}

bool ImplicitIntegrator::isSimulationOver() const {
    return updImpl().isSimulationOver();
}

ImplicitIntegrator::TerminationReason ImplicitIntegrator::getTerminationReason() const {
    return updImpl().getTerminationReason();
}

void ImplicitIntegrator::writeCheckpoint(std::ostream& stream) {
    updImpl().requireReady("writeCheckpoint");
    updImpl().writeCheckpoint(stream);
}

void ImplicitIntegrator::readCheckpoint(std::istream& stream, const SimTK::State& start) {
    updImpl().readCheckpoint(stream, start);
}

const SimTK::State& ImplicitIntegrator::getState() const {
    updImpl().requireInitialized("getState");
    return updImpl().getReturnedState();
}

Real ImplicitIntegrator::getTime() const {
    return updImpl().getTime();
}

bool ImplicitIntegrator::isStateInterpolated() const {
    updImpl().requireInitialized("isStateInterpolated");
    return updImpl().isStateInterpolated();
}

SimTK::State& ImplicitIntegrator::updAdvancedState() {
    updImpl().requireReady("updAdvancedState");
    return updImpl().updAdvancedState();
}

const SimTK::State& ImplicitIntegrator::getAdvancedState() const {
    updImpl().requireSolution("getAdvancedState");
    return updImpl().updAdvancedState();
}

const SimTK::State& ImplicitIntegrator::showAdvancedState() const {
    updImpl().requireSolution("showAdvancedState");
    return updImpl().showAdvancedState();
}

Real ImplicitIntegrator::getAdvancedTime() const {
    return getAdvancedState().getTime();
}

SimTK::Vector ImplicitIntegrator::getUDot() const {
    updImpl().requireSolution("getUDot");
    return updImpl().calcUDot();
}

SimTK::Vector ImplicitIntegrator::getMultipliers() const {
    updImpl().requireSolution("getMultipliers");
    return updImpl().calcMultipliers(nullptr);
}

SimTK::Vector ImplicitIntegrator::getMultipliers(const SimTK::Constraint& constraint) const {
    updImpl().requireSolution("getMultipliers");
    return updImpl().calcMultipliers(constraint);
}

SimTK::Vector ImplicitIntegrator::getMultipliers(const Joint& joint) const {
    updImpl().requireSolution("getMultipliers");
    return updImpl().calcMultipliers(&joint);
}

SimTK::Vector ImplicitIntegrator::getFrictionForces(const Joint& joint) const {
    updImpl().requireSolution("getFrictionForces");
    return updImpl().calcFrictionForces(joint);
}

Real ImplicitIntegrator::getLastStepSize() const {
    return updImpl().stepsTaken.lastLength;
}
int ImplicitIntegrator::getLastOrder() const {
    return updImpl().stepsTaken.lastOrder;
}
std::string ImplicitIntegrator::getErrorSource() const {
    return updImpl().getErrorSource();
}
Real ImplicitIntegrator::getWork() const {
    return updImpl().getWork();
}
Real ImplicitIntegrator::getLargestConstraintError() const {
    return updImpl().getConstraintError();
}
std::vector<std::string> ImplicitIntegrator::getRedundantConstraints() const {
    updImpl().requireInitialized("getRedundantConstraints");
    return updImpl().describeRedundancies();
}
const IntegratorStatistics& ImplicitIntegrator::getStatistics() const {
    return updImpl().statistics;
}

const char* ImplicitIntegrator::getMethodName() const {
    return updImpl().getScheme().getName();
}
int ImplicitIntegrator::getMethodMinOrder() const {
    return updImpl().getScheme().getLowestOrder();
}
int ImplicitIntegrator::getMethodMaxOrder() const {
    return updImpl().getScheme().getMaximumOrder();
}
Real ImplicitIntegrator::getAccuracyInUse() const {
    return updImpl().settings.accuracy;
}
Real ImplicitIntegrator::getConstraintToleranceInUse() const {
    const StepSettings& settings = updImpl().settings;
    return settings.ownConstraintTolerance.value_or(settings.constraintTolerance);
}

void ImplicitIntegrator::resetAllStatistics() {
    updImpl().statisticsAtReset = updImpl().statistics;
}

Real ImplicitIntegrator::getActualInitialStepSizeTaken() const {
    return updImpl().stepsTaken.firstLength;
}
Real ImplicitIntegrator::getPredictedNextStepSize() const {
    return updImpl().getPredictedNextStepSize();
}
int ImplicitIntegrator::getNumStepsAttempted() const {
    return updImpl().count(&IntegratorStatistics::stepsAttempted);
}
int ImplicitIntegrator::getNumStepsTaken() const {
    return updImpl().count(&IntegratorStatistics::stepsTaken);
}
int ImplicitIntegrator::getNumRealizations() const {
    return getNumIterations() + getNumProjections() +
           updImpl().count(&IntegratorStatistics::starts);
}
int ImplicitIntegrator::getNumQProjections() const {
    return updImpl().count(&IntegratorStatistics::projections);
}
int ImplicitIntegrator::getNumUProjections() const {
    return 0;  // speeds follow from the equations of a step
}
int ImplicitIntegrator::getNumErrorTestFailures() const {
    return updImpl().count(&IntegratorStatistics::errorTestFailures);
}
int ImplicitIntegrator::getNumConvergenceTestFailures() const {
    return updImpl().count(&IntegratorStatistics::convergenceFailures) +
           getNumProjectionFailures() + getNumRealizationFailures();
}
int ImplicitIntegrator::getNumRealizationFailures() const {
    return updImpl().count(&IntegratorStatistics::nonFiniteFailures);
}
int ImplicitIntegrator::getNumQProjectionFailures() const {
    return updImpl().count(&IntegratorStatistics::projectionFailures);
}
int ImplicitIntegrator::getNumConvergentIterations() const {
    return getNumIterations() - getNumDivergentIterations();
}
int ImplicitIntegrator::getNumDivergentIterations() const {
    return updImpl().count(&IntegratorStatistics::divergentIterations);
}
int ImplicitIntegrator::getNumIterations() const {
    return updImpl().count(&IntegratorStatistics::newtonIterations);
}

}  // namespace simflex
