#pragma once
/** @file
A function of time, written in a model file: `0.1*sin(2*pi*5*t)`, `speed*t`, `engine(t)`.

Evaluated by muParser. Derivatives of plain numbers and of tables are exact, those of formulas are
central differences extrapolated to zero step (Ridders): about 1e-11 and 1e-8 of the function's
scale. At a kink they are means of both sides; where the function ends, they are those of the side
where it is defined.

Copies share what was parsed. An expression may be evaluated by several threads at once. **/

#include <memory>
#include <string>

namespace simflex {
namespace cli {

class Expression {
public:
    /** The constant. **/
    Expression(double constant = 0);

    /** @throws ModelError naming the place of the formula where it has no finite value. **/
    double calcValue(double time) const;
    double calcDerivative(double time) const;
    double calcSecondDerivative(double time) const;

    /** True if it does not depend on time. **/
    bool isConstant() const;
    const std::string& getText() const;

    class Formula;
    explicit Expression(std::shared_ptr<const Formula> formula);

private:
    std::shared_ptr<const Formula> _formula;
};

}  // namespace cli
}  // namespace simflex
