#pragma once
/** @file
The data behind a ModelValue. Only for the files of this folder. **/

#include <map>
#include <memory>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "simflex/model/file/Formula.h"
#include "simflex/model/file/ModelValue.h"
#include "simflex/model/file/YamlTree.h"
#include "simflex/model/schema/Schema.h"

namespace simflex {
namespace model {

struct ModelFile {
    std::string path;
    formula::Scope scope;
    /** Words of laws and the quantity that each denotes: x, place.x, probes.x; see LawWords.h. **/
    std::map<std::string, std::string> words;
    std::map<std::string, std::string> ambiguous;  ///< words with two meanings, with advice
                                                   ///< how to resolve them
};

struct ModelValue::Node {
    std::shared_ptr<const ModelFile> file;
    Kind kind = Kind::Missing;
    ModelPlace place;
    std::string path, name;
    bool isPlainText = false;
    const std::vector<SchemaForm>* forms = nullptr;  ///< the allowed forms
    const SchemaForm* form = nullptr;                ///< the actual form
    const SchemaKey* key = nullptr;                  ///< null for items and entries
    std::string scalar;
    Expression expression;        ///< for Number, Integer and Function, but not for a law
    bool isLaw = false;           ///< a Function of quantities of the motion
    mutable bool isRead = false;  ///< the scalar has been used
    std::vector<std::shared_ptr<const Node>> items;
    std::vector<std::pair<std::string, std::shared_ptr<const Node>>> entries;
    std::unordered_map<std::string, std::size_t> numbers;  ///< in `entries`, by key

    void add(const std::string& key, std::shared_ptr<const Node> value);
    std::shared_ptr<const Node> find(const std::string& name) const;
    [[noreturn]] void fail(const std::string& message) const;
    [[noreturn]] void failAt(int position, const std::string& message) const;
};

/** Checks `tree` against `forms`. @throws ModelError with up to ten mistakes, one a line. **/
std::shared_ptr<const ModelValue::Node> checkModelValue(
    const std::shared_ptr<const ModelFile>& file, const YamlTree& tree,
    const std::vector<SchemaForm>& forms, const SchemaKey* key, const std::string& path,
    const std::string& name);

/** Checks a whole model; adds parameters and tables to `file`. **/
std::shared_ptr<const ModelValue::Node> checkModel(const std::shared_ptr<ModelFile>& file,
                                                   const YamlTree& tree);

}  // namespace model
}  // namespace simflex
