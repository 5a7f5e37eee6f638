#pragma once
/** @file
Base of the force elements in simflex/forces: spatial forces at attachments. **/

#include "simflex/body/Attachment.h"

namespace simflex {

class ForceElement {
public:
    virtual ~ForceElement() = default;

    /** The frames this element acts on; fixed after construction. **/
    const SimTK::Array_<Attachment>& getAttachments() const { return m_attachments; }

    /** Adds the spatial force (torque, force) on each attachment frame's origin, in Ground.
    @param[in]     frames    pose and velocity of each attachment
    @param[in,out] forces_G  one per attachment **/
    virtual void addInForces(SimTK::Real /*time*/, const SimTK::Array_<FrameMotion>& /*frames*/,
                             SimTK::Array_<SimTK::SpatialVec>& /*forces_G*/) const {}

    /** Energy stored by the element [J]. **/
    virtual SimTK::Real calcPotentialEnergy(SimTK::Real /*time*/,
                                            const SimTK::Array_<FrameMotion>& /*frames*/) const {
        return 0;
    }

protected:
    SimTK::Array_<Attachment> m_attachments;
};

}  // namespace simflex
