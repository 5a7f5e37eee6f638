#include "simflex/cli/shell/ModelPaths.h"

#include <functional>
#include <set>

#include "simflex/base/AsciiText.h"
#include "simflex/model/file/ModelNode.h"
#include "simflex/model/schema/SchemaReference.h"
#include "simflex/model/session/Quantities.h"

namespace simflex {
namespace cli {
namespace {

/** Of a value that the file leaves out. **/
std::string describeDefault(const ModelValue& value) {
    try {
        return value.getText() + " (default)";
    } catch (const std::exception&) {
        return "not given";
    }
}

}  // namespace

std::optional<std::string> formatModelValue(const ModelValue& file, const std::string& path) {
    ModelValue value = file;
    for (const std::string& part : splitAt(path, '.')) {
        if (value.isList()) {
            value = value.at(readIndex(part, 0, value.getSize(), "item"));
            continue;
        }
        try {
            value = value.get(part);
        } catch (const std::logic_error&) {  // not in the schema
            return {};
        }
    }
    if (!value.isGiven() && !value.getNode().key) return {};  // a name that is not there
    const std::function<std::string(const ModelValue&)> format = [&](const ModelValue& item) {
        if (!item.isGiven()) return describeDefault(item);
        if (item.isScalar()) return item.getText();
        std::string text;
        if (item.isList()) {
            for (int i = 0; i < item.getSize(); ++i) text += (i ? ", " : "") + format(item.at(i));
            return "[" + text + "]";
        }
        for (const std::string& key : item.getKeys())
            text += (text.empty() ? "" : ", ") + key + ": " + format(item.get(key));
        return "{" + text + "}";
    };
    return format(value);
}

std::vector<std::string> completeModelPath(const ModelValue& file, const std::string& begin) {
    const std::string level = begin.substr(0, begin.rfind('.') + 1);  // empty without a point
    std::optional<ModelValue> value = file;
    for (const std::string& part : splitAt(level, '.'))
        if (!part.empty() && value)
            value = value->has(part) ? std::optional(value->get(part)) : std::nullopt;
    std::set<std::string> keys;
    for (const SchemaForm* form : findSchemaForms(level)) {
        for (const SchemaKey& key : form->keys) keys.insert(key.name);
        if (form->kind == SchemaForm::Kind::Entries && value)
            for (const std::string& key : value->getKeys()) keys.insert(key);
    }
    std::vector<std::string> found;
    for (const std::string& key : keys) {
        bool hasMore = false;
        for (const SchemaForm* form : findSchemaForms(level + key))
            hasMore = hasMore || form->kind == SchemaForm::Kind::Map ||
                      form->kind == SchemaForm::Kind::Entries;
        found.push_back(level + key + (hasMore ? "." : ""));
    }
    return found;
}

}  // namespace cli
}  // namespace simflex
