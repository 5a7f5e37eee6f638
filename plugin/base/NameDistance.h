#pragma once
/** @file
Suggestions for misspelled names. Internal. **/

#include <string>
#include <vector>

namespace simflex {

/** Returns the member of `known` with the smallest edit distance, ignoring case, or "" if none is
close. **/
std::string findNearestName(const std::string& name, const std::vector<std::string>& known);

}  // namespace simflex
