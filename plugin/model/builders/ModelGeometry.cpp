#include "simflex/model/builders/ModelGeometry.h"

namespace simflex {
namespace model {

using namespace SimTK;

CoordinateAxis readAxis(const ModelValue& value) {
    return CoordinateAxis(value.getText()[0] - 'x');
}

UnitVec3 readDirection(const ModelValue& value) {
    if (!value.isList()) return UnitVec3(readAxis(value));
    const Vec3 direction = value.getVec3();
    if (direction.norm() == 0) value.fail("[0, 0, 0] is not a direction");
    return UnitVec3(direction);
}

Vec3 readVec3(const ModelValue& value) {
    return value.isGiven() ? value.getVec3() : Vec3(0);
}

Rotation readRotation(const ModelValue& value) {
    if (!value.isGiven()) return Rotation();
    if (!value.isMap()) {
        const Vec3 angles = value.getVec3();
        Rotation rotation;
        rotation.setRotationToBodyFixedXYZ(angles);
        return rotation;
    }
    if (value.has("quaternion")) {
        const ModelValue quaternion = value.get("quaternion");
        const Vec4 coefficients(quaternion.getNumbers().data());
        if (coefficients.norm() == 0) quaternion.fail("[0, 0, 0, 0] is not a rotation");
        return Rotation(Quaternion(coefficients));
    }
    return Rotation(value.get("angle").getNumber(), readDirection(value.get("axis")));
}

Transform readPose(const ModelValue& map) {
    if (!map.isGiven()) return Transform();
    return Transform(readRotation(map.get("rotation")), readVec3(map.get("position")));
}

}  // namespace model
}  // namespace simflex
