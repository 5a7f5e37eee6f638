#include "simflex/cli/model/Expression.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "simflex/cli/model/ExpressionFormula.h"
#include "simflex/cli/model/ModelError.h"
#include "simflex/part/NumberText.h"

namespace simflex {
namespace cli {

namespace {

const double kNone = std::numeric_limits<double>::quiet_NaN();

// Steps of the extrapolation: 0.037 s to 0.5 us, for functions of up to 10 kHz. No round number, so
// that no step is a multiple of a period.
const int kNumSteps = 24;
const double kFirstStep = 0.0371, kStepRatio = 1.6;

std::string writeNumber(double value) {
    return writeGeneral(value, 9);
}

std::string removeBlanks(const std::string& text) {
    std::string result;
    for (char c : text)
        if (c != ' ' && c != '\t') result += c;
    return result;
}

}  // namespace

Expression::Formula::Formula(double value) : text(writeNumber(value)), constant(value) {}

Expression::Formula::Formula(const std::string& formula, const FormulaScope& scope,
                             const std::string& place)
    : text(formula), _place(place) {
    if (readPlainNumber(text, constant)) return;
    _formula = std::make_unique<simflex::cli::Formula>(text, scope, std::vector<std::string>{"t"});
    isConstant = _formula->getUsedVariables().empty();
    if (isConstant) {
        constant = calcRaw(0);
        if (!std::isfinite(constant)) throw FormulaError("'" + text + "' has no finite value", 0);
        return;
    }
    const std::string plain = removeBlanks(text);
    if (plain.size() > 3 && plain.compare(plain.size() - 3, 3, "(t)") == 0) {
        const auto table = scope.tables.find(plain.substr(0, plain.size() - 3));
        if (table != scope.tables.end()) _table = table->second;
    }
}

double Expression::Formula::calcRaw(double time) const {
    try {
        return _table ? _table->calc(time) : _formula->calc(&time);
    } catch (const std::domain_error&) {
        return kNone;
    }
}

double Expression::Formula::calc(double time, int order) const {
    if (isConstant) return order == 0 ? constant : 0;
    try {
        if (_table) return _table->calc(time, order);
        if (order == 0) {
            const double value = _formula->calc(&time);
            if (std::isfinite(value)) return value;
            fail("'" + text + "' has no finite value at t = " + writeNumber(time));
        }
    } catch (const std::domain_error& error) {
        fail(std::string(error.what()) + " at t = " + writeNumber(time));
    }
    for (int side : {0, 1, -1}) {
        const double value = calcDifference(time, order, side);
        if (std::isfinite(value)) return value;
    }
    fail("'" + text + "' has no derivative at t = " + writeNumber(time));
}

/** Ridders' extrapolation of differences: central for side 0, else to that side; NaN if there is no
step at which all values are finite. **/
double Expression::Formula::calcDifference(double time, int order, int side) const {
    double row[kNumSteps], last[kNumSteps];
    double best = kNone, bestError = std::numeric_limits<double>::infinity();
    const double middle = calcRaw(time);
    double h = kFirstStep;
    int count = 0;  // rows of the tableau so far
    for (int k = 0; k < kNumSteps; ++k, h /= kStepRatio) {
        // the steps that are taken really, after rounding
        const double next = time + (side < 0 ? -h : h);
        const double other = side == 0 ? time - h : time + 2 * (next - time);
        const double yNext = calcRaw(next), yOther = calcRaw(other);
        if (side == 0)
            row[0] = order == 1 ? (yNext - yOther) / (next - other)
                                : (yNext - 2 * middle + yOther) / ((next - time) * (time - other));
        else
            row[0] = order == 1 ? (yNext - middle) / (next - time)
                                : (yOther - 2 * yNext + middle) / ((next - time) * (next - time));
        if (!std::isfinite(row[0])) {
            count = 0;
            continue;
        }
        if (count == 0 && !std::isfinite(best)) best = row[0];
        const double ratio = side == 0 ? kStepRatio * kStepRatio : kStepRatio;
        double factor = ratio;
        for (int j = 1; j <= count; ++j, factor *= ratio) {
            row[j] = (row[j - 1] * factor - last[j - 1]) / (factor - 1);
            const double error =
                std::max(std::fabs(row[j] - row[j - 1]), std::fabs(row[j] - last[j - 1]));
            if (error < bestError) {
                bestError = error;
                best = row[j];
            }
        }
        ++count;
        std::copy(row, row + count, last);
    }
    return best;
}

void Expression::Formula::fail(const std::string& message) const {
    throw ModelError(_place + (_place.empty() ? "" : ": ") + message);
}

Expression::Expression(double constant) : _formula(std::make_shared<const Formula>(constant)) {}
Expression::Expression(std::shared_ptr<const Formula> formula) : _formula(std::move(formula)) {}
double Expression::calcValue(double time) const {
    return _formula->calc(time, 0);
}
double Expression::calcDerivative(double time) const {
    return _formula->calc(time, 1);
}
double Expression::calcSecondDerivative(double time) const {
    return _formula->calc(time, 2);
}
bool Expression::isConstant() const {
    return _formula->isConstant;
}
const std::string& Expression::getText() const {
    return _formula->text;
}

}  // namespace cli
}  // namespace simflex
