#pragma once
/** @file
Adds the loads and connectors of a model file to its system. **/

#include "simflex/model/builders/Placement.h"

namespace simflex {
namespace model {

/** Forces on frames, and pressures, tractions, forces on node sets and on modes. **/
void addLoads(const ModelValue& file, const ModelFrames& frames, ModelSystem& system);

/** Springs, bushings, torsion springs and stops. **/
void addConnectors(const ModelValue& file, const ModelFrames& frames, const Placement& placement,
                   ModelSystem& system);

}  // namespace model
}  // namespace simflex
