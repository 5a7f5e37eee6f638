#pragma once
/** @file
A linear bushing between two attachment frames F and M: stiffness and damping 6×6 on their relative
pose e = (θ, p), θ the rotation vector of M in F [rad], p the position of M's origin in F [m]:

    generalized force on e:  −K e − C ė,    energy ½ eᵀK e

K and C are symmetric and have no negative eigenvalue. For small turns this is
SimTK::Force::LinearBushing, which uses body-fixed angles; the rotation vector treats all axes alike
and is good for any turn below one half.

    Bushing mount(flexible, Attachment(matter.Ground()), frame.interface("mount"),
                  Bushing::diagonal(Vec6(100, 100, 100, 1e5, 1e5, 2e5)),
                  Bushing::diagonal(Vec6(1, 1, 1, 200, 200, 300))); **/

#include "simflex/body/FlexibleBodySubsystem.h"

namespace simflex {

class Bushing {
public:
    /** @param stiffness  K: [N m/rad], [N/rad], [N m/m], [N/m] by blocks
    @param damping    C: the same times seconds
    @throws std::invalid_argument if K or C is not symmetric or has a negative eigenvalue. **/
    Bushing(FlexibleBodySubsystem& subsystem, const Attachment& F, const Attachment& M,
            const SimTK::Mat66& stiffness, const SimTK::Mat66& damping = SimTK::Mat66(0));

    /** Three stiffnesses against turning, three against shifting along F's axes. **/
    static SimTK::Mat66 diagonal(const SimTK::Vec6& values);
};

}  // namespace simflex
