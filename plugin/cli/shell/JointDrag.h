#pragma once
/** @file
States in which a coordinate of a joint, or its rate, has a given value.

From an assembled State, each step solves

    G δ = −g(q),   ∂c/∂u δ = Δc

for the smallest δ, in metres anywhere on the bodies; modal coordinates count a thousandfold, so
that bodies move before they bend. The coordinate is led to its value in steps of 0.1 rad or a tenth
of the way. Redundant equations are allowed. O(m²n) each. **/

#include "simflex/cli/model/Model.h"

namespace simflex {
namespace cli {

/** Leads the coordinate to `value`; speeds stay as they are. An angle goes the shorter way round.
@throws std::runtime_error if the joints do not allow it, saying how far the coordinate came and
which joint came apart. **/
SimTK::State dragJoint(const Model& model, const SimTK::State& state, const Joint& joint,
                       int coordinate, double value);

/** Speeds consistent with the joints, and the coordinate's rate is `rate`. @throws the same. **/
SimTK::State setJointRate(const Model& model, const SimTK::State& state, const Joint& joint,
                          int coordinate, double rate);

/** Names of a joint's coordinates: "angle", "displacement", "x", "angle_1" … **/
std::vector<std::string> getCoordinateNames(const Joint& joint);

}  // namespace cli
}  // namespace simflex
