#pragma once
/** @file
A one-sided stop that keeps the origin of attachment M above the plane z = 0 of attachment F. At a
depth δ = −z > 0,

    f = k δ (1 + a δ̇) ≥ 0    pushes M along F's z axis, and F back

(Hunt and Crossley, 1975, with exponent 1: no jump at first touch and never a pull). The coefficient
of restitution e at impact speed v is related to a by a ≈ 3(1 − e)/(2v) for e near 1.

    ContactStop stop(flexible, Attachment(matter.Ground(), X_GF), arm.interface("tip"), 1e6, 0.5);
**/

#include "simflex/body/FlexibleBodySubsystem.h"

namespace simflex {

class ContactStop {
public:
    /** @param stiffness    k > 0 [N/m]
    @param dissipation  a ≥ 0 [s/m]
    @param name         for messages
    @throws std::invalid_argument that names the value found. **/
    ContactStop(FlexibleBodySubsystem& subsystem, const Attachment& F, const Attachment& M,
                SimTK::Real stiffness, SimTK::Real dissipation = 0, const std::string& name = "");
};

}  // namespace simflex
