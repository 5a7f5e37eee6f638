#pragma once
/** @file
A number that tells one content from another. Internal to the renderer. **/

#include <cstddef>
#include <cstdint>
#include <string>
#include <type_traits>
#include <vector>

namespace simflex {

/** 64 bits of whatever is added, in this order. **/
class ContentHash {
public:
    void addBytes(const void* bytes, std::size_t count);

    template <class T>
    void add(const T& value) {
        static_assert(std::is_arithmetic<T>::value || std::is_enum<T>::value,
                      "padding and pointers are no content");
        addBytes(&value, sizeof value);
    }
    template <class T>
    void add(const std::vector<T>& values) {
        add(values.size());
        addBytes(values.data(), values.size() * sizeof(T));
    }
    void add(const std::string& text) {
        add(text.size());
        addBytes(text.data(), text.size());
    }

    std::uint64_t getValue() const { return state; }

private:
    void mix(std::uint64_t word) {
        state = (state ^ word) * 0x9E3779B97F4A7C15u;
        state ^= state >> 29;
    }
    std::uint64_t state = 0xCBF29CE484222325u;
};

}  // namespace simflex
