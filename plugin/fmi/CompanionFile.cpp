#include "simflex/fmi/CompanionFile.h"

#include <dlfcn.h>

#include <stdexcept>

namespace simflex {

namespace fs = std::filesystem;

fs::path findCompanion(const std::string& name) {
    Dl_info info{};
    if (!dladdr(reinterpret_cast<const void*>(&findCompanion), &info) || !info.dli_fname)
        throw std::runtime_error("it is not known where simflex's libraries are");
    fs::path folder = fs::absolute(info.dli_fname).parent_path();
    if (folder.parent_path().filename() == "glibc-hwcaps")
        folder = folder.parent_path().parent_path();
    for (const fs::path& path : {folder / "simflex" / name, folder / name})
        if (fs::exists(path)) return path;
    throw std::runtime_error("there is no '" + (folder / name).string() +
                             "': simflex is not installed completely");
}

}  // namespace simflex
