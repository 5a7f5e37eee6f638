#include "simflex/model/schema/SchemaText.h"

#include <cmath>
#include <cstdio>

#include "simflex/base/NumberText.h"
#include "simflex/model/file/NearestName.h"

namespace simflex {
namespace model {

namespace {

using Kind = SchemaForm::Kind;

void findPaths(const SchemaForm& form, const std::string& key, const std::string& path,
               std::vector<std::string>& found) {
    for (const SchemaKey& child : form.keys) {
        if (child.name == key && !path.empty()) found.push_back(path);
        for (const SchemaForm& childForm : child.forms)
            findPaths(childForm, key, (path.empty() ? "" : path + ".") + child.name, found);
    }
    if (form.kind == Kind::Entries)
        for (const SchemaForm& value : form.items) findPaths(value, key, path + ".NAME", found);
    if (form.kind == Kind::List)
        for (const SchemaForm& item : form.items) findPaths(item, key, path, found);
}

}  // namespace

std::string writeNumber(double value) {
    return writeGeneral(value, 9);
}

std::string describeRange(const SchemaForm& form) {
    const bool hasMinimum = std::isfinite(form.minimum), hasMaximum = std::isfinite(form.maximum);
    const std::string minimum = writeNumber(form.minimum), maximum = writeNumber(form.maximum);
    if (hasMinimum && form.isOpen)
        return "greater than " + minimum + (hasMaximum ? ", at most " + maximum : "");
    if (hasMinimum && hasMaximum) return "from " + minimum + " to " + maximum;
    if (hasMinimum) return "at least " + minimum;
    return hasMaximum ? "at most " + maximum : "";
}

std::string describeForm(const SchemaForm& form) {
    std::string text = form.title;
    if (form.kind == Kind::Choice)
        return form.choices.size() == 1 ? form.choices[0] : "one of " + joinNames(form.choices);
    if (form.kind == Kind::Number || form.kind == Kind::Integer) {
        const std::string range = describeRange(form);
        return text + (range.empty() ? "" : " " + range);
    }
    if (form.kind == Kind::List && text == "a list") {
        text = "a list";
        std::string sizes;
        for (int size : form.sizes) sizes += (sizes.empty() ? "" : " or ") + std::to_string(size);
        if (!sizes.empty()) text += " of " + sizes;
        return text + ", each " + describeForms(form.items);
    }
    if (form.kind == Kind::Map && !form.oneOf.empty() && form.oneOf.size() < 6)
        return text + " {" + joinNames(form.oneOf, ": … | ") + ": …}";
    if (form.kind == Kind::Map && !form.keys.empty() && form.keys.size() < 6) {
        std::vector<std::string> names;
        for (const SchemaKey& key : form.keys) names.push_back(key.name + ":");
        return text + " {" + joinNames(names) + "}";
    }
    if (form.kind == Kind::Map) return text + " {KEY: value}";
    if (form.kind == Kind::Entries)
        return text + (form.hasNumbers ? " {NUMBER: value}" : " {NAME: value}");
    return text;
}

std::string describeForms(const std::vector<SchemaForm>& forms) {
    std::string text;
    for (const SchemaForm& form : forms) text += (text.empty() ? "" : ", or ") + describeForm(form);
    return text;
}

std::vector<std::string> findSchemaPaths(const std::string& key) {
    std::vector<std::string> found;
    findPaths(getModelSchema(), key, "", found);
    return found;
}

}  // namespace model
}  // namespace simflex
