#include "simflex/fmu/LibraryCopy.h"

#include <dlfcn.h>
#include <link.h>

#include <filesystem>
#include <map>
#include <set>
#include <stdexcept>

#include "simflex/fmi/CompanionFile.h"

namespace simflex {
namespace fmu {

namespace fs = std::filesystem;

namespace {

const char* const LibraryName = "libsimflex_fmu.so";
const char* const Levels = "glibc-hwcaps";

/** Libraries that every system has and that a process may contain only once. **/
bool isOfSystem(const std::string& name) {
    for (const char* stem : {"ld-linux", "libc.so", "libm.so", "libdl.so", "libpthread.so",
                             "librt.so", "libresolv.so", "libstdc++.so", "libgcc_s.so"})
        if (name.compare(0, std::string(stem).size(), stem) == 0) return true;
    return false;
}

/** Returns strings of a loaded library's dynamic section. **/
std::vector<std::string> listDynamic(const link_map& library, ElfW(Sxword) tag) {
    const char* strings = nullptr;
    for (const ElfW(Dyn)* entry = library.l_ld; entry->d_tag != DT_NULL; ++entry)
        if (entry->d_tag == DT_STRTAB)
            strings = reinterpret_cast<const char*>(entry->d_un.d_ptr < library.l_addr
                                                        ? entry->d_un.d_ptr + library.l_addr
                                                        : entry->d_un.d_ptr);
    std::vector<std::string> texts;
    for (const ElfW(Dyn)* entry = library.l_ld; strings && entry->d_tag != DT_NULL; ++entry)
        if (entry->d_tag == tag) texts.push_back(strings + entry->d_un.d_val);
    return texts;
}

}  // namespace

std::vector<LibraryFile> findLibraries(const std::string& library, const std::string& identifier,
                                       bool isThin) {
    const fs::path path = library.empty() ? findCompanion(LibraryName) : fs::path(library);
    if (!fs::exists(path)) throw std::runtime_error("there is no '" + path.string() + "'");
    std::vector<LibraryFile> files{{identifier + ".so", path.string()}};
    if (isThin) return files;
    void* const handle = dlopen(path.c_str(), RTLD_LAZY | RTLD_LOCAL);
    link_map* loaded = nullptr;
    if (!handle || dlinfo(handle, RTLD_DI_LINKMAP, &loaded) != 0)
        throw std::runtime_error("cannot load '" + path.string() + "': " + dlerror());
    std::map<std::string, const link_map*> known;
    const link_map* first = loaded;
    while (first->l_prev) first = first->l_prev;
    for (const link_map* other = first; other; other = other->l_next)
        for (const std::string& name : listDynamic(*other, DT_SONAME)) known.emplace(name, other);
    std::set<std::string> seen;
    std::vector<const link_map*> open{loaded};
    for (size_t i = 0; i < open.size(); ++i)
        for (const std::string& name : listDynamic(*open[i], DT_NEEDED)) {
            if (isOfSystem(name) || !seen.insert(name).second) continue;
            const auto found = known.find(name);
            if (found == known.end())
                throw std::runtime_error("library '" + name + "' is not found");
            open.push_back(found->second);
            const fs::path own = path.parent_path() / name;
            if (!fs::exists(own)) {
                files.push_back({name, fs::canonical(found->second->l_name).string()});
                continue;
            }
            // Libraries of simflex, for all processor levels.
            files.push_back({name, fs::canonical(own).string()});
            if (!fs::is_directory(path.parent_path() / Levels)) continue;
            for (const fs::directory_entry& level :
                 fs::directory_iterator(path.parent_path() / Levels))
                if (fs::exists(level.path() / name))
                    files.push_back(
                        {std::string(Levels) + '/' + level.path().filename().string() + '/' + name,
                         fs::canonical(level.path() / name).string()});
        }
    return files;
}

}  // namespace fmu
}  // namespace simflex
