#include "simflex/cli/shell/CommandText.h"

#include <stdexcept>

#include "simflex/base/AsciiText.h"

namespace simflex {
namespace cli {
namespace {

class Splitter {
public:
    void read(const std::string& text) {
        for (const char c : text) {
            if (m_isComment) return;
            read(c);
        }
    }

    void endWord() {
        if (m_isWord) words.push_back(word);
        word.clear();
        m_isWord = false;
    }
    void endCommand() {
        endWord();
        if (!words.empty()) commands.push_back(words);
        words.clear();
    }

    bool isComment() const { return m_isComment; }
    char getQuote() const { return m_quote; }
    const std::string& getBrackets() const { return m_brackets; }

    std::vector<Words> commands;
    Words words;
    std::string word;

private:
    void read(char c) {
        if (m_quote) {
            if (c == m_quote)
                m_quote = 0;
            else
                word += c;
        } else if (c == '\'' || c == '"') {
            m_quote = c;
            m_isWord = true;
        } else if (!m_brackets.empty() || isBracket(c)) {
            readInBrackets(c);
        } else if (isBlank(c)) {
            endWord();
        } else if (c == ';') {
            endCommand();
        } else if (c == '#' && !m_isWord) {
            m_isComment = true;
        } else {
            add(c);
        }
    }

    static bool isBracket(char c) { return c == '(' || c == '[' || c == '{'; }

    void readInBrackets(char c) {
        if (isBracket(c))
            m_brackets += c == '(' ? ')' : c == '[' ? ']' : '}';
        else if (c == m_brackets.back())
            m_brackets.pop_back();
        add(c);
    }

    void add(char c) {
        word += c;
        m_isWord = true;
    }

    char m_quote = 0;
    std::string m_brackets;  ///< closing brackets expected
    bool m_isWord = false, m_isComment = false;
};

}  // namespace

std::vector<Words> splitCommands(const std::string& line) {
    Splitter splitter;
    splitter.read(line);
    if (splitter.getQuote())
        throw std::invalid_argument(std::string("a quote ") + splitter.getQuote() +
                                    " is not closed");
    if (!splitter.getBrackets().empty())
        throw std::invalid_argument(std::string("'") + splitter.getBrackets().back() +
                                    "' is missing");
    splitter.endCommand();
    return splitter.commands;
}

UnfinishedCommand splitUnfinished(const std::string& text) {
    Splitter splitter;
    splitter.read(text);
    return {splitter.words, splitter.word, splitter.getQuote(), splitter.isComment()};
}

std::vector<std::string> splitList(const std::string& text) {
    if (text.size() < 2 || text.front() != '[' || text.back() != ']') return {text};
    return splitAtCommas(text.substr(1, text.size() - 2));
}

std::string quoteWord(const std::string& word) {
    bool isPlain = !word.empty();
    for (const char c : word)
        if (isBlank(c) || std::string("'\";#()[]{}").find(c) != std::string::npos) isPlain = false;
    if (isPlain) return word;
    if (word.find('\'') == std::string::npos) return "'" + word + "'";
    std::string quoted = "\"";
    for (const char c : word) quoted += c == '"' ? std::string("\"'\"'\"") : std::string(1, c);
    return quoted + "\"";
}

}  // namespace cli
}  // namespace simflex
