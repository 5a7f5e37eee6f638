#pragma once
/** @file
A YAML document as a plain tree: aliases expanded within bounds, keys unique, every value with its
place. **/

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
    /** The text stands in the file just as it is in `scalar`, from `place` (behind a quote). **/
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
@throws ModelError  for what is no YAML, tags, duplicate keys, more than 64 levels or 200 000
values, more than 16 MB. **/
YamlTree parseYaml(const std::string& text, const std::string& name);

/** Replaces or adds what a setting "PATH=VALUE" names. @throws ModelError. **/
void applySetting(YamlTree& tree, const std::string& setting);

}  // namespace model
}  // namespace simflex
