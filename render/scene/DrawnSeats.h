#pragma once
/** @file
Where attachment frames are on parts that are drawn with their deformation exaggerated, and how
large their seats are. Internal to the renderer. **/

#include <vector>

#include "JointSymbols.h"
#include "Simbody.h"
#include "simflex/body/Attachment.h"

namespace simflex {

/** Pose in Ground. Stage::Position. **/
SimTK::Transform calcDrawnPose(const SimTK::SimbodyMatterSubsystem& matter,
                               const SimTK::State& state, const Attachment& frame, double factor);

/** Size of the first frame's seat that is an interface: mean distance of its nodes from the frame's
z axis, and how far they go along it; a twentieth of `scale` if there is none. **/
SymbolSize calcSeatSize(const SimTK::SimbodyMatterSubsystem& matter,
                        const std::vector<const Attachment*>& frames, double scale);

}  // namespace simflex
