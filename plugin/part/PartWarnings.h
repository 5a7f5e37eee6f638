#pragma once
/** @file
Warnings stored in a part file about facts that may change the meaning of the part, such as an
omitted constraint of its deck. They must be repeated to every user of the part. The data set
/warnings contains their texts and is absent if there are none. **/

#include <string>
#include <vector>

#include "simflex/part/ReducedBody.h"

namespace simflex {

/** As writeReducedBody(), with warnings. **/
void writeReducedBody(const std::string& path, const ReducedBody& body,
                      const std::vector<std::string>& warnings);

/** Reads the warnings of a part file. @throws std::runtime_error as readReducedBody() does. **/
std::vector<std::string> readPartWarnings(const std::string& path);

/** Returns warnings about a part's numbers; none for parts reduced by simflex. **/
std::vector<std::string> listPartDoubts(const ReducedBody& body);

}  // namespace simflex
