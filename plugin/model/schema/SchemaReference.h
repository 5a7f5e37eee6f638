#pragma once
/** @file
The schema for people: the key reference, and what may stand at a path. **/

#include <string>
#include <vector>

#include "simflex/model/schema/Schema.h"

namespace simflex {
namespace model {

/** Forms that a value may have at a path such as "bodies.crank.place" (any name for a name, any
number for a list's item); empty if the schema has no such path. "": the whole. **/
std::vector<const SchemaForm*> findSchemaForms(const std::string& path);

/** Keys that may stand below a path, in the schema's order; for completion. **/
std::vector<std::string> getSchemaChildren(const std::string& path);

/** Values among which the one at a path is chosen; empty if it is free. **/
std::vector<std::string> getSchemaChoices(const std::string& path);

enum class ReferenceFormat { Text, Markdown };

/** Every key at and below a path: value, unit, default, meaning.
@throws std::runtime_error for a path that the schema does not have. **/
std::string writeKeyReference(const std::string& path, ReferenceFormat format);

}  // namespace model
}  // namespace simflex
