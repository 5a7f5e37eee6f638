#pragma once
/** @file
Modified archive files (base/Archive.h). **/

#include <cstring>
#include <string>

#include "simflex/base/Hash.h"

namespace simflex {
namespace fuzz {

/** Repairs the length and checksum in the header to match the bytes after it. **/
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
