#pragma once
/** @file
Archives of type ZIP, by minizip: FMUs and NumPy's .npz are such. Internal.

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

/** Without times of files: the same contents give the same bytes. **/
class ZipWriter {
public:
    /** @throws std::runtime_error if there can be no such file. **/
    explicit ZipWriter(const std::filesystem::path& path);
    /** @param name  with '/' between folders **/
    void add(const std::string& name, std::string_view bytes,
             ZipMethod method = ZipMethod::Deflated);
    void addFile(const std::string& name, const std::filesystem::path& file);
    /** Without this nothing is left. **/
    void finish(Durability durability = Durability::PowerFailure);

private:
    UnfinishedFile m_file;
    std::string m_path;
    std::unique_ptr<void, int (*)(void*)> m_zip;
};

/** The files of an archive, one after another. Everything here throws std::runtime_error
"'PATH' CAUSE" if it is no such archive, damaged or encrypted, or much that was packed
suspiciously small. **/
class ZipReader {
public:
    explicit ZipReader(const std::filesystem::path& path);
    /** Goes to the first file, then to the next. @returns false if there is none. **/
    bool next();
    const std::string& getName() const { return m_name; }
    /** Number of its bytes. **/
    std::uint64_t getSize() const { return m_size; }
    /** The bytes of this file. **/
    std::string read() const;
    [[noreturn]] void fail(const std::string& what) const;

private:
    std::string m_path, m_name;
    std::unique_ptr<void, int (*)(void*)> m_zip;
    std::uint64_t m_size = 0, m_unpacked = 0;  ///< of this file; of all up to it
    bool m_hasBegun = false;
};

/** True if a file of `packed` bytes would fill the machine: of more than 256 MB if it is packed to
less than a hundredth, as no data of parts and libraries is. **/
bool unpacksToTooMuch(std::uint64_t packed, std::uint64_t unpacked);

/** Unpacks all into a folder that is there. @throws as ZipReader; also if the archive would write
elsewhere, or more than 4 GB. **/
void unpackZip(const std::filesystem::path& path, const std::filesystem::path& folder);

}  // namespace simflex
