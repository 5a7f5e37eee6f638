#pragma once
/** @file
From text to tree.

    or:    ? :        of all weakest, from the right
    then   ||   &&   < <= == != >= >   + -   * /   signs and !   ^ (from the right)

so that −2^2 is −4 and 2^3^2 is 2^9. **/

#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "simflex/model/formula/Tree.h"

namespace simflex {
namespace formula {

/** What formulas may name besides their variables and the functions that are always there. **/
struct Scope {
    std::map<std::string, double> constants;
    std::map<std::string, std::shared_ptr<const Table>> tables;
    std::map<std::string, std::shared_ptr<const SurfaceTable>> surfaces;  ///< of two variables

    std::map<std::string, std::shared_ptr<const OwnFunction>> functions{};  ///< of a program

    /** One of those that are called by their names. **/
    bool hasTable(const std::string& name) const {
        return tables.count(name) > 0 || surfaces.count(name) > 0 || functions.count(name) > 0;
    }
};

/** What is wrong with a formula; `position` counts its characters from 0. **/
class SyntaxError : public std::runtime_error {
public:
    SyntaxError(const std::string& message, int where, std::string unknownWord = "")
        : std::runtime_error(message), position(where), unknown(std::move(unknownWord)) {}
    int position;
    std::string unknown;  ///< the word, if it is one that nobody knows
};

/** @throws SyntaxError. **/
Tree parse(const std::string& text, const Scope& scope, const std::vector<std::string>& variables);

std::vector<std::string> getFunctionNames();

/** A plain number in YAML's way ("1e-6", "+2", "-.5"); false for anything else. **/
bool readPlainNumber(const std::string& text, double& value);

}  // namespace formula
}  // namespace simflex
