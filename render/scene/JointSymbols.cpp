#include "JointSymbols.h"

#include <algorithm>
#include <cmath>

#include "Symbol.h"

namespace simflex {

using SimTK::Array_;
using SimTK::DecorativeGeometry;
using SimTK::Rotation;
using SimTK::Transform;
using SimTK::Vec3;

namespace {

using namespace symbol_colors;

// Returns a rotated copy whose z axis is `axis`.
Transform turnZTo(const Transform& X, SimTK::CoordinateAxis axis) {
    const Rotation& R = X.R();
    return Transform(Rotation(R.getAxisUnitVec(axis), SimTK::ZAxis,
                              Vec3(R.getAxisUnitVec(axis.getNextAxis())), SimTK::XAxis),
                     X.p());
}

}  // namespace

void appendJointSymbol(const std::string& kind, const Transform& X_GF, const Transform& X_GM,
                       const SymbolSize& size, Array_<DecorativeGeometry>& geometry) {
    Symbol symbol(geometry);
    const double r = size.radius, h = std::max(size.halfLength, 0.4 * r);
    const Vec3 middle = 0.5 * (X_GF.p() + X_GM.p());
    if (kind == "Pin") {
        const Transform X(X_GF.R(), middle);
        symbol.addCylinder(X, 0, 0.6 * r, h + 0.45 * r, dark);
        for (const double side : {-1.0, 1.0})
            symbol.addCylinder(X, side * (h + 0.16 * r), 0.95 * r, 0.1 * r, light);
    } else if (kind == "Ball") {
        symbol.addSphere(middle, 0.8 * r, dark);
        symbol.addRing(X_GF, 0, 1.0 * r, 0.16 * r, light);
    } else if (kind == "Slider") {
        symbol.addBrick(X_GF, Vec3(4 * r, 0.25 * r, 0.45 * r), dark);
        symbol.addBrick(Transform(X_GF.R(), X_GM.p()), Vec3(r, 0.55 * r, 0.75 * r), light);
    } else if (kind == "Weld") {
        symbol.addBrick(Transform(X_GF.R(), middle), Vec3(0.7 * r), dark);
    } else if (kind == "Cylinder" || kind == "Screw") {
        symbol.addCylinder(X_GF, 0, 0.5 * r, h + 2 * r, dark);
        symbol.addCylinder(Transform(X_GF.R(), X_GM.p()), 0, 0.85 * r, 0.6 * r, light);
        if (kind == "Screw")
            for (int turn = -4; turn <= 4; ++turn)
                symbol.addRing(X_GF, turn * (h + 1.8 * r) / 4, 0.5 * r, 0.12 * r, dark);
    } else if (kind == "Universal") {
        symbol.addCylinder(turnZTo(Transform(X_GF.R(), middle), SimTK::XAxis), 0, 0.25 * r, 1.1 * r,
                           dark);
        symbol.addCylinder(turnZTo(Transform(X_GM.R(), middle), SimTK::YAxis), 0, 0.25 * r, 1.1 * r,
                           light);
        symbol.addSphere(middle, 0.45 * r, dark);
    } else if (kind == "Planar") {
        symbol.addPlate(X_GF, 3 * r);
        symbol.addCylinder(Transform(X_GF.R(), X_GM.p()), 0, r, 0.12 * r, dark);
    } else if (kind == "PointOnLine") {
        symbol.addCylinder(X_GF, 0, 0.18 * r, h + 3 * r, dark);
        symbol.addSphere(X_GM.p(), 0.55 * r, light);
    } else if (kind == "PointInPlane") {
        symbol.addPlate(X_GF, 3 * r);
        symbol.addSphere(X_GM.p(), 0.55 * r, dark);
    } else if (kind == "Rod") {
        symbol.addRod(X_GF.p(), X_GM.p(), 0.22 * r, dark);
        symbol.addSphere(X_GF.p(), 0.5 * r, light);
        symbol.addSphere(X_GM.p(), 0.5 * r, light);
    } else if (kind == "PrescribedRotation") {
        // Arrows around a ring, in the direction of rotation.
        symbol.addRing(Transform(X_GF.R(), middle), 0, 1.6 * r, 0.09 * r, accent);
        for (const double angle : {0.5, 0.5 + 2 * SimTK::Pi / 3, 0.5 + 4 * SimTK::Pi / 3}) {
            const Vec3 out(std::cos(angle), std::sin(angle), 0),
                forward(-std::sin(angle), std::cos(angle), 0);
            SimTK::DecorativeCone tip(middle + X_GF.R() * (1.6 * r * out),
                                      SimTK::UnitVec3(X_GF.R() * forward), 0.6 * r, 0.27 * r);
            tip.setColor(accent);
            geometry.push_back(tip);
        }
    } else if (kind == "PrescribedTranslation") {
        const Vec3 span = X_GM.p() - X_GF.p();
        symbol.addSphere(X_GF.p(), 0.3 * r, accent);
        if (span.norm() > 0.5 * r) symbol.addArrow(X_GF.p(), X_GM.p(), 0.8 * r, accent);
    } else if (kind == "PrescribedPosition" || kind == "PrescribedPose") {
        symbol.addSphere(X_GM.p(), 0.4 * r, accent);
        symbol.addFrame(X_GM, 2 * r);
    } else {
        symbol.addSphere(middle, 0.6 * r, dark);
    }
}

void appendCouplerSymbol(const std::vector<Transform>& frames, const SymbolSize& size,
                         Array_<DecorativeGeometry>& geometry) {
    Symbol symbol(geometry);
    for (std::size_t i = 0; i < frames.size(); ++i) {
        symbol.addRing(frames[i], 0, 1.3 * size.radius, 0.1 * size.radius, accent);
        if (i > 0) symbol.addRod(frames[i - 1].p(), frames[i].p(), 0.07 * size.radius, accent);
    }
}

}  // namespace simflex
