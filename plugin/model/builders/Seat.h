#pragma once
/** @file
Frames that joints, motions, connectors and forces hold on to. **/

#include "simflex/model/builders/ModelFrames.h"

namespace simflex {
namespace model {

/** As ModelFrames::find(); on a flexible body only its interfaces and nodes, since forces on its
own frame would bend nothing. @throws ModelError that lists the interfaces. **/
FrameOnBody findSeat(const ModelValue& frame, const ModelFrames& frames);

}  // namespace model
}  // namespace simflex
