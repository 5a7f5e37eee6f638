#pragma once
/** @file
A formula of named variables and time: `slider.x - 2*crank.x + 0.1*t`, with exact derivatives. **/

#include <memory>
#include <string>
#include <vector>

#include "simflex/model/file/ModelValue.h"

namespace simflex {
namespace model {

/** Copies share the parsed formula; several threads may evaluate it at once. **/
class VariableFormula {
public:
    /** @param own  quantities of the law itself, which take precedence over names of the file, see
        LawWords.h. Letters, digits, '_' and '.'
    @throws ModelError pointing into the text. **/
    VariableFormula(const ModelValue& text, const std::vector<std::string>& own);

    /** A law that has all quantities of its form. **/
    explicit VariableFormula(const ModelValue& law);

    /** Variables that occur, as written; this is the order of `values` below. **/
    const std::vector<std::string>& getUsed() const;
    /** The quantity of each variable: `place.x` for `probes.place.x`; own quantities stay as they
    are. **/
    const std::vector<std::string>& getQuantities() const;
    /** A word of the law that its form may define and that is also the name of something else.
    `others` are the full names of the latter, such as parameters.speed. **/
    struct SharedWord {
        std::string word;
        bool isOwn;  ///< it denotes the law's own quantity, else the first of the others
        std::vector<std::string> others;
    };
    const std::vector<SharedWord>& getSharedWords() const;
    /** NaN where the formula has no value. **/
    double calcValue(double time, const double* values) const;
    /** @name Comparisons, see Formula **/
    bool isComparison() const;
    double calcMargin(double time, const double* values) const;
    /** Returns the value and sets ∂f/∂x_i; not finite where there is none. **/
    double calcSlopes(double time, const double* values, double* slopes) const;
    /** Why the formula has no value: "division by zero in '1/x'". **/
    std::string explain(double time, const double* values) const;

    /** @param units  of getUsed(); an empty unit is not known
    @throws ModelError pointing to a sum or comparison of different units. **/
    void checkUnits(const ModelValue& text, const std::vector<std::string>& units) const;

    /** Times in (from, to] at which a part that depends on time alone changes course. **/
    std::vector<double> findSwitches(double from, double to) const;

private:
    struct Shared;
    std::shared_ptr<const Shared> m_shared;
};

}  // namespace model
}  // namespace simflex
