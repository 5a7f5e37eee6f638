#include "simflex/solver/TimeStepper.h"

#include <stdexcept>

#include "simflex/solver/integration/ImplicitIntegratorImpl.h"

namespace simflex {

TimeStepper::TimeStepper(const SimTK::System& system) : m_system(&system) {}
TimeStepper::TimeStepper(const SimTK::System& system, IntegratorRef integrator)
    : TimeStepper(system) {
    setIntegrator(integrator);
}
TimeStepper::~TimeStepper() = default;
TimeStepper::TimeStepper(TimeStepper&&) noexcept = default;
TimeStepper& TimeStepper::operator=(TimeStepper&&) noexcept = default;

void TimeStepper::setIntegrator(IntegratorRef integrator) {
    if (SimTK::Integrator* native = integrator.getNative()) {
        m_native = std::make_unique<SimTK::TimeStepper>(*m_system, *native);
        m_native->setReportAllSignificantStates(m_reportsAll);
    } else {
        if (!integrator.getImplicit()->updImpl().isOf(*m_system))
            throw std::invalid_argument("TimeStepper: the integrator is of another System");
        m_native.reset();
    }
    m_integrator = integrator;
}

const IntegratorRef& TimeStepper::getIntegrator() const {
    if (!m_integrator) throw std::logic_error("TimeStepper: no integrator; call setIntegrator()");
    return *m_integrator;
}

IntegratorRef& TimeStepper::updIntegrator() {
    getIntegrator();
    return *m_integrator;
}

void TimeStepper::setReportAllSignificantStates(bool shouldReport) {
    m_reportsAll = shouldReport;
    if (m_native) m_native->setReportAllSignificantStates(shouldReport);
}

void TimeStepper::initialize(const SimTK::State& state) {
    getIntegrator();
    m_native ? m_native->initialize(state) : m_integrator->initialize(state);
}

SimTK::Integrator::SuccessfulStepStatus TimeStepper::stepTo(SimTK::Real time) {
    getIntegrator();
    if (m_native) return m_native->stepTo(time);
    ImplicitIntegrator::Implementation& implementation = m_integrator->getImplicit()->updImpl();
    implementation.requireReady("stepTo");
    return implementation.stepAsTimeStepper(time, m_reportsAll);
}

}  // namespace simflex
