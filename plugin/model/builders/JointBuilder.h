#pragma once
/** @file
Adds the joints of a model file to its system. **/

#include "simflex/model/builders/Placement.h"

namespace simflex {
namespace model {

/** Frames F and M of a pair given under `between`. **/
struct FramePair {
    FrameOnBody F, M;
};

/** @throws ModelError unless there are two, of different bodies. **/
FramePair readBetween(const ModelValue& between, const ModelFrames& frames);

class JointBuilder {
public:
    JointBuilder(const ModelValue& file, const ModelFrames& frames, const Placement& placement)
        : m_joints(file.get("joints")), m_frames(frames), m_placement(placement) {}

    /** Adds all joints in the file's order; gears and couplers are made last. **/
    void addTo(ModelSystem& system);

    /** Frames of joint `name`, aligned with its axis; null for a gear or coupler. **/
    const FramePair* findFrames(const std::string& name) const;

private:
    Joint addJoint(const ModelValue& value, const std::string& type, ModelSystem& system);
    Joint addCoupling(const ModelValue& value, const std::string& type, ModelSystem& system);
    FramePair turn(const ModelValue& axis, const std::string& type, const FramePair& pair) const;
    /** Displacement of M in F, as placed, along the free axes of F. **/
    SimTK::Vec3 calcWayAsPlaced(const std::string& type, const FramePair& pair) const;

    ModelValue m_joints;
    const ModelFrames& m_frames;
    const Placement& m_placement;
    std::map<std::string, FramePair> m_pairs;
};

}  // namespace model
}  // namespace simflex
