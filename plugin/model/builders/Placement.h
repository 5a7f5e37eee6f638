#pragma once
/** @file
Where a model file places its bodies: by position, or by mating a frame of theirs with one that is
already placed. Bodies may be in any order. **/

#include "simflex/model/builders/Mobilizer.h"

namespace simflex {
namespace model {

class Placement {
public:
    /** @throws ModelError, naming all bodies of a circle of places. **/
    Placement(const ModelValue& file, const ModelFrames& frames);

    /** Of the body's own coordinates D in Ground. **/
    const SimTK::Transform& getPose(int body) const { return m_poses[size_t(body)]; }
    /** Of a frame in Ground, undeformed. **/
    SimTK::Transform calcPose(const FrameOnBody& frame) const;
    /** Of a rigid body. **/
    const Mobilizer& getMobilizer(int body) const { return m_mobilizers[size_t(body)]; }
    /** Bodies in such an order that parents come before what they carry. **/
    const std::vector<int>& getOrder() const { return m_order; }

    static constexpr double LeastSize = 1e-3;
    /** Diagonal of the box about bodies' origins and interfaces, at least LeastSize [m]. **/
    double calcSize() const;

private:
    void place(int body);
    SimTK::Transform calcPlace(int body);
    SimTK::Transform follow(const FrameOnBody& frame);

    enum class Mark { Open, Placing, Placed };
    ModelValue m_bodies;
    const ModelFrames& m_frames;
    std::vector<SimTK::Transform> m_poses;
    std::vector<Mobilizer> m_mobilizers;
    std::vector<Mark> m_marks;
    std::vector<int> m_path;  ///< bodies being placed
    std::vector<int> m_order;
};

}  // namespace model
}  // namespace simflex
