#pragma once
/** @file
A formula of named variables and time: `slider.x - 2*crank.x + 0.1*t`. **/

#include <memory>
#include <string>
#include <vector>

#include "simflex/model/file/ModelValue.h"

namespace simflex {
namespace model {

/** Copies share what was parsed; may be evaluated by several threads at once. **/
class VariableFormula {
public:
    /** @param variables  besides `t`; letters, digits, '_' and '.'; names that formulas cannot have
        are passed over
    @throws ModelError pointing into the text. **/
    VariableFormula(const ModelValue& text, const std::vector<std::string>& variables);

    /** @param values  of all variables, in their order **/
    double calcValue(double time, const double* values) const;

    /** Numbers of the variables that occur. **/
    const std::vector<int>& getUsed() const;

private:
    struct Shared;
    std::shared_ptr<const Shared> _shared;
};

}  // namespace model
}  // namespace simflex
