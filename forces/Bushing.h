#pragma once
/** @file
A linear bushing between two attachment frames F and M: stiffness and damping 6×6 on their relative
pose e = (θ, p), θ the rotation vector of M in F [rad], p the position of M's origin in F [m]:

    generalized force on e:  −K e − C ė,    energy ½ eᵀK e

K and C are symmetric and have no negative eigenvalue. For small turns this is
SimTK::Force::LinearBushing, which uses body-fixed angles; the rotation vector treats all axes alike
and is good for turns of up to LargestTurn. At half a turn the rotation vector jumps to the opposite
one, and the torque with it, which no choice of coordinates mends: runs warn by name where a bushing
that resists turning is turned further, or as far within a step. Damping alone is right at any turn
about one axis. For what turns on, use a TorsionSpring or a joint.

    Bushing mount(flexible, Attachment(matter.Ground()), frame.interface("mount"),
                  Bushing::diagonal(Vec6(100, 100, 100, 1e5, 1e5, 2e5)),
                  Bushing::diagonal(Vec6(1, 1, 1, 200, 200, 300))); **/

#include "simflex/body/FlexibleBodySubsystem.h"

namespace simflex {

class Bushing {
public:
    static constexpr SimTK::Real LargestTurn = 2.36;  ///< 135 degrees [rad]

    /** @param stiffness  K: [N m/rad], [N/rad], [N m/m], [N/m] by blocks
    @param damping    C: the same times seconds
    @param name       for messages
    @throws std::invalid_argument if K or C is not symmetric or has a negative eigenvalue. **/
    Bushing(FlexibleBodySubsystem& subsystem, const Attachment& F, const Attachment& M,
            const SimTK::Mat66& stiffness, const SimTK::Mat66& damping = SimTK::Mat66(0),
            const std::string& name = "");

    /** Three stiffnesses against turning, three against shifting along F's axes. **/
    static SimTK::Mat66 diagonal(const SimTK::Vec6& values);
};

}  // namespace simflex
