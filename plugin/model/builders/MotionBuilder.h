#pragma once
/** @file
Prescribed motions of a model file: of a coordinate of a joint, or of a frame in another. **/

#include "simflex/model/builders/JointBuilder.h"

namespace simflex {
namespace model {

/** Value, rate and acceleration as a motion has them. **/
Joint::MotionFunction makeMotionFunction(const Expression& expression);

/** @throws std::invalid_argument if the joint has no coordinate `index`. **/
void checkCoordinate(const Joint& joint, int index);

/** Adds the equation that leads coordinate `index` of a joint.
@param frames  of the joint
@throws std::invalid_argument if the joint has no such coordinate **/
Joint addJointMotion(const Joint& joint, const FramePair& pair, int index,
                     const Joint::MotionFunction& motion, const std::string& name,
                     const ModelFrames& frames, ModelSystem& system);

/** A joint with coordinates, by name. @throws ModelError for a gear or coupler, naming it. **/
const FramePair& findJointFrames(const ModelValue& name, const JointBuilder& joints,
                                 const ModelSystem& system);

/** All motions. **/
void addMotions(const ModelValue& file, const ModelFrames& frames, const JointBuilder& joints,
                ModelSystem& system);

/** From now on the system counts turns of all angles of joints, those that motions lead by these.
@pre the motions were added. **/
void countTurns(const ModelValue& file, ModelSystem& system);

}  // namespace model
}  // namespace simflex
