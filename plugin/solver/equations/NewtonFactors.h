#pragma once
/** @file
Derivatives of u̇ and q with respect to u in one implicit step (private header):

    u̇ = (u − u_hist)/mass,    δq = stiffness·N(q) δu,    J = M/mass − ∂f/∂u − stiffness ∂f/∂q N

BDF has mass = stiffness = γ = h/α₀; generalized-α has two different ones. **/

namespace simflex {

struct NewtonFactors {
    double mass = 0, stiffness = 0;  ///< [s]

    NewtonFactors() = default;
    NewtonFactors(double gamma) : mass(gamma), stiffness(gamma) {}
    NewtonFactors(double massFactor, double stiffnessFactor)
        : mass(massFactor), stiffness(stiffnessFactor) {}
};

}  // namespace simflex
