#include "simflex/base/ZipFile.h"

#include <libdeflate.h>
#include <unzip.h>
#include <zip.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <new>
#include <stdexcept>

#include "simflex/base/InputFile.h"

namespace simflex {

namespace fs = std::filesystem;

namespace {

constexpr int DeflateLevel = 6;
constexpr uLong FirstOf1980 = 33u << 16;
constexpr uLong MadeOnUnix = 3 << 8 | 20;
constexpr uLong ExecutableFile = 0100755u << 16;
constexpr uLong IsEncrypted = 1, NamesAreUtf8 = 1 << 11;
constexpr std::uint64_t MostWithoutZip64 = 0xfffffffe;
constexpr std::uint64_t MostInflation = 1100;  // deflate cannot compress better
constexpr std::uint64_t MostUnpacked = std::uint64_t(4) << 30;
// Larger files are refused above this ratio, which libraries and parts never reach.
constexpr std::uint64_t MuchUnpacked = std::uint64_t(256) << 20, LargestRatio = 100;
constexpr size_t LongestZipName = 100;           // characters quoted in an error
constexpr std::uint64_t LargestPiece = 1 << 30;  // minizip counts in 32 bits

std::string deflate(std::string_view bytes) {
    const std::unique_ptr<libdeflate_compressor, void (*)(libdeflate_compressor*)> compressor(
        libdeflate_alloc_compressor(DeflateLevel), libdeflate_free_compressor);
    if (!compressor) throw std::bad_alloc();
    std::string packed(libdeflate_deflate_compress_bound(compressor.get(), bytes.size()), '\0');
    packed.resize(libdeflate_deflate_compress(compressor.get(), bytes.data(), bytes.size(),
                                              packed.data(), packed.size()));
    return packed;
}

int closeUnfinished(void* zip) {
    return zipClose(zip, nullptr);
}

[[noreturn]] void failToWrite(const std::string& path) {
    const std::string cause = errno ? std::strerror(errno) : "the disk may be full";
    throw std::runtime_error("cannot write '" + path + "': " + cause);
}

/** Returns whether the end record is complete: minizip reads the missing bytes of a truncated
archive as zeros. **/
bool hasWholeEnd(std::ifstream& file) {
    constexpr size_t Size = 22, LongestComment = 65535;
    file.seekg(0, std::ios::end);
    const auto most = std::min<std::uint64_t>(Size + LongestComment, std::uint64_t(file.tellg()));
    std::string end(most, '\0');
    file.seekg(-std::streamoff(most), std::ios::end);
    file.read(end.data(), std::streamsize(most));
    const size_t mark = end.rfind("PK\x05\x06");
    if (mark == end.npos || mark + Size > end.size()) return false;
    const auto byte = [&](size_t at) { return size_t(std::uint8_t(end[mark + at])); };
    return mark + Size + byte(20) + 256 * byte(21) <= end.size();
}

bool staysWithin(const fs::path& name) {
    return !name.empty() && !name.is_absolute() &&
           std::find(name.begin(), name.end(), "..") == name.end();
}

}  // namespace

ZipWriter::ZipWriter(const fs::path& path)
    : m_file(path), m_path(path.string()), m_zip(nullptr, closeUnfinished) {
    errno = 0;
    m_zip.reset(zipOpen64(m_file.getPath().c_str(), APPEND_STATUS_CREATE));
    if (!m_zip) failToWrite(m_path);
}

void ZipWriter::add(const std::string& name, std::string_view bytes, ZipMethod method) {
    // The data is compressed already ("raw" to minizip): libdeflate is faster than zlib.
    const std::string packed = method == ZipMethod::Deflated ? deflate(bytes) : "";
    std::string_view rest = method == ZipMethod::Deflated ? std::string_view(packed) : bytes;
    zip_fileinfo info{};
    info.dosDate = FirstOf1980;
    info.external_fa = ExecutableFile;
    errno = 0;
    bool isWritten =
        zipOpenNewFileInZip4_64(m_zip.get(), name.c_str(), &info, nullptr, 0, nullptr, 0, nullptr,
                                method == ZipMethod::Deflated ? Z_DEFLATED : 0, DeflateLevel, 1,
                                -MAX_WBITS, MAX_MEM_LEVEL, Z_DEFAULT_STRATEGY, nullptr, 0,
                                MadeOnUnix, NamesAreUtf8,
                                std::max(bytes.size(), packed.size()) > MostWithoutZip64) == ZIP_OK;
    while (isWritten && !rest.empty()) {
        const auto size = std::min<std::uint64_t>(LargestPiece, rest.size());
        isWritten = zipWriteInFileInZip(m_zip.get(), rest.data(), unsigned(size)) == ZIP_OK;
        rest.remove_prefix(size);
    }
    if (!isWritten ||
        zipCloseFileInZipRaw64(m_zip.get(), bytes.size(),
                               libdeflate_crc32(0, bytes.data(), bytes.size())) != ZIP_OK)
        failToWrite(m_path);
}

void ZipWriter::addFile(const std::string& name, const fs::path& path) {
    add(name, readInputFile(path));
}

void ZipWriter::finish(Durability durability) {
    errno = 0;
    if (closeUnfinished(m_zip.release()) != ZIP_OK) failToWrite(m_path);
    m_file.finish(durability);
}

ZipReader::ZipReader(const fs::path& path) : m_path(path.string()), m_zip(nullptr, unzClose) {
    errno = 0;
    std::ifstream file = openInputFile(path);
    if (!file.is_open())
        throw std::runtime_error("cannot read '" + m_path + "'" +
                                 (errno ? ": " + std::string(std::strerror(errno)) : ""));
    if (hasWholeEnd(file)) m_zip.reset(unzOpen64(m_path.c_str()));
    if (!m_zip) fail("is no ZIP archive, or its end is missing");
}

void ZipReader::fail(const std::string& what) const {
    throw std::runtime_error("'" + m_path + "' " + what);
}

bool ZipReader::next() {
    const int found = m_hasBegun ? unzGoToNextFile(m_zip.get()) : unzGoToFirstFile(m_zip.get());
    m_hasBegun = true;
    unz_global_info64 archive{};
    unzGetGlobalInfo64(m_zip.get(), &archive);
    if (found == UNZ_END_OF_LIST_OF_FILE || archive.number_entry == 0) return false;
    unz_file_info64 info{};
    const auto ask = [&](char* name, uLong size) {
        return unzGetCurrentFileInfo64(m_zip.get(), &info, name, size, nullptr, 0, nullptr, 0) ==
               UNZ_OK;
    };
    if (found != UNZ_OK || !ask(nullptr, 0)) fail("is damaged: its directory ends early");
    m_name.assign(info.size_filename, '\0');
    if (!ask(m_name.data(), info.size_filename)) fail("is damaged: its directory ends early");
    if (info.flag & IsEncrypted) fail("is encrypted: '" + m_name + "'");
    if (info.compression_method != 0 && info.compression_method != Z_DEFLATED)
        fail("is packed by a method that is not known: '" + m_name + "'");
    m_size = info.uncompressed_size;
    const std::uint64_t most =
        info.compression_method == 0 ? info.compressed_size : MostInflation * info.compressed_size;
    if (m_size > most || info.compressed_size > fs::file_size(m_path))
        fail("is damaged: '" + m_name + "' cannot be as large as it says");
    m_unpacked += m_size;
    if (unpacksToTooMuch(fs::file_size(m_path), m_unpacked))
        fail("would fill the machine: unpacked it has more than " + std::to_string(LargestRatio) +
             " times its size");
    return true;
}

bool unpacksToTooMuch(std::uint64_t packed, std::uint64_t unpacked) {
    return unpacked > MuchUnpacked && unpacked / LargestRatio > packed;
}

std::string ZipReader::read() const {
    std::string bytes(m_size, '\0');
    if (unzOpenCurrentFile(m_zip.get()) != UNZ_OK) fail("is damaged: there is no '" + m_name + "'");
    for (std::uint64_t done = 0; done < m_size;) {
        const int more = unzReadCurrentFile(m_zip.get(), bytes.data() + done,
                                            unsigned(std::min(LargestPiece, m_size - done)));
        if (more <= 0) fail("is damaged: '" + m_name + "' in it cannot be unpacked");
        done += std::uint64_t(more);
    }
    if (unzCloseCurrentFile(m_zip.get()) != UNZ_OK)
        fail("is damaged: the checksum of '" + m_name + "' is wrong");
    return bytes;
}

void unpackZip(const fs::path& path, const fs::path& folder) {
    std::uint64_t unpacked = 0;
    for (ZipReader zip(path); zip.next();) {
        unpacked += zip.getSize();
        if (unpacked > MostUnpacked) zip.fail("has more than 4 GB");
    }
    for (ZipReader zip(path); zip.next();) {
        const fs::path place = folder / zip.getName();
        if (!staysWithin(zip.getName()))
            zip.fail("would write outside of its folder: '" + zip.getName() + "'");
        const bool isFolder = zip.getName().back() == '/';
        std::error_code error;
        fs::create_directories(isFolder ? place : place.parent_path(), error);
        if (error)
            zip.fail("cannot be unpacked: '" + zip.getName().substr(0, LongestZipName) +
                     "': " + error.message());
        if (isFolder) continue;
        const std::string bytes = zip.read();
        std::ofstream file(place, std::ios::binary);
        file << bytes;
        file.close();
        if (!file)
            throw std::runtime_error("cannot write '" + place.string() +
                                     "': " + std::strerror(errno));
    }
}

}  // namespace simflex
