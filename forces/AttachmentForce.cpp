#include "simflex/forces/AttachmentForce.h"

#include "simflex/body/ForceElement.h"

namespace simflex {

using namespace SimTK;

namespace {

class Element : public ForceElement {
public:
    Element(const Attachment& attachment, AttachmentForce::Law law, AttachmentForce::Axes axes)
        : m_law(std::move(law)), m_axes(axes) {
        m_attachments.push_back(attachment);
    }

    void addInForces(Real time, const Array_<FrameMotion>& frames,
                     Array_<SpatialVec>& forces_G) const override {
        const SpatialVec force = m_law(time, frames[0]);
        forces_G[0] += m_axes == AttachmentForce::Axes::Ground ? force : frames[0].X.R() * force;
    }

private:
    AttachmentForce::Law m_law;
    AttachmentForce::Axes m_axes;
};

}  // namespace

AttachmentForce::AttachmentForce(FlexibleBodySubsystem& subsystem, const Attachment& attachment,
                                 Law law, Axes axes) {
    if (!law)
        throw std::invalid_argument("AttachmentForce on " + attachment.getName() +
                                    ": no function given");
    subsystem.adoptForceElement(std::make_unique<Element>(attachment, std::move(law), axes));
}

AttachmentForce::AttachmentForce(FlexibleBodySubsystem& subsystem, const Attachment& attachment,
                                 Function force, Axes axes)
    : AttachmentForce(
          subsystem, attachment,
          force ? Law([force](Real time, const FrameMotion&) { return force(time); }) : Law(),
          axes) {}

AttachmentForce::AttachmentForce(FlexibleBodySubsystem& subsystem, const Attachment& attachment,
                                 const SpatialVec& force, Axes axes)
    : AttachmentForce(
          subsystem, attachment, [force](Real) { return force; }, axes) {}

}  // namespace simflex
