#include "ForceSymbols.h"

#include <algorithm>
#include <cmath>

#include "Symbol.h"

namespace simflex {

using SimTK::Array_;
using SimTK::DecorativeGeometry;
using SimTK::Pi;
using SimTK::Rotation;
using SimTK::Transform;
using SimTK::UnitVec3;
using SimTK::Vec3;

namespace {

using namespace symbol_colors;

const Vec3 wire(0.36, 0.41, 0.47), rubber(0.12, 0.13, 0.15);

/** The line from one end of a strut to the other. **/
struct StrutLine {
    Vec3 start, direction;
    Vec3 at(double distance) const { return start + distance * direction; }
};

// The orientation of a coil follows the frame where it starts.
Vec3 chooseAcross(const Rotation& R_GF, const Vec3& direction) {
    const Vec3 z(R_GF.z());
    const Vec3 other = std::abs(SimTK::dot(z, direction)) < 0.95 ? z : Vec3(R_GF.x());
    const Vec3 across = other - SimTK::dot(other, direction) * direction;
    return across / across.norm();
}

// Makes a coil between two distances along the line, with straight ends if it leads to the axis.
std::vector<Vec3> makeCoil(const StrutLine& line, const Vec3& across, double from, double to,
                           const StrutSize& size, bool leadsToAxis, double straight) {
    constexpr int perTurn = 24;
    const Vec3 up = SimTK::cross(line.direction, across);
    const int count = perTurn * size.numTurns;
    std::vector<Vec3> points;
    if (leadsToAxis && straight > 0) points.push_back(line.at(from - straight));
    for (int i = 0; i <= count; ++i) {
        const double share = double(i) / count, angle = 2 * Pi * size.numTurns * share;
        const double turnsToEnd = size.numTurns * std::min(share, 1 - share);
        const double ramp = leadsToAxis ? std::min(1.0, 2 * turnsToEnd) : 1;
        const double radius = size.radius * std::sqrt(ramp * (2 - ramp));
        points.push_back(line.at(from + share * (to - from)) +
                         radius * (std::cos(angle) * across + std::sin(angle) * up));
    }
    if (leadsToAxis && straight > 0) points.push_back(line.at(to + straight));
    return points;
}

}  // namespace

StrutSize chooseStrutSize(double length, double scale) {
    StrutSize size;
    size.length = length;
    size.radius = std::min(0.2 * length, std::clamp(0.075 * length, 0.02 * scale, 0.075 * scale));
    if (length > 4 * scale) {  // more a rope than a spring: straight except for its middle
        size.radius = 0.05 * scale;
        size.coil = 14 * size.radius;
    }
    size.numTurns = int(std::clamp(
        std::round(std::min(0.72 * length, size.coil) / (0.95 * size.radius)), 5.0, 14.0));
    return size;
}

void appendStrut(const Transform& X_GF, const Vec3& M_G, const StrutSize& size,
                 const StrutParts& parts, Array_<DecorativeGeometry>& geometry) {
    Symbol symbol(geometry);
    const Vec3 span = M_G - X_GF.p();
    const double length = span.norm(), r = size.radius;
    for (const bool isFirst : {true, false}) {
        const Vec3& end = isFirst ? X_GF.p() : M_G;
        symbol.addSphere(end, 0.42 * r, dark);
        if (isFirst ? parts.isFirstOnGround : parts.isSecondOnGround)
            symbol.addBrick(Transform(end), Vec3(0.62 * r), dark);
    }
    if (!(length > 0.1 * r)) return;
    const StrutLine line{X_GF.p(), span / length};
    const UnitVec3 axis(line.direction);
    const double straight =
        std::max(std::min(0.12 * size.length, 0.2 * length), 0.5 * (length - size.coil));
    const double inner = length - 2 * straight;
    const bool hasBoth = parts.hasSpring && parts.hasDamper;

    if (parts.hasDamper) {
        const double housing = hasBoth ? 0.5 * r : 0.72 * r;
        const double end =
            std::min(straight + 0.5 * (size.length - 0.24 * size.length), straight + 0.92 * inner);
        symbol.addRod(line.start, line.at(straight), 0.2 * r, dark);
        symbol.addRod(line.at(straight), line.at(end), housing, light);
        symbol.addDisc(line.at(straight), axis, 1.06 * housing, 0.07 * r, dark);
        symbol.addDisc(line.at(end), axis, 1.06 * housing, 0.07 * r, dark);
        symbol.addRod(line.at(end), M_G, 0.2 * r, dark);
    }
    if (!parts.hasSpring) return;
    const double thickness = std::min(0.15 * r, 0.4 * inner / size.numTurns);
    symbol.addWire(makeCoil(line, chooseAcross(X_GF.R(), line.direction), straight,
                            length - straight, size, !hasBoth, straight),
                   thickness, wire);
    if (!hasBoth) return;
    for (const double seat : {straight - 0.5 * thickness, length - straight + 0.5 * thickness})
        symbol.addDisc(line.at(seat), axis, 1.18 * r, 0.09 * r, light);
}

void appendTorsionSpring(const Transform& X_GF, const Transform& X_GM, const SymbolSize& size,
                         double offset, Array_<DecorativeGeometry>& geometry) {
    constexpr double turns = 3;
    constexpr int count = 96;
    Symbol symbol(geometry);
    const double outer = 2.2 * size.radius, inner = 0.75 * size.radius;
    const Vec3 middle = X_GF.p() + offset * Vec3(X_GF.R().z());
    const Vec3 x = ~X_GF.R() * Vec3(X_GM.R().x());
    const double angle = std::atan2(x[1], x[0]);
    std::vector<Vec3> points;
    for (int i = 0; i <= count; ++i) {
        const double share = double(i) / count;
        const double turned = angle + share * (2 * Pi * turns - angle);
        const double radius = inner + share * (outer - inner);
        points.push_back(middle +
                         X_GF.R() * (radius * Vec3(std::cos(turned), std::sin(turned), 0)));
    }
    symbol.addWire(points, 0.11 * size.radius, wire);
    symbol.addSphere(points.back(), 0.26 * size.radius, dark);
    symbol.addCylinder(Transform(X_GF.R(), middle), 0, inner, 0.22 * size.radius, dark);
}

void appendBushing(const Transform& X_GF, const Transform& X_GM, const SymbolSize& size,
                   Array_<DecorativeGeometry>& geometry) {
    Symbol symbol(geometry);
    const double r = size.radius, h = std::max(size.halfLength, 0.4 * r);
    symbol.addCylinder(X_GF, 0, 1.25 * r, h + 0.15 * r, rubber);
    symbol.addCylinder(X_GM, 0, 0.75 * r, h + 0.3 * r, light);
    symbol.addCylinder(X_GM, 0, 0.4 * r, h + 0.45 * r, dark);
    if ((X_GM.p() - X_GF.p()).norm() > 1.5 * r) symbol.addRod(X_GF.p(), X_GM.p(), 0.15 * r, dark);
}

void appendStop(const Transform& X_GF, const Vec3& M_G, double side,
                Array_<DecorativeGeometry>& geometry) {
    Symbol symbol(geometry);
    const double thickness = 0.09 * side;
    symbol.addBrick(X_GF * Transform(Vec3(0, 0, -thickness)), Vec3(side, side, thickness), light);
    // Hatching on the back.
    constexpr int numLines = 6;
    const Rotation slant(Pi / 4, SimTK::YAxis);
    for (int i = 0; i < numLines; ++i) {
        const double x = side * (2 * (i + 0.5) / numLines - 1);
        symbol.addBrick(X_GF * Transform(slant, Vec3(x, 0, -3.2 * thickness)),
                        Vec3(0.22 * thickness, side, 1.9 * thickness), dark);
    }
    symbol.addSphere(M_G, 0.2 * side, dark);
}

void appendForceArrow(const Vec3& start_G, const Vec3& span, double tipLength, const Vec3& color,
                      Array_<DecorativeGeometry>& geometry) {
    Symbol(geometry).addArrow(start_G, start_G + span, tipLength, color);
}

void appendTorqueArrow(const Vec3& center_G, const UnitVec3& axis, double radius, double tipLength,
                       const Vec3& color, Array_<DecorativeGeometry>& geometry) {
    const double whole = 1.55 * Pi;
    constexpr int count = 48;
    const Vec3 x(axis.perp()), y = SimTK::cross(Vec3(axis), x);
    const double end = whole - 0.8 * tipLength / radius;
    std::vector<Vec3> points;
    for (int i = 0; i <= count; ++i) {
        const double angle = end * i / count;
        points.push_back(center_G + radius * (std::cos(angle) * x + std::sin(angle) * y));
    }
    Symbol symbol(geometry);
    symbol.addWire(points, 0.12 * tipLength, color);
    // The middle of the tip lies on the circle.
    const double middle = whole - 0.4 * tipLength / radius;
    const UnitVec3 forward(-std::sin(middle) * x + std::cos(middle) * y);
    const Vec3 place = center_G + radius * (std::cos(middle) * x + std::sin(middle) * y);
    symbol.addCone(place - 0.5 * tipLength * Vec3(forward), forward, tipLength, 0.32 * tipLength,
                   color);
}

}  // namespace simflex
