#pragma once
/** @file
Texts about a model: its title, and of files that it misses. **/

#include <string>

#include "simflex/model/file/ModelValue.h"

namespace simflex {
namespace model {

/** Its title, or the file's name without its ending. **/
std::string getModelTitle(const ModelValue& model);

/** Fails for a path at which there is no file. **/
[[noreturn]] void failMissingFile(const ModelValue& value);

}  // namespace model
}  // namespace simflex
