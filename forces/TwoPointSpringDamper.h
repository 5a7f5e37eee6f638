#pragma once
/** @file
A spring and damper between the origins of two attachment frames, along the line between them:

    f = k (l − l₀) + c l̇    pulls both points together, l their distance

like SimTK::Force::TwoPointLinearSpring and TwoPointLinearDamper between stations of rigid bodies.
Energy ½k(l − l₀)².

    TwoPointSpringDamper strut(flexible, boom.interface("tip"), Attachment(matter.Ground()), 2e4,
                               50, 0.8);  **/

#include "simflex/body/FlexibleBodySubsystem.h"

namespace simflex {

class TwoPointSpringDamper {
public:
    /** If the points meet while l₀ > 0, the line has no direction: the force is then zero, and runs
    warn, naming the element.
    @param stiffness   k ≥ 0 [N/m]
    @param damping     c ≥ 0 [N s/m]
    @param freeLength  l₀ ≥ 0 [m]
    @param name        for messages
    @throws std::invalid_argument that names the value found. **/
    TwoPointSpringDamper(FlexibleBodySubsystem& subsystem, const Attachment& first,
                         const Attachment& second, SimTK::Real stiffness, SimTK::Real damping,
                         SimTK::Real freeLength, const std::string& name = "");
};

}  // namespace simflex
