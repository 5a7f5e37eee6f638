// Construction of an integrator; its settings and when they may change.
#include <utility>

#include "simflex/solver/integration/ImplicitIntegratorImpl.h"

namespace simflex {

using SimTK::Real;

namespace {

const SimTK::MultibodySystem& requireMultibodySystem(const SimTK::System& system,
                                                     const std::string& integrator) {
    if (!SimTK::MultibodySystem::isInstanceOf(system))
        throw std::invalid_argument(integrator +
                                    ": the System is not a SimTK::MultibodySystem; for other "
                                    "equations take one of Simbody's integrators");
    return SimTK::MultibodySystem::downcast(system);
}

}  // namespace

ImplicitIntegrator::Implementation::Implementation(
    std::string integratorName, const SimTK::System& system,
    std::unique_ptr<IntegrationScheme> integrationScheme)
    : name(std::move(integratorName)),
      m_system(requireMultibodySystem(system, name)),
      m_scheme(std::move(integrationScheme)),
      m_events(m_system),
      m_image(m_system) {}

void ImplicitIntegrator::Implementation::requireInitialized(const char* method) const {
    if (!m_isInitialized) throw std::logic_error(name + "::" + method + "() before initialize()");
}

void ImplicitIntegrator::Implementation::requireNotRunning(const char* method) const {
    if (isRunning())
        throw std::logic_error(name + "::" + method +
                               "() by a reporter, handler, observer or force of the same "
                               "integration: call it between calls of initialize() and stepTo()");
}

void ImplicitIntegrator::Implementation::requireReady(const char* method) const {
    requireNotRunning(method);
    requireInitialized(method);
}

void ImplicitIntegrator::Implementation::requireNotEvaluating(const char* method) const {
    if (m_activity == Activity::Evaluating)
        throw std::logic_error(name + "::" + method +
                               "() by a force, constraint or other element that is evaluated in a "
                               "step: call it from a reporter, handler or step observer, or "
                               "between calls of stepTo()");
}

void ImplicitIntegrator::Implementation::requireSolution(const char* method) const {
    requireNotEvaluating(method);
    requireInitialized(method);
}

void ImplicitIntegrator::Implementation::requireNotInitialized(const char* method) const {
    if (hasBegun())
        throw std::logic_error(name + "::" + method +
                               "() after initialize(): an integration keeps the settings it began "
                               "with; set them before, or make another integrator");
}

void ImplicitIntegrator::Implementation::setFinalTime(Real time) {
    requireNotEvaluating("setFinalTime");
    if (m_isInitialized && !(time >= getNewestTime()))
        throw std::invalid_argument(name + "::setFinalTime(): time " + std::to_string(time) +
                                    " s is before " + std::to_string(getNewestTime()) +
                                    " s, which has been reached already");
    finalTime = time;
    noteFinalTime();
}

void ImplicitIntegrator::Implementation::noteFinalTime() {
    const bool isReached = !(m_visible.t < finalTime);
    m_isFinished = m_isFinished && isReached;
    m_isFinalTimeReturned = m_isFinalTimeReturned && isReached;
    m_isOver = m_isOver && isReached;
}

void ImplicitIntegrator::Implementation::set(const std::function<void(StepSettings&)>& change) {
    change(m_waiting);
    if (!hasBegun()) settings = m_waiting;
}

void ImplicitIntegrator::Implementation::adjust(
    const std::function<void(AdjustableSettings&)>& change) {
    change(m_waiting);
    m_areAdjusted = true;
    if (!isRunning()) takeAdjustments();
}

void ImplicitIntegrator::Implementation::takeAdjustments() {
    if (!std::exchange(m_areAdjusted, false)) return;
    static_cast<AdjustableSettings&>(settings) = m_waiting;
    if (m_stepper) m_stepper->takeAdjustments();
}

void ImplicitIntegrator::Implementation::setMinimumStep(Real h) {
    if (hasBegun() && m_waiting.maximumStep > 0 && h > m_waiting.maximumStep)
        throw std::invalid_argument(name + "::setMinimumStepSize(): above setMaximumStepSize()");
    adjust([&](AdjustableSettings& s) { s.minimumStep = h; });
}

void ImplicitIntegrator::Implementation::setMaximumStep(Real h) {
    if (hasBegun() && h < std::max(m_waiting.minimumStep, m_waiting.fixedStep))
        throw std::invalid_argument(name +
                                    "::setMaximumStepSize(): below setMinimumStepSize() or "
                                    "setFixedStep()");
    adjust([&](AdjustableSettings& s) { s.maximumStep = h; });
}

void ImplicitIntegrator::Implementation::setFixedStep(Real h) {
    if (hasBegun() && m_waiting.maximumStep > 0 && h > m_waiting.maximumStep)
        throw std::invalid_argument(name + "::setFixedStep(): above setMaximumStepSize()");
    adjust([&](AdjustableSettings& s) { s.fixedStep = h; });
}

}  // namespace simflex
