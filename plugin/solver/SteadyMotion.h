#pragma once
/** @file
Speeds and accelerations of a steady motion as functions of the position (private header).

Every flexible body, and every rigid body on a Free mobilizer on Ground, keeps the twist (Ω, v) that
it has in the State: at another position p its origin moves with v + Ω×(p − p₀) and v̇ = Ω×(…),
undeformed speeds stay zero. Other mobilizers keep their u, with u̇ = 0. **/

#include "simflex/solver/TangentMatrices.h"

namespace simflex {

class SteadyMotion {
public:
    /** At rest. **/
    SteadyMotion() = default;
    /** With the speeds of a State; ξ̇ are taken as zero. **/
    SteadyMotion(const MultibodyEquations& equations, const SimTK::State& state, const double* q,
                 const double* u);

    /** A motion whose speeds are `factor` times these. **/
    void setFactor(double factor) { m_factor = factor; }

    /** Writes u and u̇ at a position. **/
    void calcSpeeds(const double* q, std::vector<double>& u, std::vector<double>& uDot) const;

private:
    struct Turning {
        bool isFlexible;
        int q0, p0, u0;  ///< quaternion (if flexible), position and speeds
        SimTK::Vec3 omega, v, p;
    };
    std::vector<Turning> m_turning;
    std::vector<double> m_u;
    double m_factor = 1;
};

}  // namespace simflex
