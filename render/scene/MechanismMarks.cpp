#include "MechanismMarks.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "DrawnSeats.h"
#include "simflex/base/DisplayUnit.h"
#include "simflex/body/FlexibleBody.h"
#include "simflex/body/InterfaceKinematics.h"
#include "simflex/body/JointEquations.h"

namespace simflex {

using SimTK::Array_;
using SimTK::DecorativeGeometry;
using SimTK::State;
using SimTK::Transform;
using SimTK::Vec3;
using SimTK::Vector;

namespace {

const Vec3 forceColor(0.89, 0.30, 0.12), momentColor(0.44, 0.20, 0.62), textColor(0.16, 0.18, 0.22);

// Relative to the largest part's radius.
constexpr double axisLength = 0.22, speedLength = 0.75, speedTip = 0.12;

// Columns of a 3×n_f matrix times ξ.
Vec3 multiply(const std::vector<double>& shapes, const Vector& xi) {
    Vec3 sum(0);
    for (int mode = 0; mode < xi.size(); ++mode)
        for (int k = 0; k < 3; ++k)
            sum[k] += shapes[3 * std::size_t(mode) + std::size_t(k)] * xi[mode];
    return sum;
}

// Joints whose symbol is a shaft along z.
bool isShaft(const std::string& kind) {
    return kind == "Pin" || kind == "Cylinder" || kind == "Screw";
}

}  // namespace

SimTK::Stage MechanismMarks::getStage() const {
    if (!settings.showReactions) return SimTK::Stage::Position;
    return settings.multipliers ? SimTK::Stage::Velocity : SimTK::Stage::Acceleration;
}

void MechanismMarks::append(const SimTK::System& system, const State& state,
                            const DrawnPoses& drawn, FrameSnapshot& frame,
                            Array_<DecorativeGeometry>& geometry) {
    frame.labels.clear();
    if (settings.isEmpty() && forces.isEmpty()) return;
    const std::vector<PartSnapshot>& parts = frame.parts;
    const double factor = frame.partStyle.deformationFactor;
    scale = calcScale(frame);
    const Image::Pixel& text = frame.style.palette.text;
    const Vec3 nameColor = Vec3(text[0], text[1], text[2]) / 255.0;
    if (settings.showInterfaces)
        for (const PartSnapshot& part : parts)
            appendInterfaces(part, factor, nameColor, frame.labels, geometry);
    if (!forces.isEmpty())
        forces.append(SimTK::MultibodySystem::downcast(system).getMatterSubsystem(), state, drawn,
                      scale, frame, geometry);
    if (!settings.showJoints && !settings.showReactions) return;

    const FlexibleBodySubsystem* const flexible = FlexibleBodySubsystem::find(system);
    if (!flexible)
        throw std::logic_error(
            "joints or reactions are to be shown, but the system has no "
            "FlexibleBodySubsystem, whose joints they would be");
    const auto& matter = SimTK::MultibodySystem::downcast(system).getMatterSubsystem();
    std::vector<Reaction> reactions;
    for (int i = 0; i < flexible->getNumJoints(); ++i) {
        const Joint joint = flexible->getJoint(JointIndex(i));
        const JointEquations& equations = joint.getEquations();
        const auto pose = [&](const Attachment& seat) { return drawn.calcPose(seat); };
        if (equations.isCoupler()) {
            std::vector<Transform> frames;
            for (int k = 0; k < equations.getNumCoordinates(); ++k)
                frames.push_back(pose(joint.getFrameM(k)));
            if (settings.showJoints) appendCouplerSymbol(frames, calcSize(matter, joint), geometry);
            continue;
        }
        const Transform X_GF = pose(joint.getFrameF()), X_GM = pose(joint.getFrameM());
        if (settings.showJoints)
            appendJointSymbol(equations.getKind(), X_GF, X_GM, calcSize(matter, joint), geometry);
        if (!settings.showReactions) continue;
        if (matter.getConstraint(joint.getConstraintIndex()).isDisabled(state)) continue;
        const Vector lambda =
            settings.multipliers ? settings.multipliers(state, joint) : joint.getMultipliers(state);
        SimTK::SpatialVec onM = joint.calcReaction(state, lambda, Joint::Side::M, Joint::Side::M);
        if (settings.friction) onM += settings.friction(state, joint);
        if (!onM[0].isFinite() || !onM[1].isFinite())
            throw std::runtime_error("the reaction of joint '" + joint.getName() +
                                     "' is not finite");
        Vec3 point = 0.5 * (X_GF.p() + X_GM.p());
        if (isShaft(equations.getKind()) && !frame.views.empty()) {
            // At the end of the shaft that faces the camera, where the part does not hide it.
            const SymbolSize size = calcSize(matter, joint);
            const Vec3 axis(X_GF.R().z()), toCamera = frame.views.front().camera.X_GC.p() - point;
            const double reach = size.halfLength + 0.55 * size.radius;
            point += (SimTK::dot(axis, toCamera) < 0 ? -reach : reach) * axis;
        }
        reactions.push_back({point, onM[1], onM[0]});
    }
    appendReactions(reactions, frame.labels, geometry);
}

void MechanismMarks::appendInterfaces(const PartSnapshot& part, double factor,
                                      const Vec3& nameColor, std::vector<Label>& labels,
                                      Array_<DecorativeGeometry>& geometry) const {
    for (const auto& interface : part.skin->part->interfaces) {
        const Vec3 s(interface.position[0], interface.position[1], interface.position[2]);
        const FrameSums moved = part.reference.exaggerate(
            {multiply(interface.Phi, part.xi), multiply(interface.Psi, part.xi)}, s, factor);
        const Transform X_GI =
            part.X_GD * Transform(calcExponential(moved.rotation), s + moved.translation);
        SimTK::DecorativeFrame frame(axisLength * scale);
        frame.setTransform(X_GI);
        geometry.push_back(frame);
        SimTK::DecorativeSphere master(0.022 * scale);
        master.setTransform(X_GI).setColor(textColor);
        geometry.push_back(master);
        labels.push_back({interface.name, X_GI.p(), nameColor});
    }
}

SymbolSize MechanismMarks::calcSize(const SimTK::SimbodyMatterSubsystem& matter,
                                    const Joint& joint) const {
    return calcSeatSize(matter, {&joint.getFrameM(0), &joint.getFrameF(0)}, scale);
}

void MechanismMarks::appendReactions(const std::vector<Reaction>& reactions,
                                     std::vector<Label>& labels,
                                     Array_<DecorativeGeometry>& geometry) {
    if (reactions.empty()) return;
    for (const Reaction& reaction : reactions) {
        largestForce = std::max(largestForce, reaction.force_G.norm());
        largestMoment = std::max(largestMoment, reaction.moment_G.norm());
    }
    // Do not draw arrows for round-off.
    const double roundOff = 1e-6;
    const bool hasForces = largestForce > roundOff * largestMoment / scale;
    const bool hasMoments = largestMoment > roundOff * largestForce * scale;
    for (const Reaction& reaction : reactions)
        for (const bool isMoment : {false, true}) {
            if (!(isMoment ? hasMoments : hasForces)) continue;
            const Vec3& value = isMoment ? reaction.moment_G : reaction.force_G;
            const double largest = isMoment ? largestMoment : largestForce;
            if (!(value.norm() > 0.01 * largest)) continue;
            const Vec3 span = speedLength * scale / largest * value;
            appendArrow(reaction.point_G, span, isMoment, geometry);
            if (!settings.showReactionValues) continue;
            labels.push_back({formatQuantity(value.norm(), isMoment ? "N m" : "N"),
                              reaction.point_G + span, isMoment ? momentColor : forceColor});
        }
    if (!hasForces && !hasMoments) return;
    std::string legend = "reactions up to ";
    if (hasForces) legend += formatQuantity(largestForce, "N");
    if (hasForces && hasMoments) legend += ", ";
    if (hasMoments) legend += formatQuantity(largestMoment, "N m");
    SimTK::DecorativeText text(legend);
    text.setIsScreenText(true);
    geometry.push_back(text);
}

// Returns the largest part's radius, or that of the largest object if there are no parts.
double MechanismMarks::calcScale(const FrameSnapshot& frame) {
    double largest = 0;
    for (const PartSnapshot& part : frame.parts)
        largest = std::max(largest, part.skin->part->calcRadius());
    if (largest > 0) return largest;
    for (const SurfaceItem& item : frame.scene.surfaces)
        largest = std::max(largest, double((item.geometry->upper - item.geometry->lower)
                                               .elementwiseMultiply(item.scale)
                                               .norm()) /
                                        2);
    return largest > 0 ? largest : 1;
}

// Arrows of moments have two tips.
void MechanismMarks::appendArrow(const Vec3& start_G, const Vec3& span, bool isMoment,
                                 Array_<DecorativeGeometry>& geometry) const {
    const Vec3& color = isMoment ? momentColor : forceColor;
    const double length = span.norm(), tip = std::min(speedTip * scale, 0.4 * length);
    const Vec3 end = start_G + span, direction = span / length;
    SimTK::DecorativeArrow arrow(start_G, end, tip);
    arrow.setColor(color);
    geometry.push_back(arrow);
    if (isMoment) {
        SimTK::DecorativeCone second(end - 1.7 * tip * direction, SimTK::UnitVec3(direction), tip,
                                     0.32 * tip);
        second.setColor(color);
        geometry.push_back(second);
    }
}

}  // namespace simflex
