#include "simflex/solver/ImplicitIntegrator.h"

#include <stdexcept>

#include "simflex/solver/ImplicitIntegratorImpl.h"

namespace simflex {

using SimTK::Real;

namespace {

void requirePositive(Real value, const char* method) {
    if (!(value > 0))
        throw std::invalid_argument(std::string("ImplicitIntegrator::") + method +
                                    "(): " + std::to_string(value) + " given, must be positive");
}

}  // namespace

ImplicitIntegrator::ImplicitIntegrator(std::unique_ptr<Implementation> implementation)
    : m_impl(std::move(implementation)) {}
ImplicitIntegrator::~ImplicitIntegrator() = default;
ImplicitIntegrator::ImplicitIntegrator(ImplicitIntegrator&&) noexcept = default;
ImplicitIntegrator& ImplicitIntegrator::operator=(ImplicitIntegrator&&) noexcept = default;

void ImplicitIntegrator::setAccuracy(Real accuracy) {
    m_impl->requireNotInitialized("setAccuracy");
    requirePositive(accuracy, "setAccuracy");
    m_impl->accuracy = accuracy;
}

void ImplicitIntegrator::setConstraintTolerance(Real tolerance) {
    m_impl->requireNotInitialized("setConstraintTolerance");
    requirePositive(tolerance, "setConstraintTolerance");
    m_impl->constraintTolerance = tolerance;
}

void ImplicitIntegrator::setFormulation(Formulation formulation) {
    m_impl->requireNotInitialized("setFormulation");
    m_impl->formulation = formulation;
}
void ImplicitIntegrator::setBlockForm(BlockForm form) {
    m_impl->requireNotInitialized("setBlockForm");
    m_impl->blockForm = form;
}

void ImplicitIntegrator::setInitialStepSize(Real h) {
    m_impl->requireNotInitialized("setInitialStepSize");
    requirePositive(h, "setInitialStepSize");
    m_impl->initialStep = h;
}

void ImplicitIntegrator::setMaximumStepSize(Real h) {
    m_impl->requireNotInitialized("setMaximumStepSize");
    requirePositive(h, "setMaximumStepSize");
    m_impl->maximumStep = h;
}

void ImplicitIntegrator::setMinimumStepSize(Real h) {
    m_impl->requireNotInitialized("setMinimumStepSize");
    requirePositive(h, "setMinimumStepSize");
    m_impl->minimumStep = h;
}

void ImplicitIntegrator::setFixedStep(Real h) {
    m_impl->requireNotInitialized("setFixedStep");
    requirePositive(h, "setFixedStep");
    m_impl->fixedStep = h;
}

void ImplicitIntegrator::setNewtonTolerances(const NewtonTolerances& tolerances) {
    m_impl->requireNotInitialized("setNewtonTolerances");
    requirePositive(tolerances.displacement, "setNewtonTolerances: displacement");
    requirePositive(tolerances.multiplier, "setNewtonTolerances: multiplier");
    requirePositive(tolerances.maxIterations, "setNewtonTolerances: maxIterations");
    m_impl->newtonTolerances = tolerances;
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
    m_impl->breaks.add(std::move(times));
}

void ImplicitIntegrator::addBreakTimes(std::function<Real(Real time)> next) {
    m_impl->requireNotInitialized("addBreakTimes");
    if (!next) throw std::invalid_argument(m_impl->name + "::addBreakTimes(): an empty function");
    m_impl->breaks.add(std::move(next));
}

void ImplicitIntegrator::setProjectInitialState(bool project) {
    m_impl->requireNotInitialized("setProjectInitialState");
    m_impl->projectInitialState = project;
}

void ImplicitIntegrator::addForceJacobian(const SimTK::Force& force,
                                          const std::vector<SimTK::MobilizedBodyIndex>& bodies) {
    m_impl->requireNotInitialized("addForceJacobian");
    if (force.isEmptyHandle())
        throw std::invalid_argument(m_impl->name + "::addForceJacobian(): an empty Force");
    m_impl->differentiated.push_back({force, bodies});
}

void ImplicitIntegrator::addForceJacobian(const std::vector<SimTK::MobilizedBodyIndex>& bodies) {
    m_impl->requireNotInitialized("addForceJacobian");
    if (bodies.empty())
        throw std::invalid_argument(m_impl->name + "::addForceJacobian(): no bodies named");
    m_impl->differentiated.push_back({SimTK::Force(), bodies});
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

void ImplicitIntegrator::writeCheckpoint(std::ostream& stream) {
    m_impl->requireInitialized("writeCheckpoint");
    m_impl->writeCheckpoint(stream);
}

void ImplicitIntegrator::readCheckpoint(std::istream& stream, const SimTK::State& start) {
    m_impl->readCheckpoint(stream, start);
}

const SimTK::State& ImplicitIntegrator::getState() const {
    m_impl->requireInitialized("getState");
    return m_impl->getState();
}

Real ImplicitIntegrator::getTime() const {
    return m_impl->getTime();
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

Real ImplicitIntegrator::getLastStepSize() const {
    return m_impl->lastStep;
}
int ImplicitIntegrator::getLastOrder() const {
    return m_impl->lastOrder;
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

}  // namespace simflex
