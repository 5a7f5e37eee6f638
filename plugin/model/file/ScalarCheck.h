#pragma once
/** @file
Checks of single values: numbers, formulas, names, choices. Only for the files of this folder. **/

#include <string>

#include "simflex/model/file/ModelNode.h"

namespace simflex {
namespace model {

/** By how much a whole number may miss, as of a formula. **/
inline constexpr double WholeTolerance = 1e-9;

/** Checks a scalar against the forms of `node` and sets which it has. **/
void checkScalar(const YamlTree& tree, ModelValue::Node& node);

/** "found X; expected Y". **/
[[noreturn]] void failForm(const YamlTree& tree, const ModelValue::Node& node);

/** Letters, digits, '_' and '-', not beginning with a digit or '-'; with dots between if allowed.
 * **/
bool isName(const std::string& text, bool canHaveDots);

/** At most 60 characters of a text, for messages. **/
std::string shorten(const std::string& text);

}  // namespace model
}  // namespace simflex
