#pragma once
/** @file
Moves a system to given values or rates of joint coordinates, with all joints closed.

    setJointCoordinates(bodies, state, {{crank, 0, Pi / 6}});   // [rad] of a pin
    setJointRates(bodies, state, {{crank, 0, 10}});             // [rad/s]

From an assembled State, each step solves

    G δ = −g(q),   ∂c/∂u δ = Δc

for the δ of least kinetic energy, taken as speeds: the result does not depend on units and axes.
Flexible bodies keep their shapes. Only if the joints cannot be closed this way do they deform, so
that the change since the start has the least strain energy, as in statics with the coordinates
held. Goals that would deform a body beyond its linear range (LinearRangeReporter.h) are refused.
Locked coordinates and those with a Motion do not move. Coordinates move to their values in steps of
at most 0.1 rad or a tenth of the way. Redundant equations are allowed. O(m²n) per step, for m
equations and n speeds. **/

#include <vector>

#include "Simbody.h"
#include "simflex/body/Joint.h"

namespace simflex {

/** Target of a joint coordinate [rad, m] or of its rate [rad/s, m/s]. **/
struct JointGoal {
    Joint joint;
    int coordinate = 0;
    SimTK::Real value = 0;
};

enum class AngleWay {
    Shorter,  ///< modulo whole turns
    Whole     ///< through whole turns to the value, where the joints allow it and turns are counted
};

/** Closes the joints and moves coordinates to their values. Torsion springs and signals that count
turns follow: at a value of 4π with AngleWay::Whole a spring is wound up by two turns. Speeds stay
unless constraints require others; call setJointRates() if they must be consistent. The State is
realized to Stage::Velocity.
@throws std::runtime_error naming a joint that does not allow it; the State is unchanged
@throws std::invalid_argument if a value is not finite or a joint is of another system
@throws std::out_of_range if a joint has no such coordinate. **/
void setJointCoordinates(const FlexibleBodySubsystem& bodies, SimTK::State& state,
                         const std::vector<JointGoal>& goals,
                         AngleWay angleWay = AngleWay::Shorter);

/** Closes the joints and sets these rates by the impulse of least kinetic energy: other speeds of
the State are kept as far as joints and rates allow, and unconstrained momentum is conserved. Throws
as setJointCoordinates(). **/
void setJointRates(const FlexibleBodySubsystem& bodies, SimTK::State& state,
                   const std::vector<JointGoal>& goals);

}  // namespace simflex
