#pragma once
/** @file
Radau IIA with three stages, order 5, for multibody systems with flexible bodies. A step solves

    M u̇ + b − f + Gᵀλ = 0,    G u + ∂g/∂t = 0    at t_n + c_i h,  i = 1, 2, 3
    q_i = q_n + h Σ_j a_ij N(q_j) u_j,    u_i = u_n + h Σ_j a_ij u̇_j

all at once: Newton's system falls into a real and a complex one, both solved by block Gaussian
elimination. L-stable at order 5: lightly damped fast modes do not limit the step, as they do BDF of
order 3 and more, and steps are far longer than those of order 2 where a small error is wanted.

    RadauIntegrator integrator(system);
    integrator.setAccuracy(1e-6);
    integrator.initialize(state);
    integrator.stepTo(0.1);

Everything else is as in ImplicitIntegrator.h. The error of the result is about as large as the
accuracy, 10 times that at most over the first ten periods of a smooth motion: an embedded formula
of order 3, and how far it changes from step to step, tell the error of the step itself. Inside a
step the solution is the collocation polynomial, of order 3. Near singular positions steps are those
of BDF2. Formulation::Index3 is refused.
Source: E. Hairer, G. Wanner, Solving ODEs II, IV.8 and VII.4. **/

#include "simflex/solver/ImplicitIntegrator.h"

namespace simflex {

class RadauIntegrator : public ImplicitIntegrator {
public:
    /** @param system  must outlive the integrator; its topology realized at the latest by
    initialize()
    @throws std::invalid_argument if it is not a SimTK::MultibodySystem. **/
    explicit RadauIntegrator(const SimTK::System& system);
};

}  // namespace simflex
