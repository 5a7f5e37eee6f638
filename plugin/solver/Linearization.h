#pragma once
/** @file
A multibody system's equations of motion, linearised about a State:

    M δ̈ + D δ̇ + K δ + Gᵀ δλ = 0,   G δ = 0

δ are small displacements in the directions of Simbody's speeds u (quasi-displacements: a rotation
for every ω), from the motion that passes through the State. With r = M u̇ + b − f + Gᵀλ and the
true accelerations and multipliers of the State,

    D = ∂r/∂u,   K = ∂r/∂q·N     at rest,

∂(Gᵀλ)/∂q and ∂(Mu̇)/∂q included: the restoring stiffness of a pendulum, of preloaded joints, of
gravity. For a State with speeds, D and K hold in addition what makes them matrices of δ and δ̇:
δ of the frame of a flexible body, and of a rigid body on a Free mobilizer on Ground, are taken in
axes that turn with the body and point in Ground's directions at this instant; other mobilizers keep
their own speeds. A system that turns steadily as one (a rotating beam, a spinning top in flight)
and a rigid rotor that spins on a Pin inside a system at rest then have constant matrices, and the
first shows the frequencies that an observer who turns along would see. Whatever else moves, M, D, K
and G are those of an instant.

    Linearization linear = calcLinearization(system, state);
    for (const Eigenmode& mode : calcEigenmodes(linear)) std::cout << mode.frequency << " Hz\n";

M and G are exact, D and K fourth-order differences of the residual with displacements of 3e-4 of a
body's size, relative error below 1e-8 where forces are smooth. O(n²) in time, and dense matrices:
for some hundreds of speeds. SI units. **/

#include <functional>

#include "Simbody.h"

namespace simflex {

struct Linearization {
    SimTK::State state;         ///< the operating point; realized to Stage::Velocity
    SimTK::Vector uDot;         ///< n: accelerations there
    SimTK::Vector multipliers;  ///< m: joints in order, then Simbody's constraints
    SimTK::Matrix M, D, K;      ///< n×n, Simbody's numbering of u
    SimTK::Matrix G;            ///< m×n
    /** n: displacement that a unit of each δ causes, at worst [m]. **/
    SimTK::Vector metres;
    /** n: nonzero for speeds that a lock or Motion prescribes, at whatever level; their δ is zero
     * and their rows and columns of D, K and G are too. **/
    SimTK::Array_<int> isHeld;
    SimTK::Array_<int> isModal;  ///< n: nonzero for modal coordinates of flexible bodies
};

/** Linearises about a State, which must be assembled.
@param observer  called before every evaluation of forces, a few for each coordinate; an exception
    that it throws passes through
@throws std::invalid_argument that names what cannot be supported (see ImplicitIntegrator; and
    nonholonomic constraints and constraints on accelerations). **/
Linearization calcLinearization(const SimTK::MultibodySystem& system, const SimTK::State& state,
                                const std::function<void()>& observer = {});

}  // namespace simflex
