#pragma once
/** @file
Directions, rotations and poses from a model file. **/

#include "simflex/model/file/ModelValue.h"

namespace simflex {
namespace model {

/** `x`, `y`, `z` or [x, y, z].
@throws ModelError for a zero vector. **/
SimTK::UnitVec3 readDirection(const ModelValue& value);

/** `x`, `y` or `z`. **/
SimTK::CoordinateAxis readAxis(const ModelValue& value);

/** Body-fixed x-y-z angles [a, b, c], {axis, angle} or {quaternion}; identity if not given. **/
SimTK::Rotation readRotation(const ModelValue& value);

/** `position` and `rotation` of a map; zero if not given. **/
SimTK::Transform readPose(const ModelValue& map);

/** A vector; zero if not given. **/
SimTK::Vec3 readVec3(const ModelValue& value);

}  // namespace model
}  // namespace simflex
