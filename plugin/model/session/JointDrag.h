#pragma once
/** @file
Coordinates of joints of a model, and their rates, changed by a person. **/

#include "simflex/model/Model.h"

namespace simflex {
namespace model {

/** See simflex::setJointCoordinates(), AngleWay::Whole; the coordinate's rate stays if it can,
other speeds are made consistent.
@throws std::runtime_error if the joints or a motion do not allow it, naming which. **/
SimTK::State dragJoint(const Model& model, const SimTK::State& state, const Joint& joint,
                       int coordinate, double value);

/** See simflex::setJointRates(). @throws the same. **/
SimTK::State setJointRate(const Model& model, const SimTK::State& state, const Joint& joint,
                          int coordinate, double rate);

/** Names of a joint's coordinates: "angle", "displacement", "x", "angle_1" … **/
std::vector<std::string> getCoordinateNames(const Joint& joint);

}  // namespace model
}  // namespace simflex
