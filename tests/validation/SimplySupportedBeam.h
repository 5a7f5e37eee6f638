#pragma once
/** @file
A brick along x on a pin at its end "left" and a roller at "right", with its weight and a load at
one node: statically determinate. **/

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"
#include "simflex/forces/AttachmentForce.h"
#include "simflex/solver/StaticEquilibrium.h"

namespace simflex::test {

struct SimplySupportedBeam {
    SimTK::MultibodySystem system;
    SimTK::SimbodyMatterSubsystem matter{system};
    SimTK::GeneralForceSubsystem forces{system};
    SimTK::Force::Gravity gravity;
    FlexibleBodySubsystem flexible{system, matter};
    FlexibleBody beam;
    Joint::Pin pin;              ///< about z
    Joint::PointInPlane roller;  ///< on a plane y = 0
    AttachmentForce push;
    StaticEquilibrium equilibrium{system};

    /** @param g  gravity [m/s²]
    @param load  (torque, force) on the node, in Ground **/
    SimplySupportedBeam(const std::shared_ptr<const ReducedBody>& part, const SimTK::Vec3& g,
                        int node, const SimTK::SpatialVec& load)
        : gravity(forces, matter, g),
          beam(flexible, part),
          pin(flexible, matter.Ground(), beam.interface("left"), "pin"),
          // z of the plane's frame is up
          roller(flexible,
                 Attachment(matter.Ground(),
                            SimTK::Transform(SimTK::Rotation(-SimTK::Pi / 2, SimTK::XAxis))),
                 beam.interface("right"), "roller"),
          push(flexible, beam.node(node), load) {}

    void solve() {
        SimTK::State state = system.realizeTopology();
        beam.setPoseByInterface(state, "left", SimTK::Transform());
        equilibrium.solve(state);
    }

    /** Returns the undeformed position of a node from "left" [m]. **/
    SimTK::Vec3 calcUndeformedNode(int node) const {
        const ReducedBody& part = beam.getPart();
        const auto& numbers = part.mesh.nodeNumbers;
        const auto at = std::find(numbers.begin(), numbers.end(), node) - numbers.begin();
        const auto s = part.mesh.position(int(at)), left = part.interfaces[0].position;
        return {s[0] - left[0], s[1] - left[1], s[2] - left[2]};
    }

    /** Returns (torque, force) of a support on the beam, at its point of the beam, in Ground. **/
    SimTK::SpatialVec calcReaction(const Joint& joint) const {
        return joint.calcReaction(equilibrium.getState(), equilibrium.getMultipliers(joint),
                                  Joint::Side::M, Joint::Side::M);
    }
};

}  // namespace simflex::test
