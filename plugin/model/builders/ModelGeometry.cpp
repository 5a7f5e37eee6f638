#include "simflex/model/builders/ModelGeometry.h"

namespace simflex {
namespace model {

using namespace SimTK;

CoordinateAxis readAxis(const ModelValue& value) {
    const std::string text = value.getText();
    if (text == "x") return XAxis;
    if (text == "y") return YAxis;
    if (text == "z") return ZAxis;
    value.fail("'" + text + "' is not an axis; write x, y or z");
}

UnitVec3 readDirection(const ModelValue& value) {
    if (!value.isList()) return UnitVec3(readAxis(value));
    const Vec3 direction = value.getVec3();
    if (direction.norm() == 0) value.fail("[0, 0, 0] is no direction");
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
    const bool hasQuaternion = value.has("quaternion"), hasAxis = value.has("axis");
    if (hasQuaternion == (hasAxis || value.has("angle")))
        value.fail("give either axis and angle, or quaternion");
    if (hasQuaternion) {
        const ModelValue quaternion = value.get("quaternion");
        const std::vector<double> e = quaternion.getNumbers();
        if (e.size() != 4) quaternion.fail("a quaternion has four numbers, [w, x, y, z]");
        const Vec4 coefficients(e[0], e[1], e[2], e[3]);
        if (coefficients.norm() == 0) quaternion.fail("[0, 0, 0, 0] is no rotation");
        return Rotation(Quaternion(coefficients));
    }
    if (!hasAxis) value.fail("an angle needs its axis: {axis: z, angle: 30*deg}");
    if (!value.has("angle")) value.fail("an axis needs its angle: {axis: z, angle: 30*deg}");
    return Rotation(value.get("angle").getNumber(), readDirection(value.get("axis")));
}

Transform readPose(const ModelValue& map) {
    if (!map.isGiven()) return Transform();
    return Transform(readRotation(map.get("rotation")), readVec3(map.get("position")));
}

}  // namespace model
}  // namespace simflex
