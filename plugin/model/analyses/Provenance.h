#pragma once
/** @file
Inputs of results apart from the model's text and settings: contents of parts, and files named by
the text. Result files store their checksums, so that earlier results are continued, completed,
shown or skipped only for the same model. **/

#include <map>
#include <set>
#include <string>

#include "simflex/model/Model.h"

namespace simflex {
namespace model {

/** Checksums by description: "the part of body 'shaft'", "the file 'motor.csv'". **/
using InputChecksums = std::map<std::string, std::string>;

/** Checksum of all numbers and names of a part that a run uses, without its origin and report. **/
std::string calcPartChecksum(const ReducedBody& part);

/** Checksums for a built model. Parts count by their contents, not by the files they are made from.
@throws std::runtime_error for a file that cannot be read **/
InputChecksums calcInputChecksums(const Model& model);

/** The first difference: "the part of body 'shaft' has changed since". Empty if there is none, or
if `then` is empty. **/
std::string findChangedInput(const InputChecksums& then, const InputChecksums& now);

/** Adds the paths of the files named by a model, ready to be opened. **/
void collectFiles(const ModelValue& model, std::set<std::string>& paths);

}  // namespace model
}  // namespace simflex
