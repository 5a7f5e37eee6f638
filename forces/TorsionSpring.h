#pragma once
/** @file
A torsion spring and damper about the z axis of attachment frame F. With θ the angle of M's x axis
about that axis,

    torque on M:  −k (θ − θ₀) − c θ̇    about F's z axis if M's z axis is aligned with it,

and the opposite on F; in general the torque follows from the energy ½k(θ − θ₀)². Place the frames
as for a Joint::Pin. The spring winds up over any number of turns, which a state of the subsystem
counts from the turn nearest to θ₀. The angle is undefined where M's x axis is within 0.1 rad of F's
z axis; runs then warn, naming the spring.

    TorsionSpring hinge(flexible, base.interface("seat"), lid.interface("hinge"), 12, 0.1);  **/

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
