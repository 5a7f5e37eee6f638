#pragma once
/** @file
What results depend on beside a model's text and settings: contents of parts, and files that the
text names. Kept in result files, so that what was computed before is continued, completed, shown
and skipped only while it is of the same model. **/

#include <map>
#include <set>
#include <string>

#include "simflex/model/Model.h"

namespace simflex {
namespace model {

/** Checksums by what they are of: "the part of body 'shaft'", "the file 'motor.csv'". **/
using InputChecksums = std::map<std::string, std::string>;

/** Of all numbers and names of a part that a run reads; not of its origin and its report. **/
std::string calcPartChecksum(const ReducedBody& part);

/** Those of a model that was built. Parts count by their numbers, not by the files that they are
made from. @throws std::runtime_error for a file that cannot be read **/
InputChecksums calcInputChecksums(const Model& model);

/** "the part of body 'shaft' has changed since": the first that differs. Empty: none does,
or nothing is known of then. **/
std::string findChangedInput(const InputChecksums& then, const InputChecksums& now);

/** Paths of the files that a model names, as they can be opened. **/
void collectFiles(const ModelValue& model, std::set<std::string>& paths);

}  // namespace model
}  // namespace simflex
