#include "ContentHash.h"

#include <cstring>

namespace simflex {

void ContentHash::addBytes(const void* bytes, std::size_t count) {
    const char* from = static_cast<const char*>(bytes);
    for (; count >= 8; count -= 8, from += 8) {
        std::uint64_t word;
        std::memcpy(&word, from, 8);
        mix(word);
    }
    if (count == 0) return;
    std::uint64_t word = std::uint64_t(count) << 56;
    std::memcpy(&word, from, count);
    mix(word);
}

}  // namespace simflex
