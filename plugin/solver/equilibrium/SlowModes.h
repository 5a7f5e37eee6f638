#pragma once
/** @file
The slowest modes of many bodies by block elimination (private header).

At rest, the undamped ones of slowest |ω² + σ|, σ small, by block Lanczos iteration with
(K + σM)⁻¹, and a count that none is missed: K − ω²M has as many negative eigenvalues as there are
slower ones (Sylvester). What damping makes of them is found in the space that they span; each
mode's residual, through the same elimination, widens it until they fulfil the damped equations.

In a steady motion, and where forces turn along with a body, the conservative part of the equations
comes first,

    H(ω) = K_s − ω²M + iωD_a,    K_s symmetric, D_a antisymmetric

(gyroscopic forces), by residuals through (s²M + sD + K)⁻¹, s real. H is Hermitian, and no vector
outside of the space may make it more negative than those inside: its eigenvalues below zero are as
many as those of its projection, or a mode is missed. Then the rest of D and K is added. **/

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "simflex/solver/Eigenmodes.h"

namespace simflex {

class SlowModes {
public:
    /** @param observer  called before evaluations of forces, and factorizations **/
    SlowModes(const SimTK::MultibodySystem& system, const SimTK::State& state,
              const std::function<void()>& observer);
    ~SlowModes();

    /** Why it does not do; empty if it does. **/
    const std::string& getObstacle() const;
    /** Rigid motions and `count` modes besides.
    @throws NoEquilibrium, std::invalid_argument as calcSlowestEigenmodes() **/
    std::vector<Eigenmode> calc(int count);

private:
    class Search;
    std::unique_ptr<Search> m_search;
};

}  // namespace simflex
