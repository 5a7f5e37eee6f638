#pragma once
/** @file
Mobilizers of rigid bodies from a model file. **/

#include "simflex/model/builders/ModelFrames.h"

namespace simflex {
namespace model {

struct Mobilizer {
    std::string type = "free";
    FrameOnBody parent;           ///< on Ground or a rigid body
    SimTK::Transform X_PF, X_BM;  ///< inboard frame in `parent`, outboard frame in the body
    double pitch = 0;             ///< of a screw [m/rad]

    bool isFree() const { return type == "free"; }
};

/** @param value  `mobilizer` of a body; free on Ground if not given. **/
Mobilizer readMobilizer(const ModelValue& value, const ModelFrames& frames);

/** Moves the mobilizer's frames so that its coordinates are zero where the body is placed. Its axes
do not change.
@param X_GP  the parent frame as placed
@param X_GB  the body as placed **/
void countFromPlace(Mobilizer& mobilizer, const SimTK::Transform& X_GP,
                    const SimTK::Transform& X_GB);

/** @param X_PF  inboard frame in the parent's body frame **/
SimTK::MobilizedBody addMobilizedBody(const Mobilizer& mobilizer, SimTK::MobilizedBody& parent,
                                      const SimTK::Transform& X_PF, const SimTK::Body& body);

}  // namespace model
}  // namespace simflex
