#include "simflex/forces/AttachmentForce.h"

#include "simflex/forces/ElementParameters.h"

namespace simflex {

using namespace SimTK;

namespace {

class AttachmentForceElement : public ForceElement {
protected:
    AttachmentForceElement(const Attachment& attachment, AttachmentForce::Axes axes)
        : m_axes(axes) {
        m_attachments.push_back(attachment);
    }

    SpatialVec expressInGround(const SpatialVec& force, const FrameMotion& frame) const {
        return m_axes == AttachmentForce::Axes::Ground ? force : frame.X.R() * force;
    }

private:
    AttachmentForce::Axes m_axes;
};

class LawElement : public AttachmentForceElement {
public:
    LawElement(const Attachment& attachment, AttachmentForce::Law law, AttachmentForce::Axes axes)
        : AttachmentForceElement(attachment, axes), m_law(std::move(law)) {}

    void addInForces(const ElementInputs& now, const Array_<FrameMotion>& frames,
                     Array_<SpatialVec>& forces_G) const override {
        forces_G[0] += expressInGround(m_law(now.time, frames[0]), frames[0]);
    }

private:
    AttachmentForce::Law m_law;
};

class TimedForceElement : public AttachmentForceElement {
public:
    TimedForceElement(const Attachment& attachment, AttachmentForce::Function force,
                      AttachmentForce::Axes axes)
        : AttachmentForceElement(attachment, axes), m_force(std::move(force)) {}

    bool hasTimedForce() const override { return true; }
    SpatialVec calcTimedForce(Real time) const override { return m_force(time); }
    void addInTimedForce(const SpatialVec& force, const Array_<FrameMotion>& frames,
                         Array_<SpatialVec>& forces_G) const override {
        forces_G[0] += expressInGround(force, frames[0]);
    }

private:
    AttachmentForce::Function m_force;
};

template <class Function>
Function checkGiven(Function function, const Attachment& attachment, const std::string& name) {
    if (!function)
        throw std::invalid_argument(nameElement("AttachmentForce", attachment, name) +
                                    ": no function given");
    return function;
}

}  // namespace

AttachmentForce::AttachmentForce(FlexibleBodySubsystem& subsystem, const Attachment& attachment,
                                 Law law, Axes axes, const std::string& name) {
    adoptNamed(subsystem,
               std::make_unique<LawElement>(attachment,
                                            checkGiven(std::move(law), attachment, name), axes),
               name);
}

AttachmentForce::AttachmentForce(FlexibleBodySubsystem& subsystem, const Attachment& attachment,
                                 Function force, Axes axes, const std::string& name) {
    adoptNamed(subsystem,
               std::make_unique<TimedForceElement>(
                   attachment, checkGiven(std::move(force), attachment, name), axes),
               name);
}

AttachmentForce::AttachmentForce(FlexibleBodySubsystem& subsystem, const Attachment& attachment,
                                 const SpatialVec& force, Axes axes, const std::string& name)
    : AttachmentForce(
          subsystem, attachment, [force](Real) { return force; }, axes, name) {}

}  // namespace simflex
