#include "simflex/base/InputFile.h"

#include <linux/magic.h>
#include <sys/stat.h>
#include <sys/vfs.h>

#include <cerrno>
#include <cstring>
#include <iterator>
#include <stdexcept>

namespace simflex {

bool isInputFile(const std::filesystem::path& path) {
    struct stat file {};
    struct statfs system {};
    if (stat(path.c_str(), &file) != 0 || !S_ISREG(file.st_mode) ||
        statfs(path.c_str(), &system) != 0)
        return false;
    for (const long kernelState : {PROC_SUPER_MAGIC, SYSFS_MAGIC, DEBUGFS_MAGIC, TRACEFS_MAGIC})
        if (system.f_type == kernelState) return false;
    return true;
}

std::ifstream openInputFile(const std::filesystem::path& path) {
    std::ifstream file;
    if (isInputFile(path)) file.open(path, std::ios::binary);
    return file;
}

std::string readInputFile(const std::filesystem::path& path) {
    errno = 0;
    std::ifstream file = openInputFile(path);
    if (!file.is_open())
        throw std::runtime_error("cannot read '" + path.string() + "': " +
                                 (errno ? std::strerror(errno) : "it is no file on a disk"));
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

}  // namespace simflex
