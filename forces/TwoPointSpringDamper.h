#pragma once
/** @file
A spring and damper between the origins of two attachment frames, along the line that joins them:

    f = k (l − l₀) + c l̇    pulls both points together, l their distance

as SimTK::Force::TwoPointLinearSpring and TwoPointLinearDamper do between stations of rigid bodies.
Energy ½k(l − l₀)².

    TwoPointSpringDamper strut(flexible, boom.interface("tip"), Attachment(matter.Ground()), 2e4,
                               50, 0.8); **/

#include "simflex/body/FlexibleBodySubsystem.h"

namespace simflex {

class TwoPointSpringDamper {
public:
    /** @param stiffness   k ≥ 0 [N/m]
    @param damping     c ≥ 0 [N s/m]
    @param freeLength  l₀ ≥ 0 [m]
    @param name        for messages
    @throws std::invalid_argument that names the value found.
    Two points that meet while l₀ > 0 have no direction: the force is zero then, and runs warn by
    name. **/
    TwoPointSpringDamper(FlexibleBodySubsystem& subsystem, const Attachment& first,
                         const Attachment& second, SimTK::Real stiffness, SimTK::Real damping,
                         SimTK::Real freeLength, const std::string& name = "");
};

}  // namespace simflex
