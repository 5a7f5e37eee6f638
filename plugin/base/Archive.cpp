#include "simflex/base/Archive.h"

#include <algorithm>
#include <cstring>
#include <istream>
#include <limits>
#include <ostream>
#include <stdexcept>

#include "simflex/base/Hash.h"

namespace simflex {
namespace {

constexpr std::uint32_t ByteOrder = 0x01020304;

struct Header {
    std::uint32_t byteOrder, version;
    std::uint64_t size, checksum;
};

std::uint64_t calcChecksum(const std::string& bytes) {
    Hash hash;
    hash.addBytes(bytes.data(), bytes.size());
    return hash.get();
}

}  // namespace

void Archive::fail(const std::string& reason) const {
    throw std::runtime_error(reason);
}

void Archive::move(void* data, std::size_t size) {
    if (m_isReading)
        std::memcpy(data, m_bytes.data() + (m_bytes.size() - m_left), size);
    else
        m_bytes.append(static_cast<const char*>(data), size);
}

void Archive::visitBytes(void* data, std::size_t size) {
    if (size == 0) return;
    if (m_isReading) requireLeft(size, 1);
    move(data, size);
    if (m_isReading) m_left -= size;
}

void Archive::requireLeft(std::uint64_t count, std::size_t bytesEach) const {
    if (count > m_left / std::max<std::size_t>(bytesEach, 1)) fail("it ends early");
}

std::size_t Archive::visitSize(std::size_t size, std::size_t bytesEach) {
    auto count = std::uint64_t(size);
    visit(count);
    if (m_isReading) requireLeft(count, bytesEach);
    return std::size_t(count);
}

void Archive::visit(bool& value) {
    unsigned char byte = value;
    visitBytes(&byte, 1);
    value = byte != 0;
}

void Archive::visit(std::string& value) {
    value.resize(visitSize(value.size(), 1));
    visitBytes(value.data(), value.size());
}

void Archive::visitWithin(int& value, int first, int last, const char* what) {
    visit(value);
    if (m_isReading && (value < first || value > last))
        fail(std::string(what) + " is " + std::to_string(value) + "; it must be " +
             std::to_string(first) + " to " + std::to_string(last));
}

void Archive::visitCount(int& count) {
    auto wide = std::uint64_t(count);
    visit(wide);
    if (wide > std::uint64_t(std::numeric_limits<int>::max()))
        fail("a number of things is " + std::to_string(wide));
    count = int(wide);
}

void Archive::requireEnd() const {
    if (m_left > 0) fail("it holds " + std::to_string(m_left) + " bytes too many");
}

void writeArchive(std::ostream& stream, const std::string& kind, std::uint32_t version,
                  const std::string& bytes) {
    const Header header{ByteOrder, version, bytes.size(), calcChecksum(bytes)};
    stream << kind << '\n';
    stream.write(reinterpret_cast<const char*>(&header), sizeof header);
    stream.write(bytes.data(), std::streamsize(bytes.size()));
    stream.flush();
    if (!stream) throw std::runtime_error("it cannot be written: is the disk full?");
}

std::string readArchive(std::istream& stream, const std::string& kind, std::uint32_t version) {
    constexpr std::size_t Piece = std::size_t(1) << 20;
    const auto refuse = [](const std::string& reason) { throw std::runtime_error(reason); };
    std::string line(kind.size() + 1, '\0'), bytes;
    if (!stream.read(line.data(), std::streamsize(line.size())) || line != kind + '\n')
        refuse("it is no " + kind);
    Header header{};
    if (!stream.read(reinterpret_cast<char*>(&header), sizeof header))
        refuse("it is cut off after " + std::to_string(line.size() + size_t(stream.gcount())) +
               " bytes");
    if (header.byteOrder != ByteOrder)
        refuse("it was written on a machine with another order of bytes");
    if (header.version != version)
        refuse("its format has version " + std::to_string(header.version) +
               ", this simflex reads " + std::to_string(version) +
               (header.version > version ? ": a newer simflex is needed" : ""));
    // Read in pieces, so that a damaged length does not allocate all memory.
    while (bytes.size() < header.size) {
        const std::size_t before = bytes.size();
        const std::size_t piece = std::min<std::uint64_t>(Piece, header.size - before);
        bytes.resize(before + piece);
        stream.read(&bytes[before], std::streamsize(piece));
        if (std::size_t(stream.gcount()) != piece)
            refuse("it is cut off: " + std::to_string(header.size) + " bytes announced, " +
                   std::to_string(before + std::size_t(stream.gcount())) + " found");
    }
    if (calcChecksum(bytes) != header.checksum) refuse("it is damaged: its checksum does not fit");
    return bytes;
}

}  // namespace simflex
