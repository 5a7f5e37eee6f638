#pragma once
/** @file
A YAML document as a plain tree: aliases are expanded within bounds, keys are unique, and every
value has its place. **/

#include <string>
#include <utility>
#include <vector>

#include "simflex/model/file/ModelError.h"

namespace simflex {
namespace model {

struct YamlTree {
    enum class Kind { Empty, Scalar, List, Map };
    struct Entry;

    Kind kind = Kind::Empty;
    ModelPlace place;
    std::string scalar;
    bool isQuoted = false;
    /** The text in the file equals `scalar`, starting at `place` (after a quote). **/
    bool isPlainText = false;
    std::vector<YamlTree> items;
    std::vector<Entry> entries;

    const YamlTree* find(const std::string& key) const;
    YamlTree* find(const std::string& key);
};
struct YamlTree::Entry {
    std::string key;
    ModelPlace place;
    YamlTree value;
};

/** @param name  of the file, for messages
@throws ModelError for invalid YAML, tags, duplicate keys, more than 64 levels or 200 000 values, or
more than 16 MB. **/
YamlTree parseYaml(const std::string& text, const std::string& name);

/** Replaces or adds the value of a setting "PATH=VALUE".
@throws ModelError. **/
void applySetting(YamlTree& tree, const std::string& setting);

}  // namespace model
}  // namespace simflex
