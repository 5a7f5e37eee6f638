#pragma once
/** @file
Directions, rotations and poses of a model file. **/

#include "simflex/model/file/ModelValue.h"

namespace simflex {
namespace model {

/** `x`, `y`, `z` or [x, y, z]. @throws ModelError if it has no length. **/
SimTK::UnitVec3 readDirection(const ModelValue& value);

/** `x`, `y` or `z`. **/
SimTK::CoordinateAxis readAxis(const ModelValue& value);

/** [a, b, c] body-fixed x-y-z angles, {axis, angle} or {quaternion}; identity if not given. **/
SimTK::Rotation readRotation(const ModelValue& value);

/** `position` and `rotation` of a map; what is not given is zero. **/
SimTK::Transform readPose(const ModelValue& map);

/** A vector; zero if it is not given. **/
SimTK::Vec3 readVec3(const ModelValue& value);

}  // namespace model
}  // namespace simflex
