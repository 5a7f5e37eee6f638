#include "simflex/cli/Json.h"
#include "simflex/base/NumberText.h"

#include <cmath>
#include <cstdio>

namespace simflex {
namespace cli {

void JsonWriter::put(const std::string& key, const std::string& value) {
    if (!_first) _text += ",";
    if (_depth > 0) _text += "\n" + std::string(2 * size_t(_depth), ' ');
    _text += (key.empty() ? "" : quoted(key) + ": ") + value;
    _first = false;
}

void JsonWriter::begin(const std::string& key, char bracket) {
    put(key, std::string(1, bracket));
    ++_depth;
    _first = true;
}

void JsonWriter::end(char bracket) {
    --_depth;
    if (!_first) _text += "\n" + std::string(2 * size_t(_depth), ' ');
    _text += bracket;
    _first = false;
}

std::string JsonWriter::quoted(const std::string& value) {
    std::string text = "\"";
    for (const char c : value) {
        if (c == '"' || c == '\\') {
            text += std::string("\\") + c;
        } else if ((unsigned char)(c) < 0x20) {
            char code[8];
            std::snprintf(code, sizeof code, "\\u%04x", c);
            text += code;
        } else {
            text += c;
        }
    }
    return text + "\"";
}

std::string JsonWriter::number(double value) {
    if (!std::isfinite(value)) return "null";  // JSON has no other word for it
    return writeGeneral(value);
}

}  // namespace cli
}  // namespace simflex
