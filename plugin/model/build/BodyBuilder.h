#pragma once
/** @file
Adds the bodies of a model file to its system. **/

#include "simflex/cli/model/Placement.h"

namespace simflex {
namespace cli {

/** All bodies, in such an order that parents come first; `system.bodies` is in the file's. **/
void addBodies(const ModelValue& file, const ModelFrames& frames, const Placement& placement,
               const Parts& parts, const ModelOptions& options, ModelSystem& system);

}  // namespace cli
}  // namespace simflex
