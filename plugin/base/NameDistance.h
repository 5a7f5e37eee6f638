#pragma once
/** @file
The known name that was probably meant. Internal. **/

#include <string>
#include <vector>

namespace simflex {

/** The nearest of `known` by edits (case aside), or "" if none is near. **/
std::string findNearestName(const std::string& name, const std::vector<std::string>& known);

}  // namespace simflex
