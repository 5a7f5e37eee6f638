#pragma once
/** @file
Sizes of joint seats. Internal to the renderer. **/

#include <vector>

#include "JointSymbols.h"
#include "Simbody.h"
#include "simflex/body/Attachment.h"

namespace simflex {

/** Returns the size of the first frame's seat that is an interface: mean distance of its nodes from
the frame's z axis, and their extent along it; a twentieth of `scale` if there is none. **/
SymbolSize calcSeatSize(const SimTK::SimbodyMatterSubsystem& matter,
                        const std::vector<const Attachment*>& frames, double scale);

}  // namespace simflex
