#include "simflex/part/TextLines.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>

namespace simflex {
namespace {

constexpr size_t kLongestNumber = 64, kLongestQuote = 40;

bool isSeparator(char c) {
    return c == ' ' || c == '\t' || c == ',' || c == ';' || c == '\r';
}

}  // namespace

TextLines::TextLines(std::string path, const std::string& kind) : _path(std::move(path)) {
    std::ifstream in(_path, std::ios::binary);
    if (!in || std::filesystem::is_directory(_path))
        throw std::runtime_error("cannot read " + kind + " '" + _path + "'");
    std::ostringstream text;
    text << in.rdbuf();
    _text = std::move(text).str();
}

bool TextLines::next() {
    if (_at >= _text.size()) return false;
    _begin = _at;
    const size_t end = std::min(_text.find('\n', _at), _text.size());
    _line = std::string_view(_text).substr(_at, end - _at);
    if (!_line.empty() && _line.back() == '\r') _line.remove_suffix(1);
    _at = end + 1;
    ++_number;
    return true;
}

bool TextLines::nextFilled() {
    while (next())
        if (!trimBlanks(_line).empty()) return true;
    return false;
}

void TextLines::refuse(const std::string& why) const {
    throw std::invalid_argument(where() + why);
}

double TextLines::parseNumber(std::string_view field, const char* what) const {
    double value = 0;
    if (!readNumber(field, value))
        refuse(std::string(what) + " is " + quoteField(field) + ", must be a finite number");
    return value;
}

int TextLines::parseInteger(std::string_view field, const char* what) const {
    int value = 0;
    if (!readInteger(field, value))
        refuse(std::string(what) + " is " + quoteField(field) + ", must be a whole number");
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

bool readNumber(std::string_view field, double& value) {
    if (field.empty() || field.size() > kLongestNumber) return false;
    char text[kLongestNumber + 1];
    std::copy(field.begin(), field.end(), text);
    for (size_t k = 0; k < field.size(); ++k)
        if (text[k] == 'd' || text[k] == 'D') text[k] = 'e';
    text[field.size()] = 0;
    const char* begin = text + (text[0] == '+' && field.size() > 1 && text[1] != '-');
    const char* end = text + field.size();
    const auto result = std::from_chars(begin, end, value);
    if (result.ptr != end) return false;
    if (result.ec == std::errc::result_out_of_range) {
        value = 0;
        return std::strstr(begin, "e-") || std::strstr(begin, "E-");  // too small, not too large
    }
    return result.ec == std::errc() && std::isfinite(value);
}

bool readInteger(std::string_view field, int& value) {
    if (field.size() > 1 && field[0] == '+' && field[1] != '-') field.remove_prefix(1);
    const char* end = field.data() + field.size();
    const auto result = std::from_chars(field.data(), end, value);
    return result.ec == std::errc() && result.ptr == end;
}

std::string quoteField(std::string_view field) {
    std::string text = "'" + std::string(field.substr(0, kLongestQuote)) +
                       (field.size() > kLongestQuote ? "…'" : "'");
    for (char& c : text)
        if ((unsigned char)(c) < ' ' || c == 0x7f) c = '?';
    return text;
}

}  // namespace simflex
