#pragma once
/** @file
What copies of an Expression share. **/

#include <memory>
#include <string>

#include "simflex/cli/model/Expression.h"
#include "simflex/cli/model/Formula.h"

namespace simflex {
namespace cli {

class Expression::Formula {
public:
    explicit Formula(double value);
    /** @param place  "crank.yaml:12:9: motions.drive.position", for errors
    @throws FormulaError. **/
    Formula(const std::string& formula, const FormulaScope& scope, const std::string& place);

    std::string text;
    bool isConstant = true;
    double constant = 0;

    /** @param order  0 to 2 **/
    double calc(double time, int order) const;

private:
    std::string _place;
    std::shared_ptr<const Table> _table;  ///< if the text is `table(t)` and nothing else
    std::unique_ptr<const simflex::cli::Formula> _formula;

    double calcRaw(double time) const;
    double calcDifference(double time, int order, int side) const;
    [[noreturn]] void fail(const std::string& message) const;
};

}  // namespace cli
}  // namespace simflex
