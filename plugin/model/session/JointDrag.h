#pragma once
/** @file
States in which a coordinate of a joint, or its rate, has a given value.

From an assembled State, each step solves

    G δ = −g(q),   ∂c/∂u δ = Δc

for the smallest δ, in metres anywhere on the bodies. Flexible bodies keep their shapes. Only where
the joints cannot be closed with these they deform, and as little as needed: the smallest change of
modal coordinates since the start counts, a thousandfold. The coordinate is led to its value in
steps of 0.1 rad or a tenth of the way. Redundant equations are allowed. O(m²n) each. **/

#include "simflex/model/Model.h"

namespace simflex {
namespace model {

/** Leads the coordinate to `value`; its rate stays, other speeds are made consistent. An angle goes
the shorter way round.
@throws std::runtime_error if the joints or a motion do not allow it, naming which. **/
SimTK::State dragJoint(const Model& model, const SimTK::State& state, const Joint& joint,
                       int coordinate, double value);

/** Speeds consistent with the joints, and the coordinate's rate is `rate`. @throws the same. **/
SimTK::State setJointRate(const Model& model, const SimTK::State& state, const Joint& joint,
                          int coordinate, double rate);

/** Names of a joint's coordinates: "angle", "displacement", "x", "angle_1" … **/
std::vector<std::string> getCoordinateNames(const Joint& joint);

}  // namespace model
}  // namespace simflex
