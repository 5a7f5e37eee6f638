#pragma once
/** @file
Title of a model, and the message for a missing file. **/

#include <string>

#include "simflex/model/file/ModelValue.h"

namespace simflex {
namespace model {

/** The model's title, or the file's name without its extension. **/
std::string getModelTitle(const ModelValue& model);

/** @throws ModelError for a path at which there is no file. **/
[[noreturn]] void failMissingFile(const ModelValue& value);

}  // namespace model
}  // namespace simflex
