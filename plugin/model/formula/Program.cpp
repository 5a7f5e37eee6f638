#include "simflex/model/formula/Program.h"

#include <algorithm>

#include "simflex/model/formula/Evaluation.h"

namespace simflex {
namespace formula {

namespace {

constexpr int FewRegisters = 64;

/** Uninitialized registers. **/
template <class S>
union Few {
    Few() {}
    S numbers[FewRegisters];
};

/** Calls `work` with an array of registers, on the stack if there are few. **/
template <class S, class Work>
auto withRegisters(int count, const Work& work) {
    if (count <= FewRegisters) {
        Few<S> few;
        return work(few.numbers);
    }
    std::vector<S> many(static_cast<std::size_t>(count));
    return work(many.data());
}

template <class S, class Instruction>
struct RegisterOperands {
    const Instruction& instruction;
    const S* registers;
    const S& operator()(std::size_t i) const { return registers[instruction.operands[i]]; }
    const double* findNumber(std::size_t) const { return instruction.exponent; }
};

template <class S, class Instruction>
S apply(const Instruction& instruction, const S* registers) {
    using Operands = RegisterOperands<S, Instruction>;
    const Operands operands{instruction, registers};
    return Application<S, Operands>(operands).calc(instruction.operation, instruction.table,
                                                   instruction.surface);
}

}  // namespace

Program::Program(const Tree& tree) {
    std::vector<int> registers(tree.nodes.size(), -1);
    findConstants(tree, registers);
    m_result = add(tree, tree.getRoot(), registers);
}

void Program::findConstants(const Tree& tree, std::vector<int>& registers) {
    for (std::size_t i = 0; i < tree.nodes.size(); ++i) {
        if (tree.nodes[i].operation != Operation::Number) continue;
        registers[i] = m_numRegisters++;
        m_numbers.push_back(tree.nodes[i].number);
    }
    for (std::size_t i = 0; i < tree.nodes.size(); ++i) {
        if (tree.nodes[i].operation != Operation::Variable) continue;
        const int variable = tree.nodes[i].variable;
        const auto known = std::find_if(m_inputs.begin(), m_inputs.end(), [&](const Input& input) {
            return input.variable == variable;
        });
        registers[i] = known != m_inputs.end() ? known->target : m_numRegisters;
        if (registers[i] == m_numRegisters) m_inputs.push_back({variable, m_numRegisters++});
    }
}

int Program::addJump(Jump jump, int operand) {
    Instruction instruction;
    instruction.jump = jump;
    instruction.operands[0] = operand;
    m_instructions.push_back(instruction);
    return static_cast<int>(m_instructions.size()) - 1;
}

int Program::add(const Tree& tree, int number, std::vector<int>& registers) {
    int& own = registers[static_cast<std::size_t>(number)];
    if (own >= 0) return own;
    const Node& node = tree[number];
    Instruction result;
    result.operation = node.operation;
    result.table = node.table.get();
    result.surface = node.surface.get();
    const auto land = [&](int jump) {
        m_instructions[static_cast<std::size_t>(jump)].skipTo =
            static_cast<int>(m_instructions.size());
    };
    const auto addOperand = [&](std::size_t i) {
        result.operands[i] = add(tree, node.operands[i], registers);
    };
    if (node.operation == Operation::Call) {
        std::vector<int> arguments;
        for (const int operand : node.operands) arguments.push_back(add(tree, operand, registers));
        return own = addCall(node, arguments);
    }
    addOperand(0);
    if (node.operation == Operation::If) {
        const int toElse = addJump(Jump::UnlessTrue, result.operands[0]);
        addOperand(1);
        const int toEnd = addJump(Jump::Always, 0);
        land(toElse);
        addOperand(2);
        land(toEnd);
    } else if (node.operation == Operation::And || node.operation == Operation::Or) {
        const bool isAnd = node.operation == Operation::And;
        const int toEnd = addJump(isAnd ? Jump::IfFalse : Jump::IfTrue, result.operands[0]);
        addOperand(1);
        land(toEnd);
    } else {
        for (std::size_t i = 1; i < node.operands.size(); ++i) addOperand(i);
    }
    if (node.operation == Operation::Power && tree[node.operands[1]].operation == Operation::Number)
        result.exponent = &tree[node.operands[1]].number;
    own = result.target = m_numRegisters++;
    m_instructions.push_back(result);
    return own;
}

int Program::addCall(const Node& node, const std::vector<int>& arguments) {
    Instruction result;
    result.operation = Operation::Call;
    result.function = node.function.get();
    result.operands[0] = static_cast<int>(m_arguments.size());
    result.operands[1] = static_cast<int>(arguments.size());
    m_arguments.insert(m_arguments.end(), arguments.begin(), arguments.end());
    result.target = m_numRegisters++;
    m_instructions.push_back(result);
    return result.target;
}

template <class S>
S Program::runCall(const Instruction& instruction, const S* registers) const {
    const int* const arguments = m_arguments.data() + instruction.operands[0];
    std::vector<S> values;
    for (int i = 0; i < instruction.operands[1]; ++i) values.push_back(registers[arguments[i]]);
    return call(*instruction.function, values.data(), instruction.operands[1]);
}

void Program::addInCallAdjoints(const Instruction& instruction, const double* registers,
                                double* adjoints) const {
    const int* const arguments = m_arguments.data() + instruction.operands[0];
    const int count = instruction.operands[1];
    std::vector<double> values, direction(static_cast<std::size_t>(count), 0.0);
    for (int i = 0; i < count; ++i) values.push_back(registers[arguments[i]]);
    for (int i = 0; i < count; ++i) {
        if (arguments[i] < static_cast<int>(m_numbers.size())) continue;  // a Number
        double& along = direction[static_cast<std::size_t>(i)];
        along = 1;
        adjoints[arguments[i]] +=
            adjoints[instruction.target] *
            callSlope(*instruction.function, values.data(), direction.data(), count);
        along = 0;
    }
}

template <class S>
void Program::run(const S* inputs, S* registers) const {
    std::copy(m_numbers.begin(), m_numbers.end(), registers);
    for (const Input& input : m_inputs) registers[input.target] = inputs[input.variable];
    const Instruction* const begin = m_instructions.data();
    const Instruction* const end = begin + m_instructions.size();
    for (const Instruction* at = begin; at != end; ++at) {
        const auto operand = [&](int i) -> const S& { return registers[at->operands[i]]; };
        if (at->jump != Jump::None) {
            const Truth truth =
                at->jump == Jump::Always ? Truth::Unknown : truthOf(registers[at->operands[0]]);
            if (at->jump == Jump::Always || (at->jump == Jump::UnlessTrue && truth != Truth::Yes) ||
                (at->jump == Jump::IfTrue && truth == Truth::Yes) ||
                (at->jump == Jump::IfFalse && truth == Truth::No))
                at = begin + at->skipTo - 1;
            continue;
        }
        S& result = registers[at->target];
        switch (at->operation) {  // frequent operations, inlined
            case Operation::Add:
                result = operand(0) + operand(1);
                break;
            case Operation::Subtract:
                result = operand(0) - operand(1);
                break;
            case Operation::Multiply:
                result = operand(0) * operand(1);
                break;
            case Operation::Divide:
                result = divide(operand(0), operand(1));
                break;
            case Operation::Negate:
                result = -operand(0);
                break;
            case Operation::Min:
                result = minimum(operand(0), operand(1));
                break;
            case Operation::Max:
                result = maximum(operand(0), operand(1));
                break;
            case Operation::Call:
                result = runCall(*at, registers);
                break;
            default:
                result = apply(*at, registers);
        }
    }
}

double Program::calc(const double* inputs) const {
    return withRegisters<double>(m_numRegisters, [&](double* registers) {
        run(inputs, registers);
        return registers[m_result];
    });
}

Jet<double> Program::calc(const Jet<double>* inputs) const {
    return withRegisters<Jet<double>>(m_numRegisters, [&](Jet<double>* registers) {
        run(inputs, registers);
        return registers[m_result];
    });
}

std::optional<double> Program::calcSlopes(const double* inputs, double* slopes, int count) const {
    return withRegisters<double>(
        2 * m_numRegisters, [&](double* registers) -> std::optional<double> {
            double* const adjoints = registers + m_numRegisters;
            run(inputs, registers);
            std::fill_n(adjoints, m_numRegisters, 0.0);
            adjoints[m_result] = 1;
            for (auto at = m_instructions.rbegin(); at != m_instructions.rend(); ++at) {
                // Skipped instructions do not affect the value.
                if (at->jump != Jump::None || adjoints[at->target] == 0) continue;
                if (at->operation == Operation::Call)
                    addInCallAdjoints(*at, registers, adjoints);
                else if (!addInAdjoints(*at, registers, adjoints))
                    return std::nullopt;
            }
            std::fill_n(slopes, count, 0.0);
            for (const Input& input : m_inputs)
                if (input.variable < count) slopes[input.variable] = adjoints[input.target];
            return registers[m_result];
        });
}

bool Program::addInAdjoints(const Instruction& instruction, const double* registers,
                            double* adjoints) {
    const double g = adjoints[instruction.target], value = registers[instruction.target];
    const auto get = [&](int i) { return registers[instruction.operands[i]]; };
    const auto pass = [&](int i, double slope) { adjoints[instruction.operands[i]] += g * slope; };
    const double x = get(0), y = get(1);
    switch (instruction.operation) {
        case Operation::Number:
        case Operation::Variable:
        case Operation::Call:
        case Operation::Less:
        case Operation::LessOrEqual:
        case Operation::Equal:
        case Operation::NotEqual:
        case Operation::And:
        case Operation::Or:
        case Operation::Sign:
        case Operation::Floor:
        case Operation::Ceil:
        case Operation::Pulse:
            return true;
        case Operation::Lookup: {
            if (!instruction.table->covers(x)) return true;
            const double slope = instruction.table->calc(x, 1);
            pass(0, slope);
            return !instruction.table->isPoint(x) ||
                   instruction.table->calc(x, 1, Table::Side::Left) == slope;
        }
        case Operation::LookupTwo:
            if (!instruction.surface->covers(x, y)) return true;
            pass(0, instruction.surface->calc(x, y, 1, 0));
            pass(1, instruction.surface->calc(x, y, 0, 1));
            return !instruction.surface->isAtPoint(x, y);
        case Operation::Negate:
            pass(0, -1);
            return true;
        case Operation::Add:
            pass(0, 1);
            pass(1, 1);
            return true;
        case Operation::Subtract:
            pass(0, 1);
            pass(1, -1);
            return true;
        case Operation::Multiply:
            pass(0, y);
            pass(1, x);
            return true;
        case Operation::Divide:
            pass(0, divide(1, y));
            pass(1, -divide(value, y));
            return true;
        case Operation::Power:
            pass(0, y == 0 ? 0 : y * std::pow(x, y - 1));
            if (!instruction.exponent) pass(1, x > 0 ? value * std::log(x) : NoNumber);
            return true;
        case Operation::If:
            adjoints[instruction.operands[x != 0 ? 1 : 2]] += g;
            return true;
        case Operation::Sin:
            pass(0, std::cos(x));
            return true;
        case Operation::Cos:
            pass(0, -std::sin(x));
            return true;
        case Operation::Tan:
            pass(0, 1 + value * value);
            return true;
        case Operation::Asin:
            pass(0, divide(1, std::sqrt((1 - x) * (1 + x))));
            return true;
        case Operation::Acos:
            pass(0, -divide(1, std::sqrt((1 - x) * (1 + x))));
            return true;
        case Operation::Atan:
            pass(0, 1 / (1 + x * x));
            return true;
        case Operation::Sinh:
            pass(0, std::cosh(x));
            return true;
        case Operation::Cosh:
            pass(0, std::sinh(x));
            return true;
        case Operation::Tanh:
            pass(0, 1 - value * value);
            return true;
        case Operation::Exp:
            pass(0, value);
            return true;
        case Operation::Ln:
            pass(0, divide(1, x));
            return true;
        case Operation::Log10:
            pass(0, divide(1 / std::log(10.0), x));
            return true;
        case Operation::Sqrt:
            pass(0, divide(0.5, value));
            return true;
        case Operation::Abs:
            pass(0, x < 0 ? -1 : 1);
            return x != 0;
        case Operation::Mod:
            pass(0, 1);
            pass(1, -std::floor(divide(x, y)));
            return true;
        case Operation::Atan2: {
            const double size = std::hypot(x, y);
            pass(0, y / size / size);
            pass(1, -x / size / size);
            return size != 0;
        }
        case Operation::Hypot:
            pass(0, x / value);
            pass(1, y / value);
            return value != 0;
        case Operation::Min:
            adjoints[instruction.operands[x < y ? 0 : 1]] += g;
            return x != y;
        case Operation::Max:
            adjoints[instruction.operands[x > y ? 0 : 1]] += g;
            return x != y;
        case Operation::Step:
        case Operation::Ramp: {
            const double start = y, y0 = get(2), end = get(3), y1 = get(4);
            if (!(x < end)) {
                pass(4, 1);
                return true;
            }
            if (!(start < end) || x < start) {
                pass(2, 1);
                return true;
            }
            const bool isRamp = instruction.operation == Operation::Ramp;
            const double s = (x - start) / (end - start);
            const double shape = isRamp ? s : s * s * s * (10 + s * (6 * s - 15));
            const double slope =
                (y1 - y0) * (isRamp ? 1 : 30 * s * s * (1 - s) * (1 - s)) / (end - start);
            pass(0, slope);
            pass(1, slope * (s - 1));
            pass(2, 1 - shape);
            pass(3, -slope * s);
            pass(4, shape);
            return !(isRamp && x == start);
        }
    }
    return true;
}

}  // namespace formula
}  // namespace simflex
