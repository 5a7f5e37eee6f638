#pragma once
/** @file
Detection of angles given in degrees. **/

#include <string>
#include <vector>

#include "simflex/model/file/ModelValue.h"

namespace simflex {
namespace model {

/** Warnings, with their places, for rotations of frames and bodies by more than one turn. **/
std::vector<std::string> listAngleDoubts(const ModelValue& model);

}  // namespace model
}  // namespace simflex
