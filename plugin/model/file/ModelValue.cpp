#include "simflex/model/file/ModelValue.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <stdexcept>

#include "simflex/base/NumberText.h"
#include "simflex/model/file/LawWords.h"
#include "simflex/model/file/ModelNode.h"
#include "simflex/model/file/NearestName.h"
#include "simflex/model/file/ScalarCheck.h"
#include "simflex/model/file/VariableFormula.h"

namespace simflex {
namespace model {

namespace {

using Node = ModelValue::Node;
using NodePointer = std::shared_ptr<const Node>;

/** Default of a missing value from the schema; null if none. **/
NodePointer makeDefault(const Node& node) {
    if (!node.key || node.key->defaultText.empty()) return nullptr;
    YamlTree tree = parseYaml(node.key->defaultText, "default of " + node.path);
    return checkModelValue(node.file, tree, node.key->forms, node.key, node.path, node.name);
}

NodePointer getContents(const NodePointer& node) {
    return node->kind == ModelValue::Kind::Missing ? makeDefault(*node) : node;
}

NodePointer needContents(const NodePointer& node) {
    NodePointer contents = getContents(node);
    if (!contents) node->fail("a value is missing here");
    return contents;
}

bool isNumeric(const Node& node) {
    if (!node.form) return false;
    const SchemaForm::Kind kind = node.form->kind;
    return kind == SchemaForm::Kind::Number || kind == SchemaForm::Kind::Integer ||
           kind == SchemaForm::Kind::Function;
}

NodePointer makeMissing(const NodePointer& parent, const std::string& name,
                        const std::vector<SchemaForm>& forms, const SchemaKey* key) {
    auto node = std::make_shared<Node>();
    node->file = parent->file;
    node->place = parent->place;
    node->name = name;
    node->path = (parent->path.empty() ? "" : parent->path + ".") + name;
    node->forms = &forms;
    node->key = key;
    return node;
}

}  // namespace

ModelValue::ModelValue(std::shared_ptr<const Node> node) : m_node(std::move(node)) {}

ModelValue::Kind ModelValue::getKind() const {
    return m_node->kind;
}

bool ModelValue::has(const std::string& key) const {
    return m_node->find(key) != nullptr;
}

ModelValue ModelValue::get(const std::string& key) const {
    const NodePointer contents = getContents(m_node);
    if (contents)
        if (const NodePointer child = contents->find(key)) return ModelValue(child);
    for (const SchemaForm& form : *m_node->forms) {
        if (form.kind == SchemaForm::Kind::Entries)
            return ModelValue(makeMissing(m_node, key, form.items, nullptr));
        if (const SchemaKey* known = findSchemaKey(form, key))
            return ModelValue(makeMissing(m_node, key, known->forms, known));
    }
    throw std::logic_error("the schema has no key '" + key + "' in '" + m_node->path + "'");
}

std::vector<std::string> ModelValue::getKeys() const {
    std::vector<std::string> keys;
    if (const NodePointer contents = getContents(m_node))
        for (const auto& entry : contents->entries) keys.push_back(entry.first);
    return keys;
}

int ModelValue::getSize() const {
    const NodePointer contents = getContents(m_node);
    if (!contents) return 0;
    return contents->kind == Kind::List ? static_cast<int>(contents->items.size()) : 1;
}

ModelValue ModelValue::at(int index) const {
    const NodePointer contents = needContents(m_node);
    if (index < 0 || index >= getSize())
        throw std::logic_error("'" + m_node->path + "' has no item " + std::to_string(index));
    return contents->kind == Kind::List
               ? ModelValue(contents->items[static_cast<std::size_t>(index)])
               : ModelValue(contents);
}

double ModelValue::getNumber() const {
    const NodePointer contents = needContents(m_node);
    if (!isNumeric(*contents)) m_node->fail("a number is expected here");
    contents->isRead = true;
    if (!contents->expression.isConstant()) m_node->fail("this number must not depend on time");
    return contents->expression.calcValue(0);
}

int ModelValue::getInteger() const {
    const double number = getNumber(), value = std::round(number);
    if (std::fabs(number - value) > WholeTolerance)
        m_node->fail("found " + writeGeneral(number, 9) + "; expected a whole number");
    if (!(std::fabs(value) <= 2147483647.0)) m_node->fail("the number is too large");
    return static_cast<int>(value);
}

bool ModelValue::getBool() const {
    const std::string text = getText();
    if (text != "true" && text != "false") m_node->fail("write true or false");
    return text == "true";
}

std::string ModelValue::getText() const {
    const NodePointer contents = needContents(m_node);
    if (contents->kind != Kind::Scalar) m_node->fail("a single value is expected here");
    contents->isRead = true;
    return contents->scalar;
}

std::vector<double> ModelValue::getNumbers() const {
    const NodePointer contents = needContents(m_node);
    std::vector<double> numbers;
    if (contents->kind == Kind::Map && contents->find("from") && contents->find("to") &&
        contents->find("count")) {
        const double from = get("from").getNumber(), to = get("to").getNumber();
        const int count = get("count").getInteger();
        for (int i = 0; i < count; ++i)
            numbers.push_back(count == 1       ? from
                              : i == count - 1 ? to
                                               : from + (to - from) * i / (count - 1));
        return numbers;
    }
    if (contents->kind == Kind::Map) m_node->fail("a list of numbers is expected here");
    for (int i = 0; i < getSize(); ++i) numbers.push_back(at(i).getNumber());
    return numbers;
}

std::vector<std::string> ModelValue::getTexts() const {
    const NodePointer contents = needContents(m_node);
    if (contents->kind == Kind::Map) m_node->fail("a list is expected here");
    std::vector<std::string> texts;
    for (int i = 0; i < getSize(); ++i) texts.push_back(at(i).getText());
    return texts;
}

SimTK::Vec3 ModelValue::getVec3() const {
    const std::vector<double> numbers = getNumbers();
    if (numbers.size() != 3) m_node->fail("a vector [x, y, z] is expected here");
    return SimTK::Vec3(numbers[0], numbers[1], numbers[2]);
}

bool ModelValue::isLaw() const {
    return m_node->isLaw;
}

Expression ModelValue::getExpression() const {
    if (isLaw()) fail("it depends on quantities of the motion, which is not possible here");
    const NodePointer contents = needContents(m_node);
    if (!isNumeric(*contents)) m_node->fail("a function of time is expected here");
    contents->isRead = true;
    return contents->expression;
}

std::vector<Expression> ModelValue::getExpressions() const {
    const NodePointer contents = needContents(m_node);
    if (contents->kind == Kind::Map) m_node->fail("a list of functions of time is expected here");
    std::vector<Expression> expressions;
    for (int i = 0; i < getSize(); ++i) expressions.push_back(at(i).getExpression());
    return expressions;
}

std::string ModelValue::getFilePath() const {
    const std::filesystem::path path(getText());
    if (path.is_absolute()) return path.string();
    return (std::filesystem::path(m_node->file->path).parent_path() / path).string();
}

std::string ModelValue::getPath() const {
    return m_node->path;
}
std::string ModelValue::getName() const {
    return m_node->name;
}
std::string ModelValue::getPlace() const {
    return m_node->place.getText();
}

std::vector<ModelValue> ModelValue::findUnread() const {
    std::vector<ModelValue> unread;
    const auto add = [&](const NodePointer& child) {
        const std::vector<ModelValue> more = ModelValue(child).findUnread();
        unread.insert(unread.end(), more.begin(), more.end());
    };
    if (m_node->kind == Kind::Scalar && !m_node->isRead) unread.push_back(*this);
    for (const NodePointer& item : m_node->items) add(item);
    for (const auto& entry : m_node->entries) add(entry.second);
    return unread;
}

void ModelValue::checkRead() const {
    std::string text;
    std::vector<ModelError::Mistake> mistakes;
    for (const ModelValue& value : findUnread()) {
        const std::string message = "nothing reads this here, it has no effect: remove it";
        mistakes.push_back({value.getNode().place, value.getPath(), message});
        text +=
            (text.empty() ? "" : "\n") + value.getPlace() + ": " + value.getPath() + ": " + message;
    }
    if (!text.empty()) throw ModelError(text, mistakes);
}

void ModelValue::fail(const std::string& message) const {
    m_node->fail(message);
}

void ModelValue::failUnknown(const std::string& what, const std::string& name,
                             const std::vector<std::string>& known) const {
    const std::string proposal = proposeName(name, known);
    m_node->fail("there is no " + what + " '" + name + "'" +
                 (!proposal.empty() ? "; " + proposal
                  : known.empty()   ? "; there are none"
                                    : ""));
}

double calcConstant(const ModelValue& model, const std::string& text) {
    try {
        return calcConstant(text, model.getNode().file->scope);
    } catch (const formula::SyntaxError& error) {
        throw std::invalid_argument(error.what());
    }
}

struct VariableFormula::Shared {
    std::unique_ptr<const formula::Formula> formula;  ///< of t and the used variables
    std::vector<std::string> used, quantities;
    std::vector<SharedWord> sharedWords;
};

VariableFormula::VariableFormula(const ModelValue& text, const std::vector<std::string>& own) {
    const ModelValue::Node& node = text.getNode();
    const ModelFile& file = *node.file;
    checkLawWords(node, own);
    auto shared = std::make_shared<Shared>();
    try {
        shared->used = readLaw(text.getText(), file, *node.form, own).getUsedVariables();
        shared->used.erase(std::remove(shared->used.begin(), shared->used.end(), "t"),
                           shared->used.end());
        std::vector<std::string> names = shared->used;
        names.insert(names.begin(), "t");
        shared->formula = std::make_unique<const formula::Formula>(
            readFormula(text.getText(), file.scope, names));
    } catch (const formula::SyntaxError& error) {
        node.failAt(error.position, error.what());
    }
    for (const std::string& word : shared->used) {
        const auto found = file.words.find(word);
        const bool isOwn = std::find(own.begin(), own.end(), word) != own.end();
        shared->quantities.push_back(isOwn || found == file.words.end() ? word : found->second);
    }
    for (const std::string& local : node.form->locals) {
        std::vector<std::string> others = listNamesakes(file, local);
        const std::vector<FormulaWord> words = findWords(node.scalar);
        if (!others.empty() &&
            std::any_of(words.begin(), words.end(),
                        [&](const FormulaWord& word) { return word.text == local; }))
            shared->sharedWords.push_back(
                {local, std::find(own.begin(), own.end(), local) != own.end(), std::move(others)});
    }
    m_shared = shared;
}

VariableFormula::VariableFormula(const ModelValue& law)
    : VariableFormula(law, law.getNode().form->locals) {}

const std::vector<std::string>& VariableFormula::getUsed() const {
    return m_shared->used;
}

const std::vector<std::string>& VariableFormula::getQuantities() const {
    return m_shared->quantities;
}

const std::vector<VariableFormula::SharedWord>& VariableFormula::getSharedWords() const {
    return m_shared->sharedWords;
}

namespace {

/** Time and values, on the stack if there are few. **/
template <class Number>
class Inputs {
public:
    Inputs(double time, const double* values, std::size_t count) {
        if (count >= Few) m_many.resize(count + 1);
        m_begin = count >= Few ? m_many.data() : m_few;
        m_begin[0] = time;
        for (std::size_t i = 0; i < count; ++i) m_begin[i + 1] = values[i];
    }
    Number* get() { return m_begin; }

private:
    static constexpr std::size_t Few = 12;
    Number m_few[Few];
    std::vector<Number> m_many;
    Number* m_begin;
};

}  // namespace

double VariableFormula::calcValue(double time, const double* values) const {
    return m_shared->formula->calc(Inputs<double>(time, values, getUsed().size()).get());
}

bool VariableFormula::isComparison() const {
    return m_shared->formula->isComparison();
}

double VariableFormula::calcMargin(double time, const double* values) const {
    return m_shared->formula->calcMargin(Inputs<double>(time, values, getUsed().size()).get());
}

double VariableFormula::calcSlopes(double time, const double* values, double* slopes) const {
    const std::size_t count = getUsed().size();
    Inputs<double> all(0, values, count);
    const double value = m_shared->formula->calcSlopes(Inputs<double>(time, values, count).get(),
                                                       all.get(), static_cast<int>(count) + 1);
    std::copy_n(all.get() + 1, count, slopes);
    return value;
}

void VariableFormula::checkUnits(const ModelValue& text,
                                 const std::vector<std::string>& units) const {
    std::vector<std::string> all = units;
    all.insert(all.begin(), "s");  // unit of time
    try {
        m_shared->formula->checkUnits(all);
    } catch (const formula::SyntaxError& error) {
        text.getNode().failAt(error.position, error.what());
    }
}

std::string VariableFormula::explain(double time, const double* values) const {
    return m_shared->formula->explain(Inputs<double>(time, values, getUsed().size()).get());
}

std::vector<double> VariableFormula::findSwitches(double from, double to) const {
    return m_shared->formula->findSwitches(from, to);
}

}  // namespace model
}  // namespace simflex
