#pragma once
/** @file
The libraries that an FMU takes along. Internal. **/

#include <string>
#include <vector>

namespace simflex {
namespace fmu {

struct LibraryFile {
    std::string name;  ///< in the folder of the unit's binary
    std::string path;
};

/** simflex_fmu as IDENTIFIER.so and, unless it is thin, all that it needs but what belongs to the
system: the C and C++ libraries and the loader.
@param library  path of simflex_fmu; empty: beside the library that this function is in
@throws std::runtime_error if it is not there or cannot be loaded. **/
std::vector<LibraryFile> findLibraries(const std::string& library, const std::string& identifier,
                                       bool isThin);

}  // namespace fmu
}  // namespace simflex
