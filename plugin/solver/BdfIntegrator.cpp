#include "simflex/solver/BdfIntegrator.h"

#include <stdexcept>

#include "simflex/solver/BdfIntegratorImpl.h"

namespace simflex {

using SimTK::Real;

namespace {

void requirePositive(Real value, const char* method) {
    if (!(value > 0))
        throw std::invalid_argument(std::string("BdfIntegrator::") + method +
                                    "(): " + std::to_string(value) + " given, must be positive");
}

}  // namespace

BdfIntegrator::BdfIntegrator(const SimTK::MultibodySystem& system)
    : m_impl(std::make_unique<Implementation>(system)) {}
BdfIntegrator::~BdfIntegrator() = default;
BdfIntegrator::BdfIntegrator(BdfIntegrator&&) noexcept = default;
BdfIntegrator& BdfIntegrator::operator=(BdfIntegrator&&) noexcept = default;

void BdfIntegrator::setAccuracy(Real accuracy) {
    requirePositive(accuracy, "setAccuracy");
    m_impl->accuracy = accuracy;
}

void BdfIntegrator::setConstraintTolerance(Real tolerance) {
    requirePositive(tolerance, "setConstraintTolerance");
    m_impl->constraintTolerance = tolerance;
}

void BdfIntegrator::setFormulation(Formulation formulation) {
    m_impl->formulation = formulation;
}
void BdfIntegrator::setBlockForm(BlockForm form) {
    m_impl->blockForm = form;
}

void BdfIntegrator::setMaximumOrder(int order) {
    if (order < 1 || order > BdfHistory::MaxOrder)
        throw std::invalid_argument("BdfIntegrator::setMaximumOrder(): " + std::to_string(order) +
                                    " given, must be 1 to 5");
    m_impl->maximumOrder = order;
}

void BdfIntegrator::setInitialStepSize(Real h) {
    requirePositive(h, "setInitialStepSize");
    m_impl->initialStep = h;
}

void BdfIntegrator::setMaximumStepSize(Real h) {
    requirePositive(h, "setMaximumStepSize");
    m_impl->maximumStep = h;
}

void BdfIntegrator::setMinimumStepSize(Real h) {
    requirePositive(h, "setMinimumStepSize");
    m_impl->minimumStep = h;
}

void BdfIntegrator::setFixedStep(Real h) {
    requirePositive(h, "setFixedStep");
    m_impl->fixedStep = h;
}

void BdfIntegrator::setFixedOrder(int order) {
    setMaximumOrder(order);
    m_impl->fixedOrder = order;
}

void BdfIntegrator::setNewtonTolerances(const NewtonTolerances& tolerances) {
    requirePositive(tolerances.displacement, "setNewtonTolerances: displacement");
    requirePositive(tolerances.multiplier, "setNewtonTolerances: multiplier");
    requirePositive(tolerances.maxIterations, "setNewtonTolerances: maxIterations");
    m_impl->newtonTolerances = tolerances;
}

void BdfIntegrator::setFinalTime(Real time) {
    m_impl->finalTime = time;
}

void BdfIntegrator::setNumThreads(int threads) {
    requirePositive(threads, "setNumThreads");
    m_impl->numThreads = threads;
}

void BdfIntegrator::setProjectInitialState(bool project) {
    m_impl->projectInitialState = project;
}

void BdfIntegrator::setNewtonSystemObserver(std::function<void(const NewtonSystem&)> observer) {
    m_impl->observer = std::move(observer);
}

void BdfIntegrator::initialize(const SimTK::State& state) {
    m_impl->initialize(state);
}
void BdfIntegrator::initialize(const SimTK::Array_<SimTK::State>& history) {
    m_impl->initialize(history);
}

BdfIntegrator::StepStatus BdfIntegrator::stepTo(Real time) {
    m_impl->requireInitialized("stepTo");
    return m_impl->stepTo(time);
}

BdfIntegrator::StepStatus BdfIntegrator::stepOnce() {
    m_impl->requireInitialized("stepOnce");
    return m_impl->stepOnce();
}

const SimTK::State& BdfIntegrator::getState() const {
    m_impl->requireInitialized("getState");
    return m_impl->getState();
}

Real BdfIntegrator::getTime() const {
    return m_impl->visibleTime;
}

SimTK::Vector BdfIntegrator::getUDot() const {
    m_impl->requireInitialized("getUDot");
    return m_impl->calcUDot();
}

SimTK::Vector BdfIntegrator::getMultipliers() const {
    m_impl->requireInitialized("getMultipliers");
    return m_impl->calcMultipliers(nullptr);
}

SimTK::Vector BdfIntegrator::getMultipliers(const SimTK::Constraint& constraint) const {
    m_impl->requireInitialized("getMultipliers");
    return m_impl->calcMultipliers(constraint);
}

SimTK::Vector BdfIntegrator::getMultipliers(const Joint& joint) const {
    m_impl->requireInitialized("getMultipliers");
    return m_impl->calcMultipliers(&joint);
}

Real BdfIntegrator::getLastStepSize() const {
    return m_impl->lastStep;
}
int BdfIntegrator::getLastOrder() const {
    return m_impl->lastOrder;
}
Real BdfIntegrator::getWork() const {
    return m_impl->visibleWork;
}
Real BdfIntegrator::getLargestConstraintError() const {
    return m_impl->constraintError;
}
const IntegratorStatistics& BdfIntegrator::getStatistics() const {
    return m_impl->statistics;
}

}  // namespace simflex
