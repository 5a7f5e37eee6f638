#pragma once
/** @file
Rigid bodies of a model file: mass properties, given or from a shape, and decorations. **/

#include "simflex/model/file/ModelValue.h"

namespace simflex {
namespace model {

/** Makes a body with decorations.
@param value  of `bodies` **/
SimTK::Body::Rigid makeRigidBody(const ModelValue& value);

/** A colour by name, as '#rrggbb' or [r, g, b] with components from 0 to 1. **/
SimTK::Vec3 readColor(const ModelValue& value);

std::vector<std::string> listColors();

}  // namespace model
}  // namespace simflex
