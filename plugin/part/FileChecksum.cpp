#include "FileChecksum.h"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <vector>

#include "simflex/base/Hash.h"

namespace simflex {
namespace {

constexpr size_t Block = size_t(1) << 20;  // must be a multiple of eight bytes

struct Trailer {
    char mark[8] = {'S', 'F', 'L', 'X', 'S', 'U', 'M', '1'};
    std::uint64_t sum = 0;
};

std::uint64_t calcChecksum(std::ifstream& in, size_t size) {
    Hash hash;
    std::vector<char> block(std::min(size, Block));
    in.seekg(0);
    for (size_t start = 0; start < size; start += Block) {
        const size_t count = std::min(Block, size - start);
        if (!in.read(block.data(), std::streamsize(count)))
            throw std::runtime_error("it cannot be read");
        hash.addBytes(block.data(), count);
    }
    return hash.get();
}

}  // namespace

void appendChecksum(const std::string& path) {
    Trailer trailer;
    {
        std::ifstream in(path, std::ios::binary);
        trailer.sum = calcChecksum(in, std::filesystem::file_size(path));
    }
    std::ofstream out(path, std::ios::binary | std::ios::app);
    out.write(reinterpret_cast<const char*>(&trailer), sizeof trailer);
    if (!out.flush()) throw std::runtime_error("cannot write all of it; is the disk full?");
}

void checkChecksum(const std::string& path) {
    const size_t whole = std::filesystem::file_size(path);
    Trailer found;
    if (whole < sizeof found) return;
    const size_t size = whole - sizeof found;
    std::ifstream in(path, std::ios::binary);
    in.seekg(std::streamoff(size));
    if (!in.read(reinterpret_cast<char*>(&found), sizeof found))
        throw std::runtime_error("it cannot be read");
    if (std::memcmp(found.mark, Trailer().mark, sizeof found.mark) != 0) return;
    if (calcChecksum(in, size) != found.sum)
        throw std::runtime_error("it is damaged: its checksum is not that of its bytes");
}

}  // namespace simflex
