#pragma once
/** @file
A function of time, written in a model file: `0.1*sin(2*pi*5*t)`, `speed*t`, `engine(t)`.

Derivatives are exact: the formula's own tree is differentiated. At a kink they are those of the
side that comes next.

Copies share what was parsed. An expression may be evaluated by several threads at once. **/

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
    /** The constant. **/
    Expression(double constant = 0);
    /** @param place, key  "crank.yaml:12:9", "motions.drive.position", for errors
    @throws formula::SyntaxError. **/
    Expression(const std::string& text, const formula::Scope& scope, const ModelPlace& place,
               const std::string& key);

    /** @throws ModelError naming the place of the formula, the time and the reason where it has no
    finite value. **/
    double calcValue(double time) const;
    /** Value, first and second derivative; throws likewise. **/
    std::array<double, 3> calcMotion(double time) const;

    /** Times in (from, to] at which it changes its course: see formula/Switches.h. **/
    std::vector<double> findSwitches(double from, double to) const;
    /** Where it jumps (order 0), or has a kink (order 1). **/
    struct Kink {
        double time;
        int order;
        double before, after;
    };
    /** The first one between these times. **/
    std::optional<Kink> findKink(double from, double to) const;

    /** True if it does not depend on time. **/
    bool isConstant() const;
    const std::string& getText() const;
    /** @throws ModelError with its place. **/
    [[noreturn]] void fail(const std::string& message) const;

private:
    struct Contents;
    std::shared_ptr<const Contents> m_contents;
};

}  // namespace model
}  // namespace simflex
