#include "simflex/model/file/ModelReader.h"
#include "simflex/base/InputFile.h"
#include "simflex/base/NumberText.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "simflex/model/file/Formula.h"
#include "simflex/model/file/LawWords.h"
#include "simflex/model/file/ModelNode.h"
#include "simflex/model/file/NearestName.h"

namespace simflex {
namespace model {

namespace {

const double StandardGravity = 9.80665;
const int Format = 1;
const std::string Hdf5 = "\x89HDF\r\n";
const std::uintmax_t LargestFile = 16000000;

/** Refuses files of newer formats before checking anything else in them. **/
void checkFormat(const YamlTree& tree, const std::string& path) {
    if (tree.kind == YamlTree::Kind::Empty)
        throw ModelError({path}, "", "the file is empty; a model begins with 'simflex: 1'");
    if (tree.kind != YamlTree::Kind::Map)
        throw ModelError(tree.place, "",
                         "this is not a model: a model begins with 'simflex: 1', followed by other "
                         "keys and values");
    const YamlTree* version = tree.find("simflex");
    if (!version)
        throw ModelError(tree.place, "",
                         "'simflex: 1' is missing, which tells the format of the file");
    double number = 0;
    if (version->kind != YamlTree::Kind::Scalar ||
        !formula::readPlainNumber(version->scalar, number))
        return;
    if (number > Format)
        throw ModelError(version->place, "",
                         "the file has format " + version->scalar +
                             " and needs a newer simflex; this one reads format " +
                             std::to_string(Format));
}

/** Requires that a setting changes an existing parameter; a new one would have no effect. **/
void checkSetting(const YamlTree& tree, const std::string& setting) {
    const std::string group = "parameters.";
    if (setting.compare(0, group.size(), group) != 0) return;
    const std::string name =
        setting.substr(group.size(), setting.find_first_of(".=", group.size()) - group.size());
    std::vector<std::string> known;
    if (const YamlTree* parameters = tree.find("parameters"))
        for (const YamlTree::Entry& entry : parameters->entries) known.push_back(entry.key);
    if (std::find(known.begin(), known.end(), name) != known.end()) return;
    const std::string proposal = proposeName(name, known);
    throw ModelError(
        {"setting '" + setting + "'"}, "",
        "the model has no parameter '" + name + "'" + (proposal.empty() ? "" : "; " + proposal));
}

void addFunctions(const ModelText& text, formula::Scope& scope) {
    for (const auto& [name, function] : text.functions) {
        const auto fail = [&, &key = name](const std::string& message) {
            throw ModelError({text.path}, "", "the function '" + key + "' " + message);
        };
        if (findWords(name + " ").size() != 1 || findWords(name)[0].text != name ||
            name.find('.') != std::string::npos)
            fail(
                "has a name that formulas cannot use: letters, digits and _ are allowed, and it "
                "begins with a letter or _");
        if (isFormulaWord(name)) fail("has a name that already has a meaning in formulas");
        if (function.fewest < 1 || function.most < function.fewest)
            fail("needs at least one argument");
        scope.functions[name] = std::make_shared<const formula::OwnFunction>(function);
    }
}
void checkFunctions(const ModelText& text, const formula::Scope& scope) {
    for (const auto& entry : text.functions)
        if (scope.constants.count(entry.first) + scope.tables.count(entry.first) +
                scope.surfaces.count(entry.first) >
            0)
            throw ModelError({text.path}, "",
                             "the function '" + entry.first +
                                 "' has the name of a parameter or table: rename one of them");
}

/** Checks the words of expressions, which are parsed only when probes are made. **/
void checkExpressions(const ModelValue& model) {
    const ModelValue probes = model.get("probes");
    for (const std::string& name : probes.getKeys())
        if (probes.get(name).has("expression"))
            checkLawWords(probes.get(name).get("expression").getNode(), {});
}

}  // namespace
}  // namespace model

using namespace model;

void ModelText::set(const std::string& key, const std::string& value) {
    const auto isSame = [&](const std::string& setting) {
        return setting.compare(0, key.size() + 1, key + '=') == 0;
    };
    settings.erase(std::remove_if(settings.begin(), settings.end(), isSame), settings.end());
    settings.push_back(key + '=' + value);
}

void ModelText::set(const std::string& key, double value) {
    set(key, writeGeneral(value));
}

void ModelText::set(const std::string& key, std::initializer_list<double> values) {
    std::string list;
    for (const double value : values) list += (list.empty() ? "[" : ", ") + writeGeneral(value);
    set(key, list + "]");
}

ModelText loadModelText(const std::string& path, const std::vector<std::string>& settings) {
    std::error_code error;
    if (std::filesystem::is_directory(path, error))
        throw std::runtime_error(path + " is a folder; the name of a model file is expected");
    std::ifstream file = openInputFile(path);
    if (!file.is_open()) throw std::runtime_error("cannot read the model file " + path);
    std::string text;
    char block[65536];
    while (file.read(block, sizeof block) || file.gcount() > 0) {
        text.append(block, static_cast<std::size_t>(file.gcount()));
        if (text.size() > LargestFile)
            throw std::runtime_error("the model file " + path + " has more than " +
                                     std::to_string(LargestFile) +
                                     " bytes (large tables belong in CSV files)");
    }
    return {path, text, settings};
}

ModelValue readModel(const ModelText& text) {
    if (text.text.compare(0, Hdf5.size(), Hdf5) == 0)
        throw ModelError({text.path}, "",
                         "this is an HDF5 file, as results and parts are, and not a model: a model "
                         "is a text that begins with 'simflex: 1'");
    YamlTree tree = parseYaml(text.text, text.path);
    checkFormat(tree, text.path);
    for (const std::string& setting : text.settings) {
        checkSetting(tree, setting);
        applySetting(tree, setting);
    }
    checkFormat(tree, text.path);
    auto file = std::make_shared<ModelFile>();
    file->path = text.path;
    file->scope.constants = {{"pi", M_PI}, {"deg", M_PI / 180}, {"g", StandardGravity}};
    addFunctions(text, file->scope);
    const ModelValue model(checkModel(file, tree));
    checkFunctions(text, file->scope);
    checkExpressions(model);
    return model;
}

}  // namespace simflex
