#pragma once
/** @file
Adds the loads and connectors of a model file to its system. **/

#include "simflex/forces/LoadShape.h"
#include "simflex/model/builders/Placement.h"
#include "simflex/model/builders/SignalBuilder.h"

namespace simflex {
namespace model {

/** Adds forces on frames, and pressures, tractions, forces on node sets and on modes. **/
void addLoads(const ModelValue& file, const ModelFrames& frames, SignalBuilder& signals,
              ModelSystem& system);

/** Effect of a distributed load of unit size on a part. **/
LoadShape makeLoadShape(const ModelValue& load, const FlexibleBody& body);
std::vector<int> listLoadNodes(const ModelValue& load, const ReducedBody& part);

/** Adds springs, bushings, torsion springs, stops, actuators and motors. **/
void addConnectors(const ModelValue& file, const ModelFrames& frames, const Placement& placement,
                   SignalBuilder& signals, ModelSystem& system);

}  // namespace model
}  // namespace simflex
