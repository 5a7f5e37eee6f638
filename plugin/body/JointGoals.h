#pragma once
/** @file
States in which coordinates of joints, or their rates, have given values, and all joints are closed.

    setJointCoordinates(bodies, state, {{crank, 0, Pi / 6}});   // [rad] of a pin
    setJointRates(bodies, state, {{crank, 0, 10}});             // [rad/s]

From an assembled State, each step solves

    G δ = −g(q),   ∂c/∂u δ = Δc

for the smallest δ: where flexible bodies are, in metres anywhere on them; of rigid ones by the
speeds' weights (SimTK::State::getUWeights()). Flexible bodies keep their shapes. Only where the
joints cannot be closed with these they deform, with the least strain energy, of the change since the
start: as statics bends them when it holds the coordinates. Goals that would deform a body beyond its
linear range (LinearRangeReporter.h) are refused. What is locked or has a Motion stays. The
coordinates are led to their values in steps of at most 0.1 rad or a tenth of the way. Redundant
equations are allowed. O(m²n) each, for m equations and n speeds. **/

#include <vector>

#include "Simbody.h"
#include "simflex/body/Joint.h"

namespace simflex {

/** What a coordinate of a joint [rad, m], or its rate [rad/s, m/s], is to be. **/
struct JointGoal {
    Joint joint;
    int coordinate = 0;
    SimTK::Real value = 0;
};

enum class AngleWay {
    Shorter,  ///< round; a whole turn more or less is the same
    Whole     ///< through whole turns to the value, where the joints allow it and turns are counted
};

/** Closes the joints and leads coordinates to their values. Torsion springs, and signals that count
turns, go along: at a value of 4π, the whole way, a spring is wound up by two turns. Speeds stay as
they are where nothing asks for others: the State may have to be given consistent ones by
setJointRates(). The State is realized to Stage::Velocity.
@throws std::runtime_error naming a joint that does not allow it; the State is as it was
@throws std::invalid_argument if a value is not finite or a joint is of another system
@throws std::out_of_range if a joint has no such coordinate. **/
void setJointCoordinates(const FlexibleBodySubsystem& bodies, SimTK::State& state,
                         const std::vector<JointGoal>& goals,
                         AngleWay angleWay = AngleWay::Shorter);

/** Closes the joints and gives speeds these rates, by the impulse of least kinetic energy: speeds
that the State has are met where joints and rates leave them, and momentum that nothing holds stays.
@throws the same. **/
void setJointRates(const FlexibleBodySubsystem& bodies, SimTK::State& state,
                   const std::vector<JointGoal>& goals);

}  // namespace simflex
