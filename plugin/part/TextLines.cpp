#include "simflex/part/TextLines.h"

#include <algorithm>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "simflex/base/InputFile.h"
#include "simflex/base/NumberText.h"

namespace simflex {
namespace {

constexpr size_t LongestQuote = 40;

bool isSeparator(char c) {
    return c == ' ' || c == '\t' || c == ',' || c == ';' || c == '\r';
}

}  // namespace

TextLines::TextLines(std::string path, const std::string& kind) : m_path(std::move(path)) {
    std::ifstream in = openInputFile(m_path);
    if (!in.is_open()) throw std::runtime_error("cannot read " + kind + " '" + m_path + "'");
    std::ostringstream text;
    text << in.rdbuf();
    m_text = std::move(text).str();
}

bool TextLines::next() {
    if (m_at >= m_text.size()) return false;
    m_begin = m_at;
    const size_t end = std::min(m_text.find('\n', m_at), m_text.size());
    m_line = std::string_view(m_text).substr(m_at, end - m_at);
    if (!m_line.empty() && m_line.back() == '\r') m_line.remove_suffix(1);
    m_at = end + 1;
    ++m_number;
    return true;
}

bool TextLines::nextFilled() {
    while (next())
        if (!trimBlanks(m_line).empty()) return true;
    return false;
}

void TextLines::refuse(const std::string& why) const {
    throw std::invalid_argument(where() + why);
}

double TextLines::parseNumber(std::string_view field, const char* what) const {
    double value = 0;
    if (!readNumber(field, value))
        refuse(std::string(what) + " is " + quoteField(field) + "; it must be a finite number");
    return value;
}

int TextLines::parseInteger(std::string_view field, const char* what) const {
    int value = 0;
    if (!readInteger(field, value))
        refuse(std::string(what) + " is " + quoteField(field) + "; it must be a whole number");
    return value;
}

std::string_view trimBlanks(std::string_view text) {
    const size_t begin = text.find_first_not_of(" \t\r");
    if (begin == std::string_view::npos) return {};
    return text.substr(begin, text.find_last_not_of(" \t\r") - begin + 1);
}

void splitFields(std::string_view line, std::vector<std::string_view>& fields) {
    fields.clear();
    for (size_t at = 0; at < line.size();) {
        while (at < line.size() && isSeparator(line[at])) ++at;
        const size_t begin = at;
        while (at < line.size() && !isSeparator(line[at])) ++at;
        if (at > begin) fields.push_back(line.substr(begin, at - begin));
    }
}

std::string quoteField(std::string_view field) {
    std::string text = "'" + std::string(field.substr(0, LongestQuote)) +
                       (field.size() > LongestQuote ? "…'" : "'");
    for (char& c : text)
        if ((unsigned char)(c) < ' ' || c == 0x7f) c = '?';
    return text;
}

}  // namespace simflex
