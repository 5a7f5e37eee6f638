#pragma once
/** @file
A formula of named variables and time: `slider.x - 2*crank.x + 0.1*t`, with exact derivatives. **/

#include <memory>
#include <string>
#include <vector>

#include "simflex/model/file/ModelValue.h"

namespace simflex {
namespace model {

/** Copies share what was parsed; may be evaluated by several threads at once. **/
class VariableFormula {
public:
    /** @param own  what the law itself knows besides the time and what the file has; it wins, see
        LawWords.h. Letters, digits, '_' and '.'
    @throws ModelError pointing into the text. **/
    VariableFormula(const ModelValue& text, const std::vector<std::string>& own);

    /** A law that knows all that its form may know of its own. **/
    explicit VariableFormula(const ModelValue& law);

    /** Variables that occur, as written; in their order are the values below. **/
    const std::vector<std::string>& getUsed() const;
    /** What each means: `place.x` of `probes.place.x`; what is its own, itself. **/
    const std::vector<std::string>& getQuantities() const;
    /** A word that laws of this form may have for their own, and that something else is called by,
    too: `others` are what reaches these, such as parameters.speed. **/
    struct SharedWord {
        std::string word;
        bool isOwn;  ///< it means the law's own; else the first of the others
        std::vector<std::string> others;
    };
    const std::vector<SharedWord>& getSharedWords() const;
    /** NaN where it has none. **/
    double calcValue(double time, const double* values) const;
    /** @name Comparisons, see Formula **/
    bool isComparison() const;
    double calcMargin(double time, const double* values) const;
    /** Its value, and ∂f/∂x_i; not finite where it has none. **/
    double calcSlopes(double time, const double* values, double* slopes) const;
    /** "division by zero in '1/x'": why it has no value. **/
    std::string explain(double time, const double* values) const;

    /** @param units  of getUsed(); empty: not known
    @throws ModelError that points to where what is added or compared has different units. **/
    void checkUnits(const ModelValue& text, const std::vector<std::string>& units) const;

    /** Times in (from, to] at which a part of it that depends on time alone changes its course. **/
    std::vector<double> findSwitches(double from, double to) const;

private:
    struct Shared;
    std::shared_ptr<const Shared> m_shared;
};

}  // namespace model
}  // namespace simflex
