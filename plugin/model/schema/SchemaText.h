#pragma once
/** @file
The schema in words. **/

#include <string>
#include <vector>

#include "simflex/model/schema/Schema.h"

namespace simflex {
namespace model {

/** "a number greater than 0", "one of x, y, z, or a vector [x, y, z]". **/
std::string describeForms(const std::vector<SchemaForm>& forms);
std::string describeForm(const SchemaForm& form);

/** "at least 0", "greater than 0", "from 0 to 1". **/
std::string describeRange(const SchemaForm& form);

/** Paths at which a key is allowed: "solver", "bodies.NAME". **/
std::vector<std::string> findSchemaPaths(const std::string& key);

/** Writes at most 9 digits. **/
std::string writeNumber(double value);

}  // namespace model
}  // namespace simflex
