#include "ForceMarks.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "DrawnSeats.h"
#include "ForceSymbols.h"
#include "simflex/base/DisplayUnit.h"
#include "simflex/body/FlexibleBody.h"

namespace simflex {

using SimTK::Array_;
using SimTK::DecorativeGeometry;
using SimTK::SpatialVec;
using SimTK::State;
using SimTK::Transform;
using SimTK::Vec3;

namespace {

const Vec3 loadColor(0.74, 0.08, 0.24);

// Relative to the symbols' scale.
constexpr double arrowLength = 0.6, circleRadius = 0.26, tipLength = 0.11, stopSide = 0.15;

// Returns the radius, across an axis, of the largest object that contains a point: a circle inside
// would be invisible.
double calcRadiusAround(const Scene& scene, const Vec3& point_G, const SimTK::UnitVec3& axis) {
    double largest = 0;
    for (const SurfaceItem& item : scene.surfaces) {
        const Vec3 p = ~item.X_GM * point_G;
        bool isInside = true;
        double radius = 0;
        for (int k = 0; k < 3; ++k) {
            const double low = item.geometry->lower[k] * item.scale[k],
                         high = item.geometry->upper[k] * item.scale[k];
            isInside &= p[k] >= low && p[k] <= high;
            const Vec3 along(item.X_GM.R().getAxisUnitVec(SimTK::CoordinateAxis(k)));
            radius = std::max(
                radius, std::max(high - p[k], p[k] - low) * SimTK::cross(along, Vec3(axis)).norm());
        }
        if (isInside) largest = std::max(largest, radius);
    }
    return largest;
}

bool isOnGround(const Attachment& frame) {
    return !frame.isFlexible() && frame.getMobilizedBodyIndex() == SimTK::GroundIndex;
}

void appendConnector(const SimTK::SimbodyMatterSubsystem& matter, const DrawnPoses& drawn,
                     const DrawnConnector& connector, double scale, const FrameSnapshot& frame,
                     Array_<DecorativeGeometry>& geometry) {
    const Transform X_GF = drawn.calcPose(connector.F), X_GM = drawn.calcPose(connector.M);
    const ConnectorKind kind = connector.kind;
    if (kind == ConnectorKind::Spring || kind == ConnectorKind::Damper ||
        kind == ConnectorKind::SpringDamper) {
        const double length =
            connector.freeLength > 0 ? connector.freeLength : (X_GM.p() - X_GF.p()).norm();
        StrutParts parts;
        parts.hasSpring = kind != ConnectorKind::Damper;
        parts.hasDamper = kind != ConnectorKind::Spring;
        parts.isFirstOnGround = isOnGround(connector.F);
        parts.isSecondOnGround = isOnGround(connector.M);
        if (length > 0)
            appendStrut(X_GF, X_GM.p(), chooseStrutSize(length, scale), parts, geometry);
        return;
    }
    const SymbolSize seat = calcSeatSize(matter, {&connector.M, &connector.F}, scale);
    if (kind == ConnectorKind::Bushing) {
        appendBushing(X_GF, X_GM, {std::max(seat.radius, 0.05 * scale), seat.halfLength}, geometry);
    } else if (kind == ConnectorKind::Stop) {
        appendStop(X_GF, X_GM.p(), stopSide * scale, geometry);
    } else {
        // On the side of the seat that faces the camera.
        const Vec3 axis(X_GF.R().z());
        double side = 1;
        if (!frame.views.empty() &&
            SimTK::dot(axis, frame.views.front().camera.X_GC.p() - X_GF.p()) < 0)
            side = -1;
        appendTorsionSpring(X_GF, X_GM, {std::max(seat.radius, 0.07 * scale), seat.halfLength},
                            side * (seat.halfLength + 0.8 * seat.radius), geometry);
    }
}

}  // namespace

void ForceMarks::append(const SimTK::SimbodyMatterSubsystem& matter, const State& state,
                        const DrawnPoses& drawn, double scale, const FrameSnapshot& frame,
                        Array_<DecorativeGeometry>& geometry) {
    if (showConnectors)
        for (const DrawnConnector& connector : connectors)
            appendConnector(matter, drawn, connector, scale, frame, geometry);
    if (showLoads) appendArrows(calcArrows(state, drawn), scale, frame.scene, geometry);
}

std::vector<ForceMarks::Arrow> ForceMarks::calcArrows(const State& state,
                                                      const DrawnPoses& drawn) const {
    std::vector<Arrow> arrows;
    const auto add = [&](const Arrow& arrow, const std::string& name) {
        if (!arrow.force_G.isFinite() || !arrow.torque_G.isFinite())
            throw std::runtime_error("the load on '" + name + "' is not finite");
        arrows.push_back(arrow);
    };
    for (const DrawnLoad& load : loads) {
        SpatialVec force = load.force(state);
        if (load.axes == DrawnLoad::Axes::Attachment)
            force = drawn.calcPose(load.frame).R() * force;
        add({drawn.calcPose(load.frame).p(), force[1], force[0]}, load.frame.getName());
    }
    for (const DrawnSpreadLoad& load : spreadLoads) {
        const double size = load.force_B.norm();
        if (!(size > 0)) continue;
        const SimTK::Vector xi = load.body.getModalCoordinates(state);
        double work = 0;  // mean displacement along the load, times its size
        for (int i = 0; i < std::min(xi.size(), load.modal.size()); ++i)
            work += load.modal[i] * xi[i];
        const Vec3 displacement = work / (size * size) * load.force_B;
        const Vec3 place = load.center_B + drawn.calcReference(load.body.getIndex())
                                               .exaggerate({displacement, Vec3(0)}, load.center_B,
                                                           drawn.getFactor())
                                               .translation;
        const Transform X_GB = load.body.getFramePose(drawn.getState());
        add({X_GB * place, load.scale(state.getTime()) * (X_GB.R() * load.force_B), Vec3(0)},
            load.body.getName());
    }
    return arrows;
}

void ForceMarks::appendArrows(const std::vector<Arrow>& arrows, double scale, const Scene& scene,
                              Array_<DecorativeGeometry>& geometry) {
    for (const Arrow& arrow : arrows) {
        largestForce = std::max(largestForce, double(arrow.force_G.norm()));
        largestTorque = std::max(largestTorque, double(arrow.torque_G.norm()));
    }
    if (arrows.empty() || !(largestForce > 0 || largestTorque > 0)) return;
    for (const Arrow& arrow : arrows) {
        const double force = arrow.force_G.norm(), torque = arrow.torque_G.norm();
        if (force > 0.01 * largestForce) {
            const Vec3 span = arrowLength * scale / largestForce * arrow.force_G;
            appendForceArrow(arrow.point_G, span, std::min(tipLength * scale, 0.4 * span.norm()),
                             loadColor, geometry);
        }
        if (torque > 0.01 * largestTorque) {
            const SimTK::UnitVec3 axis(arrow.torque_G);
            const double radius =
                std::max(circleRadius * scale * (0.25 + 0.75 * torque / largestTorque),
                         1.12 * calcRadiusAround(scene, arrow.point_G, axis));
            appendTorqueArrow(arrow.point_G, axis, radius,
                              std::min(tipLength * scale, 0.7 * radius), loadColor, geometry);
        }
    }
    std::string legend = "loads up to ";
    if (largestForce > 0) legend += formatQuantity(largestForce, "N");
    if (largestForce > 0 && largestTorque > 0) legend += ", ";
    if (largestTorque > 0) legend += formatQuantity(largestTorque, "N m");
    SimTK::DecorativeText text(legend);
    text.setIsScreenText(true);
    geometry.push_back(text);
}

}  // namespace simflex
