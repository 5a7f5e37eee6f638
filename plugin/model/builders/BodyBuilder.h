#pragma once
/** @file
Adds the bodies of a model file to its system. **/

#include "simflex/model/builders/Placement.h"

namespace simflex {
namespace model {

/** Adds all bodies, parents first; `system.bodies` keeps the file's order. **/
void addBodies(const ModelValue& file, const ModelFrames& frames, const Placement& placement,
               const Parts& parts, const ModelOptions& options, ModelSystem& system);

}  // namespace model
}  // namespace simflex
