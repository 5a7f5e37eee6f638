#pragma once
/** @file
A torsion spring and damper about the z axis of attachment frame F: with θ the angle by which the x
axis of M stands turned about it,

    torque on M:  −k (θ − θ₀) − c θ̇    about F's z axis if M's is in line with it,

and the opposite on F; in general the torque that θ's energy ½k(θ − θ₀)² has. Put the frames where a
Joint::Pin has them. It winds up over any number of turns, which a state of the subsystem counts,
from the one nearest to θ₀ on. Where M's x axis is within 0.1 rad of F's z axis it has no angle, and
runs warn by name.

    TorsionSpring hinge(flexible, base.interface("seat"), lid.interface("hinge"), 12, 0.1); **/

#include "simflex/body/FlexibleBodySubsystem.h"

namespace simflex {

class TorsionSpring {
public:
    /** @param stiffness  k ≥ 0 [N m/rad]
    @param damping    c ≥ 0 [N m s/rad]
    @param freeAngle  θ₀ [rad]
    @param name       for messages
    @throws std::invalid_argument that names the value found. **/
    TorsionSpring(FlexibleBodySubsystem& subsystem, const Attachment& F, const Attachment& M,
                  SimTK::Real stiffness, SimTK::Real damping = 0, SimTK::Real freeAngle = 0,
                  const std::string& name = "");
};

}  // namespace simflex
