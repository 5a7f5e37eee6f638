/** @file
Probes of functions of time and of formulas of other probes. **/

#include <cmath>

#include "simflex/model/file/VariableFormula.h"
#include "simflex/model/probes/ProbeColumns.h"
#include "simflex/model/probes/ProbeKinds.h"

namespace simflex {
namespace model {

namespace {

/** A column of another probe. **/
struct Column {
    Probe probe;
    size_t number;
};

struct FormulaOfProbes {
    VariableFormula formula;
    std::vector<Column> columns;

    double calc(const Moment& moment) const {
        std::vector<double> arguments, numbers;
        for (const Column& column : columns) {
            numbers.resize(column.probe.columns.size());
            column.probe.calc(moment, numbers.data());
            arguments.push_back(numbers[column.number]);
        }
        const double value = formula.calcValue(moment.state.getTime(), arguments.data());
        return std::isnan(value) ? SimTK::NaN : value;  // the same NaN on every machine
    }
};

/** Finds the column NAME or NAME.COLUMN. **/
Column findColumn(const ModelValue& formula, const std::string& variable,
                  const FindProbe& findProbe) {
    const Probe probe = findProbe(formula, variable.substr(0, variable.find('.')));
    return {probe, chooseColumn(formula, variable, probe.columns)};
}

Probe makeNumber(const ModelValue& entry) {
    Probe probe;
    probe.unit = entry.get("unit").getText();
    probe.columns = {""};
    return probe;
}

Probe makeSignal(const ProbeSource& source, const Signal& signal) {
    Probe probe;
    probe.columns = {""};
    probe.calc = [model = source.model, signal](const Moment& moment, double* values) {
        *values = signal.calcValue(model->getFlexibleBodies(), moment.state);
    };
    return probe;
}

}  // namespace

Probe makeStateProbe(const ProbeSource& source) {
    Probe probe = makeSignal(source, source.model->findState(source.entry.get("state")));
    probe.unit = source.entry.get("unit").getText();
    return probe;
}

Probe makeFunctionProbe(const ProbeSource& source) {
    Probe probe = makeNumber(source.entry);
    probe.calc = [function = source.entry.get("function").getExpression()](const Moment& moment,
                                                                           double* values) {
        *values = function.calcValue(moment.state.getTime());
    };
    return probe;
}

Probe makeExpressionProbe(const ProbeSource& source, const FindProbe& findProbe) {
    const ModelValue text = source.entry.get("expression");
    const auto& states = source.model->getStates();
    const VariableFormula formula(text);
    std::vector<Column> columns;
    for (const std::string& name : formula.getQuantities()) {
        const auto state = states.find(name);
        columns.push_back(state != states.end() ? Column{makeSignal(source, state->second), 0}
                                                : findColumn(text, name, findProbe));
    }
    Probe probe = makeNumber(source.entry);
    // Shared by all copies, and evaluated once per Moment.
    const auto own = std::make_shared<const FormulaOfProbes>(FormulaOfProbes{formula, columns});
    probe.calc = [own](const Moment& moment, double* values) {
        const auto known = moment.formulas.find(own.get());
        *values = known != moment.formulas.end() ? known->second : own->calc(moment);
        moment.formulas.emplace(own.get(), *values);
    };
    return probe;
}

}  // namespace model
}  // namespace simflex
