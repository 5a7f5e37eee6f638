#pragma once
/** @file
What the fuzz targets share: a folder for the files they read, and what a reader may throw.

A target is LLVMFuzzerTestOneInput in a file of its own. The preset `fuzz` links libFuzzer to it;
elsewhere FuzzDriver.cpp runs it over its corpus and a few thousand mutations of it. **/

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

/** A folder that lives as long as the program, in memory where there is /dev/shm. **/
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

/** The files of one input, which lines of "====" divide. **/
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

/** Ends the program: the reader is wrong. **/
[[noreturn]] inline void fail(const std::string& what) {
    std::fprintf(stderr, "fuzz: %s\n", what.c_str());
    std::abort();
}

/** What a refusal must name. **/
enum class Names { AFile, Anything };

/** Runs a reader. It may refuse, with a message that names one of its files; all else that it
throws ends the program. @returns whether it accepted. **/
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
