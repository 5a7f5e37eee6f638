#pragma once
/** @file
Adds the bodies of a model file to its system. **/

#include "simflex/model/builders/Placement.h"

namespace simflex {
namespace model {

/** All bodies, in such an order that parents come first; `system.bodies` is in the file's. **/
void addBodies(const ModelValue& file, const ModelFrames& frames, const Placement& placement,
               const Parts& parts, const ModelOptions& options, ModelSystem& system);

}  // namespace model
}  // namespace simflex
