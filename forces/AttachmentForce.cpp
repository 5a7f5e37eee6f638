#include "simflex/forces/AttachmentForce.h"

#include "simflex/body/ForceElement.h"

namespace simflex {

using namespace SimTK;

namespace {

class Element : public ForceElement {
public:
    Element(const Attachment& attachment, AttachmentForce::Function force,
            AttachmentForce::Axes axes)
        : m_force(std::move(force)), m_axes(axes) {
        m_attachments.push_back(attachment);
    }

    void addInForces(Real time, const Array_<FrameMotion>& frames,
                     Array_<SpatialVec>& forces_G) const override {
        const SpatialVec force = m_force(time);
        forces_G[0] += m_axes == AttachmentForce::Axes::Ground ? force : frames[0].X.R() * force;
    }

private:
    AttachmentForce::Function m_force;
    AttachmentForce::Axes m_axes;
};

}  // namespace

AttachmentForce::AttachmentForce(FlexibleBodySubsystem& subsystem, const Attachment& attachment,
                                 Function force, Axes axes) {
    if (!force)
        throw std::invalid_argument("AttachmentForce on " + attachment.getName() +
                                    ": no function given");
    subsystem.adoptForceElement(std::make_unique<Element>(attachment, std::move(force), axes));
}

AttachmentForce::AttachmentForce(FlexibleBodySubsystem& subsystem, const Attachment& attachment,
                                 const SpatialVec& force, Axes axes)
    : AttachmentForce(
          subsystem, attachment, [force](Real) { return force; }, axes) {}

}  // namespace simflex
