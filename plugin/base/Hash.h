#pragma once
/** @file
A 64-bit content hash for cache keys and file checksums. It must stay the same in all versions,
since part and result files store it.

Data is hashed in 64-bit words; the last word of each addBytes() is padded with zeros. The function
is FNV-1a on words instead of bytes, with a shift that lets high bits act on low ones:

    state ← (state ⊕ word) · 1099511628211,  state ← state ⊕ (state >> 32)

O(bytes), about 3 GB/s. It detects errors and accidental collisions, not forgery. **/

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <type_traits>
#include <vector>

namespace simflex {

/** Hash of everything added, in order. Hashes values, not addresses. **/
class Hash {
public:
    /** Does not hash the size: shorter content followed by zeros may give the same hash. **/
    void addBytes(const void* bytes, std::size_t size) {
        const char* at = static_cast<const char*>(bytes);
        for (; size > 0;) {
            std::uint64_t word = 0;
            const std::size_t count = std::min(size, sizeof word);
            std::memcpy(&word, at, count);
            m_state = (m_state ^ word) * 1099511628211u;
            m_state ^= m_state >> 32;
            at += count;
            size -= count;
        }
    }

    template <class T>
    void add(const T& value) {
        static_assert(std::is_arithmetic_v<T> || std::is_enum_v<T>,
                      "padding and pointers are no content");
        addBytes(&value, sizeof value);
    }
    template <class T>
    void add(const std::vector<T>& values) {
        static_assert(std::is_trivially_copyable_v<T> && !std::is_pointer_v<T>);
        addSized(values.data(), values.size() * sizeof(T));
    }
    void add(const std::string& text) { addSized(text.data(), text.size()); }

    std::uint64_t get() const { return m_state; }

    /** Returns 16 hexadecimal digits. **/
    std::string getText() const {
        std::string text;
        for (int shift = 60; shift >= 0; shift -= 4)
            text += "0123456789abcdef"[m_state >> shift & 15];
        return text;
    }

private:
    void addSized(const void* bytes, std::size_t size) {
        add(size);
        addBytes(bytes, size);
    }

    std::uint64_t m_state = 14695981039346656037u;
};

}  // namespace simflex
