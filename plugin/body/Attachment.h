#pragma once
/** @file
A frame that joints and forces hold on to: on an interface or a mesh node of a flexible body, or on
any MobilizedBody. **/

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
    /** A frame X_BA on an ordinary mobilized body, Ground included. Implicit, so that a body can
     * stand for its frame. **/
    Attachment(const SimTK::MobilizedBody& body, const SimTK::Transform& X_BA = SimTK::Transform());

    /** A frame on interface `name`, whose axes are those of B while undeformed; X_IA turns and
    shifts it.
    @throws std::out_of_range naming the part, the interface and those that exist. **/
    static Attachment onInterface(const FlexibleBody& body, const std::string& name,
                                  const SimTK::Transform& X_IA = SimTK::Transform());

    /** A frame on the mesh node with this deck number. Its rotation is that of the surrounding
    elements: the antisymmetric part of the least-squares displacement gradient over the nodes that
    share an element with it.
    @throws std::out_of_range if the mesh has no such node. **/
    static Attachment onNode(const FlexibleBody& body, int nodeNumber,
                             const SimTK::Transform& X_NA = SimTK::Transform());

    /** A frame that moves with the modes as it is told: at s + Φξ, turned by Ψξ.
    @param s         from the centre of mass, in B [m]
    @param Phi, Psi  3×n_f, column-major; empty: 0
    @throws std::invalid_argument on other numbers of shapes. **/
    static Attachment onShapes(const FlexibleBody& body, const SimTK::Vec3& s,
                               std::vector<double> Phi = {}, std::vector<double> Psi = {});

    bool isFlexible() const { return bool(m_flexibleFrame); }

    /** What it is on, for messages: "crank.pin", "crank node 12", "slider", "body 3" or "ground".
     * **/
    const std::string& getName() const { return m_name; }

    /** Whether it is on a body of this subsystem or of its system's matter. **/
    bool isIn(const FlexibleBodySubsystem& subsystem) const;

    /** Body frame of the flexible body, or the mobilized body itself. **/
    SimTK::MobilizedBodyIndex getMobilizedBodyIndex() const { return m_mobod; }

    /** @pre isFlexible(). **/
    FlexibleBodyIndex getFlexibleBodyIndex() const { return m_flexibleBody; }
    const FlexibleFrame& getFlexibleFrame() const { return *m_flexibleFrame; }

    /** Order of its displacement in ξ, see FlexibleBody::enableStiffening(). @pre isFlexible(). **/
    FrameAtXi::Order getFrameOrder(const SimTK::State& state) const;

    /** Frame on a rigid body. @pre !isFlexible(). **/
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

/** Whether both are the same place and axes of the same body. **/
bool isSame(const Attachment& a, const Attachment& b);

}  // namespace simflex
