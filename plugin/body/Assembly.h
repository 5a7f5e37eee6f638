#pragma once
/** @file
Assembly of joints and constraints (private header): implemented in plugin/solver. **/

#include "Simbody.h"

namespace simflex {

/** How speeds are made consistent with joints, constraints and prescribed speeds: by their impulses
alone. **/
enum class SpeedJump {
    Start,  ///< the body moves as before: deformation rates are kept where the joints allow it
    Impact  ///< sudden change, such as a joint that locks: deformation rates change, too
};

/** Sets locked and prescribed coordinates, closes joints and constraints with the least
deformation, and makes speeds consistent. The State is realized to Stage::Velocity.
@param tolerance  largest position error left [m, rad]
@throws std::runtime_error naming the worst joint or constraint and its error, or a flexible body
that assembly would deform beyond its linear range (LinearRangeReporter.h)
@throws std::invalid_argument naming an unsupported feature (see ImplicitIntegrator) **/
void assemble(const SimTK::MultibodySystem& system, SimTK::State& state, SimTK::Real tolerance,
              SpeedJump jump = SpeedJump::Start);

}  // namespace simflex
