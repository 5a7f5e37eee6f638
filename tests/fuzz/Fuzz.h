#pragma once
/** @file
Support for fuzz targets: a folder for their input files, and permitted exceptions of a reader.

A target is LLVMFuzzerTestOneInput in a separate file. The preset `fuzz` links libFuzzer to it;
otherwise FuzzDriver.cpp runs it over its corpus and a few thousand mutations. **/

#include <unistd.h>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace simflex {
namespace fuzz {

/** A folder for the lifetime of the program, in memory if /dev/shm exists. **/
class Folder {
public:
    Folder() {
        const bool hasMemory = std::filesystem::is_directory("/dev/shm");
        std::string pattern =
            (hasMemory ? "/dev/shm" : std::filesystem::temp_directory_path().string()) +
            std::string("/simflex-fuzz-XXXXXX");
        if (!mkdtemp(pattern.data())) std::abort();
        _path = pattern;
    }
    ~Folder() {
        std::error_code ignored;
        std::filesystem::remove_all(_path, ignored);
    }

    const std::string& path() const { return _path; }
    std::string operator/(const std::string& name) const { return _path + "/" + name; }

    std::string write(const std::string& name, const std::string& text) const {
        std::ofstream(_path + "/" + name, std::ios::binary) << text;
        return _path + "/" + name;
    }

private:
    std::string _path;
};

inline const Folder& getFolder() {
    static const Folder folder;
    return folder;
}

/** Splits one input into files at lines of "====". **/
inline std::vector<std::string> splitFiles(const uint8_t* data, size_t size, size_t count) {
    const std::string text(reinterpret_cast<const char*>(data), size), mark = "====\n";
    std::vector<std::string> files;
    size_t at = 0;
    while (files.size() + 1 < count) {
        const size_t end = text.find(mark, at);
        if (end == std::string::npos) break;
        files.push_back(text.substr(at, end - at));
        at = end + mark.size();
    }
    files.push_back(text.substr(at));
    files.resize(count);
    return files;
}

/** Ends the program because of an error in the reader. **/
[[noreturn]] inline void fail(const std::string& what) {
    std::fprintf(stderr, "fuzz: %s\n", what.c_str());
    std::abort();
}

/** Required content of a refusal's message. **/
enum class Names { AFile, Anything };

/** Runs a reader. It may refuse with a message that names one of its files; any other exception
ends the program. @returns whether it accepted. **/
template <class Read>
bool accepts(Read read, Names names = Names::AFile) {
    std::string message;
    try {
        read();
        return true;
    } catch (const std::invalid_argument& error) {
        message = error.what();
    } catch (const std::runtime_error& error) {
        message = error.what();
    }
    if (names == Names::AFile && message.find(getFolder().path()) == std::string::npos)
        fail("a message without a file: " + message);
    return false;
}

}  // namespace fuzz
}  // namespace simflex

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size);
