#pragma once
/** @file
A StateSpace in the coordinates of its own modes,

    A = diag(A₁, A₂ …),   A_k = [σ ω; −ω σ] of a pair of poles σ ± iω, [σ] of a real one

by ascending |λ|. Poles that cannot be told apart, such as those of a free body (two zeros and one
vector) or of a symmetric rotor, share a block, which is triangular but for such pairs; so do real
ones within a factor of two, as of a mode that is damped nearly critically.

    const StateSpace low = calcModalForm(space, {ModalForm::Kind::Modal, 12});

Fast modes that are left out answer as springs do: C_k(−A_k)⁻¹B_k is added to D, so that what slow
inputs do stays as it was.

Balancing (Parlett and Reinsch 1969), a complex Schur form, ordered (Golub and Van Loan, 7.6.2) and
divided by Sylvester's equations (Bavely and Stewart 1979): O(n³). **/

#include "simflex/solver/StateSpace.h"

namespace simflex {

struct ModalForm {
    enum class Kind {
        Full,    ///< as it is
        Modal,   ///< all modes
        Minimal  ///< without modes that inputs do not reach or outputs do not see
    } kind = Kind::Full;
    /** Kept, the slowest ones, and all that share a block with them; two poles are a mode. Zeros
    and what is unstable stay. 0: all. **/
    int modes = 0;
    SimTK::Real highest = 0;  ///< |λ| that is kept [rad/s]; 0: all
};

/** @throws std::runtime_error if the modes cannot be told apart. **/
StateSpace calcModalForm(const StateSpace& space, const ModalForm& form);

}  // namespace simflex
