#pragma once
/** @file
How large seats of joints are. Internal to the renderer. **/

#include <vector>

#include "JointSymbols.h"
#include "Simbody.h"
#include "simflex/body/Attachment.h"

namespace simflex {

/** Size of the first frame's seat that is an interface: mean distance of its nodes from the frame's
z axis, and how far they go along it; a twentieth of `scale` if there is none. **/
SymbolSize calcSeatSize(const SimTK::SimbodyMatterSubsystem& matter,
                        const std::vector<const Attachment*>& frames, double scale);

}  // namespace simflex
