#include "simflex/fmi/ZipFile.h"

#include <libdeflate.h>

#include <cerrno>
#include <cstring>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <vector>

namespace simflex {

namespace fs = std::filesystem;

namespace {

constexpr std::uint32_t LocalMark = 0x04034b50, CentralMark = 0x02014b50, EndMark = 0x06054b50;
constexpr int LocalSize = 30, CentralSize = 46, EndSize = 22;
constexpr int Stored = 0, Deflated = 8;
constexpr int Version = 20, MadeOnUnix = 3 << 8;
constexpr std::uint32_t ExecutableFile = 0100755u << 16;
constexpr int NoDate = (1 << 5) | 1;  // the first day of 1980
constexpr int NamesAreUtf8 = 1 << 11;
constexpr int Level = 6;
constexpr std::uint64_t Most = 0xfffffffe;  // of sizes and places in 32 bits
constexpr std::uint64_t MostUnpacked = std::uint64_t(4) << 30;

std::string readWhole(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    if (!file)
        throw std::runtime_error("cannot read '" + path.string() + "': " + std::strerror(errno));
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

template <class T>
void put(std::string& bytes, T value, int size) {
    for (int i = 0; i < size; ++i) bytes += char(std::uint64_t(value) >> (8 * i) & 255);
}

std::string deflate(std::string_view bytes) {
    const std::unique_ptr<libdeflate_compressor, void (*)(libdeflate_compressor*)> compressor(
        libdeflate_alloc_compressor(Level), libdeflate_free_compressor);
    if (!compressor) throw std::bad_alloc();
    std::string packed(libdeflate_deflate_compress_bound(compressor.get(), bytes.size()), '\0');
    packed.resize(libdeflate_deflate_compress(compressor.get(), bytes.data(), bytes.size(),
                                              packed.data(), packed.size()));
    return packed;
}

/** Numbers and text at places of an archive that may end anywhere. **/
class Bytes {
public:
    Bytes(const std::string& path, const std::string& bytes) : m_path(path), m_bytes(bytes) {}
    std::uint64_t size() const { return m_bytes.size(); }
    std::string_view take(std::uint64_t place, std::uint64_t size) const {
        if (place > m_bytes.size() || size > m_bytes.size() - place) fail("ends early");
        return std::string_view(m_bytes).substr(place, size);
    }
    std::uint32_t number(std::uint64_t place, int size) const {
        const std::string_view text = take(place, std::uint64_t(size));
        std::uint32_t value = 0;
        for (int i = size; i-- > 0;) value = value << 8 | std::uint8_t(text[size_t(i)]);
        return value;
    }
    [[noreturn]] void fail(const std::string& what) const {
        throw std::runtime_error("'" + m_path + "' " + what);
    }

private:
    const std::string& m_path;
    const std::string& m_bytes;
};

std::uint64_t findEnd(const Bytes& bytes) {
    constexpr std::uint64_t LongestComment = 65535;
    for (std::uint64_t back = EndSize; back <= std::min(bytes.size(), EndSize + LongestComment);
         ++back)
        if (bytes.number(bytes.size() - back, 4) == EndMark) return bytes.size() - back;
    bytes.fail("is no ZIP archive");
}

std::string inflate(const Bytes& bytes, std::string_view packed, std::uint64_t size,
                    const std::string& name) {
    std::string whole(size, '\0');
    const std::unique_ptr<libdeflate_decompressor, void (*)(libdeflate_decompressor*)> decompressor(
        libdeflate_alloc_decompressor(), libdeflate_free_decompressor);
    if (!decompressor) throw std::bad_alloc();
    if (libdeflate_deflate_decompress(decompressor.get(), packed.data(), packed.size(),
                                      whole.data(), whole.size(), nullptr) != LIBDEFLATE_SUCCESS)
        bytes.fail("is damaged: '" + name + "' in it cannot be unpacked");
    return whole;
}

bool isWithin(const fs::path& name) {
    if (name.empty() || name.is_absolute()) return false;
    for (const fs::path& part : name)
        if (part == "..") return false;
    return true;
}

}  // namespace

ZipWriter::ZipWriter(const fs::path& path)
    : m_file(path), m_path(path.string()), m_stream(m_file.getPath(), std::ios::binary) {
    if (!m_stream)
        throw std::runtime_error("cannot write '" + m_path + "': " + std::strerror(errno));
}

void ZipWriter::add(const std::string& name, std::string_view bytes) {
    const std::string packed = deflate(bytes);
    if (m_size + packed.size() > Most || bytes.size() > Most)
        throw std::runtime_error("cannot write '" + m_path + "': it would have more than 4 GB");
    // From the version that is needed to the length of further fields.
    std::string header;
    put(header, Version, 2);
    put(header, NamesAreUtf8, 2);
    put(header, Deflated, 2);
    put(header, 0, 2);
    put(header, NoDate, 2);
    put(header, libdeflate_crc32(0, bytes.data(), bytes.size()), 4);
    put(header, packed.size(), 4);
    put(header, bytes.size(), 4);
    put(header, name.size(), 2);
    put(header, 0, 2);

    put(m_directory, CentralMark, 4);
    put(m_directory, MadeOnUnix | Version, 2);
    m_directory += header;
    put(m_directory, 0, 6);  // comment, disk, kind
    put(m_directory, ExecutableFile, 4);
    put(m_directory, m_size, 4);
    m_directory += name;
    ++m_numEntries;

    std::string mark;
    put(mark, LocalMark, 4);
    m_stream << mark << header << name << packed;
    m_size += LocalSize + name.size() + packed.size();
}

void ZipWriter::addFile(const std::string& name, const fs::path& file) {
    add(name, readWhole(file));
}

void ZipWriter::finish() {
    std::string end;
    put(end, EndMark, 4);
    put(end, 0, 4);
    put(end, m_numEntries, 2);
    put(end, m_numEntries, 2);
    put(end, m_directory.size(), 4);
    put(end, m_size, 4);
    put(end, 0, 2);
    m_stream << m_directory << end;
    m_stream.close();
    if (!m_stream)
        throw std::runtime_error("cannot write '" + m_path + "': " + std::strerror(errno));
    m_file.finish(Durability::ProcessEnd);
}

void unpackZip(const fs::path& path, const fs::path& folder) {
    const std::string name = path.string(), contents = readWhole(path);
    const Bytes bytes(name, contents);
    const std::uint64_t end = findEnd(bytes);
    std::uint64_t place = bytes.number(end + 16, 4), unpacked = 0;
    for (std::uint32_t count = bytes.number(end + 10, 2); count > 0; --count) {
        if (bytes.number(place, 4) != CentralMark)
            bytes.fail("is damaged: its directory ends early");
        const std::uint32_t flags = bytes.number(place + 8, 2),
                            method = bytes.number(place + 10, 2), sum = bytes.number(place + 16, 4);
        const std::uint64_t packedSize = bytes.number(place + 20, 4),
                            size = bytes.number(place + 24, 4),
                            nameSize = bytes.number(place + 28, 2),
                            local = bytes.number(place + 42, 4);
        const std::string entry(bytes.take(place + CentralSize, nameSize));
        place += CentralSize + nameSize + bytes.number(place + 30, 2) + bytes.number(place + 32, 2);
        if (!isWithin(entry)) bytes.fail("would write outside of its folder: '" + entry + "'");
        if (flags & 1) bytes.fail("is encrypted: '" + entry + "'");
        if (method != Stored && method != Deflated)
            bytes.fail("is packed by a method that is not known: '" + entry + "'");
        unpacked += size;
        if (unpacked > MostUnpacked) bytes.fail("has more than 4 GB");
        if (bytes.number(local, 4) != LocalMark)
            bytes.fail("is damaged: there is no '" + entry + "'");
        const std::string_view packed = bytes.take(
            local + LocalSize + bytes.number(local + 26, 2) + bytes.number(local + 28, 2),
            packedSize);
        if (entry.back() == '/') {
            fs::create_directories(folder / entry);
            continue;
        }
        const std::string whole =
            method == Stored ? std::string(packed) : inflate(bytes, packed, size, entry);
        if (libdeflate_crc32(0, whole.data(), whole.size()) != sum)
            bytes.fail("is damaged: the checksum of '" + entry + "' is wrong");
        fs::create_directories((folder / entry).parent_path());
        std::ofstream file(folder / entry, std::ios::binary);
        file << whole;
        file.close();
        if (!file)
            throw std::runtime_error("cannot write '" + (folder / entry).string() +
                                     "': " + std::strerror(errno));
    }
}

}  // namespace simflex
