#pragma once
/** @file
A multibody system's equations of motion, linearised about a State:

    M δ̈ + D δ̇ + K δ + B δz + Gᵀ δλ = 0,   G δ = 0

δ are small displacements in the directions of Simbody's speeds u (quasi-displacements: a rotation
for every ω), from the motion that passes through the State. With r = M u̇ + b − f + Gᵀλ and the
true accelerations and multipliers of the State,

    D = ∂r/∂u,   K = ∂r/∂q·N     at rest,

∂(Gᵀλ)/∂q and ∂(Mu̇)/∂q included: the restoring stiffness of a pendulum, of preloaded joints, of
gravity. For a State with speeds, δ are taken from the steady motion with these speeds and in axes
that it carries along, which point in the directions of u at this instant. Along a steady motion
every joint keeps its relative twist: a rotor spins about the axis that its bearing has now, and
what nothing links to Ground turns about an axis at rest. So bodies that are joined move as one,
however many pieces they are made of; a rotor on a bearing that does not turn shows the frequencies
that an observer at rest would see, a system that turns as one those of an observer who turns along.

With X(q) the speeds of the steady motion as it would pass through q, a(q) their rate of change, X′
the derivative along δ and δ̇ = δu − A δ by the kinematics (guide, theory),

    D = ∂r/∂u + M (2X′ − A),   K = d/dδ r(q, X(q), a(q), λ).

These are constant if the motion is steady. If they are not, `unsteady` says so, and there are no
natural modes. Bodies that the motion has yet to stretch, as in a State that is placed with its
speeds, get the accelerations and multipliers λ that they will have.

    Linearization linear = calcLinearization(system, state);
    for (const Eigenmode& mode : calcEigenmodes(linear)) std::cout << mode.frequency << " Hz\n";

M and G are exact, D and K fourth-order differences of the residual with displacements of 3e-4 of a
body's size, relative error below 1e-8 where forces are smooth; smaller ones where a kink is near,
such as a stop beyond a gap. Exactly at a kink there are no linear equations, which is said. O(n²)
in time, and dense matrices: for some hundreds of speeds; twice where something moves. SI units. **/

#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "Simbody.h"

namespace simflex {

/** A State at which a force has a kink: a stop that just touches, a friction law that jumps. **/
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
    /** States z of the model's own (StateEquation), s of them, at rest: B δz stands beside K δ, and
    δż = C δ + E δ̇ + F δz. **/
    SimTK::Matrix B, C, E, F;
    /** Of a State with speeds, empty at rest: u changes by X′δ + δ̇, u̇ by a′δ + (2X′ − A) δ̇ + δ̈. **/
    SimTK::Matrix speedsByQ, accelerationsByQ, accelerationsByU;  ///< X′, a′, 2X′ − A
    /** Of a State with speeds: the same motion a radian later, realized to Stage::Velocity. **/
    std::optional<SimTK::State> later;
    SimTK::Matrix carried;  ///< n×n: what δ become until then, as the motion carries them along
    /** n: displacement that a unit of each δ causes, at worst [m]. **/
    SimTK::Vector metres;
    /** n: nonzero for speeds that a lock or Motion prescribes, at whatever level; their δ is zero
     * and their rows and columns of D, K and G are too. **/
    SimTK::Array_<int> isHeld;
    SimTK::Array_<int> isModal;  ///< n: nonzero for modal coordinates of flexible bodies
    /** Why M, D, K and G are those of an instant only; empty if they are constant, or change little
    in a period of the slowest mode. **/
    std::string unsteady;
};

/** Linearises about a State, which must be assembled.
@param observer  called before every evaluation of forces, a few for each coordinate; an exception
    that it throws passes through
@throws NoLinearForces that names the force; std::invalid_argument that names what cannot be
supported (see ImplicitIntegrator; and nonholonomic constraints and constraints on accelerations).
**/
Linearization calcLinearization(const SimTK::MultibodySystem& system, const SimTK::State& state,
                                const std::function<void()>& observer = {});

/** Forces that damp otherwise forth than back, such as a shock absorber's, at a State at rest:
linear equations have the mean of both, as the first harmonic of a vibration does. Each in words.
**/
std::vector<std::string> listUnevenDamping(const SimTK::MultibodySystem& system,
                                           const SimTK::State& state);

/** What a State leaves of the equations of motion, with accelerations and multipliers as given. **/
struct EquationErrors {
    SimTK::Vector residual;               ///< n: M u̇ + b − f + Gᵀλ, Simbody's numbering of u
    SimTK::Vector positions, velocities;  ///< m: of constraints, g and ġ
    SimTK::Vector rates;  ///< s: ż of the system's own states, as in calcLinearization()
};
/** @throws std::invalid_argument as calcLinearization(). **/
EquationErrors calcEquationErrors(const SimTK::MultibodySystem& system, const SimTK::State& state,
                                  const SimTK::Vector& uDot, const SimTK::Vector& multipliers);

}  // namespace simflex
