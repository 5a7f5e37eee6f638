#include "simflex/base/Json.h"

#include <algorithm>
#include <cmath>

#include "simflex/base/NumberText.h"

namespace simflex {

Json::Json(double value, int digits)
    : m_text(std::isfinite(value) ? writeGeneral(value, digits) : "null") {}

std::string Json::quote(const std::string& text) {
    std::string quoted = "\"";
    for (const char c : text) {
        const auto code = (unsigned char)(c);
        if (c == '"' || c == '\\')
            quoted += std::string("\\") + c;
        else if (c == '\n')
            quoted += "\\n";
        else if (code < 0x20)
            quoted += std::string("\\u00") + "01"[code >> 4] + "0123456789abcdef"[code & 15];
        else
            quoted += c;
    }
    return quoted + "\"";
}

std::string Json::write(int indent) const {
    std::string text;
    write(indent, 0, text);
    return text;
}

void Json::write(int indent, int depth, std::string& out) const {
    if (m_bracket == 0) {
        out += m_text;
        return;
    }
    const bool isFlat = m_bracket == '[' &&
                        std::all_of(m_items.begin(), m_items.end(),
                                    [](const auto& item) { return item.second.m_bracket == 0; });
    const auto breakLine = [&](int level) {
        out += '\n' + std::string(size_t(indent * level), ' ');
    };
    out += m_bracket;
    bool isFirst = true;
    for (const auto& [key, value] : m_items) {
        if (!isFirst) out += isFlat ? ", " : ",";
        if (!isFlat) breakLine(depth + 1);
        isFirst = false;
        if (m_bracket == '{') out += quote(key) + ": ";
        value.write(indent, depth + 1, out);
    }
    if (!isFlat && !m_items.empty()) breakLine(depth);
    out += m_bracket == '{' ? '}' : ']';
}

}  // namespace simflex
