#pragma once
/** @file
The schema in readable form: the key reference, and the allowed values at a path. **/

#include <string>
#include <vector>

#include "simflex/model/schema/Schema.h"

namespace simflex {
namespace model {

/** Allowed forms of a value at a path such as "bodies.crank.place" (any name for a name, any number
for a list item); empty if the schema has no such path. "": the whole model. **/
std::vector<const SchemaForm*> findSchemaForms(const std::string& path);

/** Keys allowed below a path, in the schema's order; for completion. **/
std::vector<std::string> getSchemaChildren(const std::string& path);

/** Allowed choices of the value at a path; empty if it is not a choice. **/
std::vector<std::string> getSchemaChoices(const std::string& path);

enum class ReferenceFormat { Text, Markdown };

/** Every key at and below a path: value, unit, default, meaning.
@throws std::runtime_error for a path that the schema does not have. **/
std::string writeKeyReference(const std::string& path, ReferenceFormat format);

}  // namespace model
}  // namespace simflex
