#pragma once
/** @file
The libraries packed into an FMU. Internal. **/

#include <string>
#include <vector>

namespace simflex {
namespace fmu {

struct LibraryFile {
    std::string name;  ///< in the folder of the FMU's binary
    std::string path;
};

/** Returns simflex_fmu as IDENTIFIER.so and, unless it is thin, all its dependencies except those
of the system: the C and C++ libraries and the loader.
@param library  path of simflex_fmu; empty: beside this library
@throws std::runtime_error if it does not exist or cannot be loaded. **/
std::vector<LibraryFile> findLibraries(const std::string& library, const std::string& identifier,
                                       bool isThin);

}  // namespace fmu
}  // namespace simflex
