#pragma once
/** @file
The schema of model files: keys, forms of their values, units, defaults and meanings. It is the
single source for validation, the JSON schema, the key reference and completion. **/

#include <limits>
#include <string>
#include <vector>

namespace simflex {
namespace model {

struct SchemaKey;

/** One form of a value. A key has at most one form that is a list, and at most one that is a map
(fixed keys) or a group of entries (keys chosen by the user). **/
struct SchemaForm {
    enum class Kind {
        Number,    ///< constant expression
        Integer,   ///< constant expression with a whole value
        Function,  ///< of time, or a law
        Bool,
        Text,
        Name,     ///< of a body, joint … or BODY.INTERFACE
        Formula,  ///< of other names, compiled by its user
        Choice,
        File,    ///< name of an input file
        Output,  ///< relative path of an output file, without '..'
        List,
        Map,
        Entries
    };
    Kind kind = Kind::Text;
    std::string title;  ///< "a frame", for messages

    double minimum = -std::numeric_limits<double>::infinity();
    double maximum = std::numeric_limits<double>::infinity();
    bool isOpen = false;  ///< excludes the minimum itself

    bool isLaw = false;               ///< a Function may depend on quantities of the motion
    std::vector<std::string> locals;  ///< a law's own quantities

    std::vector<std::string> choices;

    std::vector<SchemaForm> items;  ///< forms of the items of a list, or of entries
    std::vector<int> sizes;         ///< allowed sizes of a list; empty: any but zero
    bool hasNumbers = false;        ///< the keys of entries are numbers from 1
    bool hasWords = false;          ///< the keys of entries are words of formulas
    bool hasPaths = false;          ///< the keys of entries may be paths: bodies.arm.mass
    bool hasTexts = false;          ///< the keys of entries may be any text: y[1] of an FMU

    std::vector<SchemaKey> keys;
    std::vector<std::string> oneOf;  ///< exactly one of these keys must be given
};

struct SchemaKey {
    SchemaKey(std::string keyName, std::vector<SchemaForm> keyForms, std::string keyMeaning);

    std::string name;
    std::vector<SchemaForm> forms;
    std::string meaning;  ///< one sentence
    std::string unit;
    std::string defaultText;  ///< YAML
    std::string defaultNote;  ///< describes the default if it is not a value
    std::string example;      ///< YAML
    bool isRequired = false;
    std::vector<std::string> onlyFor;   ///< values of `type` that have this key; empty: all
    std::vector<std::string> onlyWith;  ///< requires one of these keys
    std::vector<std::string> notWith;   ///< excludes these keys

    /** @name Modifiers for writing the schema; each returns a changed copy. **/
    /**@{**/
    SchemaKey in(const std::string& unit) const;
    SchemaKey orElse(const std::string& defaultText) const;
    SchemaKey orElseNote(const std::string& note) const;
    SchemaKey such(const std::string& example) const;
    SchemaKey required() const;
    SchemaKey only(const std::vector<std::string>& types) const;
    SchemaKey with(const std::vector<std::string>& keys) const;
    SchemaKey without(const std::vector<std::string>& keys) const;
    /**@}**/
};

/** Schema of a whole model: a map. **/
const SchemaForm& getModelSchema();

/** The key `name` of a map, or null. **/
const SchemaKey* findSchemaKey(const SchemaForm& map, const std::string& name);

}  // namespace model
}  // namespace simflex
