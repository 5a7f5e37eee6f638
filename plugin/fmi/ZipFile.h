#pragma once
/** @file
Archives of type ZIP (PKWARE's APPNOTE 6.3, without ZIP64 and encryption), as FMUs are. Internal.

    ZipWriter zip("model.fmu");
    zip.add("modelDescription.xml", xml);
    zip.finish();

    unpackZip("model.fmu", folder);  **/

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "simflex/base/UnfinishedFile.h"

namespace simflex {

/** Without times of files: the same contents give the same bytes. **/
class ZipWriter {
public:
    /** @throws std::runtime_error if there can be no such file. **/
    explicit ZipWriter(const std::filesystem::path& path);
    /** @param name  with '/' between folders **/
    void add(const std::string& name, std::string_view bytes);
    void addFile(const std::string& name, const std::filesystem::path& file);
    /** Without this nothing is left. **/
    void finish();

private:
    UnfinishedFile m_file;
    std::string m_path;
    std::ofstream m_stream;
    std::uint64_t m_size = 0;
    std::string m_directory;
    int m_numEntries = 0;
};

/** Unpacks all into a folder that is there.
@throws std::runtime_error "'PATH' CAUSE" if it is no such archive or damaged, or would write
elsewhere. **/
void unpackZip(const std::filesystem::path& path, const std::filesystem::path& folder);

}  // namespace simflex
