#pragma once
/** @file
(With both `using namespace SimTK` and `using namespace simflex` the name TimeStepper is ambiguous:
write simflex::TimeStepper.)

SimTK::TimeStepper for either kind of integrator: calls reporters and event handlers, and returns
statuses, as Simbody's does.

    RadauIntegrator integ(system);            // was: RungeKuttaMersonIntegrator integ(system);
    simflex::TimeStepper ts(system, integ);   // was: TimeStepper ts(system, integ);
    ts.initialize(state);
    ts.stepTo(10);

An ImplicitIntegrator also calls them by itself, with two differences: it handles events due at the
exact time of stepTo() at once, TimeStepper in the next call; TimeStepper calls Termination handlers
in the call that returns EndOfSimulation. **/

#include <memory>
#include <optional>

#include "simflex/solver/IntegratorRef.h"

namespace simflex {

class TimeStepper {
public:
    /** @param system  must outlive the stepper; setIntegrator() before initialize() **/
    explicit TimeStepper(const SimTK::System& system);
    /** @throws std::invalid_argument if the integrator belongs to another system. **/
    TimeStepper(const SimTK::System& system, IntegratorRef integrator);
    ~TimeStepper();
    TimeStepper(TimeStepper&&) noexcept;
    TimeStepper& operator=(TimeStepper&&) noexcept;

    void setIntegrator(IntegratorRef integrator);
    const IntegratorRef& getIntegrator() const;
    IntegratorRef& updIntegrator();

    /** Whether stepTo() returns at reports, events, starts of continuous intervals, and internal
    steps if the integrator returns them; default false. **/
    bool getReportAllSignificantStates() const { return m_reportsAll; }
    void setReportAllSignificantStates(bool shouldReport);

    void initialize(const SimTK::State& state);
    const SimTK::State& getState() const { return getIntegrator().getState(); }
    SimTK::Real getTime() const { return getState().getTime(); }

    /** Advances to `time`. Returns ReachedReportTime, or EndOfSimulation if the final time is
    earlier or was already returned, or a handler ended the simulation. **/
    SimTK::Integrator::SuccessfulStepStatus stepTo(SimTK::Real time);

private:
    const SimTK::System* m_system;
    std::optional<IntegratorRef> m_integrator;
    std::unique_ptr<SimTK::TimeStepper> m_native;  ///< around one of Simbody's integrators
    bool m_reportsAll = false;
};

}  // namespace simflex
