#pragma once
/** @file Files of simflex that stand beside its libraries. Internal. **/

#include <filesystem>
#include <string>

namespace simflex {

/** In the folder of simflex's libraries, or in its folder `simflex`, where they are installed.
@throws std::runtime_error if there is none. **/
std::filesystem::path findCompanion(const std::string& name);

}  // namespace simflex
