#pragma once
/** @file
Motion of attachments, including accelerations, from an integrator's u̇.

    const std::vector<FrameMotion> motions =
        calcFrameMotions(flexible, integrator.getState(), integrator.getUDot(), {tip, bearing});
**/

#include <vector>

#include "simflex/body/Attachment.h"
#include "simflex/body/FlexibleBodySubsystem.h"

namespace simflex {

/** Computes pose, velocity and acceleration of each attachment in Ground. O(bodies).
Stage::Velocity.
@param uDot  in Simbody's numbering; empty: zero **/
std::vector<FrameMotion> calcFrameMotions(const FlexibleBodySubsystem& subsystem,
                                          const SimTK::State& state, const SimTK::Vector& uDot,
                                          const std::vector<Attachment>& attachments);

}  // namespace simflex
