#pragma once
/** @file
The State in which a model starts: bodies as placed, then what the file has under `initial`. **/

#include "simflex/model/builders/MotionBuilder.h"

namespace simflex {
namespace model {

/** Coordinates and rates of joints that the file gives. **/
struct JointStart {
    ModelValue joint;  ///< of `initial.joints` or `initial.rates`
    int coordinate = 0;
    std::optional<double> value, rate;
};
std::vector<JointStart> readJointStarts(const ModelValue& file);
/** What the file gives a coordinate of a joint to begin with; 0: nothing. **/
double findStartValue(const ModelValue& file, const std::string& joint, int coordinate);

/** Values of `count` modes of {1: VALUE, …}; zero where none is given.
@throws ModelError if there is no such mode. **/
SimTK::Vector readModes(const ModelValue& modes, int count);

/** As placed, with velocities and modes of bodies; joints are not assembled.
@throws ModelError if a mobilizer cannot put its body where it is placed. **/
void placeBodies(const ModelValue& file, const ModelFrames& frames, const Placement& placement,
                 const ModelSystem& system, SimTK::State& state);

/** Gives joints the coordinates and rates that the file has for them, and leaves the State realized
to Stage::Velocity.
@returns what is to be said of it: bodies that could not keep their shapes, or vibrate from the
start
@throws ModelError if it cannot. **/
std::vector<std::string> setJointStarts(const ModelValue& file, const ModelSystem& system,
                                        SimTK::State& state);

}  // namespace model
}  // namespace simflex
