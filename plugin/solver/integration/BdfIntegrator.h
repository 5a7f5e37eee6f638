#pragma once
/** @file
Variable-step, variable-order BDF for multibody systems with flexible bodies. With γ = h/α₀ each
step has

    u̇ = (u − u_hist)/γ,    q = q_hist + γ N(q) u

and what ImplicitIntegrator.h says of all implicit integrators. A start or restart takes its first
step with the trapezoidal rule (BDF2 through the start's values and derivatives), so no step is
taken at order 1.

With order p the error of the result falls as accuracy^(p/(p+1)): 2/3 at order 2, which flexible
bodies get, 5/6 at order 5. At the same accuracy it is 3 to 100 times that of Runge–Kutta–Merson or
RadauIntegrator, which is the one to take for an error about as large as the accuracy.

    BdfIntegrator integrator(system);
    integrator.setMaximumOrder(2);
    integrator.initialize(state);
    integrator.stepTo(0.1);

Source: C. Yang et al., Appl. Sci. 2025, 15(8), 4541; E. Hairer, G. Wanner, Solving ODEs II, VII.2.
**/

#include "simflex/solver/ImplicitIntegrator.h"

namespace simflex {

class BdfIntegrator : public ImplicitIntegrator {
public:
    /** @param system  must outlive the integrator; its topology realized at the latest by
    initialize()
    @throws std::invalid_argument if it is not a SimTK::MultibodySystem. **/
    explicit BdfIntegrator(const SimTK::System& system);

    /** 1 … 5. From order 3 on BDF is not A-stable: lightly damped modes then limit the step. So the
    default follows the system: 2 where flexible bodies have modes, where something remembers what
    it was at the ends of steps (cables, Measures, hysteresis), and with setFixedStep(); else 5. **/
    void setMaximumOrder(int order);
    /** Never leaves this order once the history allows it. **/
    void setFixedOrder(int order);

    using ImplicitIntegrator::initialize;
    /** Starts from an exact history: states at t₀, t₀+h, …, oldest first, at least the order's
    number of them.
    @pre setFixedStep(h) with their spacing.
    @throws std::invalid_argument if there are too few, or their spacing is another. **/
    void initialize(const SimTK::Array_<SimTK::State>& history);
};

}  // namespace simflex
