#pragma once
/** @file
A frame for joints and forces: on an interface or a mesh node of a flexible body, or on any
MobilizedBody. **/

#include <memory>
#include <string>
#include <vector>

#include "simflex/body/InterfaceKinematics.h"

namespace simflex {

class FlexibleBody;
class FlexibleBodySubsystem;
SimTK_DEFINE_UNIQUE_INDEX_TYPE(FlexibleBodyIndex)

    class Attachment {
public:
    /** A frame X_BA on an ordinary mobilized body, Ground included. Implicit, so that a body can be
    passed for its frame. **/
    Attachment(const SimTK::MobilizedBody& body, const SimTK::Transform& X_BA = SimTK::Transform());

    /** A frame on interface `name`, whose undeformed axes are those of B; X_IA is its pose in the
    interface frame.
    @throws std::out_of_range naming the part, the interface and the existing ones. **/
    static Attachment onInterface(const FlexibleBody& body, const std::string& name,
                                  const SimTK::Transform& X_IA = SimTK::Transform());

    /** A frame on the mesh node with this deck number. It rotates with the surrounding elements: by
    the antisymmetric part of the least-squares displacement gradient over the nodes that share an
    element with it.
    @throws std::out_of_range if the mesh has no such node. **/
    static Attachment onNode(const FlexibleBody& body, int nodeNumber,
                             const SimTK::Transform& X_NA = SimTK::Transform());

    /** A frame with given shapes: its origin is at s + Φξ, its rotation vector is Ψξ.
    @param s         from the centre of mass, in B [m]
    @param Phi, Psi  3×n_f, column-major; empty: 0
    @throws std::invalid_argument if the number of shapes is wrong. **/
    static Attachment onShapes(const FlexibleBody& body, const SimTK::Vec3& s,
                               std::vector<double> Phi = {}, std::vector<double> Psi = {});

    bool isFlexible() const { return bool(m_flexibleFrame); }

    /** Returns the name for messages: "crank.pin", "crank node 12", "slider", "body 3" or
    "ground". **/
    const std::string& getName() const { return m_name; }

    /** Returns whether the attachment is on a body of this subsystem or of its system's matter. **/
    bool isIn(const FlexibleBodySubsystem& subsystem) const;

    /** Returns the frame body of the flexible body, or the mobilized body itself. **/
    SimTK::MobilizedBodyIndex getMobilizedBodyIndex() const { return m_mobod; }

    /** @pre isFlexible(). **/
    FlexibleBodyIndex getFlexibleBodyIndex() const { return m_flexibleBody; }
    const FlexibleFrame& getFlexibleFrame() const { return *m_flexibleFrame; }

    /** Returns the order of the displacement in ξ, see FlexibleBody::enableStiffening(). @pre
    isFlexible(). **/
    FrameAtXi::Order getFrameOrder(const SimTK::State& state) const;

    /** Returns X_BA on the rigid body. @pre !isFlexible(). **/
    const SimTK::Transform& getFrame() const { return m_X_BA; }

    /** Pose and velocity in Ground. @pre state realized to Stage::Velocity. **/
    FrameMotion calcMotion(const SimTK::State& state) const;

private:
    Attachment() = default;

    std::string m_name;
    SimTK::MobilizedBodyIndex m_mobod;
    SimTK::Transform m_X_BA;
    FlexibleBodyIndex m_flexibleBody;
    std::shared_ptr<const FlexibleFrame> m_flexibleFrame;
    std::shared_ptr<const SimTK::MobilizedBody> m_mobilizedBody;
    std::shared_ptr<const FlexibleBody> m_body;
};

/** Returns whether both have the same origin and axes on the same body. **/
bool isSame(const Attachment& a, const Attachment& b);

}  // namespace simflex
