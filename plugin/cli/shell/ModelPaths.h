#pragma once
/** @file
Paths into a model file, as typed at the prompt. **/

#include <optional>
#include <string>
#include <vector>

#include "simflex/model/file/ModelValue.h"

namespace simflex {
namespace cli {

using namespace model;

/** The text of what the model file says at a path; empty if it says nothing there. **/
std::optional<std::string> formatModelValue(const ModelValue& file, const std::string& path);

/** Paths that the model file and its schema have, of those that begin like `begin`; one level
deeper at most, the end of a level with a point. **/
std::vector<std::string> completeModelPath(const ModelValue& file, const std::string& begin);

}  // namespace cli
}  // namespace simflex
