#pragma once
/** @file
A flexible brick on a pin at its end "left", under gravity. **/

#include <cmath>

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"

namespace simflex::test {

struct HangingPendulum {
    static constexpr SimTK::Real Gravity = 9.81;
    SimTK::MultibodySystem system;
    SimTK::SimbodyMatterSubsystem matter{system};
    SimTK::GeneralForceSubsystem forces{system};
    SimTK::Force::Gravity gravity{forces, matter, -SimTK::YAxis, Gravity};
    FlexibleBodySubsystem flexible{system, matter};
    FlexibleBody body;
    Joint::Pin pin;

    explicit HangingPendulum(const std::shared_ptr<const ReducedBody>& part)
        : body(flexible, part), pin(flexible, matter.Ground(), body.interface("left"), "pin") {}

    /** Returns a State at rest, undeformed, `angle` away from hanging. **/
    SimTK::State makeState(SimTK::Real angle) {
        SimTK::State state = system.realizeTopology();
        body.setPoseByInterface(
            state, "left", SimTK::Transform(SimTK::Rotation(angle - SimTK::Pi / 2, SimTK::ZAxis)));
        return state;
    }

    /** Returns the frequency of small swings of the rigid pendulum, √(mgd/I) [rad/s]. **/
    SimTK::Real calcRigidFrequency() const {
        const ReducedBody& part = body.getPart();
        const SimTK::Real d = -part.interfaces[0].position[0];
        return std::sqrt(part.mass * Gravity * d / (part.inertia[2] + part.mass * d * d));
    }
};

}  // namespace simflex::test
