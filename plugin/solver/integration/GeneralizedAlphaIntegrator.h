#pragma once
/** @file
Generalized-α for multibody systems with flexible bodies, on the Lie group of rotations: one-step,
order 2, with user-controlled damping of high frequencies and little damping of low ones.

    (1 − α_m) a_{n+1} + α_m a_n = (1 − α_f) u̇_{n+1} + α_f u̇_n
    u_{n+1} = u_n + h((1 − γ) a_n + γ a_{n+1})
    q_{n+1} = q_n exp(h u_n + h²((½ − β) a_n + β a_{n+1}))

All four constants follow from the spectral radius ρ at infinite frequency: 1 conserves the energy
of all modes (the trapezoidal rule), 0 annihilates modes far above 1/h in one step.

    GeneralizedAlphaIntegrator integrator(system);
    integrator.setSpectralRadius(0.8);
    integrator.initialize(state);
    integrator.stepTo(0.1);

Everything else is as in ImplicitIntegrator.h. Quaternions keep unit length to round-off.
Source: O. Brüls, A. Cardona, M. Arnold, Mech. Mach. Theory 48 (2012) 121–137. **/

#include "simflex/solver/ImplicitIntegrator.h"

namespace simflex {

class GeneralizedAlphaIntegrator : public ImplicitIntegrator {
public:
    /** @param system  must outlive the integrator; its topology must be realized before
    initialize()
    @throws std::invalid_argument if it is not a SimTK::MultibodySystem. **/
    explicit GeneralizedAlphaIntegrator(const SimTK::System& system);

    /** ρ at infinite frequency, 0 … 1, default 0.8. With joints use less than 1, because errors of
    accelerations along constrained directions decay only by ρ per step. **/
    void setSpectralRadius(SimTK::Real rho);
};

}  // namespace simflex
