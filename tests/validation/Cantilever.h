#pragma once
/** @file
A brick welded to Ground by its end "left", under gravity. **/

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"

namespace simflex::test {

struct Cantilever {
    SimTK::MultibodySystem system;
    SimTK::SimbodyMatterSubsystem matter{system};
    SimTK::GeneralForceSubsystem forces{system};
    SimTK::Force::Gravity gravity;
    FlexibleBodySubsystem flexible{system, matter};
    FlexibleBody beam;
    Joint::Weld clamp;

    /** @param g  gravity [m/s²] **/
    Cantilever(const std::shared_ptr<const ReducedBody>& part, const SimTK::Vec3& g)
        : gravity(forces, matter, g),
          beam(flexible, part),
          clamp(flexible, matter.Ground(), beam.interface("left"), "clamp") {}

    /** Undeformed. **/
    SimTK::State makeState() {
        SimTK::State state = system.realizeTopology();
        beam.setPoseByInterface(state, "left", SimTK::Transform());
        return state;
    }
};

}  // namespace simflex::test
