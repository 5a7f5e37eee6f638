#pragma once
/** @file
Formulas as they stand in model files: what nobody knows is answered with what was meant. **/

#include "simflex/model/formula/Formula.h"

namespace simflex {
namespace model {

/** @throws formula::SyntaxError that proposes the nearest of the names there are. **/
formula::Formula readFormula(const std::string& text, const formula::Scope& scope,
                             const std::vector<std::string>& variables);

/** The value of a formula of constants. @throws formula::SyntaxError if it has none. **/
double calcConstant(const std::string& text, const formula::Scope& scope);

/** Names that parameters and tables must not have: functions, `t`, `pi` … **/
bool isFormulaWord(const std::string& name);

}  // namespace model
}  // namespace simflex
