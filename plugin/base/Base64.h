#pragma once
/** @file
Base64 encoding (RFC 4648). **/

#include <cstddef>
#include <cstdint>
#include <string>

namespace simflex {

inline std::string encodeBase64(const void* data, std::size_t size) {
    static const char letters[] =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const auto* bytes = static_cast<const std::uint8_t*>(data);
    std::string text;
    text.reserve(size / 3 * 4 + 4);
    for (std::size_t i = 0; i < size; i += 3) {
        std::uint32_t group = std::uint32_t(bytes[i]) << 16;
        if (i + 1 < size) group |= std::uint32_t(bytes[i + 1]) << 8;
        if (i + 2 < size) group |= bytes[i + 2];
        text += letters[group >> 18];
        text += letters[group >> 12 & 63];
        text += i + 1 < size ? letters[group >> 6 & 63] : '=';
        text += i + 2 < size ? letters[group & 63] : '=';
    }
    return text;
}

}  // namespace simflex
