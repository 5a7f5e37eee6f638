#pragma once
/** @file
The initial State of a model: bodies as placed, then the values under `initial`. **/

#include "simflex/model/builders/MotionBuilder.h"

namespace simflex {
namespace model {

/** Initial coordinate and rate of a joint from the file. **/
struct JointStart {
    ModelValue joint;  ///< key under `initial.joints` or `initial.rates`
    int coordinate = 0;
    std::optional<double> value, rate;
};
std::vector<JointStart> readJointStarts(const ModelValue& file);
/** Initial value of a joint coordinate from the file; 0 if there is none. **/
double findStartValue(const ModelValue& file, const std::string& joint, int coordinate);

/** Values of `count` modes from {1: VALUE, …}; others are zero.
@throws ModelError if there is no such mode. **/
SimTK::Vector readModes(const ModelValue& modes, int count);

/** Places bodies and sets their velocities and modes; joints are not assembled.
@throws ModelError if a mobilizer cannot reach its body's place. **/
void placeBodies(const ModelValue& file, const ModelFrames& frames, const Placement& placement,
                 const ModelSystem& system, SimTK::State& state);

/** Sets the initial coordinates and rates of joints, and leaves the State realized to
Stage::Velocity.
@returns warnings about bodies that could not keep their shapes, or vibrate from the start
@throws ModelError if it cannot. **/
std::vector<std::string> setJointStarts(const ModelValue& file, const ModelSystem& system,
                                        SimTK::State& state);

}  // namespace model
}  // namespace simflex
