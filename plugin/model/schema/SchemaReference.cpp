#include "simflex/model/schema/SchemaReference.h"

#include <algorithm>
#include <set>
#include <stdexcept>
#include <utility>

#include "simflex/base/AsciiText.h"
#include "simflex/model/file/NearestName.h"
#include "simflex/model/schema/SchemaText.h"

namespace simflex {
namespace model {

namespace {

using Kind = SchemaForm::Kind;

std::vector<std::string> splitKeys(const std::string& path) {
    std::vector<std::string> parts;
    std::size_t begin = 0;
    while (begin < path.size()) {
        const std::size_t end = std::min(path.find('.', begin), path.size());
        parts.push_back(path.substr(begin, end - begin));
        begin = end + 1;
    }
    return parts;
}

/** The forms one step below `forms`. **/
std::vector<const SchemaForm*> findBelow(const std::vector<const SchemaForm*>& forms,
                                         const std::string& part) {
    const bool isNumber = !part.empty() && std::all_of(part.begin(), part.end(), isDigit);
    std::vector<const SchemaForm*> below;
    for (const SchemaForm* form : forms) {
        if (const SchemaKey* key = findSchemaKey(*form, part))
            for (const SchemaForm& child : key->forms) below.push_back(&child);
        if (form->kind == Kind::Entries || (form->kind == Kind::List && isNumber))
            for (const SchemaForm& item : form->items) below.push_back(&item);
    }
    return below;
}

struct Section {
    std::string path;
    const SchemaForm* form;
};

/** Name of a form that many keys share, which is described once; else empty. **/
std::string findCommonName(const SchemaForm& form) {
    if (form.kind != Kind::Map) return "";
    if (form.title == "a frame") return form.keys[0].name == "on" ? "FRAME" : "";
    if (form.title == "a rotation") return "ROTATION";
    if (form.title == "a place") return "PLACE";
    if (form.title == "a range") return "RANGE";
    return "";
}

class Reference {
public:
    explicit Reference(ReferenceFormat format)
        : m_isMarkdown(format == ReferenceFormat::Markdown) {}

    void addSections(const SchemaForm& form, const std::string& path) {
        const std::string common = findCommonName(form);
        if (!common.empty() && path != common) {
            if (m_commonNames.insert(common).second) m_commons.push_back({common, &form});
            return;
        }
        if (form.kind == Kind::Map) {
            if (!m_described.insert(path + " " + form.title).second) return;
            m_sections.push_back({path, &form});
            for (const SchemaKey& key : form.keys)
                for (const SchemaForm& child : key.forms)
                    addSections(child, (path.empty() ? "" : path + ".") + key.name);
        }
        const std::string item = form.hasNumbers ? ".NUMBER" : ".NAME";
        if (form.kind == Kind::Entries)
            for (const SchemaForm& value : form.items) addSections(value, path + item);
        if (form.kind == Kind::List)
            for (const SchemaForm& value : form.items) addSections(value, path);
    }

    void addKey(const SchemaKey& key, const std::string& path) { writeKey(key, path); }

    std::string write() {
        for (std::size_t i = 0; i < m_commons.size(); ++i) {  // the list grows: a place has frames
            const Section common = m_commons[i];
            addSections(*common.form, common.path);
        }
        for (const Section& section : m_sections) writeSection(section);
        return m_text;
    }

private:
    bool m_isMarkdown;
    std::string m_text;
    std::vector<Section> m_sections, m_commons;
    std::set<std::string> m_commonNames, m_described;

    void writeSection(const Section& section) {
        if (m_isMarkdown) {
            m_text +=
                "\n### " + (section.path.empty() ? "The file" : "`" + section.path + "`") + "\n\n";
        } else if (!m_text.empty()) {
            m_text += "\n";
        }
        if (!section.form->oneOf.empty())
            m_text += std::string(m_isMarkdown ? "" : "# " + section.path + ": ") +
                      "Exactly one of " + joinNames(section.form->oneOf) + ".\n" +
                      (m_isMarkdown ? "\n" : "");
        if (m_isMarkdown)
            m_text += "| Key | Value | Unit | Default | Meaning |\n|---|---|---|---|---|\n";
        for (const SchemaKey& key : section.form->keys)
            writeKey(key,
                     (section.path.empty() || m_isMarkdown ? "" : section.path + ".") + key.name);
    }

    static std::string describeOne(const SchemaForm& form) {
        const std::string common = findCommonName(form);
        if (!common.empty()) return common;
        switch (form.kind) {
            case Kind::Name:
                return "name of " + form.title;
            case Kind::File:
            case Kind::Output:
                return "path of " + form.title;
            case Kind::Map:
                return "{…}";
            case Kind::Entries: {
                const std::string key = form.hasNumbers ? "{NUMBER: " : "{NAME: ";
                return key + (form.items.size() == 1 && form.items[0].kind == Kind::Map
                                  ? "{…}}"
                                  : describeAll(form.items) + "}");
            }
            case Kind::List: {
                const std::string plain = describeForm(form);
                if (plain.compare(0, 6, "a list") != 0) return plain;  // has its own name
                std::string sizes;
                for (int size : form.sizes)
                    sizes += (sizes.empty() ? "" : " or ") + std::to_string(size);
                return "a list" + (sizes.empty() ? "" : " of " + sizes) + ", each " +
                       describeAll(form.items);
            }
            default:
                return describeForm(form);
        }
    }

    static std::string describeAll(const std::vector<SchemaForm>& forms) {
        std::string text;
        for (const SchemaForm& form : forms)
            text += (text.empty() ? "" : ", or ") + describeOne(form);
        return text;
    }
    static std::string describeValue(const SchemaKey& key) { return describeAll(key.forms); }

    static std::string describeDefault(const SchemaKey& key) {
        if (key.isRequired) return "required";
        if (!key.defaultText.empty()) return key.defaultText;
        return key.defaultNote;
    }

    static std::string describeConditions(const SchemaKey& key) {
        std::string text;
        if (!key.onlyFor.empty()) text += " Only for type " + joinNames(key.onlyFor) + ".";
        if (!key.onlyWith.empty()) text += " Only with " + joinNames(key.onlyWith, " or ") + ".";
        if (!key.notWith.empty()) text += " Not with " + joinNames(key.notWith, " or ") + ".";
        return text;
    }

    static std::string escape(const std::string& text) {
        std::string result;
        for (char c : text) {
            if (c == '|') result += '\\';
            result += c;
        }
        return result;
    }

    void writeKey(const SchemaKey& key, const std::string& name) {
        const std::string value = describeValue(key), defaultValue = describeDefault(key);
        const std::string meaning = key.meaning + describeConditions(key);
        if (m_isMarkdown) {
            const bool isCode = !key.isRequired && !key.defaultText.empty();
            m_text += "| `" + name + "` | " + escape(value) + " | " + escape(key.unit) + " | " +
                      (isCode ? "`" + escape(defaultValue) + "`" : escape(defaultValue)) + " | " +
                      escape(meaning) +
                      (key.example.empty() ? "" : " Example: `" + escape(key.example) + "`") +
                      " |\n";
            return;
        }
        m_text += name + "\n    " + meaning + "\n    value: " + value;
        if (!key.unit.empty()) m_text += " [" + key.unit + "]";
        if (key.isRequired)
            m_text += "; required";
        else if (!defaultValue.empty())
            m_text += "; default: " + defaultValue;
        m_text += "\n";
        if (!key.example.empty()) m_text += "    example: " + key.name + ": " + key.example + "\n";
    }
};

[[noreturn]] void failUnknownPath(const std::vector<std::string>& parts) {
    std::string path;
    for (const std::string& part : parts) {
        const std::vector<std::string> known = getSchemaChildren(path);
        const std::string longer = (path.empty() ? "" : path + ".") + part;
        if (findSchemaForms(longer).empty()) {
            const std::string proposal = proposeName(part, known);
            const std::vector<std::string> elsewhere = findSchemaPaths(part);
            std::string text = "model files have no key '" + longer + "'";
            if (!proposal.empty())
                text += "; " + proposal;
            else if (!known.empty())
                text += "; there are " + joinNames(known);
            if (!elsewhere.empty() && elsewhere.size() <= 8)
                text += "; '" + part + "' belongs to " + joinNames(elsewhere, " or ");
            throw std::runtime_error(text);
        }
        path = longer;
    }
    throw std::runtime_error("model files have no such key");
}

bool hasItemKey(const std::vector<const SchemaForm*>& forms, const std::string& key) {
    for (const SchemaForm* form : forms)
        if (form->kind == Kind::Entries)
            for (const SchemaForm& item : form->items)
                if (findSchemaKey(item, key)) return true;
    return false;
}

/** "joints.NAME.type" for "joints.type": inserts omitted names of entries. **/
std::string addNames(const std::string& path) {
    const std::vector<std::string> parts = splitKeys(path);
    std::vector<std::string> full;
    for (std::size_t k = 0; k < parts.size(); ++k) {
        const std::vector<const SchemaForm*> forms = findSchemaForms(joinNames(full, "."));
        const bool isNamed = k + 1 < parts.size() && hasItemKey(forms, parts[k + 1]);
        if (hasItemKey(forms, parts[k]) && !isNamed) full.push_back("NAME");
        full.push_back(parts[k]);
    }
    return joinNames(full, ".");
}

}  // namespace

std::vector<const SchemaForm*> findSchemaForms(const std::string& path) {
    std::vector<const SchemaForm*> forms{&getModelSchema()};
    for (const std::string& part : splitKeys(path)) forms = findBelow(forms, part);
    return forms;
}

std::vector<std::string> getSchemaChildren(const std::string& path) {
    std::vector<std::string> names;
    for (const SchemaForm* form : findSchemaForms(path))
        for (const SchemaKey& key : form->keys) names.push_back(key.name);
    return names;
}

std::vector<std::string> getSchemaChoices(const std::string& path) {
    std::vector<std::string> names;
    for (const SchemaForm* form : findSchemaForms(path)) {
        if (form->kind == Kind::Bool) names.insert(names.end(), {"true", "false"});
        names.insert(names.end(), form->choices.begin(), form->choices.end());
    }
    return names;
}

std::string writeKeyReference(const std::string& shortPath, ReferenceFormat format) {
    const std::string path = addNames(shortPath);
    Reference reference(format);
    const std::vector<std::string> parts = splitKeys(path);
    const std::vector<const SchemaForm*> forms = findSchemaForms(path);
    if (forms.empty()) failUnknownPath(parts);
    if (!parts.empty()) {  // the key itself
        const std::string above = path.size() > parts.back().size()
                                      ? path.substr(0, path.size() - parts.back().size() - 1)
                                      : "";
        for (const SchemaForm* form : findSchemaForms(above))
            if (const SchemaKey* key = findSchemaKey(*form, parts.back());
                key && format == ReferenceFormat::Text)
                reference.addKey(*key, path);
    }
    for (const SchemaForm* form : forms) reference.addSections(*form, path);
    const bool isWhole = parts.empty() && format == ReferenceFormat::Markdown;
    return (isWhole
                ? "`{…}` stands for keys that have a table of their own below, under their path.\n"
                  "`FRAME`, `ROTATION`, `PLACE` and `RANGE` are the same everywhere; their tables "
                  "come last.\n"
                : "") +
           reference.write();
}

}  // namespace model
}  // namespace simflex
