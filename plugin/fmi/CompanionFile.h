#pragma once
/** @file Files of simflex installed with its libraries. Internal. **/

#include <filesystem>
#include <string>

namespace simflex {

/** Finds a file in the folder of simflex's libraries, or in its subfolder `simflex` if they are
installed.
@throws std::runtime_error if there is none. **/
std::filesystem::path findCompanion(const std::string& name);

}  // namespace simflex
