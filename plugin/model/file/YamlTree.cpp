#include "simflex/model/file/YamlTree.h"

#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <map>
#include <set>
#include <sstream>

#include "simflex/base/AsciiText.h"
#include "simflex/base/Utf8.h"
#include "simflex/model/file/ModelError.h"

namespace simflex {
namespace model {

namespace {

const std::size_t MaxBytes = 16000000;
const int MaxValues = 200000;
const int MaxDepth = 64;

[[noreturn]] void fail(const ModelPlace& place, const std::string& message) {
    throw ModelError(place, "", message);
}

/** An unquoted formula in {…} or […] is split at its commas. **/
std::string explainKey(const std::string& key) {
    return key.find_first_not_of("0123456789.+-") == std::string::npos
               ? ": a formula with commas stands in quotes, decimals have a point"
               : "";
}

/** Builds a YamlTree from the events of yaml-cpp's parser. **/
class TreeMaker : public YAML::EventHandler {
public:
    TreeMaker(const std::string& text, const std::string& name) : m_text(text), m_name(name) {
        m_lines.push_back(0);
        for (std::size_t i = 0; i < text.size(); ++i)
            if (text[i] == '\n') m_lines.push_back(i + 1);
    }

    YamlTree takeRoot() { return std::move(m_root); }

    ModelPlace makePlace(const YAML::Mark& mark) const {
        if (mark.is_null()) return {m_name, 0, 0};
        return {m_name, mark.line + 1, mark.column + 1};
    }

    void OnDocumentStart(const YAML::Mark& mark) override {
        if (++m_numDocuments == 1) return;
        if (m_text.compare(findByte(mark), 3, "---") == 0)
            fail(makePlace(mark), "a second document begins here; a model file has one");
        fail(makePlace(mark), "what begins here has no meaning");
    }
    void OnDocumentEnd() override {}
    void OnAnchor(const YAML::Mark&, const std::string&) override {}

    void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
        add(makeTree(YamlTree::Kind::Empty, mark, "?"), anchor);
    }
    void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                  const std::string& value) override {
        if (makePrintable(value) != value || makePrintable(tag) != tag)
            fail(makePlace(mark),
                 "this text holds control characters, or bytes that are not UTF-8");
        YamlTree tree = makeTree(YamlTree::Kind::Scalar, mark, tag);
        tree.scalar = value;
        tree.isQuoted = tag == "!";
        if (tree.isQuoted) checkQuote(mark);
        if (!tree.isQuoted && (value == "~" || value == "null")) tree.kind = YamlTree::Kind::Empty;
        findText(mark, tree);
        add(std::move(tree), anchor);
    }
    void OnSequenceStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                         YAML::EmitterStyle::value) override {
        begin(makeTree(YamlTree::Kind::List, mark, tag), anchor);
    }
    void OnSequenceEnd() override { end(); }
    void OnMapStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                    YAML::EmitterStyle::value) override {
        begin(makeTree(YamlTree::Kind::Map, mark, tag), anchor);
    }
    void OnMapEnd() override {
        mergeBases(m_open.back());
        end();
    }

    void OnAlias(const YAML::Mark& mark, YAML::anchor_t anchor) override {
        const auto found = m_anchors.find(anchor);
        if (found == m_anchors.end())
            fail(makePlace(mark), "this alias stands within its own anchor");
        checkDepth(found->second, static_cast<int>(m_open.size()));
        add(copy(found->second), 0);
    }

private:
    /** An incomplete list or map. **/
    struct Open {
        YamlTree tree;
        YAML::anchor_t anchor = 0;
        bool hasKey = false;
        YamlTree key;
        std::set<std::string> keys;
        std::vector<YamlTree> bases;  ///< of `<<`
    };

    const std::string& m_text;
    std::string m_name;
    std::vector<std::size_t> m_lines;
    YamlTree m_root;
    std::vector<Open> m_open;
    std::map<YAML::anchor_t, YamlTree> m_anchors;
    int m_numDocuments = 0, m_numValues = 0;

    void countValue(const ModelPlace& place) {
        if (++m_numValues > MaxValues)
            fail(place, "the file has more than " + std::to_string(MaxValues) +
                            " values once its aliases are expanded (large tables belong in CSV "
                            "files)");
    }

    YamlTree makeTree(YamlTree::Kind kind, const YAML::Mark& mark, const std::string& tag) {
        YamlTree tree;
        tree.kind = kind;
        tree.place = makePlace(mark);
        countValue(tree.place);
        if (!tag.empty() && tag != "?" && tag != "!")
            fail(tree.place, "tags such as '" + tag + "' have no meaning here: leave it out");
        return tree;
    }

    YamlTree copy(const YamlTree& tree) {
        countAll(tree);
        return tree;
    }
    void countAll(const YamlTree& tree) {
        countValue(tree.place);
        for (const YamlTree& item : tree.items) countAll(item);
        for (const YamlTree::Entry& entry : tree.entries) countAll(entry.value);
    }

    static void checkDepth(const YamlTree& tree, int depth) {
        if (depth > MaxDepth)
            fail(tree.place, "values are nested more than " + std::to_string(MaxDepth) + " deep");
        for (const YamlTree& item : tree.items) checkDepth(item, depth + 1);
        for (const YamlTree::Entry& entry : tree.entries) checkDepth(entry.value, depth + 1);
    }

    void begin(YamlTree tree, YAML::anchor_t anchor) {
        if (static_cast<int>(m_open.size()) >= MaxDepth)
            fail(tree.place, "values are nested more than " + std::to_string(MaxDepth) + " deep");
        Open open;
        open.tree = std::move(tree);
        open.anchor = anchor;
        m_open.push_back(std::move(open));
    }
    void end() {
        Open open = std::move(m_open.back());
        m_open.pop_back();
        add(std::move(open.tree), open.anchor);
    }

    void add(YamlTree tree, YAML::anchor_t anchor) {
        if (anchor != 0) m_anchors[anchor] = copy(tree);
        if (m_open.empty()) {
            m_root = std::move(tree);
            return;
        }
        Open& open = m_open.back();
        if (open.tree.kind == YamlTree::Kind::List) {
            open.tree.items.push_back(std::move(tree));
            return;
        }
        if (!open.hasKey) {
            if (tree.kind != YamlTree::Kind::Scalar)
                fail(tree.place, "a key must be a single name");
            if (!open.keys.insert(tree.scalar).second)
                fail(tree.place,
                     "the key '" + tree.scalar + "' stands here twice" + explainKey(tree.scalar));
            open.key = std::move(tree);
            open.hasKey = true;
            return;
        }
        open.hasKey = false;
        if (open.key.scalar == "<<" && !open.key.isQuoted) {
            if (tree.kind == YamlTree::Kind::List)
                open.bases = std::move(tree.items);
            else
                open.bases.push_back(std::move(tree));
            return;
        }
        if (tree.place.line == 0) tree.place = open.key.place;
        open.tree.entries.push_back({open.key.scalar, open.key.place, std::move(tree)});
    }

    /** Adds the entries of `<<: *name` that are not there yet. **/
    static void mergeBases(Open& open) {
        for (const YamlTree& base : open.bases) {
            if (base.kind != YamlTree::Kind::Map) fail(base.place, "'<<' needs a map");
            for (const YamlTree::Entry& entry : base.entries)
                if (open.keys.insert(entry.key).second) open.tree.entries.push_back(entry);
        }
    }

    /** Position of a mark in the text; the text's end if the mark has none. **/
    std::size_t findByte(const YAML::Mark& mark) const {
        if (mark.is_null() || mark.line < 0 || mark.column < 0) return m_text.size();
        if (static_cast<std::size_t>(mark.line) >= m_lines.size()) return m_text.size();
        return std::min(m_text.size(), m_lines[static_cast<std::size_t>(mark.line)] +
                                           static_cast<std::size_t>(mark.column));
    }

    /** Requires a closing quote, which yaml-cpp does not check. **/
    void checkQuote(const YAML::Mark& mark) const {
        std::size_t at = findByte(mark);
        if (at >= m_text.size() || (m_text[at] != '"' && m_text[at] != '\'')) return;
        const char quote = m_text[at];
        for (++at; at < m_text.size(); ++at) {
            if (m_text[at] == quote) return;
            if (quote == '"' && m_text[at] == '\\') ++at;
        }
        fail(makePlace(mark), std::string("the text that begins here has no closing ") + quote);
    }

    /** Finds out whether the scalar stands in the file verbatim. **/
    void findText(const YAML::Mark& mark, YamlTree& tree) const {
        std::size_t at = findByte(mark);
        if (at >= m_text.size()) return;
        const bool hasQuote = m_text[at] == '"' || m_text[at] == '\'';
        if (hasQuote) ++at;
        if (m_text.compare(at, tree.scalar.size(), tree.scalar) != 0) return;
        tree.isPlainText = true;
        if (hasQuote) ++tree.place.column;
    }
};

/** Start of a line, counted from 1; the text's end after the last line. **/
std::size_t findLine(const std::string& text, int line) {
    std::size_t at = 0;
    while (--line > 0 && at < text.size()) at = std::min(text.find('\n', at), text.size() - 1) + 1;
    return at;
}

/** The last unclosed '[' or '{' before the end of a line; column 0 if there is none. **/
ModelPlace findOpenBracket(const std::string& text, const std::string& name, int lastLine) {
    std::vector<ModelPlace> open;
    std::string ends;  // their closing brackets
    ModelPlace place{name, 1, 0};
    char quote = 0, before = '\n';  // the last one that is not a space
    bool afterSpace = true, isComment = false;
    for (const char c : text) {
        if (c == '\n' && ++place.line > lastLine) break;
        place.column = c == '\n' ? 0 : place.column + 1;
        if (quote) {
            if (c == quote) quote = 0;
        } else if (isComment) {
            isComment = c != '\n';
            if (isComment) continue;
        } else if (c == '#' && afterSpace) {
            isComment = true;
            continue;
        } else if ((c == '"' || c == '\'') && std::strchr("\n:,-[{", before)) {
            quote = c;
        } else if ((c == '[' || c == '{') && std::strchr("\n:,-[{", before)) {
            open.push_back(place);
            ends += c == '[' ? ']' : '}';
        } else if ((c == ']' || c == '}') && !open.empty()) {
            if (ends.back() != c) break;
            open.pop_back();
            ends.pop_back();
        }
        afterSpace = c == ' ' || c == '\n';
        if (c != ' ') before = c;
    }
    return open.empty() ? ModelPlace{name, 0, 0} : open.back();
}

/** Translates the parser's messages for the author of the file. **/
[[noreturn]] void explain(const std::string& text, const std::string& name, const ModelPlace& place,
                          const std::string& words) {
    namespace Words = YAML::ErrorMsg;
    if (words == Words::END_OF_MAP_FLOW || words == Words::END_OF_SEQ_FLOW ||
        words == Words::FLOW_END) {
        const ModelPlace open = findOpenBracket(text, name, place.line);
        const bool isList =
            open.line > 0 ? text[findLine(text, open.line) + std::size_t(open.column - 1)] == '['
                          : words == Words::END_OF_SEQ_FLOW;
        const std::string bracket = isList ? "'['" : "'{'", end = isList ? "']'" : "'}'";
        if (open.line > 0)
            fail(open, "the " + bracket + " here has no " + end + " (sought up to line " +
                           std::to_string(place.line) + "), or a comma is missing in between");
        fail(place, "a " + bracket + " has no " + end + ", or a comma is missing in between");
    }
    if (words == Words::MAP_VALUE)
        fail(place,
             "this ':' makes no key here: put a text that has one in quotes (title: \"A: b\"), a "
             "map in braces or on lines of its own");
    if (words == Words::END_OF_MAP || words == Words::END_OF_SEQ)
        fail(place,
             "this line does not fit those above it: lines of one map or list begin in the same "
             "column, and every key has a ':' and a space");
    if (words == Words::BLOCK_ENTRY)
        fail(place, "this '-' begins no item here: items of a list stand on lines of their own");
    const std::string escape = Words::INVALID_ESCAPE;  // with the character after it
    if (words.compare(0, escape.size(), escape) == 0)
        fail(place, "'\\' has a meaning in double quotes: use single quotes for plain text");
    fail(place, "this is not YAML: " + words);
}

YamlTree parse(const std::string& text, const std::string& name) {
    TreeMaker maker(text, name);
    try {
        std::istringstream stream(text);
        YAML::Parser parser(stream);
        while (parser.HandleNextDocument(maker)) {  // a second one is refused
        }
        return maker.takeRoot();
    } catch (const YAML::Exception& error) {
        explain(text, name, maker.makePlace(error.mark), error.msg);
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

void checkEncoding(const std::string& text, const std::string& name) {
    ModelPlace place{name, 1, 1};
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t length = calcUtf8Length(text, at);
        if (length == 0 || text[at] == '\0')
            fail(place, "this is not text in UTF-8: save the file in that encoding");
        if (text[at] == '\n') {
            ++place.line;
            place.column = 0;
        }
        ++place.column;
        at += length;
    }
}

/** Line of the first indentation by a tab, from 1; 0 if none. **/
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

const YamlTree* YamlTree::find(const std::string& key) const {
    for (const Entry& entry : entries)
        if (entry.key == key) return &entry.value;
    return nullptr;
}
YamlTree* YamlTree::find(const std::string& key) {
    return const_cast<YamlTree*>(static_cast<const YamlTree*>(this)->find(key));
}

YamlTree parseYaml(const std::string& text, const std::string& name) {
    if (text.size() > MaxBytes)
        fail({name, 0, 0}, "the file has " + std::to_string(text.size()) + " bytes; at most " +
                               std::to_string(MaxBytes) +
                               " are read (large tables belong in CSV files)");
    checkEncoding(text, name);
    try {
        return parse(text, name);
    } catch (const ModelError&) {
        const int line = findTab(text);
        if (line == 0) throw;
        const auto canRead = [&](int numLines) {
            try {
                parse(text.substr(0, findLine(text, numLines + 1)), name);
                return true;
            } catch (const ModelError&) {
                return false;
            }
        };
        if (!canRead(line - 1) || canRead(line)) throw;  // the tab is not the cause
        fail({name, line, 1}, "this line is indented by a tab: YAML needs spaces");
    }
}

namespace {

/** Reads YAML, but also formulas with ? : and !, which YAML would read as a map and a tag. **/
YamlTree readSettingValue(const std::string& text, const std::string& name) {
    const std::size_t first = text.find_first_not_of(' ');
    const bool isPlain = first != std::string::npos && text.find('\n') == std::string::npos &&
                         std::string("{[\"'|>&*").find(text[first]) == std::string::npos;
    if (!isPlain || (text[first] != '!' && text.find(" ? ") == std::string::npos))
        return parseYaml(text, name);
    YamlTree value;
    value.kind = YamlTree::Kind::Scalar;
    value.scalar = text.substr(first, text.find_last_not_of(' ') - first + 1);
    return value;
}

}  // namespace

void applySetting(YamlTree& tree, const std::string& setting) {
    const std::string name = "setting '" + setting + "'";
    const std::size_t equals = setting.find('=');
    if (equals == std::string::npos || equals == 0)
        fail({name, 0, 0}, "a setting is written PATH=VALUE, as in solver.accuracy=1e-5");
    YamlTree value = readSettingValue(setting.substr(equals + 1), name);
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
            const std::size_t count = target->items.size(), axis = std::string("xyz").find(key);
            const bool isAxis = count == 3 && key.size() == 1 && axis != std::string::npos,
                       isNumber = key.size() < 7 && std::all_of(key.begin(), key.end(), isDigit);
            if (!isAxis && (!isNumber || std::stoul(key) >= count))
                fail({name, 0, 0}, path + " is a list: give the number of an item, 0 to " +
                                       std::to_string(count == 0 ? 0 : count - 1) +
                                       (count == 3 ? ", or x, y, z" : "") + ", not '" + key + "'");
            target = &target->items[isAxis ? axis : std::stoul(key)];
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

}  // namespace model

std::string ModelPlace::getText() const {
    if (line == 0) return file;
    return file + ":" + std::to_string(line) + ":" + std::to_string(column);
}

}  // namespace simflex
