#pragma once
/** @file
Checks of single values: numbers, formulas, names, choices. Only for the files of this folder. **/

#include <string>

#include "simflex/model/file/ModelNode.h"

namespace simflex {
namespace model {

/** Tolerance for a formula's value to count as a whole number. **/
inline constexpr double WholeTolerance = 1e-9;

/** Checks a scalar against the forms of `node` and sets the form that it has. **/
void checkScalar(const YamlTree& tree, ModelValue::Node& node);

/** "found X; expected Y". **/
[[noreturn]] void failForm(const YamlTree& tree, const ModelValue::Node& node);

/** Letters, digits, '_' and '-', not starting with a digit or '-'; dots in between if allowed. **/
bool isName(const std::string& text, bool canHaveDots);

/** The first 60 characters of a text, for messages. **/
std::string shorten(const std::string& text);

}  // namespace model
}  // namespace simflex
