#pragma once
/** @file
A rigid body with its own mass, welded to an interface or node of a flexible body. Bodies cannot be
mobilized on a flexible body itself; a hub accepts any Simbody mobilizer, constraint, force or
geometry.

    Hub hub(flexible, matter, blade.interface("root"), Body::Rigid(massProperties), "hub");
    MobilizedBody::Pin flap(hub.updBody(), X_HF, flapBody, X_BM);

    State state = system.realizeTopology();
    blade.setPoseByInterface(state, "root", Transform());
    hub.setStateToFit(state);

The body is a MobilizedBody::Free on Ground, held by a Joint::Weld. **/

#include "simflex/body/Joint.h"

namespace simflex {

class Hub {
public:
    /** @param X_BS  frame on the body that is welded to `seat` **/
    Hub(FlexibleBodySubsystem& subsystem, SimTK::SimbodyMatterSubsystem& matter,
        const Attachment& seat, const SimTK::Body& body, const std::string& name = "",
        const SimTK::Transform& X_BS = SimTK::Transform());

    const SimTK::MobilizedBody::Free& getBody() const { return m_body; }
    SimTK::MobilizedBody::Free& updBody() { return m_body; }
    const Joint::Weld& getWeld() const { return m_weld; }

    /** Moves the body to its seat, with the seat's velocity. Realizes the State to
    Stage::Velocity. **/
    void setStateToFit(SimTK::State& state) const;

private:
    SimTK::MobilizedBody::Free m_body;
    Joint::Weld m_weld;
};

}  // namespace simflex
