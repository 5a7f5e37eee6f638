#include "simflex/model/file/LawWords.h"

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "simflex/base/AsciiText.h"
#include "simflex/model/file/Formula.h"
#include "simflex/model/file/ScalarCheck.h"

namespace simflex {
namespace model {

namespace {

/** Sections that hold quantities of the motion. **/
const std::pair<const char*, const char*> QuantitySections[] = {{"probes", "a probe"},
                                                                {"inputs", "an input"},
                                                                {"states", "a state"},
                                                                {"controllers", "a controller"},
                                                                {"events", "an event"}};

/** Kind of a name that is not a quantity; empty if none. **/
std::string describeConstant(const ModelFile& file, const std::string& name) {
    const formula::Scope& scope = file.scope;
    if (scope.constants.count("parameters." + name)) return "a parameter";
    if (scope.constants.count(name)) return "a word of formulas";
    if (scope.functions.count(name)) return "a function";
    return scope.hasTable(name) ? "a table" : "";
}

/** Names of the outputs of a state space or a controller. **/
std::vector<std::string> listOutputs(const YamlTree& entry) {
    const YamlTree* const space = entry.find("state_space");
    const YamlTree* const outputs = (space ? *space : entry).find("outputs");
    std::vector<std::string> names;
    if (!outputs) return names;
    for (const YamlTree& output : outputs->items) names.push_back(output.scalar);
    for (const YamlTree::Entry& output : outputs->entries) names.push_back(output.key);
    names.erase(std::remove_if(names.begin(), names.end(),
                               [](const std::string& name) { return !isName(name, false); }),
                names.end());
    return names;
}

/** The probe whose expression this is; empty if it is none. **/
std::string findOwnProbe(const ModelValue::Node& formula) {
    const std::string begin = "probes.", end = ".expression";
    const std::string& path = formula.path;
    if (path.size() <= begin.size() + end.size() || path.compare(0, begin.size(), begin) != 0 ||
        path.compare(path.size() - end.size(), end.size(), end) != 0)
        return "";
    return path.substr(begin.size(), path.size() - begin.size() - end.size());
}

bool contains(const std::vector<std::string>& names, const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
}

/** What a law may name: the time, its own quantities, `named` ones of the motion, and what its form
knows besides. **/
std::vector<std::string> listVariables(const ModelFile& file, const SchemaForm& form,
                                       const std::vector<std::string>& own,
                                       const std::set<std::string>& named) {
    std::vector<std::string> names = {"t"};
    names.insert(names.end(), own.begin(), own.end());
    for (const std::string& word : named)
        if (!contains(own, word)) names.push_back(word);
    for (const std::string& local : form.locals)
        if (!contains(own, local) && !file.words.count(local) &&
            describeConstant(file, local).empty())
            names.push_back(local);
    return names;
}

}  // namespace

std::vector<FormulaWord> findWords(const std::string& formula) {
    std::vector<FormulaWord> words;
    const auto isWordCharacter = [](char c) {
        return isLetter(c) || isDigit(c) || c == '_' || c == '.';
    };
    for (std::size_t i = 0; i < formula.size();) {
        const std::size_t begin = i;
        while (i < formula.size() && isWordCharacter(formula[i])) ++i;
        if (i == begin) {
            ++i;
            continue;
        }
        const bool isName = isLetter(formula[begin]) || formula[begin] == '_';
        const std::size_t next = formula.find_first_not_of(" \t\r\n", i);
        const bool isCalled = next != std::string::npos && formula[next] == '(';
        if (isName && !isCalled) words.push_back({formula.substr(begin, i - begin), begin});
    }
    return words;
}

void addLawWords(const YamlTree& tree, ModelFile& file) {
    std::map<std::string, std::string> full;
    const auto add = [&](const std::string& section, const std::string& quantity) {
        full[section + '.' + quantity] = quantity;
        const bool hasDot = quantity.find('.') != std::string::npos;
        if (hasDot || (describeConstant(file, quantity).empty() && !isFormulaWord(quantity)))
            file.words[quantity] = quantity;
    };
    for (const auto& [section, what] : QuantitySections) {
        const YamlTree* const entries = tree.find(section);
        if (!entries) continue;
        for (const YamlTree::Entry& entry : entries->entries) {
            const std::string& name = entry.key;
            if (!isName(name, false) || name.find('-') != std::string::npos) continue;
            add(section, name);
            for (const char* column : {".x", ".y", ".z", ".0", ".1", ".2"})
                add(section, name + column);
            for (const std::string& output : listOutputs(entry.value))
                add(section, name + '.' + output);
            const std::string constant = describeConstant(file, name);
            if (constant.empty()) continue;
            const std::string quantity = section + std::string(".") + name;
            file.ambiguous[name] =
                "'" + name + "' is " + constant + " and " + what + ": write " +
                (constant == "a parameter" ? "parameters." + name + " or " + quantity
                                           : quantity + " for the latter") +
                ", or rename one of them";
        }
    }
    // A probe may have the name of a section.
    const auto confuse = [&](const std::string& word, const std::string& other) {
        file.ambiguous[word] = "'" + word + "' could be " + other + " or what belongs to '" +
                               word.substr(0, word.find('.')) + "': rename the latter";
        file.words.erase(word);
    };
    for (const auto& [word, quantity] : full) {
        const auto other = file.words.find(word);
        if (other == file.words.end())
            file.words[word] = quantity;
        else if (other->second != quantity)
            confuse(word, "'" + quantity + "'");
    }
    for (const auto& constant : file.scope.constants)
        if (file.words.count(constant.first)) confuse(constant.first, "a parameter");
}

formula::Formula readLaw(const std::string& text, const ModelFile& file, const SchemaForm& form,
                         const std::vector<std::string>& own) {
    // A model has many quantities and a law names few of them.
    std::set<std::string> named;
    for (const FormulaWord& word : findWords(text))
        if (file.words.count(word.text)) named.insert(word.text);
    try {
        return {text, file.scope, listVariables(file, form, own, named)};
    } catch (const formula::SyntaxError& error) {
        if (error.unknown.empty()) throw;
    }
    for (const auto& word : file.words) named.insert(word.first);  // from which to propose one
    return readFormula(text, file.scope, listVariables(file, form, own, named));
}

std::vector<std::string> listNamesakes(const ModelFile& file, const std::string& name) {
    std::vector<std::string> names;
    if (file.scope.constants.count("parameters." + name)) names.push_back("parameters." + name);
    for (const auto& section : QuantitySections) {
        const std::string word = section.first + std::string(".") + name;
        if (file.words.count(word)) names.push_back(word);
    }
    return names;
}

void checkLawWords(const ModelValue::Node& law, const std::vector<std::string>& own) {
    const auto& ambiguous = law.file->ambiguous;
    if (ambiguous.empty()) return;
    const std::string probe = findOwnProbe(law);  // a probe does not depend on itself
    for (const FormulaWord& word : findWords(law.scalar)) {
        const auto found = ambiguous.find(word.text);
        if (found != ambiguous.end() && word.text != probe && !contains(own, word.text))
            law.failAt(static_cast<int>(word.position), found->second);
    }
}

}  // namespace model
}  // namespace simflex
