#pragma once
/** @file
Places the bodies of a model file, by position or by mating one of their frames with a frame placed
already. Bodies may be in any order. **/

#include <optional>
#include <vector>

#include "simflex/model/builders/Mobilizer.h"

namespace simflex {
namespace model {

class Placement {
public:
    /** @throws ModelError naming all bodies of a cycle. **/
    Placement(const ModelValue& file, const ModelFrames& frames);

    /** Pose of the body's own coordinates D in Ground. **/
    const SimTK::Transform& getPose(int body) const { return *m_poses[size_t(body)]; }
    /** Pose of a frame in Ground, undeformed. **/
    SimTK::Transform calcPose(const FrameOnBody& frame) const;
    /** Mobilizer of a rigid body. **/
    const Mobilizer& getMobilizer(int body) const { return m_mobilizers[size_t(body)]; }
    /** Bodies ordered so that parents come before their children. **/
    const std::vector<int>& getOrder() const { return m_order; }

    static constexpr double LeastSize = 1e-3;
    /** Diagonal of the bounding box of body origins and interfaces, at least LeastSize [m]. **/
    double calcSize() const;

private:
    /** Where the file puts a body: its frame `own` at frame `at`, moved by `offset`. **/
    struct Place {
        bool isGiven = false;
        SimTK::Transform offset;
        FrameOnBody own, at;
    };
    /** Places the body, and first those that it depends on. **/
    void place(int body);
    bool isPlaced(int body) const { return m_poses[size_t(body)].has_value(); }
    Place readPlace(int body) const;
    SimTK::Transform calcPlace(int body) const;

    ModelValue m_bodies;
    const ModelFrames& m_frames;
    std::vector<std::optional<SimTK::Transform>> m_poses;
    std::vector<Mobilizer> m_mobilizers;
    std::vector<std::optional<Place>> m_places;  ///< read when they are needed
    std::vector<int> m_order;
};

}  // namespace model
}  // namespace simflex
