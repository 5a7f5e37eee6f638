#include "simflex/model/schema/SchemaJson.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>
#include <vector>

#include "simflex/base/Json.h"
#include "simflex/model/file/Formula.h"
#include "simflex/model/file/YamlTree.h"
#include "simflex/model/schema/Schema.h"
#include "simflex/model/schema/SchemaText.h"

namespace simflex {
namespace model {

namespace {

using Kind = SchemaForm::Kind;
constexpr int JsonDigits = 9;

/** Converts a key's default from YAML. **/
Json convert(const YamlTree& tree) {
    if (tree.kind == YamlTree::Kind::List) {
        Json list = Json::list();
        for (const YamlTree& item : tree.items) list.add(convert(item));
        return list;
    }
    if (tree.kind == YamlTree::Kind::Map) {
        Json object = Json::object();
        for (const YamlTree::Entry& entry : tree.entries)
            object.add(entry.key, convert(entry.value));
        return object;
    }
    double value = 0;
    if (!tree.isQuoted && formula::readPlainNumber(tree.scalar, value))
        return Json(value, JsonDigits);
    if (!tree.isQuoted && (tree.scalar == "true" || tree.scalar == "false"))
        return Json(tree.scalar == "true");
    return Json(tree.scalar);
}

Json makeType(const std::string& type) {
    return Json::object().add("type", type);
}

Json require(const std::vector<std::string>& keys) {
    return Json::object().add("required", keys);
}

Json anyOf(const std::vector<Json>& alternatives) {
    if (alternatives.size() == 1) return alternatives[0];
    Json list = Json::list();
    for (const Json& alternative : alternatives) list.add(alternative);
    return Json::object().add("anyOf", list);
}

Json makeFormula() {
    return makeType("string").add("pattern", Json("^[-+*/^()<>=!&|?:,._ A-Za-z0-9]+$"));
}

const char* const NamePattern = "^(?!ground$)[A-Za-z_][A-Za-z0-9_-]*$";
const char* const PathPattern = "^[A-Za-z_][A-Za-z0-9_-]*(\\.[A-Za-z_][A-Za-z0-9_-]*)*$";

Json makeForms(const std::vector<SchemaForm>& forms);

/** Condition that `type` is one of `types`; an omitted type matches if they include the default.
 **/
Json makeTypeCondition(const std::vector<std::string>& types, const std::string& defaultType) {
    Json condition = Json::object().add(
        "properties", Json::object().add("type", Json::object().add("enum", types)));
    if (std::find(types.begin(), types.end(), defaultType) == types.end())
        condition.add("required", std::vector<std::string>{"type"});
    return condition;
}

Json makeKey(const SchemaKey& key) {
    std::string description = key.meaning;
    if (!key.unit.empty()) description += " [" + key.unit + "]";
    if (!key.onlyFor.empty()) {
        description += " For type";
        for (const std::string& type : key.onlyFor) description += " " + type;
        description += ".";
    }
    if (!key.defaultNote.empty()) description += " Default: " + key.defaultNote + ".";
    Json json = Json::object().add("description", description);
    if (!key.defaultText.empty())
        json.add("default", convert(parseYaml(key.defaultText, key.name)));
    if (!key.example.empty())
        json.add("examples", Json::list().add(convert(parseYaml(key.example, key.name))));
    json.merge(makeForms(key.forms));
    return json;
}

Json makeMap(const SchemaForm& form) {
    Json properties = Json::object();
    std::vector<std::string> required;
    Json conditions = Json::list();
    const SchemaKey* type = findSchemaKey(form, "type");
    const std::string defaultType = type ? type->defaultText : "";
    for (const SchemaKey& key : form.keys) {
        properties.add(key.name, makeKey(key));
        if (key.isRequired && key.onlyFor.empty()) required.push_back(key.name);
        if (key.isRequired && !key.onlyFor.empty())
            conditions.add(Json::object()
                               .add("if", makeTypeCondition(key.onlyFor, defaultType))
                               .add("then", require({key.name})));
        if (!key.onlyFor.empty())
            conditions.add(Json::object()
                               .add("if", require({key.name}))
                               .add("then", makeTypeCondition(key.onlyFor, defaultType)));
        if (!key.onlyWith.empty()) {
            std::vector<Json> others;
            for (const std::string& other : key.onlyWith) others.push_back(require({other}));
            conditions.add(
                Json::object().add("if", require({key.name})).add("then", anyOf(others)));
        }
        for (const std::string& other : key.notWith)
            conditions.add(Json::object().add("not", require({key.name, other})));
    }
    Json json = makeType("object");
    json.add("properties", properties).add("additionalProperties", false);
    if (!required.empty()) json.add("required", required);
    if (!form.oneOf.empty()) {
        Json choices = Json::list();
        for (const std::string& key : form.oneOf) choices.add(require({key}));
        json.add("oneOf", choices);
    }
    if (!conditions.isEmpty()) json.add("allOf", conditions);
    return json;
}

std::vector<Json> makeForm(const SchemaForm& form) {
    switch (form.kind) {
        case Kind::Number:
        case Kind::Integer: {
            Json number = makeType(form.kind == Kind::Integer ? "integer" : "number");
            if (std::isfinite(form.minimum))
                number.add(form.isOpen ? "exclusiveMinimum" : "minimum",
                           Json(form.minimum, JsonDigits));
            if (std::isfinite(form.maximum)) number.add("maximum", Json(form.maximum, JsonDigits));
            return {number, makeFormula()};
        }
        case Kind::Function:
            return {makeType("number"), makeFormula()};
        case Kind::Bool:
            return {makeType("boolean")};
        case Kind::Name:
            return {makeType("string").add("pattern", PathPattern)};
        case Kind::Choice:
            return {Json::object().add("enum", form.choices)};
        case Kind::File:
            return {makeType("string").add("minLength", 1)};
        case Kind::Output:
            return {makeType("string").add("pattern", Json("^(?![/~])(?!(.*/)?\\.\\.(/|$)).+$"))};
        case Kind::List: {
            std::vector<Json> lists;
            const std::vector<int> sizes = form.sizes.empty() ? std::vector<int>{0} : form.sizes;
            for (int size : sizes) {
                Json list = makeType("array").add("items", makeForms(form.items));
                list.add("minItems", size == 0 ? 1 : size);
                if (size > 0) list.add("maxItems", size);
                lists.push_back(list);
            }
            return lists;
        }
        case Kind::Map:
            return {makeMap(form)};
        case Kind::Entries: {
            const char* const pattern = form.hasNumbers ? "^[1-9][0-9]*$"
                                        : form.hasTexts ? "^.+$"
                                        : form.hasPaths ? PathPattern
                                        : form.hasWords
                                            ? "^(?!(t|pi|deg|g)$)[A-Za-z_][A-Za-z0-9_]*$"
                                            : NamePattern;
            return {
                makeType("object")
                    .add("patternProperties", Json::object().add(pattern, makeForms(form.items)))
                    .add("additionalProperties", false)};
        }
        default:
            return {Json::object().add("type",
                                       std::vector<std::string>{"string", "number", "boolean"})};
    }
}

Json makeForms(const std::vector<SchemaForm>& forms) {
    std::vector<Json> alternatives;
    for (const SchemaForm& form : forms)
        for (Json& json : makeForm(form)) alternatives.push_back(std::move(json));
    return anyOf(alternatives);
}

}  // namespace

std::string writeJsonSchema() {
    Json json = Json::object();
    json.add("$schema", "http://json-schema.org/draft-07/schema#");
    json.add("title", "simflex model");
    json.add("description", Json("A mechanism of rigid and flexible bodies, for simflex run."));
    json.merge(makeMap(getModelSchema()));
    return json.write(1) + "\n";
}

}  // namespace model
}  // namespace simflex
