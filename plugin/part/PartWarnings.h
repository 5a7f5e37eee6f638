#pragma once
/** @file
Warnings that a part file carries: what may change the meaning of the part, such as a constraint of
its deck that was left out. Whoever uses the part must be told, too. They stand in the file's data
set /warnings, texts, which is left out where there are none. **/

#include <string>
#include <vector>

#include "simflex/part/ReducedBody.h"

namespace simflex {

/** writeReducedBody() with warnings. **/
void writeReducedBody(const std::string& path, const ReducedBody& body,
                      const std::vector<std::string>& warnings);

/** Those of a part file. @throws std::runtime_error as readReducedBody() does. **/
std::vector<std::string> readPartWarnings(const std::string& path);

/** What the numbers of a part themselves give reason to warn of: empty for simflex's own. **/
std::vector<std::string> listPartDoubts(const ReducedBody& body);

}  // namespace simflex
