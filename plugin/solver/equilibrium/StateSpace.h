#pragma once
/** @file
A linearised system in state-space form,

    ẋ = A x + B p,    y = C x + D p

where p are small changes of inputs and y those of outputs. Constraints are eliminated: with the
undamped modes X (G X = 0, XᵀMX = 1; see Eigenmodes.h), and P p the least motion, XᵀM P = 0, that
satisfies the constraints under the inputs,

    δ = X η + P p,    x = (η, η̇ + XᵀD P p, δz − E P p)

so that A has the eigenvalues of calcEigenmodes(), and no rate of an input is needed unless an
output depends on it.

    const Linearization linear = calcLinearization(system, state);
    const LinearOutputs outputs = differentiateOutputs(system, linear, observe);
    const StateSpace model = calcStateSpace(linear, inputs, outputs);

Dense: O(n³) for n speeds. **/

#include <stdexcept>
#include <vector>

#include "simflex/solver/Linearization.h"

namespace simflex {

/** Effect of p inputs in the equations. **/
struct LinearInputs {
    SimTK::Matrix forces;                    ///< n×p: right-hand side of M δ̈ + …
    SimTK::Matrix drives;                    ///< m×p: G δ = drives·p
    SimTK::Matrix direct;                    ///< o×p: direct effect on outputs
    SimTK::Matrix states = SimTK::Matrix();  ///< s×p: in ż; empty: none
};

/** Partial derivatives of o outputs with respect to positions, speeds, accelerations, multipliers
and states. **/
struct LinearOutputs {
    SimTK::Matrix byQ, byU, byUDot;  ///< o×n, along δ; Simbody's numbering of u
    SimTK::Matrix byMultipliers;     ///< o×m
    SimTK::Matrix byStates;          ///< o×s
};

/** An output is not differentiable at the State, such as the magnitude of a quantity that is zero
there. **/
struct NoDerivative : std::invalid_argument {
    explicit NoDerivative(std::vector<int> numbers);
    std::vector<int> outputs;  ///< indices of the outputs, ascending
};

/** Differentiates any outputs by fourth-order differences. Coordinates without effect are found in
groups, so that only the others take several evaluations each.
@param observe  returns o numbers; the State is realized to Stage::Velocity
@throws NoDerivative. **/
LinearOutputs differentiateOutputs(
    const SimTK::MultibodySystem& system, const OperatingPoint& point,
    const std::function<std::vector<double>(const SimTK::State& state, const SimTK::Vector& uDot,
                                            const SimTK::Vector& multipliers)>& observe);

struct StateSpace {
    SimTK::Matrix A, B, C, D;
    /** o×p: y = C x + D p + D₁ṗ + D₂p̈; zero unless an output depends on a drive's speed or
    acceleration, or on the force or power that drives it. **/
    SimTK::Matrix D1, D2;

    /** Returns C (s − A)⁻¹B + D + s D₁ + s²D₂, o×p.
    @throws std::runtime_error if s is an eigenvalue, within 1e-7. **/
    SimTK::Matrix_<SimTK::Complex> calcTransfer(SimTK::Complex s) const;
    /** Number of eigenvalues of A with positive real part, beyond the round-off of zeros. **/
    int countUnstable() const;
};

/** @throws std::invalid_argument for mismatched shapes, for a drive that constraints do not allow,
    naming its number, and if the matrices hold at an instant only. **/
StateSpace calcStateSpace(const Linearization& linear, const LinearInputs& inputs,
                          const LinearOutputs& outputs);

/** Describes why a State at rest is not an equilibrium: force, body and displacement; empty if no
body moves by more than 1e-4 of its size, which is negligible for vibrations. **/
std::string describeImbalance(const SimTK::MultibodySystem& system, const Linearization& linear);

}  // namespace simflex
