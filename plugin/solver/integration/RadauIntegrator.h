#pragma once
/** @file
Radau IIA with three stages, order 5, for multibody systems with flexible bodies. A step solves

    M u̇ + b − f + Gᵀλ = 0,    G u + ∂g/∂t = 0    at t_n + c_i h,  i = 1, 2, 3
    q_i = q_n + h Σ_j a_ij N(q_j) u_j,    u_i = u_n + h Σ_j a_ij u̇_j

simultaneously: the Newton system splits into a real and a complex one, both solved by block
Gaussian elimination. It is L-stable at order 5: lightly damped fast modes do not limit the step, as
they do for BDF of order 3 and higher, and small errors need far fewer steps than at order 2.

    RadauIntegrator integrator(system);
    integrator.setAccuracy(1e-6);
    integrator.initialize(state);
    integrator.stepTo(0.1);

Everything else is as in ImplicitIntegrator.h. The global error is about as large as the accuracy,
at most 10 times that over the first ten periods of a smooth motion: the step's own error is
estimated by an embedded formula of order 3 and its change from step to step. Dense output is the
collocation polynomial, of order 3. Near singular positions steps are those of BDF2.
Formulation::Index3 is refused.
Source: E. Hairer, G. Wanner, Solving ODEs II, IV.8 and VII.4. **/

#include "simflex/solver/ImplicitIntegrator.h"

namespace simflex {

class RadauIntegrator : public ImplicitIntegrator {
public:
    /** @param system  must outlive the integrator; its topology must be realized before
    initialize()
    @throws std::invalid_argument if it is not a SimTK::MultibodySystem. **/
    explicit RadauIntegrator(const SimTK::System& system);
};

}  // namespace simflex
