#pragma once
/** @file
Spring, damper and stop on a coordinate q of a joint, or of any two frames (Joint::Coordinate), like
Simbody's Force::MobilityLinearSpring, MobilityLinearDamper and MobilityLinearStop on a mobilizer
coordinate. The force acts along the coordinate, forward on M and back on F [N, N m]:

    CoordinateSpring   f = −k (q − q₀)                       stores ½k(q − q₀)²
    CoordinateDamper   f = −c q̇
    CoordinateStop     f = k x (1 + a ẋ) ≥ 0, back into [low, high], x the depth beyond the limit

(the stop follows Hunt and Crossley, 1975, with exponent 1, like ContactStop). Angles are continuous
over any number of turns, which a state of the subsystem counts. Counting starts from the turn
nearest to q₀ or to the middle of the limits.

    Joint::Pin knee(flexible, thigh.interface("knee"), shank, "knee");
    CoordinateSpring(flexible, knee, 40, 0.2);
    CoordinateDamper(flexible, knee, 0.5);
    CoordinateStop(flexible, knee, 0, 2.4, 1e4, 0.1);

On the displacement of a cylinder: CoordinateSpring(flexible, Joint::Coordinate(sleeve, 1), 2e4).
**/

#include "simflex/body/Joint.h"

namespace simflex {

class CoordinateSpring {
public:
    /** @param stiffness  k ≥ 0 [N/m, N m/rad]
    @param rest       q₀ [m, rad]
    @throws std::invalid_argument that names the value found. **/
    CoordinateSpring(FlexibleBodySubsystem& subsystem, const Joint::Coordinate& coordinate,
                     SimTK::Real stiffness, SimTK::Real rest = 0, const std::string& name = "");
};

class CoordinateDamper {
public:
    /** @param damping  c ≥ 0 [N s/m, N m s/rad]
    @throws std::invalid_argument that names the value found. **/
    CoordinateDamper(FlexibleBodySubsystem& subsystem, const Joint::Coordinate& coordinate,
                     SimTK::Real damping, const std::string& name = "");
};

class CoordinateStop {
public:
    /** @param low, high    limits, low < high; ∓Infinity means no limit on that side [m, rad]
    @param stiffness    k > 0 [N/m, N m/rad]
    @param dissipation  a ≥ 0 [s/m, s/rad]
    @throws std::invalid_argument that names the value found. **/
    CoordinateStop(FlexibleBodySubsystem& subsystem, const Joint::Coordinate& coordinate,
                   SimTK::Real low, SimTK::Real high, SimTK::Real stiffness,
                   SimTK::Real dissipation = 0, const std::string& name = "");
};

}  // namespace simflex
