#pragma once
/** @file
A function of time in a model file: `0.1*sin(2*pi*5*t)`, `speed*t`, `engine(t)`.

Derivatives are exact, by differentiation of the formula's tree. At a kink they are those of the
later side.

Copies share the parsed formula. Several threads may evaluate an expression at once. **/

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace simflex {
struct ModelPlace;
namespace formula {
struct Scope;
}
namespace model {

class Expression {
public:
    Expression(double constant = 0);
    /** @param place, key  "crank.yaml:12:9", "motions.drive.position", for errors
    @throws formula::SyntaxError. **/
    Expression(const std::string& text, const formula::Scope& scope, const ModelPlace& place,
               const std::string& key);

    /** @throws ModelError naming the place of the formula, the time and the reason if the value is
    not finite. **/
    double calcValue(double time) const;
    /** Value, first and second derivative.
    @throws ModelError as calcValue(). **/
    std::array<double, 3> calcMotion(double time) const;

    /** Times in (from, to] at which the function changes course: see formula/Switches.h. **/
    std::vector<double> findSwitches(double from, double to) const;
    /** A jump of the value (order 0) or of the slope (order 1). **/
    struct Kink {
        double time;
        int order;
        double before, after;
    };
    /** Finds the first kink between these times. **/
    std::optional<Kink> findKink(double from, double to) const;

    /** True if the expression does not depend on time. **/
    bool isConstant() const;
    const std::string& getText() const;
    /** @throws ModelError with the place of the formula. **/
    [[noreturn]] void fail(const std::string& message) const;

private:
    struct Contents;
    std::shared_ptr<const Contents> m_contents;
};

}  // namespace model
}  // namespace simflex
