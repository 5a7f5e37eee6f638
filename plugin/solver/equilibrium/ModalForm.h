#pragma once
/** @file
A StateSpace in modal coordinates,

    A = diag(A₁, A₂ …),   A_k = [σ ω; −ω σ] for a pair of poles σ ± iω, [σ] for a real one

by ascending |λ|. Poles that cannot be separated, such as those of a free body (two zeros and one
vector) or of a symmetric rotor, share a block, which is triangular except for such pairs, as do
real poles within a factor of two, such as those of a nearly critically damped mode.

    const StateSpace low = calcModalForm(space, {ModalForm::Kind::Modal, 12});

Truncated fast modes are replaced by their static response: C_k(−A_k)⁻¹B_k is added to D, so that
the response to slow inputs is unchanged.

Balancing (Parlett and Reinsch 1969), an ordered complex Schur form (Golub and Van Loan, 7.6.2),
block diagonalisation by Sylvester's equations (Bavely and Stewart 1979): O(n³). **/

#include "simflex/solver/StateSpace.h"

namespace simflex {

struct ModalForm {
    enum class Kind {
        Full,    ///< unchanged
        Modal,   ///< all modes
        Minimal  ///< without uncontrollable and unobservable modes
    } kind = Kind::Full;
    /** Number of slowest modes to keep, with all that share a block with them; two poles count as a
    mode. Zero and unstable poles are always kept. 0: all. **/
    int modes = 0;
    SimTK::Real highest = 0;  ///< highest |λ| to keep [rad/s]; 0: all
};

/** @throws std::runtime_error if the modes cannot be separated. **/
StateSpace calcModalForm(const StateSpace& space, const ModalForm& form);

}  // namespace simflex
