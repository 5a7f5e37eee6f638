#include "GlLibrary.h"

#include <dlfcn.h>

#include <cstdlib>
#include <stdexcept>

namespace simflex {

GlLibrary::GlLibrary(const char* environmentVariable, const std::vector<const char*>& names,
                     const char* package) {
    std::vector<const char*> candidates = names;
    if (const char* wanted = std::getenv(environmentVariable)) candidates = {wanted};
    std::string reason;
    for (const char* candidate : candidates) {
        name = candidate;
        if ((handle = dlopen(candidate, RTLD_NOW | RTLD_LOCAL))) return;
        if (reason.empty()) reason = dlerror();
    }
    throw std::runtime_error(reason + " (Debian package " + package + ")");
}

void* GlLibrary::find(const char* symbol) const {
    void* address = dlsym(handle, symbol);
    if (!address) throw std::runtime_error(name + " has no function " + symbol);
    return address;
}

}  // namespace simflex
