#include "simflex/model/file/ScalarCheck.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <stdexcept>

#include "simflex/base/AsciiText.h"
#include "simflex/model/file/Formula.h"
#include "simflex/model/file/LawWords.h"
#include "simflex/model/file/NearestName.h"
#include "simflex/model/schema/SchemaText.h"

namespace simflex {
namespace model {

namespace {

using Form = SchemaForm::Kind;
using Node = ModelValue::Node;

bool isNameCharacter(char c) {
    return isLetter(c) || isDigit(c) || c == '_' || c == '-';
}

std::string describeFound(const YamlTree& tree) {
    switch (tree.kind) {
        case YamlTree::Kind::Empty:
            return "nothing";
        case YamlTree::Kind::Scalar:
            return "'" + shorten(tree.scalar) + "'";
        case YamlTree::Kind::List:
            return "a list of " + std::to_string(tree.items.size());
        default:
            return "a map" + (tree.entries.empty()
                                  ? std::string()
                                  : " with '" + shorten(tree.entries[0].key) + "'");
    }
}

/** Restricts output to paths below the current folder. **/
void checkOutput(const Node& node) {
    const std::filesystem::path path(node.scalar);
    bool climbs = path.empty() || path.is_absolute() || node.scalar[0] == '~';
    for (const auto& part : path) climbs = climbs || part == "..";
    if (climbs)
        node.fail("'" + shorten(node.scalar) +
                  "' must be a relative path without '..': model files write only below the "
                  "current folder (the command line may name any other)");
}

/** True for a text that would be a valid law elsewhere. **/
bool namesQuantities(const std::string& text, const Node& node, const SchemaForm& form) {
    try {
        return !readLaw(text, *node.file, form, form.locals).getUsedVariables().empty();
    } catch (const formula::SyntaxError&) {
        return false;
    }
}

void checkNumber(Node& node, const SchemaForm& form) {
    const std::string& text = node.scalar;
    std::string plain = lowerCase(text);
    if (!plain.empty() && (plain[0] == '-' || plain[0] == '+')) plain.erase(0, 1);
    if (plain == ".nan" || plain == ".inf" || plain == "nan" || plain == "inf" ||
        plain == "infinity")
        node.fail("'" + shorten(text) + "' is not finite");
    const bool canMove = form.kind == Form::Function;
    double ignored = 0;
    try {
        if (canMove && form.isLaw && !formula::readPlainNumber(text, ignored)) {
            // The quantities that a connector has of its form are known only once it is built.
            checkLawWords(node, form.locals);
            const std::vector<std::string> used =
                readLaw(text, *node.file, form, form.locals).getUsedVariables();
            node.isLaw = std::any_of(used.begin(), used.end(),
                                     [](const std::string& name) { return name != "t"; });
        }
        if (node.isLaw) return;
        if (canMove) {
            node.expression = Expression(text, node.file->scope, node.place, node.path);
        } else {
            node.expression = Expression(calcConstant(text, node.file->scope));
        }
    } catch (const formula::SyntaxError& error) {
        const bool isLaw = !form.isLaw && namesQuantities(text, node, form);
        node.failAt(error.position,
                    error.what() + std::string(!isLaw    ? ""
                                               : canMove ? "; it is a quantity of the motion, and "
                                                           "this is a function of time alone"
                                                         : "; it is a quantity of the motion, and "
                                                           "this is a constant"));
    }
    if (canMove) return;
    const double value = node.expression.calcValue(0);
    const std::string found =
        writeNumber(value) + (text == writeNumber(value) ? "" : " ('" + shorten(text) + "')");
    if (form.kind == Form::Integer && std::fabs(value - std::round(value)) > WholeTolerance)
        node.fail("found " + found + "; expected a whole number");
    if (value < form.minimum || value > form.maximum || (form.isOpen && value <= form.minimum))
        node.fail("found " + found + "; allowed is " + describeRange(form));
    if (form.kind == Form::Integer && std::fabs(value) > 2147483647.0)
        node.fail("found " + found + ", which is too large");
}

void checkScalarForm(const YamlTree& tree, Node& node, const SchemaForm& form) {
    const std::string& text = node.scalar;
    switch (form.kind) {
        case Form::Number:
        case Form::Integer:
        case Form::Function:
            checkNumber(node, form);
            break;
        case Form::Bool:
            if (tree.isQuoted || (text != "true" && text != "false"))
                node.fail("found '" + shorten(text) + "'; write true or false");
            break;
        case Form::Name:
            if (!isName(text, true))
                node.fail("'" + shorten(text) + "' is not a name: expected " + form.title +
                          " (letters, digits, _ and -)");
            break;
        case Form::Choice:
            if (std::find(form.choices.begin(), form.choices.end(), text) == form.choices.end()) {
                const std::string nearest = findNearestName(text, form.choices);
                node.fail("'" + shorten(text) +
                          "' is none of the choices: " + joinNames(form.choices) +
                          (nearest.empty() ? "" : "; did you mean '" + nearest + "'?"));
            }
            break;
        case Form::File:
            if (text.empty()) node.fail("the name of a file is missing");
            break;
        case Form::Output:
            checkOutput(node);
            break;
        default:
            break;
    }
}

}  // namespace

bool isName(const std::string& text, bool canHaveDots) {
    bool isFirst = true;
    for (char c : text) {
        if (isFirst && !(isLetter(c) || c == '_')) return false;
        isFirst = c == '.' && canHaveDots;
        if (!isFirst && !isNameCharacter(c)) return false;
    }
    return !isFirst;
}

std::string shorten(const std::string& text) {
    return text.size() > 60 ? text.substr(0, 57) + "..." : text;
}

void failForm(const YamlTree& tree, const Node& node) {
    node.fail("found " + describeFound(tree) + "; expected " + describeForms(*node.forms) +
              (node.key && !node.key->example.empty() ? ", for example " + node.key->example : ""));
}

void checkScalar(const YamlTree& tree, Node& node) {
    std::vector<const SchemaForm*> scalars;
    for (const SchemaForm& form : *node.forms)
        if (form.kind != Form::List && form.kind != Form::Map && form.kind != Form::Entries)
            scalars.push_back(&form);
    if (scalars.empty()) failForm(tree, node);
    const bool isOne = scalars.size() == 1;
    const std::string& text = node.scalar;
    const bool beginsAsNumber =
        !text.empty() &&
        (isDigit(text[0]) || std::string("+-.(").find(text[0]) != std::string::npos);
    const SchemaForm* guess = nullptr;
    for (const SchemaForm* form : scalars) {
        node.form = form;
        const bool isNumber = form->kind == Form::Number || form->kind == Form::Integer ||
                              form->kind == Form::Function;
        if (isOne || (isNumber && beginsAsNumber)) {
            checkScalarForm(tree, node, *form);
            return;
        }
        try {
            checkScalarForm(tree, node, *form);
            return;
        } catch (const ModelError&) {
            if (form->kind == Form::Choice && !findNearestName(text, form->choices).empty())
                guess = form;
        }
    }
    if (guess) checkScalarForm(tree, node, *guess);
    failForm(tree, node);
}

}  // namespace model
}  // namespace simflex
