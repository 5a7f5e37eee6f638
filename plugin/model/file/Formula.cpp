#include "simflex/model/file/Formula.h"

#include <algorithm>
#include <cmath>

#include "simflex/model/file/NearestName.h"
#include "simflex/model/file/ScalarCheck.h"

namespace simflex {
namespace model {

using formula::SyntaxError;

formula::Formula readFormula(const std::string& text, const formula::Scope& scope,
                             const std::vector<std::string>& variables) {
    try {
        return {text, scope, variables};
    } catch (const SyntaxError& error) {
        if (error.unknown.empty()) throw;
        std::vector<std::string> known = variables;
        const bool hasSection = error.unknown.find('.') != std::string::npos;
        const auto add = [&](const auto& entries) {
            for (const auto& entry : entries)
                if (hasSection || entry.first.find('.') == std::string::npos)
                    known.push_back(entry.first);
        };
        add(scope.constants);
        add(scope.tables);
        add(scope.surfaces);
        for (const auto& function : scope.functions) known.push_back(function.first);
        for (const std::string& function : formula::getFunctionNames()) known.push_back(function);
        const std::string proposal = proposeName(error.unknown, known);
        throw SyntaxError(error.what() + (proposal.empty() ? "" : "; " + proposal), error.position);
    }
}

double calcConstant(const std::string& text, const formula::Scope& scope) {
    double value = 0;
    if (formula::readPlainNumber(text, value)) return value;
    const formula::Formula formula = readFormula(text, scope, {});
    const double none = 0;
    value = formula.calc(&none);
    if (!std::isfinite(value))
        throw SyntaxError("'" + shorten(text) + "' has no finite value: " + formula.explain(&none),
                          0);
    return value;
}

bool isFormulaWord(const std::string& name) {
    if (name == "t" || name == "pi" || name == "deg" || name == "g") return true;
    const std::vector<std::string> functions = formula::getFunctionNames();
    return std::find(functions.begin(), functions.end(), name) != functions.end();
}

}  // namespace model
}  // namespace simflex
