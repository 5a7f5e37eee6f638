#include "simflex/model/file/Expression.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "simflex/base/NumberText.h"
#include "simflex/model/file/Formula.h"
#include "simflex/model/file/ModelError.h"

namespace simflex {
namespace model {

namespace {

std::string writeNumber(double value) {
    return writeGeneral(value, 9);
}

}  // namespace

struct Expression::Contents {
    std::string text, key;
    ModelPlace place;
    double constant = 0;
    std::unique_ptr<const formula::Formula> formula;  ///< null for a constant
};

Expression::Expression(double constant) {
    auto contents = std::make_shared<Contents>();
    contents->text = writeNumber(constant);
    contents->constant = constant;
    m_contents = contents;
}

Expression::Expression(const std::string& text, const formula::Scope& scope,
                       const ModelPlace& place, const std::string& key) {
    auto contents = std::make_shared<Contents>();
    contents->text = text;
    contents->place = place;
    contents->key = key;
    if (!formula::readPlainNumber(text, contents->constant)) {
        auto formula = std::make_unique<formula::Formula>(readFormula(text, scope, {"t"}));
        if (formula->getUsedVariables().empty())
            contents->constant = calcConstant(text, scope);
        else
            contents->formula = std::move(formula);
    }
    m_contents = contents;
}

double Expression::calcValue(double time) const {
    if (isConstant()) return m_contents->constant;
    const double value = m_contents->formula->calc(&time);
    if (!std::isfinite(value))
        fail("'" + getText() + "' has no finite value at t = " + writeNumber(time) + ": " +
             m_contents->formula->explain(&time));
    return value;
}

std::array<double, 3> Expression::calcMotion(double time) const {
    if (isConstant()) return {m_contents->constant, 0, 0};
    const auto now = formula::Jet<double>::makeVariable(time);
    const formula::Jet<double> motion = m_contents->formula->calc(&now);
    if (!std::isfinite(motion.value)) calcValue(time);
    if (!std::isfinite(motion.first) || !std::isfinite(motion.second))
        fail("'" + getText() + "' has no finite " +
             (std::isfinite(motion.first) ? "second" : "first") +
             " derivative at t = " + writeNumber(time));
    return {motion.value, motion.first, motion.second};
}

std::vector<double> Expression::findSwitches(double from, double to) const {
    if (isConstant()) return {};
    return m_contents->formula->findSwitches(from, to);
}

std::optional<Expression::Kink> Expression::findKink(double from, double to) const {
    if (isConstant()) return std::nullopt;
    // Sample points within each stretch between two switches, as fractions of its length.
    const double places[] = {0.03, 0.21, 0.39, 0.5, 0.63, 0.82, 0.97};
    // Tolerances of jumps in value and slope, relative to the largest magnitude nearby.
    const double tolerances[] = {1e-9, 1e-6};
    using Motion = formula::Jet<double>;
    const auto calc = [this](double time) {
        const Motion now = Motion::makeVariable(time);
        return m_contents->formula->calc(&now);
    };
    const std::vector<double> switches = findSwitches(from, to);
    for (std::size_t i = 0; i < switches.size(); ++i) {
        const double time = switches[i];
        const double begin = i > 0 ? switches[i - 1] : from;
        const double end = i + 1 < switches.size() ? switches[i + 1] : to;
        if (!(time < end)) continue;
        // Evaluate slightly off the switch on both sides, and extrapolate to it.
        const double beside = std::max(std::min(1e-9 * std::max(1.0, std::abs(time)),
                                                1e-3 * std::min(time - begin, end - time)),
                                       1e-14 * std::max(1.0, std::abs(time)));
        double sides[2][2], sizes[2] = {0, 0};
        for (int side : {0, 1}) {
            const double step = side == 0 ? beside : -beside;
            const Motion motion = calc(time - step);
            const double bend = std::isfinite(motion.second) ? motion.second : 0;
            sides[side][0] = motion.value + step * (motion.first + step / 2 * bend);
            sides[side][1] = motion.first + step * bend;
            for (double place : places) {
                const Motion other =
                    calc(side == 0 ? time - place * (time - begin) : time + place * (end - time));
                if (std::isfinite(other.value))
                    sizes[0] = std::max(sizes[0], std::abs(other.value));
                if (std::isfinite(other.first))
                    sizes[1] = std::max(sizes[1], std::abs(other.first));
            }
        }
        // The run reports a missing value itself.
        if (!std::isfinite(sides[0][0]) || !std::isfinite(sides[1][0])) continue;
        for (int order : {0, 1}) {
            const double before = sides[0][order], after = sides[1][order];
            const double size = std::max({sizes[order], std::abs(before), std::abs(after)});
            if (std::abs(after - before) > tolerances[order] * size)
                return Kink{time, order, before, after};
        }
    }
    return std::nullopt;
}

bool Expression::isConstant() const {
    return !m_contents->formula;
}
const std::string& Expression::getText() const {
    return m_contents->text;
}

void Expression::fail(const std::string& message) const {
    if (m_contents->key.empty()) throw ModelError(message);
    throw ModelError(m_contents->place, m_contents->key, message);
}

}  // namespace model
}  // namespace simflex
