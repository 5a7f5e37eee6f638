#pragma once
/** @file
Connectors and loads of a model in its pictures (private to this room). **/

#include "simflex/model/Model.h"
#include "simflex/render/OffscreenVisualizer.h"

namespace simflex {
namespace model {

/** Adds those of the model file. @throws ModelError. **/
void addForces(const Model& model, OffscreenVisualizer& viz);

}  // namespace model
}  // namespace simflex
