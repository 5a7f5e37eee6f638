#pragma once
/** @file
Rigid bodies of a model file: mass properties given or from a shape, and how they are drawn. **/

#include "simflex/model/file/ModelValue.h"

namespace simflex {
namespace model {

/** With decorations. @param value  of `bodies` **/
SimTK::Body::Rigid makeRigidBody(const ModelValue& value);

/** A colour by name, as '#rrggbb' or [r, g, b] with parts from 0 to 1. **/
SimTK::Vec3 readColor(const ModelValue& value);

/** Names of colours. **/
std::vector<std::string> listColors();

}  // namespace model
}  // namespace simflex
