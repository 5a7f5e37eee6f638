/** @file
Checks the tree of a model file against the schema. **/

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <stdexcept>

#include "simflex/base/AsciiText.h"
#include "simflex/model/file/LawWords.h"
#include "simflex/model/file/ModelNode.h"
#include "simflex/model/file/NearestName.h"
#include "simflex/model/file/ScalarCheck.h"
#include "simflex/model/schema/SchemaText.h"

namespace simflex {
namespace model {

namespace {

using ValueKind = ModelValue::Kind;
using Form = SchemaForm::Kind;
using Node = ModelValue::Node;
using NodePointer = std::shared_ptr<const Node>;

const std::size_t MaxMistakes = 10;  // reported at once

class Checker {
public:
    explicit Checker(std::shared_ptr<const ModelFile> file) : m_file(std::move(file)) {}
    explicit Checker(const std::shared_ptr<ModelFile>& file)
        : m_file(file), m_newFile(file.get()) {}

    NodePointer check(const YamlTree& tree, const std::vector<SchemaForm>& forms,
                      const SchemaKey* key, const std::string& path, const std::string& name) {
        auto node = std::make_shared<Node>();
        node->file = m_file;
        node->place = tree.place;
        node->path = path;
        node->name = name;
        node->forms = &forms;
        node->key = key;
        node->isPlainText = tree.isPlainText;
        switch (tree.kind) {
            case YamlTree::Kind::Scalar:
                node->kind = ValueKind::Scalar;
                node->scalar = tree.scalar;
                checkScalar(tree, *node);
                break;
            case YamlTree::Kind::List:
                node->kind = ValueKind::List;
                node->form = findForm(tree, *node, {Form::List});
                checkList(tree, *node);
                break;
            default:
                node->kind = ValueKind::Map;
                node->form = findForm(tree, *node, {Form::Map, Form::Entries});
                if (node->form->kind == Form::Map)
                    checkMap(tree, *node);
                else
                    checkEntries(tree, *node);
        }
        return node;
    }

    /** The same, but reports all mistakes together. **/
    NodePointer checkAll(const YamlTree& tree, const std::vector<SchemaForm>& forms,
                         const SchemaKey* key, const std::string& path, const std::string& name) {
        NodePointer node;
        attempt([&] { node = check(tree, forms, key, path, name); });
        throwMistakes();
        return node;
    }

private:
    std::shared_ptr<const ModelFile> m_file;
    ModelFile* m_newFile = nullptr;  ///< only while parameters and tables are read
    std::vector<ModelError> m_mistakes;

    struct AllMistakes : ModelError {
        using ModelError::ModelError;
    };

    /** Records a mistake and continues. **/
    template <class Check>
    void attempt(const Check& checkPart) {
        try {
            checkPart();
        } catch (const AllMistakes&) {
            throw;
        } catch (const ModelError& mistake) {
            if (mistake.getMistakes().empty()) throw;  // it has no place
            m_mistakes.push_back(mistake);
        }
        if (m_mistakes.size() >= MaxMistakes) throwMistakes();
    }

    void throwMistakes() {
        if (m_mistakes.empty()) return;
        const auto getPlace = [](const ModelError& mistake) {
            const ModelPlace& place = mistake.getMistakes().at(0).place;
            return std::make_pair(place.line, place.column);
        };
        std::stable_sort(
            m_mistakes.begin(), m_mistakes.end(),
            [&](const ModelError& a, const ModelError& b) { return getPlace(a) < getPlace(b); });
        std::string text;
        std::vector<ModelError::Mistake> mistakes;
        for (const ModelError& mistake : m_mistakes) {
            text += (text.empty() ? "" : "\n") + std::string(mistake.what());
            mistakes.push_back(mistake.getMistakes()[0]);
        }
        if (m_mistakes.size() >= MaxMistakes) text += "\nThere may be more errors than these.";
        throw AllMistakes(text, mistakes);
    }

    static const SchemaForm* findForm(const YamlTree& tree, const Node& node,
                                      const std::vector<Form>& kinds) {
        for (const SchemaForm& form : *node.forms)
            if (std::find(kinds.begin(), kinds.end(), form.kind) != kinds.end()) return &form;
        failForm(tree, node);
    }

    // --- Lists ---

    void checkList(const YamlTree& tree, Node& node) {
        const SchemaForm& form = *node.form;
        const int size = static_cast<int>(tree.items.size());
        if (!form.sizes.empty() &&
            std::find(form.sizes.begin(), form.sizes.end(), size) == form.sizes.end()) {
            std::string sizes;
            for (int allowed : form.sizes)
                sizes += (sizes.empty() ? "" : " or ") + std::to_string(allowed);
            node.fail("the list has " + std::to_string(size) + " values; it must have " + sizes +
                      (node.key && !node.key->example.empty() ? ", for example " + node.key->example
                                                              : ""));
        }
        if (size == 0) node.fail("the list is empty");
        for (int i = 0; i < size; ++i) {
            const std::string index = std::to_string(i);
            const YamlTree& item = tree.items[static_cast<std::size_t>(i)];
            if (item.kind == YamlTree::Kind::Empty)
                node.fail("value " + index + " of the list (from 0) is empty");
            attempt([&] {
                node.items.push_back(
                    check(item, form.items, nullptr, node.path + "." + index, index));
            });
        }
    }

    // --- Maps ---

    void checkMap(const YamlTree& tree, Node& node) {
        const SchemaForm& form = *node.form;
        // Parameters and tables come first, since formulas name them.
        if (node.path.empty() && m_newFile) {
            for (const char* name : {"parameters", "tables"})
                if (const YamlTree* child = tree.find(name); child && isGiven(*child))
                    check(*child, findSchemaKey(form, name)->forms, findSchemaKey(form, name), name,
                          name);
            addLawWords(tree, *m_newFile);
            m_newFile = nullptr;
            throwMistakes();  // formulas would report names that failed here as missing
        }
        bool isKnown = true;
        for (const YamlTree::Entry& entry : tree.entries) {
            isKnown = isKnown && findSchemaKey(form, entry.key);
            attempt([&] { checkKey(entry, node); });
        }
        if (isKnown) attempt([&] { checkTogether(tree, node); });
    }

    void checkKey(const YamlTree::Entry& entry, Node& node) {
        const SchemaKey* key = findSchemaKey(*node.form, entry.key);
        if (!key) failUnknownKey(node, entry);
        const std::string path = (node.path.empty() ? "" : node.path + ".") + entry.key;
        if (isGiven(entry.value)) {
            node.add(entry.key, check(entry.value, key->forms, key, path, entry.key));
            return;
        }
        const bool canBeEmpty = std::any_of(
            key->forms.begin(), key->forms.end(),
            [](const SchemaForm& f) { return f.kind == Form::Map || f.kind == Form::Entries; });
        if (!canBeEmpty)
            throw ModelError(entry.place, path,
                             "the value is missing" +
                                 (key->example.empty() ? "" : ", for example " + key->example));
    }

    static bool isGiven(const YamlTree& tree) { return tree.kind != YamlTree::Kind::Empty; }

    /** Checks keys that depend on others. **/
    static void checkTogether(const YamlTree& tree, const Node& node) {
        const SchemaForm& form = *node.form;
        const auto has = [&](const std::string& name) {
            const YamlTree* value = tree.find(name);
            return value && isGiven(*value);
        };
        std::string type;
        if (const SchemaKey* typeKey = findSchemaKey(form, "type")) {
            const NodePointer given = node.find("type");
            if (!given && has("type")) return;  // the type is invalid
            if (!given && typeKey->isRequired)
                node.fail("'type' is missing; it is one of " +
                          joinNames(typeKey->forms[0].choices));
            type = given ? given->scalar : typeKey->defaultText;
        }
        std::vector<std::string> chosen;
        for (const std::string& name : form.oneOf)
            if (has(name)) chosen.push_back(name);
        if (!form.oneOf.empty() && chosen.size() != 1)
            node.fail(chosen.empty() ? "one of these keys is needed: " + joinNames(form.oneOf)
                                     : "'" + chosen[0] + "' and '" + chosen[1] +
                                           "' exclude each other: give one of them");
        for (const SchemaKey& key : form.keys) {
            const bool applies =
                key.onlyFor.empty() ||
                std::find(key.onlyFor.begin(), key.onlyFor.end(), type) != key.onlyFor.end();
            if (!has(key.name)) {
                if (key.isRequired && applies)
                    node.fail(
                        "'" + key.name + "' is missing" +
                        (type.empty() ? "" : ", which '" + type + "' needs") + ": " + key.meaning +
                        (key.example.empty() ? ""
                                             : " For example " + key.name + ": " + key.example));
                continue;
            }
            const auto fail = [&](const std::string& message) {
                for (const YamlTree::Entry& entry : tree.entries)
                    if (entry.key == key.name)
                        throw ModelError(entry.place,
                                         (node.path.empty() ? "" : node.path + ".") + key.name,
                                         message);
                throw std::logic_error("a key has no place");
            };
            if (!applies)
                fail("'" + key.name + "' is for type " + joinNames(key.onlyFor) + ", not for " +
                     type);
            if (!key.onlyWith.empty() &&
                std::none_of(key.onlyWith.begin(), key.onlyWith.end(), has))
                fail("'" + key.name + "' has a meaning only together with " +
                     joinNames(key.onlyWith, " or "));
            for (const std::string& other : key.notWith)
                if (has(other))
                    fail("'" + key.name + "' and '" + other +
                         "' exclude each other: give one of them");
        }
    }

    [[noreturn]] static void failUnknownKey(const Node& node, const YamlTree::Entry& entry) {
        std::vector<std::string> known;
        for (const SchemaKey& key : node.form->keys) known.push_back(key.name);
        std::string proposal = proposeName(entry.key, known);
        const std::vector<std::string> elsewhere = findSchemaPaths(entry.key);
        if (!elsewhere.empty() && elsewhere.size() <= 4) {
            const std::string hint =
                "'" + entry.key + "' belongs to " + joinNames(elsewhere, " or ");
            proposal =
                findNearestName(entry.key, known).empty() ? hint : proposal + " (" + hint + ")";
        }
        throw ModelError(
            entry.place, node.path,
            "unknown key '" + shorten(entry.key) + "'" + (proposal.empty() ? "" : "; " + proposal));
    }

    // --- Entries ---

    void checkEntries(const YamlTree& tree, Node& node) {
        for (const YamlTree::Entry& entry : tree.entries) attempt([&] { checkEntry(entry, node); });
    }

    void checkEntry(const YamlTree::Entry& entry, Node& node) {
        const SchemaForm& form = *node.form;
        const std::string path = node.path + "." + entry.key;
        checkEntryName(form, entry, path);
        YamlTree nothing;
        nothing.kind = YamlTree::Kind::Map;
        nothing.place = entry.place;
        const bool canBeEmpty =
            std::any_of(form.items.begin(), form.items.end(),
                        [](const SchemaForm& f) { return f.kind == Form::Map; });
        if (!isGiven(entry.value) && !canBeEmpty)
            throw ModelError(entry.place, path, "the value is missing");
        const std::size_t numMistakes = m_mistakes.size();
        const NodePointer child = check(isGiven(entry.value) ? entry.value : nothing, form.items,
                                        nullptr, path, entry.key);
        node.add(entry.key, child);
        if (!m_newFile || m_mistakes.size() > numMistakes) return;
        if (node.path == "parameters")
            m_newFile->scope.constants[entry.key] =
                m_newFile->scope.constants["parameters." + entry.key] =
                    child->expression.calcValue(0);
        if (node.path == "tables") addTable(child);
    }

    static void checkEntryName(const SchemaForm& form, const YamlTree::Entry& entry,
                               const std::string& path) {
        const auto fail = [&](const std::string& message) {
            throw ModelError(entry.place, path, message);
        };
        const std::string name = "'" + shorten(entry.key) + "'";
        if (form.hasNumbers) {
            const bool isNumber = !entry.key.empty() && entry.key.size() < 8 &&
                                  entry.key[0] != '0' &&
                                  std::all_of(entry.key.begin(), entry.key.end(), isDigit);
            if (!isNumber) fail(name + " is not the number of a mode: modes are numbered from 1");
            return;
        }
        if (form.hasTexts && !entry.key.empty()) return;
        if (entry.key.empty() || !isName(entry.key, form.hasPaths))
            fail(name +
                 " cannot be a name: letters, digits, _ and - are allowed, and it begins with a "
                 "letter or _");
        if (entry.key == "ground")
            fail("'ground' is the name of the inertial frame; choose another");
        if (entry.key == "t" && (path == "probes.t" || path == "inputs.t" || path == "states.t" ||
                                 path == "controllers.t" || path == "events.t"))
            fail("'t' is the time wherever formulas may name this; choose another name");
        if (!form.hasWords) return;
        if (isFormulaWord(entry.key))
            fail(name + " has a meaning in formulas already; choose another name");
        if (entry.key.find('-') != std::string::npos)
            fail(name + " cannot be a name in formulas: write _ instead of -");
    }

    static formula::Table::Interpolation readInterpolation(const ModelValue& table) {
        const std::string text = table.get("interpolation").getText();
        return text == "linear" ? formula::Table::Interpolation::Linear
               : text == "step" ? formula::Table::Interpolation::Step
                                : formula::Table::Interpolation::Spline;
    }
    static formula::Table::Extrapolation readExtrapolation(const ModelValue& table) {
        const std::string text = table.get("extrapolation").getText();
        return text == "linear"   ? formula::Table::Extrapolation::Linear
               : text == "refuse" ? formula::Table::Extrapolation::Refuse
                                  : formula::Table::Extrapolation::Constant;
    }

    /** Adds a table to the names that formulas may use. **/
    void addTable(const NodePointer& node) const {
        const ModelValue table(node);
        if (m_newFile->scope.constants.count(node->name) > 0)
            node->fail("a parameter has the name '" + node->name + "' already");
        const ModelValue culprit = table.has("file") ? table.get("file")
                                   : table.has("z")  ? table
                                                     : table.get("x");
        const auto interpolation = readInterpolation(table);
        const auto extrapolation = readExtrapolation(table);
        const auto addCurve = [&](const std::vector<double>& x, const std::vector<double>& y) {
            m_newFile->scope.tables[node->name] = m_newFile->scope.tables["tables." + node->name] =
                std::make_shared<formula::Table>(node->name, x, y, interpolation, extrapolation);
        };
        const auto addSurface = [&](formula::SurfaceTable surface) {
            m_newFile->scope.surfaces[node->name] =
                m_newFile->scope.surfaces["tables." + node->name] =
                    std::make_shared<formula::SurfaceTable>(std::move(surface));
        };
        try {
            if (table.has("file")) {
                std::vector<int> columns;
                for (const double number : table.get("columns").getNumbers())
                    columns.push_back(static_cast<int>(number));
                const auto points = formula::readTableFile(culprit.getFilePath(), columns);
                if (columns.size() == 2) return addCurve(points[0], points[1]);
                return addSurface(formula::SurfaceTable::fromPoints(node->name, points,
                                                                    interpolation, extrapolation));
            }
            const std::vector<double> x = table.get("x").getNumbers(),
                                      y = table.get("y").getNumbers();
            if (!table.has("z")) return addCurve(x, y);
            std::vector<std::vector<double>> z;
            const ModelValue rows = table.get("z");
            for (int i = 0; i < rows.getSize(); ++i) z.push_back(rows.at(i).getNumbers());
            addSurface({node->name, x, y, z, interpolation, extrapolation});
        } catch (const ModelError&) {
            throw;
        } catch (const std::exception& error) {
            culprit.fail(error.what());
        }
    }
};

}  // namespace

void ModelValue::Node::add(const std::string& entry, NodePointer value) {
    numbers.emplace(entry, entries.size());
    entries.emplace_back(entry, std::move(value));
}

NodePointer ModelValue::Node::find(const std::string& wanted) const {
    const auto found = numbers.find(wanted);
    return found == numbers.end() ? nullptr : entries[found->second].second;
}

void ModelValue::Node::fail(const std::string& message) const {
    throw ModelError(place, path, message);
}

void ModelValue::Node::failAt(int position, const std::string& message) const {
    ModelPlace there = place;
    const bool isOneLine = scalar.find('\n') == std::string::npos;
    if (isPlainText && isOneLine && there.line > 0) there.column += position;
    throw ModelError(there, path, message);
}

NodePointer checkModelValue(const std::shared_ptr<const ModelFile>& file, const YamlTree& tree,
                            const std::vector<SchemaForm>& forms, const SchemaKey* key,
                            const std::string& path, const std::string& name) {
    return Checker(file).checkAll(tree, forms, key, path, name);
}

NodePointer checkModel(const std::shared_ptr<ModelFile>& file, const YamlTree& tree) {
    static const std::vector<SchemaForm> forms{getModelSchema()};
    return Checker(file).checkAll(tree, forms, nullptr, "", "");
}

}  // namespace model
}  // namespace simflex
