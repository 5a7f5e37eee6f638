#include "simflex/body/Hub.h"

namespace simflex {

using namespace SimTK;

Hub::Hub(FlexibleBodySubsystem& subsystem, SimbodyMatterSubsystem& matter, const Attachment& seat,
         const Body& body, const std::string& name, const Transform& X_BS)
    : m_body(matter.Ground(), body), m_weld(subsystem, seat, Attachment(m_body, X_BS), name) {}

void Hub::setStateToFit(State& state) const {
    const System& system = m_body.getMatterSubsystem().getSystem();
    const Attachment& onBody = m_weld.getFrameM();
    system.realize(state, Stage::Velocity);
    const FrameMotion fitted =
        shiftMotion(m_weld.getFrameF().calcMotion(state), ~onBody.getFrame());
    m_body.setQToFitTransform(state, fitted.X);
    m_body.setUToFitVelocity(state, fitted.V);
    system.realize(state, Stage::Velocity);
}

}  // namespace simflex
