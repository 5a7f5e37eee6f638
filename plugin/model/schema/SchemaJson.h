#pragma once
/** @file
The schema for editors: JSON Schema, draft 7. **/

#include <string>

namespace simflex {
namespace model {

/** What editors check model files against. It knows keys, kinds, choices and ranges of plain
numbers; the reader knows more (formulas, names of bodies). **/
std::string writeJsonSchema();

}  // namespace model
}  // namespace simflex
