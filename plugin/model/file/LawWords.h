#pragma once
/** @file
Meaning of words in laws and expressions, by one rule:

    own        quantities of the law itself, such as a spring's `length`, take precedence
    then       parameters, constants, tables, and quantities of the motion
    SECTION.X  parameters.X, tables.X, probes.X, inputs.X, states.X, controllers.X, events.X

A word that is both a parameter (constant, table, function) and a quantity is refused with advice on
what to write instead. A word before a parenthesis is a call, not a quantity.
Only for the files of this folder. **/

#include <string>
#include <vector>

#include "simflex/model/file/ModelNode.h"
#include "simflex/model/formula/Formula.h"

namespace simflex {
namespace model {

struct FormulaWord {
    std::string text;
    std::size_t position;
};
/** All words except those that are called. **/
std::vector<FormulaWord> findWords(const std::string& formula);

/** Collects the words for the quantities in the model `tree`; `file.scope` must already have
parameters and tables. **/
void addLawWords(const YamlTree& tree, ModelFile& file);

/** Reads a law. Its variables are the time `t`, the law's own quantities, and those of the motion
that it names. Of what the form knows and this law does not, the rest, for a better message.
@throws formula::SyntaxError **/
formula::Formula readLaw(const std::string& text, const ModelFile& file, const SchemaForm& form,
                         const std::vector<std::string>& own);

/** Other things of the same name, with their sections: parameters.speed, probes.speed. **/
std::vector<std::string> listNamesakes(const ModelFile& file, const std::string& name);

/** @throws ModelError pointing to an ambiguous word. **/
void checkLawWords(const ModelValue::Node& law, const std::vector<std::string>& own);

}  // namespace model
}  // namespace simflex
