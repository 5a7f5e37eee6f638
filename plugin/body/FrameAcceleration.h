#pragma once
/** @file
Motion of attachments, accelerations included, from u̇ as an integrator has it.

    const std::vector<FrameMotion> motions =
        calcFrameMotions(flexible, integrator.getState(), integrator.getUDot(), {tip, bearing}); **/

#include <vector>

#include "simflex/body/Attachment.h"
#include "simflex/body/FlexibleBodySubsystem.h"

namespace simflex {

/** Pose, velocity and acceleration in Ground of each attachment. O(bodies). Stage::Velocity.
@param uDot  in Simbody's numbering; empty: zero **/
std::vector<FrameMotion> calcFrameMotions(const FlexibleBodySubsystem& subsystem,
                                          const SimTK::State& state, const SimTK::Vector& uDot,
                                          const std::vector<Attachment>& attachments);

}  // namespace simflex
