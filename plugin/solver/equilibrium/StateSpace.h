#pragma once
/** @file
A linearised system as a control engineer has it,

    ẋ = A x + B p,    y = C x + D p

p are small changes of inputs, y those of what is observed. Constraints are gone: with the undamped
modes X (G X = 0, XᵀMX = 1; see Eigenmodes.h) and P p the least motion, XᵀM P = 0, by which
constraints follow inputs,

    δ = X η + P p,    x = (η, η̇ + XᵀD P p, δz − E P p)

so that A has the eigenvalues that calcEigenmodes() tells and no rate of an input is needed, but
where something observed follows it.

    const Linearization linear = calcLinearization(system, state);
    const LinearOutputs outputs = differentiateOutputs(system, linear, observe);
    const StateSpace model = calcStateSpace(linear, inputs, outputs);

Dense: O(n³) for n speeds. **/

#include <stdexcept>
#include <vector>

#include "simflex/solver/Linearization.h"

namespace simflex {

/** What p inputs change in the equations. **/
struct LinearInputs {
    SimTK::Matrix forces;                    ///< n×p: on the right hand of M δ̈ + …
    SimTK::Matrix drives;                    ///< m×p: G δ = drives·p
    SimTK::Matrix direct;                    ///< o×p: in what is observed, by themselves
    SimTK::Matrix states = SimTK::Matrix();  ///< s×p: in ż; empty: nothing
};

/** How o observed numbers change with positions, speeds, accelerations, multipliers and states, all
else as it is. **/
struct LinearOutputs {
    SimTK::Matrix byQ, byU, byUDot;  ///< o×n, along δ; Simbody's numbering of u
    SimTK::Matrix byMultipliers;     ///< o×m
    SimTK::Matrix byStates;          ///< o×s
};

/** What is observed has a kink at a State, as has the size of what is zero there: it grows
whichever way the system moves. **/
struct NoDerivative : std::invalid_argument {
    explicit NoDerivative(std::vector<int> numbers);
    std::vector<int> outputs;  ///< their numbers, ascending
};

/** Differences of whatever is observed, fourth-order. Coordinates that change nothing are found
many at once, so that it takes some evaluations for each coordinate that counts.
@param observe  o numbers; the State is realized to Stage::Velocity
@throws NoDerivative. **/
LinearOutputs differentiateOutputs(
    const SimTK::MultibodySystem& system, const OperatingPoint& point,
    const std::function<std::vector<double>(const SimTK::State& state, const SimTK::Vector& uDot,
                                            const SimTK::Vector& multipliers)>& observe);

struct StateSpace {
    SimTK::Matrix A, B, C, D;
    /** o×p: y = C x + D p + D₁ṗ + D₂p̈; zero unless a drive's speed or acceleration is observed, or
    what it takes. **/
    SimTK::Matrix D1, D2;

    /** C (s − A)⁻¹B + D + s D₁ + s²D₂, o×p. @throws std::runtime_error if s is an
    eigenvalue, within 1e-7. **/
    SimTK::Matrix_<SimTK::Complex> calcTransfer(SimTK::Complex s) const;
    /** Eigenvalues of A with a positive real part, beyond what round-off makes of zeros. **/
    int countUnstable() const;
};

/** @throws std::invalid_argument for shapes that do not fit, for a drive that constraints do not
   let be followed, naming its number, and if the matrices are those of an instant only. **/
StateSpace calcStateSpace(const Linearization& linear, const LinearInputs& inputs,
                          const LinearOutputs& outputs);

/** Says what leads a State at rest away from where it is: force, body and how far; empty if no body
leaves by more than 1e-4 of its size, so that it is an equilibrium as far as vibrations can tell.
**/
std::string describeImbalance(const SimTK::MultibodySystem& system, const Linearization& linear);

}  // namespace simflex
