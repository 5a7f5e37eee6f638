#include "simflex/model/formula/Formula.h"

#include <algorithm>

#include "simflex/base/NumberText.h"
#include "simflex/model/formula/Evaluation.h"
#include "simflex/model/formula/Switches.h"

namespace simflex {
namespace formula {

namespace {

/** The largest parts that depend on variable 0 alone, excluding results of user-defined functions.
 **/
std::vector<int> collectTimed(const Tree& tree) {
    enum class Kind { Constant, Timed, Other };
    std::vector<Kind> kinds;
    std::vector<bool> isPart(tree.nodes.size(), false);
    for (const Node& node : tree.nodes) {
        const auto kindOf = [&](int operand) { return kinds[static_cast<std::size_t>(operand)]; };
        Kind kind = node.operation == Operation::Call ? Kind::Other : Kind::Constant;
        if (node.operation == Operation::Variable)
            kind = node.variable == 0 ? Kind::Timed : Kind::Other;
        for (const int operand : node.operands) kind = std::max(kind, kindOf(operand));
        for (const int operand : node.operands)
            if (kind == Kind::Other && kindOf(operand) == Kind::Timed)
                isPart[static_cast<std::size_t>(operand)] = true;
        kinds.push_back(kind);
    }
    if (kinds.back() == Kind::Timed) return {tree.getRoot()};
    std::vector<int> parts;
    for (std::size_t i = 0; i < isPart.size(); ++i)
        if (isPart[i]) parts.push_back(static_cast<int>(i));
    return parts;
}

}  // namespace

Formula::Formula(std::string text, const Scope& scope, const std::vector<std::string>& variables)
    : m_text(std::move(text)),
      m_tree(std::make_unique<const Tree>(parse(m_text, scope, variables))),
      m_program(*m_tree) {
    std::vector<bool> isUsed(variables.size(), false);
    m_numVariables = variables.size();
    for (const Node& node : m_tree->nodes)
        if (node.variable >= 0) isUsed[static_cast<std::size_t>(node.variable)] = true;
    for (std::size_t i = 0; i < variables.size(); ++i)
        if (isUsed[i]) m_used.push_back(variables[i]);
}

double Formula::calc(const double* values) const {
    return m_program.calc(values);
}

Jet<double> Formula::calc(const Jet<double>* values) const {
    return m_program.calc(values);
}

double Formula::calcSlopes(const double* values, double* slopes, int count) const {
    if (const auto value = m_program.calcSlopes(values, slopes, count)) return *value;
    std::vector<Jet<double>> inputs(values, values + m_numVariables);
    for (int i = 0; i < count; ++i) {
        Jet<double>& input = inputs[static_cast<std::size_t>(i)];
        input = Jet<double>::makeVariable(values[i]);
        slopes[i] = calc(inputs.data()).first;
        input = Jet<double>(values[i]);
    }
    return calc(values);
}

bool Formula::isComparison() const {
    return isComparison(m_tree->getRoot());
}

bool Formula::isComparison(int number) const {
    const Node& node = (*m_tree)[number];
    if (node.operation == Operation::And || node.operation == Operation::Or)
        return isComparison(node.operands[0]) && isComparison(node.operands[1]);
    return node.operation == Operation::Less || node.operation == Operation::LessOrEqual;
}

double Formula::calcMargin(const double* values) const {
    return calcMargin(m_tree->getRoot(), values);
}

double Formula::calcMargin(int number, const double* values) const {
    const Node& node = (*m_tree)[number];
    if (node.operation == Operation::And || node.operation == Operation::Or) {
        const double first = calcMargin(node.operands[0], values),
                     second = calcMargin(node.operands[1], values);
        return node.operation == Operation::And ? std::min(first, second) : std::max(first, second);
    }
    const double low = evaluate(*m_tree, node.operands[0], values),
                 high = evaluate(*m_tree, node.operands[1], values);
    return (high - low) / std::max({1.0, std::abs(low), std::abs(high)});
}

std::string Formula::explain(const double* values) const {
    return explain(m_tree->getRoot(), values);
}

std::string Formula::explain(int number, const double* values) const {
    const Node& node = (*m_tree)[number];
    const auto calcOperand = [&](std::size_t i) {
        return evaluate(*m_tree, node.operands[i], values);
    };
    // The cause is the first operand without a value, except for a branch that is not taken.
    double x = 0;
    for (std::size_t i = 0; i < node.operands.size(); ++i) {
        if (node.operation == Operation::If && i > 0 && (x != 0) != (i == 1)) continue;
        const double value = calcOperand(i);
        if (!std::isfinite(value)) return explain(node.operands[i], values);
        if (i == 0) x = value;
    }
    const std::string text = m_text.substr(static_cast<std::size_t>(node.begin),
                                           static_cast<std::size_t>(node.end - node.begin));
    const std::string at = writeGeneral(x, 9);
    const std::string in = text == m_text ? "" : " in '" + text + "'";
    switch (node.operation) {
        case Operation::Divide:
        case Operation::Mod:
            if (calcOperand(1) == 0) return "a division by zero" + in;
            break;
        case Operation::Sqrt:
            return "the root of " + at + in;
        case Operation::Ln:
        case Operation::Log10:
            return "the logarithm of " + at + in;
        case Operation::Asin:
        case Operation::Acos:
            return "no angle has the " +
                   std::string(node.operation == Operation::Asin ? "sine " : "cosine ") + at + in;
        case Operation::Power:
            if (std::isnan(evaluate(*m_tree, number, values)) || x == 0)
                return at + " to the power of " + writeGeneral(calcOperand(1), 9) + in;
            break;
        case Operation::Step:
        case Operation::Ramp:
        case Operation::Pulse: {
            const bool isPulse = node.operation == Operation::Pulse;
            const double begin = calcOperand(1), end = calcOperand(isPulse ? 2 : 3);
            if (begin > end)
                return "its times must ascend, and " + writeGeneral(end, 9) + " follows " +
                       writeGeneral(begin, 9) + in;
            break;
        }
        case Operation::Lookup:
            return node.table->describeRefusal(x);
        case Operation::LookupTwo:
            return node.surface->describeRefusal(x, calcOperand(1));
        case Operation::Call: {
            std::string arguments;
            for (std::size_t i = 0; i < node.operands.size(); ++i)
                arguments += (i == 0 ? "" : ", ") + writeGeneral(calcOperand(i), 9);
            return "'" + text + "' gives no finite number for " + arguments;
        }
        case Operation::Variable:
            return "'" + text + "' has no value";
        default:
            break;
    }
    return "a number that is too large" + in;
}

void Formula::checkUnits(const std::vector<std::string>& units) const {
    std::vector<std::string> found;  // by node
    for (const Node& node : m_tree->nodes) found.push_back(findUnit(node, units, found));
}

/** Unit of a node; empty if unknown, since a factor may have any. **/
std::string Formula::findUnit(const Node& node, const std::vector<std::string>& units,
                              const std::vector<std::string>& ofNodes) const {
    if (node.operation == Operation::Variable)
        return units[static_cast<std::size_t>(node.variable)];
    std::vector<std::string> found;
    for (const int operand : node.operands)
        found.push_back(ofNodes[static_cast<std::size_t>(operand)]);
    const auto unite = [&](std::size_t first, std::size_t second) {
        const std::string &a = found[first], &b = found[second];
        if (!a.empty() && !b.empty() && a != b) {
            const std::string text = m_text.substr(static_cast<std::size_t>(node.begin),
                                                   static_cast<std::size_t>(node.end - node.begin));
            throw SyntaxError("'" + text + "' takes " + a + " and " + b +
                                  " together; if one of them has a factor of 1, write it: 1*...",
                              node.begin);
        }
        return a.empty() ? b : a;
    };
    switch (node.operation) {
        case Operation::Negate:
        case Operation::Abs:
            return found[0];
        case Operation::Add:
        case Operation::Subtract:
        case Operation::Min:
        case Operation::Max:
        case Operation::Hypot:
        case Operation::Mod:
            return unite(0, 1);
        case Operation::Less:
        case Operation::LessOrEqual:
        case Operation::Equal:
        case Operation::NotEqual:
        case Operation::Atan2:
            unite(0, 1);
            return "";
        case Operation::If:
            return unite(1, 2);
        case Operation::Step:
        case Operation::Ramp:
            unite(0, 1);
            unite(0, 3);
            return unite(2, 4);
        default:
            return "";
    }
}

std::vector<double> Formula::findSwitches(double from, double to) const {
    std::vector<double> times;
    for (const int part : collectTimed(*m_tree)) {
        const std::vector<double> found = formula::findSwitches(m_tree->copyPart(part), from, to);
        times.insert(times.end(), found.begin(), found.end());
    }
    std::sort(times.begin(), times.end());
    return times;
}

}  // namespace formula
}  // namespace simflex
