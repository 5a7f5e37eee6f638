#pragma once
/** @file
Formulas of a model file, parsed once by muParser and evaluated by any number of threads. **/

#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "simflex/cli/model/Table.h"

namespace simflex {
namespace cli {

/** What formulas may name besides their variables and the functions that are always there. **/
struct FormulaScope {
    std::map<std::string, double> constants;
    std::map<std::string, std::shared_ptr<const Table>> tables;
};

/** What is wrong with a formula; `position` counts its characters from 0. **/
class FormulaError : public std::runtime_error {
public:
    FormulaError(const std::string& message, int where)
        : std::runtime_error(message), position(where) {}
    int position;
};

class Formula {
public:
    /** @throws FormulaError. **/
    Formula(const std::string& text, const FormulaScope& scope,
            const std::vector<std::string>& variables);
    ~Formula();
    Formula(const Formula&) = delete;
    Formula& operator=(const Formula&) = delete;

    /** @param values  of the variables, in their order; not checked for being finite
    @throws std::domain_error of tables that refuse extrapolation. **/
    double calc(const double* values) const;

    /** Those of the variables that occur in the text. **/
    const std::vector<std::string>& getUsedVariables() const { return _used; }
    const std::string& getText() const { return _text; }

private:
    struct Evaluator;
    struct Pool;
    std::string _text, _evaluated;  ///< as given, and with choices that leave out the other branch
    FormulaScope _scope;
    std::vector<std::string> _variables, _used;
    std::unique_ptr<Pool> _pool;

    std::unique_ptr<Evaluator> makeEvaluator(const std::string& text) const;
};

/** Names that parameters and tables must not have: functions, `t`, `pi` … **/
bool isFormulaWord(const std::string& name);
/** Names of the functions, for messages and completion. **/
std::vector<std::string> getFormulaFunctions();

/** A plain number in YAML's way ("1e-6", "+2", "-.5"); false for anything else. **/
bool readPlainNumber(const std::string& text, double& value);

}  // namespace cli
}  // namespace simflex
