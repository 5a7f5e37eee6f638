#pragma once
/** @file
Exact accelerations of a Simbody system with PointMassParts, without the plugin's equations: one
dense matrix over Simbody's speeds,

    [ M  Gᵀ ] [u̇]   [−R(0)]
    [ G  0  ] [λ] = [−A(0)]

R(u̇) is Simbody's own residual for the forces of other subsystems, with a flexible body's share
replaced by d'Alembert's sums over its masses, elasticity and damping; A(u̇) are Simbody's constraint
errors. Columns come from unit accelerations. **/

#include "simflex/body/FlexibleBody.h"
#include "support/PointMassMotion.h"

namespace simflex::test {

struct FlexibleMasses {
    FlexibleBody body;
    PointMassPart part;
    double dampingRatio = 0;
};

struct NativeReference {
    Eigen::VectorXd uDot, multipliers;
};

/** Returns the motion of a body in a State realized to Stage::Velocity, with zero
accelerations. **/
PointMassMotion getMotion(const FlexibleMasses& body, const SimTK::State& state);

/** Speeds prescribed by a lock or Motion keep the accelerations in `known`. Multipliers are the
minimum-norm ones. Forces of simflex's own elements are left out, except those of `bodies`.
@param state  realized to Stage::Velocity **/
NativeReference calcNativeReference(const SimTK::MultibodySystem& system,
                                    const FlexibleBodySubsystem& flexible,
                                    const std::vector<FlexibleMasses>& bodies,
                                    const SimTK::State& state, const SimTK::Vector& known);

/** Returns the rate of the system's kinetic energy from Simbody's accelerations alone [W]: the
power of all forces, including velocity-dependent ones. **/
SimTK::Real calcPowerOfForces(const FlexibleBodySubsystem& flexible, const SimTK::State& state);

}  // namespace simflex::test
