#pragma once
/** @file
Prescribed motions of a model file: of a joint coordinate, or of one frame in another. **/

#include "simflex/model/builders/JointBuilder.h"

namespace simflex {
namespace model {

Joint::MotionFunction makeMotionFunction(const Expression& expression);

/** @throws std::invalid_argument if the joint has no coordinate `index`. **/
void checkCoordinate(const Joint& joint, int index);

/** Adds the equation that prescribes coordinate `index` of a joint.
@param pair  frames of the joint
@throws std::invalid_argument if the joint has no such coordinate **/
Joint addJointMotion(const Joint& joint, const FramePair& pair, int index,
                     const Joint::MotionFunction& motion, const std::string& name,
                     const ModelFrames& frames, ModelSystem& system);

/** Frames of a joint with coordinates, by name.
@throws ModelError for a gear or coupler, naming it. **/
const FramePair& findJointFrames(const ModelValue& name, const JointBuilder& joints,
                                 const ModelSystem& system);

void addMotions(const ModelValue& file, const ModelFrames& frames, const JointBuilder& joints,
                ModelSystem& system);

/** Makes the system count turns of all joint angles; an angle with a motion takes its turn from it.
@pre the motions were added. **/
void countTurns(const ModelValue& file, ModelSystem& system);

}  // namespace model
}  // namespace simflex
