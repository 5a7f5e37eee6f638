#pragma once
/** @file
What a word of a law or an expression means. One rule for all of them:

    own        what the law itself knows, as a spring's `length`, wins
    then       parameters, constants, tables, and quantities of the motion
    SECTION.X  parameters.X, tables.X, probes.X, inputs.X, states.X, controllers.X, events.X

A word that is a parameter (constant, table, function) and a quantity is refused, and the message
tells what to write instead. What is followed by a parenthesis is called: it is no quantity.
Only for the files of this folder. **/

#include <string>
#include <vector>

#include "simflex/model/file/ModelNode.h"
#include "simflex/model/formula/Formula.h"

namespace simflex {
namespace model {

/** A word in the text of a formula. **/
struct FormulaWord {
    std::string text;
    std::size_t position;
};
/** All but those that are called. **/
std::vector<FormulaWord> findWords(const std::string& formula);

/** Collects the words of the quantities in the model `tree`; parameters and tables stand in
`file.scope` already. **/
void addLawWords(const YamlTree& tree, ModelFile& file);

/** Reads a law. Its variables are the time `t`, the law's own quantities, and those of the motion
that it names. Of what the form knows and this law does not, the rest, for a better message.
@throws formula::SyntaxError **/
formula::Formula readLaw(const std::string& text, const ModelFile& file, const SchemaForm& form,
                         const std::vector<std::string>& own);

/** What else has the name, with its section: parameters.speed, probes.speed. **/
std::vector<std::string> listNamesakes(const ModelFile& file, const std::string& name);

/** @throws ModelError, which points to a word that could mean two things. **/
void checkLawWords(const ModelValue::Node& law, const std::vector<std::string>& own);

}  // namespace model
}  // namespace simflex
