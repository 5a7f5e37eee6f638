#pragma once
/** @file
The slowest modes of many bodies by block elimination (private header).

At rest, the undamped modes of smallest |ω² + σ|, σ small, are found by block Lanczos iteration with
(K + σM)⁻¹, and a count ensures that none is missed: K − ω²M has as many negative eigenvalues as
there are slower modes (Sylvester). Damped modes are computed in the space that these span; each
mode's residual, solved for by the same elimination, extends it until the modes satisfy the damped
equations.

In a steady motion, and with forces that co-rotate with a body, the conservative part of the
equations comes first,

    H(ω) = K_s − ω²M + iωD_a,    K_s symmetric, D_a antisymmetric

(gyroscopic forces), by residuals through (s²M + sD + K)⁻¹, s real. H is Hermitian, so it has as
many negative eigenvalues as its projection onto the space, or a mode is missed. Then the rest of D
and K is added. **/

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "simflex/solver/Eigenmodes.h"

namespace simflex {

class SlowModes {
public:
    /** @param observer  called before evaluations of forces and before factorizations **/
    SlowModes(const SimTK::MultibodySystem& system, const SimTK::State& state,
              const std::function<void()>& observer);
    ~SlowModes();

    /** Why this method is not applicable; empty if it is. **/
    const std::string& getObstacle() const;
    /** Computes the rigid motions and `count` other modes.
    @throws NoEquilibrium, std::invalid_argument as calcSlowestEigenmodes() **/
    std::vector<Eigenmode> calc(int count);

private:
    class Search;
    std::unique_ptr<Search> m_search;
};

}  // namespace simflex
