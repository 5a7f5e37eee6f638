#pragma once
/** @file
Building blocks of symbols of joints, connectors and loads. Internal to the renderer. **/

#include <vector>

#include "SimTKcommon.h"

namespace simflex {

namespace symbol_colors {
const SimTK::Vec3 dark(0.20, 0.225, 0.265), light(0.80, 0.815, 0.835), accent(0.93, 0.62, 0.16);
}

/** Appends shapes to a list, placed in Ground. **/
class Symbol {
public:
    explicit Symbol(SimTK::Array_<SimTK::DecorativeGeometry>& geometryToFill)
        : geometry(geometryToFill) {}

    /** Adds a cylinder about the z axis of X_GS, at `offset` along it. **/
    void addCylinder(const SimTK::Transform& X_GS, double offset, double radius, double halfLength,
                     const SimTK::Vec3& color) {
        const SimTK::Rotation yToZ(SimTK::Pi / 2, SimTK::XAxis);
        add(SimTK::DecorativeCylinder(radius, halfLength),
            X_GS * SimTK::Transform(yToZ, SimTK::Vec3(0, 0, offset)), color);
    }
    void addRing(const SimTK::Transform& X_GS, double offset, double radius, double tubeRadius,
                 const SimTK::Vec3& color) {
        add(SimTK::DecorativeTorus(radius, tubeRadius),
            X_GS * SimTK::Transform(SimTK::Vec3(0, 0, offset)), color);
    }
    void addSphere(const SimTK::Vec3& center_G, double radius, const SimTK::Vec3& color) {
        add(SimTK::DecorativeSphere(radius), SimTK::Transform(center_G), color);
    }
    void addBrick(const SimTK::Transform& X_GS, const SimTK::Vec3& halfLengths,
                  const SimTK::Vec3& color) {
        add(SimTK::DecorativeBrick(halfLengths), X_GS, color);
    }
    void addPlate(const SimTK::Transform& X_GS, double side) {
        SimTK::DecorativeBrick plate(SimTK::Vec3(side, side, 0.02 * side));
        plate.setOpacity(0.35);
        add(plate, X_GS, symbol_colors::dark);
    }
    void addRod(const SimTK::Vec3& start_G, const SimTK::Vec3& end_G, double radius,
                const SimTK::Vec3& color) {
        const SimTK::Vec3 span = end_G - start_G;
        const double length = span.norm();
        if (!(length > 0)) return;
        const SimTK::Rotation alongZ(SimTK::UnitVec3(span), SimTK::ZAxis);
        addCylinder(SimTK::Transform(alongZ, start_G + 0.5 * span), 0, radius, 0.5 * length, color);
    }
    void addArrow(const SimTK::Vec3& start_G, const SimTK::Vec3& end_G, double tipLength,
                  const SimTK::Vec3& color) {
        add(SimTK::DecorativeArrow(start_G, end_G, tipLength), SimTK::Transform(), color);
    }
    void addDisc(const SimTK::Vec3& center_G, const SimTK::UnitVec3& axis, double radius,
                 double halfLength, const SimTK::Vec3& color) {
        addCylinder(SimTK::Transform(SimTK::Rotation(axis, SimTK::ZAxis), center_G), 0, radius,
                    halfLength, color);
    }
    /** Adds a round wire along these points, open at its ends. **/
    void addWire(const std::vector<SimTK::Vec3>& points_G, double radius, const SimTK::Vec3& color);
    void addCone(const SimTK::Vec3& base_G, const SimTK::UnitVec3& direction, double height,
                 double radius, const SimTK::Vec3& color) {
        SimTK::DecorativeCone cone(base_G, direction, height, radius);
        cone.setColor(color);
        geometry.push_back(cone);
    }
    void addFrame(const SimTK::Transform& X_GS, double length) {
        SimTK::DecorativeFrame frame(length);
        frame.setTransform(X_GS);
        geometry.push_back(frame);
    }

private:
    template <class Shape>
    void add(Shape shape, const SimTK::Transform& X_GS, const SimTK::Vec3& color) {
        shape.setBodyId(0).setTransform(X_GS).setColor(color);
        geometry.push_back(shape);
    }

    SimTK::Array_<SimTK::DecorativeGeometry>& geometry;
};

}  // namespace simflex
