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

    /** NaN where it has no value.
    @param values  of the variables, in their order **/
    double calc(const double* values) const;
    Jet<double> calc(const Jet<double>* values) const;
    /** The value, and ∂f/∂x_i of the first `count` variables; not finite where it has none, at a
    kink those of growing x_i. **/
    double calcSlopes(const double* values, double* slopes, int count) const;
    /** True for `a < b`, `a > b` and the like, and what `&&` and `||` make of these. **/
    bool isComparison() const;
    /** How far a comparison holds, negative where it does not: b − a, over the larger of 1, |a| and
    |b|; of several the least, or the largest. **/
    double calcMargin(const double* values) const;
    /** Why it has no finite value: "the root of -1 in 'sqrt(1 - t)'". **/
    std::string explain(const double* values) const;

    /** @param units  of the variables; empty: not known
    @throws SyntaxError where numbers are added or compared whose units are known and differ. **/
    void checkUnits(const std::vector<std::string>& units) const;

    /** Times in (from, to] at which it changes its course, see Switches.h: of several variables the
    first is the time, and parts that depend on it alone are searched. **/
    std::vector<double> findSwitches(double from, double to) const;

    /** Those of the variables that occur in the text. **/
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
