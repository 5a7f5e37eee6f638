#pragma once
/** @file
A YAML document as a plain tree: aliases expanded within bounds, keys unique, every value with its
place. **/

#include <string>
#include <utility>
#include <vector>

namespace simflex {
namespace model {

/** Where something stands: line and column from 1 in the model file, or in a setting. **/
struct YamlPlace {
    std::string file;
    int line = 0;  ///< 0: no place within the file
    int column = 0;

    /** "crank.yaml:12:9". **/
    std::string getText() const;
};

struct YamlTree {
    enum class Kind { Empty, Scalar, List, Map };
    struct Entry;

    Kind kind = Kind::Empty;
    YamlPlace place;
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
    YamlPlace place;
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
