#pragma once
/** @file
Variable-step, variable-order BDF for multibody systems with flexible bodies. With γ = h/α₀ each
step uses

    u̇ = (u − u_hist)/γ,    q = q_hist + γ N(q) u

See ImplicitIntegrator.h for the features common to all implicit integrators. The first step after a
start or restart uses the trapezoidal rule (BDF2 through the start's values and derivatives), so no
step is taken at order 1.

At order p the global error falls as accuracy^(p/(p+1)): exponent 2/3 at order 2, the default for
flexible bodies, 5/6 at order 5. At the same accuracy it is 3 to 100 times that of
Runge–Kutta–Merson or RadauIntegrator; use RadauIntegrator for an error about as large as the
accuracy.

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
    /** @param system  must outlive the integrator; its topology must be realized before
    initialize()
    @throws std::invalid_argument if it is not a SimTK::MultibodySystem. **/
    explicit BdfIntegrator(const SimTK::System& system);

    /** 1 … 5. From order 3 on BDF is not A-stable, so lightly damped modes limit the step. The
    default is 2 if flexible bodies have modes, if something remembers values from ends of steps
    (cables, Measures, hysteresis), or with setFixedStep(); otherwise 5. **/
    void setMaximumOrder(int order);
    /** Keeps this order once the history allows it. **/
    void setFixedOrder(int order);

    using ImplicitIntegrator::initialize;
    /** Starts from an exact history: states at t₀, t₀+h, …, oldest first, at least as many as the
    order.
    They are not projected. An Initialization handler that changes q, u or z begins the run at its
    own State instead, as initialize(State) does.
    @pre setFixedStep(h) with their spacing.
    @throws std::invalid_argument if there are too few, or their spacing is different. **/
    void initialize(const SimTK::Array_<SimTK::State>& history);
};

}  // namespace simflex
