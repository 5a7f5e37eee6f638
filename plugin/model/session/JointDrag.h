#pragma once
/** @file
Interactive changes of joint coordinates and their rates. **/

#include "simflex/model/Model.h"

namespace simflex {
namespace model {

/** Sets a coordinate, see simflex::setJointCoordinates() with AngleWay::Whole. The coordinate's
rate is kept if possible, other speeds are made consistent.
@throws std::runtime_error naming the joints or the motion that do not allow it. **/
SimTK::State dragJoint(const Model& model, const SimTK::State& state, const Joint& joint,
                       int coordinate, double value);

/** Sets a rate, see simflex::setJointRates().
@throws the same. **/
SimTK::State setJointRate(const Model& model, const SimTK::State& state, const Joint& joint,
                          int coordinate, double rate);

/** Names of a joint's coordinates: "angle", "displacement", "x", "angle_1" … **/
std::vector<std::string> getCoordinateNames(const Joint& joint);

}  // namespace model
}  // namespace simflex
