#pragma once
/** @file
Assembly of joints and constraints (private header): implemented in plugin/solver. **/

#include "Simbody.h"

namespace simflex {

/** How speeds come to fit joints: by impulses of joints, constraints and prescribed speeds alone.
 * **/
enum class SpeedJump {
    Start,  ///< as of what has been moving: deformations keep their rates wherever joints allow it
    Impact  ///< as of what is hit: deformations begin to move, too
};

/** Sets locked and prescribed coordinates, brings positions onto joints and constraints by least
deformation, and speeds with them. The State is realized to Stage::Velocity.
@param tolerance  largest position error left [m, rad]
@throws std::runtime_error naming the worst joint or constraint and its error, or a flexible body
that it would deform beyond its linear range (LinearRangeReporter.h)
@throws std::invalid_argument that names what cannot be supported (see ImplicitIntegrator) **/
void assemble(const SimTK::MultibodySystem& system, SimTK::State& state, SimTK::Real tolerance,
              SpeedJump jump = SpeedJump::Start);

}  // namespace simflex
