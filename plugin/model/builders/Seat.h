#pragma once
/** @file
Frames to which joints, motions, connectors and forces attach. **/

#include "simflex/model/builders/ModelFrames.h"

namespace simflex {
namespace model {

/** Like ModelFrames::find(), but on a flexible body only interfaces and nodes, since forces on its
own frame would not deform it.
@throws ModelError that lists the interfaces. **/
FrameOnBody findSeat(const ModelValue& frame, const ModelFrames& frames);

}  // namespace model
}  // namespace simflex
