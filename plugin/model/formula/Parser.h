#pragma once
/** @file
Parses the text of a formula into a tree. Precedence, from the weakest:

    ? :   (right to left)
    ||   &&   < <= == != >= >   + -   * /   signs and !   ^ (right to left)

so that −2^2 is −4 and 2^3^2 is 2^9. **/

#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "simflex/model/formula/Tree.h"

namespace simflex {
namespace formula {

/** Names that formulas may use besides their variables and the built-in functions. **/
struct Scope {
    std::map<std::string, double> constants;
    std::map<std::string, std::shared_ptr<const Table>> tables;
    std::map<std::string, std::shared_ptr<const SurfaceTable>> surfaces;  ///< of two variables

    std::map<std::string, std::shared_ptr<const OwnFunction>> functions{};  ///< user-defined

    /** True for a table or a user-defined function. **/
    bool hasTable(const std::string& name) const {
        return tables.count(name) > 0 || surfaces.count(name) > 0 || functions.count(name) > 0;
    }
};

/** An error in a formula; `position` counts characters from 0. **/
class SyntaxError : public std::runtime_error {
public:
    SyntaxError(const std::string& message, int where, std::string unknownWord = "")
        : std::runtime_error(message), position(where), unknown(std::move(unknownWord)) {}
    int position;
    std::string unknown;  ///< the unknown word, if that is the error
};

/** @throws SyntaxError. **/
Tree parse(const std::string& text, const Scope& scope, const std::vector<std::string>& variables);

std::vector<std::string> getFunctionNames();

/** Reads a plain number in YAML's notation ("1e-6", "+2", "-.5"); returns false for anything else.
 **/
bool readPlainNumber(const std::string& text, double& value);

}  // namespace formula
}  // namespace simflex
