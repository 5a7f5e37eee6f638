#pragma once
/** @file
Draws connectors and loads of a model (private to this folder). **/

#include "simflex/model/Model.h"
#include "simflex/render/OffscreenVisualizer.h"

namespace simflex {
namespace model {

/** Adds the connectors and loads of the model file.
@throws ModelError. **/
void addForces(const Model& model, OffscreenVisualizer& viz);

}  // namespace model
}  // namespace simflex
