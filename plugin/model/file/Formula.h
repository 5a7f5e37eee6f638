#pragma once
/** @file
Formulas of model files; messages about unknown names suggest the nearest one. **/

#include "simflex/model/formula/Formula.h"

namespace simflex {
namespace model {

/** @throws formula::SyntaxError suggesting the nearest existing name. **/
formula::Formula readFormula(const std::string& text, const formula::Scope& scope,
                             const std::vector<std::string>& variables);

/** Value of a formula of constants.
@throws formula::SyntaxError if it has none. **/
double calcConstant(const std::string& text, const formula::Scope& scope);

/** True for names that parameters and tables must not have: functions, `t`, `pi` … **/
bool isFormulaWord(const std::string& name);

}  // namespace model
}  // namespace simflex
