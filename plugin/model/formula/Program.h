#pragma once
/** @file
A tree compiled to instructions on numbered registers, for repeated evaluation.

    sin(2*t) > 0 ? t : 1        r3 = 2·t,  r4 = sin r3,  r5 = 0 < r4,  r6 = if(r5, t, 1)

Values equal those of evaluate() on the tree. Slopes are computed by reverse mode (Griewank &
Walther, Evaluating Derivatives, ch. 3): their cost does not grow with the number of variables. **/

#include <optional>
#include <vector>

#include "simflex/model/formula/Jet.h"
#include "simflex/model/formula/Tree.h"

namespace simflex {
namespace formula {

class Program {
public:
    /** @param tree  outlives the program, in place **/
    explicit Program(const Tree& tree);

    double calc(const double* inputs) const;
    Jet<double> calc(const Jet<double>* inputs) const;

    /** Returns the value and sets its slopes by all variables; empty at a kink, where slopes depend
    on the direction. **/
    std::optional<double> calcSlopes(const double* inputs, double* slopes, int count) const;

private:
    enum class Jump { None, UnlessTrue, IfTrue, IfFalse, Always };
    struct Instruction {
        Jump jump = Jump::None;  ///< depends on the truth of operand 0
        Operation operation = Operation::Number;
        int skipTo = 0;
        int target = 0;  ///< register
        int operands[5] = {};
        const double* exponent = nullptr;  ///< if the exponent is a Number
        const Table* table = nullptr;
        const SurfaceTable* surface = nullptr;
        const OwnFunction* function = nullptr;  ///< operands: start and number of arguments
    };
    struct Input {
        int variable, target;
    };

    // Registers hold numbers, inputs, then results.
    std::vector<double> m_numbers;
    std::vector<Input> m_inputs;
    std::vector<Instruction> m_instructions;
    std::vector<int> m_arguments;  ///< registers of arguments of calls
    int m_numRegisters = 0, m_result = 0;

    void findConstants(const Tree& tree, std::vector<int>& registers);
    int add(const Tree& tree, int number, std::vector<int>& registers);
    int addJump(Jump jump, int operand);
    int addCall(const Node& node, const std::vector<int>& arguments);
    template <class S>
    S runCall(const Instruction& instruction, const S* registers) const;
    void addInCallAdjoints(const Instruction& instruction, const double* registers,
                           double* adjoints) const;
    template <class S>
    void run(const S* inputs, S* registers) const;
    /** Returns false at a kink. **/
    static bool addInAdjoints(const Instruction& instruction, const double* registers,
                              double* adjoints);
};

}  // namespace formula
}  // namespace simflex
