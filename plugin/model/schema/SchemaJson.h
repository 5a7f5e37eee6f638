#pragma once
/** @file
The schema as JSON Schema, draft 7, for editors. **/

#include <string>

namespace simflex {
namespace model {

/** JSON schema of model files. It covers keys, kinds, choices and ranges of plain numbers; only the
reader checks formulas and names of bodies. **/
std::string writeJsonSchema();

}  // namespace model
}  // namespace simflex
