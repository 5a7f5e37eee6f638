#pragma once
/** @file
A multibody system's equations of motion, linearised about a State:

    M δ̈ + D δ̇ + K δ + B δz + Gᵀ δλ = 0,   G δ = 0

δ are small displacements along Simbody's speeds u (quasi-displacements: a rotation for each ω),
relative to the motion through the State. With r = M u̇ + b − f + Gᵀλ and the true accelerations and
multipliers of the State,

    D = ∂r/∂u,   K = ∂r/∂q·N     at rest,

including ∂(Gᵀλ)/∂q and ∂(Mu̇)/∂q: the restoring stiffness of pendulums, preloaded joints and
gravity. For a State with speeds, δ are relative to the steady motion with these speeds, in axes
that it carries along and that have the directions of u at this instant. In a steady motion every
joint keeps its relative twist: a rotor spins about the current axis of its bearing, and a body not
linked to Ground turns about an axis at rest. Jointed bodies therefore move as one, however many
pieces they consist of. A rotor on a bearing that does not turn has the frequencies seen by an
observer at rest; a system that turns as a whole has those seen by a co-rotating observer.

With X(q) the speeds of the steady motion through q, a(q) their rate of change, X′ the derivative
along δ, and δ̇ = δu − A δ by the kinematics (guide, theory),

    D = ∂r/∂u + M (2X′ − A),   K = d/dδ r(q, X(q), a(q), λ).

These are constant if the motion is steady. Otherwise `unsteady` gives the reason, and there are no
natural modes. Bodies that are not yet stretched by the motion, as in a State that was only given
speeds, have the accelerations and multipliers λ of the stretched ones.

    Linearization linear = calcLinearization(system, state);
    for (const Eigenmode& mode : calcEigenmodes(linear)) std::cout << mode.frequency << " Hz\n";

M and G are exact; D and K are fourth-order differences of the residual with displacements of 3e-4
of a body's size, with relative error below 1e-8 for smooth forces; steps are smaller near a kink,
such as a stop beyond a gap. Exactly at a kink NoLinearForces is thrown. O(n²) time and dense
matrices, suitable for some hundreds of speeds; twice the time for States with speeds. SI units. **/

#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "Simbody.h"

namespace simflex {

/** A force has a kink at the State: a stop that just touches, a friction law that jumps. **/
class NoLinearForces : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

struct OperatingPoint {
    SimTK::State state;         ///< realized to Stage::Velocity
    SimTK::Vector uDot;         ///< n: accelerations there
    SimTK::Vector multipliers;  ///< m: joints in order, then Simbody's constraints
};

struct Linearization : OperatingPoint {
    SimTK::Matrix M, D, K;  ///< n×n, Simbody's numbering of u
    SimTK::Matrix G;        ///< m×n
    /** States z of the model's own (StateEquation), s of them, at rest: B δz is added to K δ, and
    δż = C δ + E δ̇ + F δz. **/
    SimTK::Matrix B, C, E, F;
    /** For a State with speeds, empty at rest: u changes by X′δ + δ̇, u̇ by a′δ + (2X′ − A) δ̇ +
    δ̈. **/
    SimTK::Matrix speedsByQ, accelerationsByQ, accelerationsByU;  ///< X′, a′, 2X′ − A
    /** For a State with speeds: the same motion a radian later, realized to Stage::Velocity. **/
    std::optional<SimTK::State> later;
    SimTK::Matrix carried;  ///< n×n: maps δ to their values in `later`, carried by the motion
    /** n: largest displacement per unit of each δ [m]. **/
    SimTK::Vector metres;
    /** n: nonzero for speeds prescribed by a lock or Motion at any level; their δ is zero, and so
    are their rows and columns of D, K and G. **/
    SimTK::Array_<int> isHeld;
    SimTK::Array_<int> isModal;  ///< n: nonzero for modal coordinates of flexible bodies
    /** Why M, D, K and G hold at an instant only; empty if they are constant, or nearly so over a
    period of the slowest mode. **/
    std::string unsteady;
};

/** Linearises about an assembled State.
@param observer  called before every evaluation of forces, a few times per coordinate; an exception
    that it throws is passed on
@throws NoLinearForces that names the force; std::invalid_argument that names an unsupported element
(see ImplicitIntegrator; also nonholonomic constraints and constraints on accelerations). **/
Linearization calcLinearization(const SimTK::MultibodySystem& system, const SimTK::State& state,
                                const std::function<void()>& observer = {});

/** Describes each force at a State at rest that damps differently in the two directions, such as a
shock absorber's. The linear equations use the mean of both, as in the first harmonic of a
vibration. **/
std::vector<std::string> listUnevenDamping(const SimTK::MultibodySystem& system,
                                           const SimTK::State& state);

/** Residuals of the equations of motion at a State, with given accelerations and multipliers. **/
struct EquationErrors {
    SimTK::Vector residual;               ///< n: M u̇ + b − f + Gᵀλ, Simbody's numbering of u
    SimTK::Vector positions, velocities;  ///< m: constraint errors g and ġ
    SimTK::Vector rates;  ///< s: ż of the system's own states, as in calcLinearization()
};
/** @throws std::invalid_argument as calcLinearization(). **/
EquationErrors calcEquationErrors(const SimTK::MultibodySystem& system, const SimTK::State& state,
                                  const SimTK::Vector& uDot, const SimTK::Vector& multipliers);

}  // namespace simflex
