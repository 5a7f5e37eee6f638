#include "simflex/base/Utf8.h"

#include <algorithm>

namespace simflex {

std::size_t calcUtf8Length(std::string_view text, std::size_t at) {
    const auto byte = [&](std::size_t k) {
        return at + k < text.size() ? static_cast<unsigned char>(text[at + k]) : 0u;
    };
    const unsigned first = byte(0), second = byte(1);
    if (first < 0x80) return at < text.size() ? 1 : 0;
    if (first < 0xC2 || first > 0xF4) return 0;
    const std::size_t length = first >= 0xF0 ? 4 : first >= 0xE0 ? 3 : 2;
    for (std::size_t k = 1; k < length; ++k)
        if ((byte(k) & 0xC0) != 0x80) return 0;
    const bool isTooLong = (first == 0xE0 && second < 0xA0) || (first == 0xF0 && second < 0x90),
               isSurrogate = first == 0xED && second > 0x9F,
               isBeyond = first == 0xF4 && second > 0x8F;
    return isTooLong || isSurrogate || isBeyond ? 0 : length;
}

std::u32string decodeUtf8(std::string_view text) {
    std::u32string codes;
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t length = std::max<std::size_t>(1, calcUtf8Length(text, at));
        char32_t code = static_cast<unsigned char>(text[at]);
        if (length > 1) code &= 0xFFu >> (length + 1);
        for (std::size_t k = 1; k < length; ++k)
            code = code << 6 | (static_cast<unsigned char>(text[at + k]) & 0x3F);
        codes += code;
        at += length;
    }
    return codes;
}

std::u16string convertToUtf16(std::string_view text) {
    std::u16string units;
    for (const char32_t code : decodeUtf8(text)) {
        if (code >= 0x10000) {
            units += char16_t(0xD800 + ((code - 0x10000) >> 10));
            units += char16_t(0xDC00 + ((code - 0x10000) & 0x3FF));
        } else {
            units += char16_t(code);
        }
    }
    return units;
}

namespace {

/** Returns whether a terminal interprets a character or changes the writing direction after it. **/
bool isControl(char32_t code) {
    const bool isBlank = code == '\n' || code == '\t';
    return (code < 0x20 && !isBlank) || (code >= 0x7F && code < 0xA0) || code == 0x061C ||
           code == 0x200E || code == 0x200F || (code >= 0x2028 && code <= 0x202E) ||
           (code >= 0x2066 && code <= 0x2069);
}

}  // namespace

std::string makePrintable(std::string_view text) {
    std::string printable;
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t length = calcUtf8Length(text, at);
        if (length == 0 || isControl(decodeUtf8(text.substr(at, length))[0]))
            printable += '?';
        else
            printable += text.substr(at, length);
        at += std::max<std::size_t>(1, length);
    }
    return printable;
}

std::size_t countCharacters(std::string_view text) {
    return decodeUtf8(text).size();
}

}  // namespace simflex
