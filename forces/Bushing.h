#pragma once
/** @file
A linear bushing between two attachment frames F and M: 6×6 stiffness and damping on their relative
pose e = (θ, p), where θ is the rotation vector of M in F [rad] and p the position of M's origin in
F [m]:

    generalized force on e:  −K e − C ė,    energy ½ eᵀK e

K and C are symmetric and positive semidefinite. For small rotations this is
SimTK::Force::LinearBushing, which uses body-fixed angles; the rotation vector treats all axes alike
and is valid for rotations up to LargestTurn. At half a turn the rotation vector flips its sign, and
the torque with it, in any choice of coordinates. Runs warn, naming the bushing, if one that resists
rotation turns further, or as far within a single step. Pure damping is correct at any angle about
one axis. For continuous rotation use a TorsionSpring or a joint.

    Bushing mount(flexible, Attachment(matter.Ground()), frame.interface("mount"),
                  Bushing::diagonal(Vec6(100, 100, 100, 1e5, 1e5, 2e5)),
                  Bushing::diagonal(Vec6(1, 1, 1, 200, 200, 300)));  **/

#include "simflex/body/FlexibleBodySubsystem.h"

namespace simflex {

class Bushing {
public:
    static constexpr SimTK::Real LargestTurn = 2.36;  ///< 135 degrees [rad]

    /** @param stiffness  K: [N m/rad], [N/rad], [N m/m], [N/m] by blocks
    @param damping    C: the same units times seconds
    @param name       for messages
    @throws std::invalid_argument if K or C is not finite, not symmetric or has a negative
    eigenvalue. **/
    Bushing(FlexibleBodySubsystem& subsystem, const Attachment& F, const Attachment& M,
            const SimTK::Mat66& stiffness, const SimTK::Mat66& damping = SimTK::Mat66(0),
            const std::string& name = "");

    /** Diagonal matrix from three rotational and three translational coefficients along F's axes.
     **/
    static SimTK::Mat66 diagonal(const SimTK::Vec6& values);
};

}  // namespace simflex
