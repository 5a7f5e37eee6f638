#pragma once
/** @file
Optional marks on flexible parts: interface frames, joints, joint forces and moments, connectors and
loads. Internal to the renderer.

Marks are placed on the parts as drawn, with exaggerated deformation. Their sizes are proportional
to those of the parts. **/

#include <functional>
#include <vector>

#include "ForceMarks.h"
#include "FrameSnapshot.h"
#include "JointSymbols.h"
#include "Simbody.h"
#include "simflex/body/FlexibleBodySubsystem.h"
#include "simflex/body/Joint.h"

namespace simflex {

struct MarkSettings {
    bool showInterfaces = false, showJoints = false;
    bool showReactions = false, showReactionValues = false;
    /** Source of a joint's λ; empty: Simbody's own, for which States are realized to
    Stage::Acceleration. **/
    std::function<SimTK::Vector(const SimTK::State&, const Joint&)> multipliers;
    /** Additional force of a joint on M, at its origin and in Ground; empty: none. **/
    std::function<SimTK::SpatialVec(const SimTK::State&, const Joint&)> friction;

    bool isEmpty() const { return !showInterfaces && !showJoints && !showReactions; }
};

class MechanismMarks {
public:
    MarkSettings settings;
    ForceMarks forces;

    /** Returns the stage to which a State must be realized. **/
    SimTK::Stage getStage() const;

    /** Appends all marks of the frame's parts, in Ground.
    @param drawn  poses of this State
    @param frame  with parts, scene, factor and views; receives labels
    @throws std::logic_error if joints are requested and the system has no flexible subsystem. **/
    void append(const SimTK::System& system, const SimTK::State& state, const DrawnPoses& drawn,
                FrameSnapshot& frame, SimTK::Array_<SimTK::DecorativeGeometry>& geometry);

    /** Resets the largest reactions, which set the scale of the arrows. **/
    void forgetRun() {
        largestForce = largestMoment = 0;
        forces.forgetRun();
    }

private:
    struct Reaction {
        SimTK::Vec3 point_G, force_G, moment_G;
    };
    void appendInterfaces(const PartSnapshot& part, double factor, const SimTK::Vec3& nameColor,
                          std::vector<Label>& labels,
                          SimTK::Array_<SimTK::DecorativeGeometry>& geometry) const;
    SymbolSize calcSize(const SimTK::SimbodyMatterSubsystem& matter, const Joint& joint) const;
    static double calcScale(const FrameSnapshot& frame);
    void appendReactions(const std::vector<Reaction>& reactions, std::vector<Label>& labels,
                         SimTK::Array_<SimTK::DecorativeGeometry>& geometry);
    void appendArrow(const SimTK::Vec3& start_G, const SimTK::Vec3& span, bool isMoment,
                     SimTK::Array_<SimTK::DecorativeGeometry>& geometry) const;

    double scale = 1;  // of symbols [m]
    double largestForce = 0, largestMoment = 0;
};

}  // namespace simflex
