#pragma once
/** @file
(With `using namespace SimTK` and `using namespace simflex` in one file the name TimeStepper alone
is ambiguous: write simflex::TimeStepper.)

SimTK::TimeStepper for either kind of integrator: reporters and event handlers are called, and
statuses returned, as Simbody's does.

    RadauIntegrator integ(system);            // was: RungeKuttaMersonIntegrator integ(system);
    simflex::TimeStepper ts(system, integ);   // was: TimeStepper ts(system, integ);
    ts.initialize(state);
    ts.stepTo(10);

An ImplicitIntegrator calls them by itself too. What differs: events that are due at the very time
of stepTo() are handled in the next call here, at once there; Termination handlers are called by the
call that returns EndOfSimulation. **/

#include <memory>
#include <optional>

#include "simflex/solver/IntegratorRef.h"

namespace simflex {

class TimeStepper {
public:
    /** @param system  must outlive the stepper; setIntegrator() before initialize() **/
    explicit TimeStepper(const SimTK::System& system);
    /** @throws std::invalid_argument if the integrator is of another system. **/
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

    /** Advances to `time`: ReachedReportTime, or EndOfSimulation where the final time is earlier,
    was returned before or a handler asked for the end. **/
    SimTK::Integrator::SuccessfulStepStatus stepTo(SimTK::Real time);

private:
    const SimTK::System* m_system;
    std::optional<IntegratorRef> m_integrator;
    std::unique_ptr<SimTK::TimeStepper> m_native;  ///< around one of Simbody's integrators
    bool m_reportsAll = false;
};

}  // namespace simflex
