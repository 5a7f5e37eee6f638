#include "simflex/base/Checkpoint.h"

#include <algorithm>
#include <cstring>
#include <istream>
#include <ostream>
#include <stdexcept>

#include "simflex/base/Hash.h"

namespace simflex {
namespace {

constexpr char Magic[] = "simflex checkpoint\n";
constexpr std::size_t MagicSize = sizeof Magic - 1;
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

void Checkpoint::refuse(const std::string& reason) {
    throw std::runtime_error("the checkpoint cannot be used: " + reason);
}

Checkpoint::Checkpoint(std::istream& stream) : m_isReading(true) {
    constexpr std::size_t Piece = std::size_t(1) << 20;
    char magic[MagicSize];
    if (!stream.read(magic, MagicSize) || !std::equal(magic, magic + MagicSize, Magic))
        refuse("the file is no checkpoint of simflex");
    Header header{};
    if (!stream.read(reinterpret_cast<char*>(&header), sizeof header))
        refuse("the file is cut off after " + std::to_string(MagicSize + stream.gcount()) +
               " bytes");
    if (header.byteOrder != ByteOrder)
        refuse("it was written on a machine with another order of bytes");
    if (header.version != Version)
        refuse("its format has version " + std::to_string(header.version) +
               ", this simflex reads " + std::to_string(Version) +
               (header.version > Version ? ": a newer simflex is needed" : ""));
    // Piece by piece: a damaged length must not ask for all memory.
    while (m_bytes.size() < header.size) {
        const std::size_t before = m_bytes.size();
        const std::size_t piece = std::min<std::uint64_t>(Piece, header.size - before);
        m_bytes.resize(before + piece);
        stream.read(&m_bytes[before], std::streamsize(piece));
        if (std::size_t(stream.gcount()) != piece)
            refuse("the file is cut off: " + std::to_string(header.size) + " bytes announced, " +
                   std::to_string(before + std::size_t(stream.gcount())) + " found");
    }
    if (calcChecksum(m_bytes) != header.checksum)
        refuse(
            "the file is damaged: its checksum does not fit; use an older checkpoint or start "
            "anew");
}

void Checkpoint::write(std::ostream& stream) const {
    const Header header{ByteOrder, Version, m_bytes.size(), calcChecksum(m_bytes)};
    stream.write(Magic, MagicSize);
    stream.write(reinterpret_cast<const char*>(&header), sizeof header);
    stream.write(m_bytes.data(), std::streamsize(m_bytes.size()));
    stream.flush();
    if (!stream) throw std::runtime_error("the checkpoint cannot be written: is the disk full?");
}

void Checkpoint::visitBytes(void* data, std::size_t size) {
    if (size == 0) return;
    if (!m_isReading) {
        m_bytes.append(static_cast<const char*>(data), size);
        return;
    }
    if (size > m_bytes.size() - m_at) refuse("it ends too early: it does not fit this model");
    std::memcpy(data, m_bytes.data() + m_at, size);
    m_at += size;
}

std::size_t Checkpoint::visitSize(std::size_t size, std::size_t bytesEach) {
    auto count = std::uint64_t(size);
    visitBytes(&count, sizeof count);
    if (m_isReading && count > (m_bytes.size() - m_at) / std::max<std::size_t>(bytesEach, 1))
        refuse("it ends too early: it does not fit this model");
    return std::size_t(count);
}

void Checkpoint::visit(bool& value) {
    unsigned char byte = value;
    visitBytes(&byte, 1);
    value = byte != 0;
}

void Checkpoint::visit(std::string& value) {
    value.resize(visitSize(value.size(), 1));
    visitBytes(value.data(), value.size());
}

void Checkpoint::visitWithin(int& value, int first, int last, const char* what) {
    visit(value);
    if (m_isReading && (value < first || value > last))
        refuse(std::string(what) + " is " + std::to_string(value) + ", must be " +
               std::to_string(first) + " to " + std::to_string(last));
}

void Checkpoint::visit(std::vector<double>& values) {
    const std::size_t size = visitSize(values.size(), sizeof(double));
    if (size != values.size())
        refuse("it holds " + std::to_string(size) + " numbers where this model has " +
               std::to_string(values.size()));
    visitBytes(values.data(), size * sizeof(double));
}

void Checkpoint::requireEnd() const {
    if (m_at != m_bytes.size())
        refuse("it holds " + std::to_string(m_bytes.size() - m_at) +
               " bytes more than this model asks for");
}

}  // namespace simflex
