#pragma once
/** @file
Files of archives (base/Archive.h) that were changed. **/

#include <cstring>
#include <string>

#include "simflex/base/Hash.h"

namespace simflex {
namespace fuzz {

/** Makes the length and the checksum in the header fit the bytes behind it. **/
inline void mendArchive(std::string& bytes) {
    const size_t header = bytes.find('\n') + 1, payload = header + 24;
    if (header == 0 || bytes.size() < payload) return;
    const std::uint64_t count = bytes.size() - payload;
    Hash hash;
    hash.addBytes(bytes.data() + payload, count);
    const std::uint64_t sum = hash.get();
    std::memcpy(&bytes[header + 8], &count, sizeof count);
    std::memcpy(&bytes[header + 16], &sum, sizeof sum);
}

}  // namespace fuzz
}  // namespace simflex
