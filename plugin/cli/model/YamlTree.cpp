#include "simflex/cli/model/YamlTree.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <set>

#include "simflex/cli/model/ModelError.h"

namespace simflex {
namespace cli {

namespace {

const std::size_t kMaxBytes = 16000000;
const int kMaxValues = 500000;
const int kMaxDepth = 64;

[[noreturn]] void fail(const YamlPlace& place, const std::string& message) {
    throw ModelError(place.getText() + ": " + message);
}

/** Makes a YamlTree of yaml-cpp's graph. **/
class Converter {
public:
    Converter(const std::string& text, const std::string& name) : _text(text), _name(name) {
        _lines.push_back(0);
        for (std::size_t i = 0; i < text.size(); ++i)
            if (text[i] == '\n') _lines.push_back(i + 1);
    }

    YamlPlace makePlace(const YAML::Mark& mark) const {
        if (mark.is_null()) return {_name, 0, 0};
        return {_name, mark.line + 1, mark.column + 1};
    }

    YamlTree convert(const YAML::Node& node, int depth) {
        YamlTree tree;
        tree.place = makePlace(node.Mark());
        if (depth > kMaxDepth)
            fail(tree.place, "values are nested more than " + std::to_string(kMaxDepth) +
                                 " deep (does an alias contain itself?)");
        if (++_numValues > kMaxValues)
            fail(tree.place, "the file has more than " + std::to_string(kMaxValues) +
                                 " values once its aliases are expanded");
        const std::string& tag = node.Tag();
        if (!tag.empty() && tag != "?" && tag != "!")
            fail(tree.place, "tags such as '" + tag + "' have no meaning here: leave it out");
        if (node.IsScalar()) {
            tree.kind = YamlTree::Kind::Scalar;
            tree.scalar = node.Scalar();
            tree.isQuoted = tag == "!";
            findText(node.Mark(), tree);
        } else if (node.IsSequence()) {
            tree.kind = YamlTree::Kind::List;
            for (const YAML::Node& item : node) tree.items.push_back(convert(item, depth + 1));
        } else if (node.IsMap()) {
            tree.kind = YamlTree::Kind::Map;
            convertMap(node, depth, tree);
        }
        return tree;
    }

private:
    const std::string& _text;
    std::string _name;
    std::vector<std::size_t> _lines;
    int _numValues = 0;

    void convertMap(const YAML::Node& node, int depth, YamlTree& tree) {
        std::vector<YamlTree> bases;
        std::set<std::string> keys;
        for (const auto& entry : node) {
            const YamlPlace place = makePlace(entry.first.Mark());
            if (!entry.first.IsScalar()) fail(place, "a key must be a single name");
            const std::string key = entry.first.Scalar();
            if (!keys.insert(key).second) fail(place, "the key '" + key + "' stands here twice");
            YamlTree value = convert(entry.second, depth + 1);
            if (key == "<<") {
                if (value.kind == YamlTree::Kind::List)
                    bases.insert(bases.end(), value.items.begin(), value.items.end());
                else
                    bases.push_back(value);
            } else {
                if (value.place.line == 0) value.place = place;
                tree.entries.push_back({key, place, std::move(value)});
            }
        }
        for (const YamlTree& base : bases) {  // `<<: *name` adds what is not there yet
            if (base.kind != YamlTree::Kind::Map) fail(tree.place, "'<<' wants a map");
            for (const YamlTree::Entry& entry : base.entries)
                if (keys.insert(entry.key).second) tree.entries.push_back(entry);
        }
    }

    /** Sees whether the scalar stands in the file as it is. **/
    void findText(const YAML::Mark& mark, YamlTree& tree) const {
        if (mark.is_null() || mark.line < 0 || mark.column < 0) return;
        if (static_cast<std::size_t>(mark.line) >= _lines.size()) return;
        std::size_t begin =
            _lines[static_cast<std::size_t>(mark.line)] + static_cast<std::size_t>(mark.column);
        if (begin >= _text.size()) return;
        const bool hasQuote = _text[begin] == '"' || _text[begin] == '\'';
        if (hasQuote) ++begin;
        if (_text.compare(begin, tree.scalar.size(), tree.scalar) != 0) return;
        tree.isPlainText = true;
        if (hasQuote) ++tree.place.column;
    }
};

YamlTree parse(const std::string& text, const std::string& name) {
    Converter converter(text, name);
    try {
        const std::vector<YAML::Node> documents = YAML::LoadAll(text);
        if (documents.empty()) return {};
        if (documents.size() > 1)
            fail(converter.makePlace(documents[1].Mark()),
                 "a second document begins here; a model file has one");
        return converter.convert(documents[0], 0);
    } catch (const YAML::Exception& error) {
        fail(converter.makePlace(error.mark), "this is no YAML: " + error.msg);
    }
}

void forgetLines(YamlTree& tree) {
    tree.place.line = 0;
    tree.isPlainText = false;
    for (YamlTree& item : tree.items) forgetLines(item);
    for (YamlTree::Entry& entry : tree.entries) {
        entry.place.line = 0;
        forgetLines(entry.value);
    }
}

/** The line of the first tab that indents, from 1; 0: none. **/
int findTab(const std::string& text) {
    int line = 1;
    bool isIndent = true;
    for (char c : text) {
        if (c == '\n') {
            ++line;
            isIndent = true;
        } else if (isIndent && c == '\t') {
            return line;
        } else if (c != ' ') {
            isIndent = false;
        }
    }
    return 0;
}

}  // namespace

std::string YamlPlace::getText() const {
    if (line == 0) return file;
    return file + ":" + std::to_string(line) + ":" + std::to_string(column);
}

const YamlTree* YamlTree::find(const std::string& key) const {
    for (const Entry& entry : entries)
        if (entry.key == key) return &entry.value;
    return nullptr;
}
YamlTree* YamlTree::find(const std::string& key) {
    return const_cast<YamlTree*>(static_cast<const YamlTree*>(this)->find(key));
}

YamlTree parseYaml(const std::string& text, const std::string& name) {
    if (text.size() > kMaxBytes)
        fail({name, 0, 0}, "the file has " + std::to_string(text.size()) + " bytes; at most " +
                               std::to_string(kMaxBytes) +
                               " are read (large tables belong in CSV files)");
    if (text.find('\0') != std::string::npos)
        fail({name, 0, 0}, "the file has bytes of value zero: it is no text in UTF-8");
    try {
        return parse(text, name);
    } catch (const ModelError&) {
        const int line = findTab(text);
        if (line == 0) throw;
        try {
            std::string spaces = text;
            std::replace(spaces.begin(), spaces.end(), '\t', ' ');
            parse(spaces, name);
        } catch (const ModelError&) {
            throw;
        }
        fail({name, line, 1}, "this line is indented by a tab: YAML wants spaces");
    }
}

void applySetting(YamlTree& tree, const std::string& setting) {
    const std::string name = "setting '" + setting + "'";
    const std::size_t equals = setting.find('=');
    if (equals == std::string::npos || equals == 0)
        fail({name, 0, 0}, "a setting is written PATH=VALUE, as in solver.accuracy=1e-5");
    YamlTree value = parseYaml(setting.substr(equals + 1), name);
    forgetLines(value);
    value.place.file = name;
    YamlTree* target = &tree;
    std::string path;
    for (std::size_t begin = 0; begin <= equals;) {
        const std::size_t end = std::min(setting.find('.', begin), equals);
        const std::string key = setting.substr(begin, end - begin);
        begin = end + 1;
        if (key.empty()) fail({name, 0, 0}, "there is an empty name in the path");
        if (target->kind == YamlTree::Kind::List) {
            const bool isNumber = key.size() < 7 && std::all_of(key.begin(), key.end(), [](char c) {
                                      return std::isdigit(static_cast<unsigned char>(c));
                                  });
            const std::size_t count = target->items.size();
            if (!isNumber || std::stoul(key) >= count)
                fail({name, 0, 0}, path + " is a list: give the number of an item, 0 to " +
                                       std::to_string(count == 0 ? 0 : count - 1) + ", not '" +
                                       key + "'");
            target = &target->items[std::stoul(key)];
        } else {
            if (target->kind == YamlTree::Kind::Scalar)
                fail({name, 0, 0}, path + " is a single value and has no '" + key + "'");
            target->kind = YamlTree::Kind::Map;
            YamlTree* child = target->find(key);
            if (!child) {
                target->entries.push_back({key, {name, 0, 0}, {}});
                child = &target->entries.back().value;
                child->place = {name, 0, 0};
            }
            target = child;
        }
        path += (path.empty() ? "" : ".") + key;
    }
    *target = std::move(value);
}

}  // namespace cli
}  // namespace simflex
