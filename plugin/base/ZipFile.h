#pragma once
/** @file
ZIP archives (FMUs, NumPy's .npz) by minizip. Internal.

    ZipWriter zip("model.fmu");
    zip.add("modelDescription.xml", xml);
    zip.finish();

    for (ZipReader zip("crank.npz"); zip.next();) use(zip.getName(), zip.read());  **/

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include "simflex/base/UnfinishedFile.h"

namespace simflex {

enum class ZipMethod { Stored, Deflated };

/** Writes no file times: the same contents give the same bytes. **/
class ZipWriter {
public:
    /** @throws std::runtime_error if the file cannot be created. **/
    explicit ZipWriter(const std::filesystem::path& path);
    /** @param name  with '/' between folders **/
    void add(const std::string& name, std::string_view bytes,
             ZipMethod method = ZipMethod::Deflated);
    void addFile(const std::string& name, const std::filesystem::path& file);
    /** Without this call no file remains. **/
    void finish(Durability durability = Durability::PowerFailure);

private:
    UnfinishedFile m_file;
    std::string m_path;
    std::unique_ptr<void, int (*)(void*)> m_zip;
};

/** Reads the files of an archive one after another. All members throw std::runtime_error "'PATH'
CAUSE" if the file is no ZIP archive, damaged, encrypted, or packed at a suspiciously high
ratio. **/
class ZipReader {
public:
    explicit ZipReader(const std::filesystem::path& path);
    /** Moves to the first file, then to the next. @returns false after the last. **/
    bool next();
    const std::string& getName() const { return m_name; }
    /** Size of the current file in bytes. **/
    std::uint64_t getSize() const { return m_size; }
    /** Returns the contents of the current file. **/
    std::string read() const;
    [[noreturn]] void fail(const std::string& what) const;

private:
    std::string m_path, m_name;
    std::unique_ptr<void, int (*)(void*)> m_zip;
    std::uint64_t m_size = 0, m_unpacked = 0;  ///< of the current file; of all files so far
    bool m_hasBegun = false;
};

/** True if a file of `packed` bytes would fill the machine: of more than 256 MB if it is packed to
less than a hundredth, as no data of parts and libraries is. **/
bool unpacksToTooMuch(std::uint64_t packed, std::uint64_t unpacked);

/** Unpacks all into a folder that is there. @throws as ZipReader; also if the archive would write
elsewhere, or more than 4 GB. **/
void unpackZip(const std::filesystem::path& path, const std::filesystem::path& folder);

}  // namespace simflex
