#pragma once
/** @file
Angles that are degrees by mistake. **/

#include <string>
#include <vector>

#include "simflex/model/file/ModelValue.h"

namespace simflex {
namespace model {

/** Rotations of frames and bodies by more than a whole turn, with their places: warnings. **/
std::vector<std::string> listAngleDoubts(const ModelValue& model);

}  // namespace model
}  // namespace simflex
