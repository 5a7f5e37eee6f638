#pragma once
/** @file
A formula of named variables: parsed once, evaluated by any number of threads.

    const Formula formula("2*sin(w*t)", {{{"w", 5.0}}, {}}, {"t"});
    const double time = 0.1, value = formula.calc(&time);
    const Jet<double> now = Jet<double>::makeVariable(time);
    const double slope = formula.calc(&now).first;                     // exact **/

#include "simflex/model/formula/Jet.h"
#include "simflex/model/formula/Parser.h"
#include "simflex/model/formula/Program.h"

namespace simflex {
namespace formula {

class Formula {
public:
    /** @throws SyntaxError. **/
    Formula(std::string text, const Scope& scope, const std::vector<std::string>& variables);

    /** The value, or NaN.
    @param values  of the variables, in their order **/
    double calc(const double* values) const;
    Jet<double> calc(const Jet<double>* values) const;
    /** Returns the value and sets ∂f/∂x_i of the first `count` variables, at a kink those for
    growing x_i; not finite where they do not exist. **/
    double calcSlopes(const double* values, double* slopes, int count) const;
    /** True for comparisons such as `a < b`, and their combinations by `&&` and `||`. **/
    bool isComparison() const;
    /** Margin of a comparison, negative where it does not hold: b − a relative to the largest of 1,
    |a| and |b|; for combinations the smallest or largest one. **/
    double calcMargin(const double* values) const;
    /** Why the value is not finite: "the root of -1 in 'sqrt(1 - t)'". **/
    std::string explain(const double* values) const;

    /** @param units  of the variables; an empty unit is not known
    @throws SyntaxError at a sum or comparison of numbers with known, different units. **/
    void checkUnits(const std::vector<std::string>& units) const;

    /** Times in (from, to] at which the formula changes course, see Switches.h. The first variable
    is the time; with several variables, only parts that depend on time alone are searched. **/
    std::vector<double> findSwitches(double from, double to) const;

    const std::vector<std::string>& getUsedVariables() const { return m_used; }
    const std::string& getText() const { return m_text; }

private:
    bool isComparison(int node) const;
    double calcMargin(int node, const double* values) const;

    std::string m_text;
    std::unique_ptr<const Tree> m_tree;
    Program m_program;
    std::size_t m_numVariables = 0;
    std::vector<std::string> m_used;

    std::string findUnit(const Node& node, const std::vector<std::string>& units,
                         const std::vector<std::string>& ofNodes) const;
    std::string explain(int node, const double* values) const;
};

}  // namespace formula
}  // namespace simflex
