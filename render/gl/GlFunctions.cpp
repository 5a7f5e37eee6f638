#include "GlFunctions.h"

#include <stdexcept>
#include <string>

namespace simflex {

namespace {

template <class Function>
void loadOne(Function& function, const char* name,
             const std::function<GlFunctions::ProcAddress(const char*)>& getProcAddress) {
    function = reinterpret_cast<Function>(getProcAddress(name));
    if (!function)
        throw std::runtime_error(std::string("the OpenGL context has no function ") + name);
}

}  // namespace

void GlFunctions::load(const std::function<ProcAddress(const char*)>& getProcAddress) {
#define SIMFLEX_GL_LOAD(name, NAME) loadOne(name, "gl" #name, getProcAddress);
    SIMFLEX_GL_FUNCTIONS(SIMFLEX_GL_LOAD)
#undef SIMFLEX_GL_LOAD
    GLint version[2] = {0, 0};
    GetIntegerv(GL_MAJOR_VERSION, &version[0]);
    GetIntegerv(GL_MINOR_VERSION, &version[1]);
    if (10 * version[0] + version[1] < 43) return;
#define SIMFLEX_GL_LOAD(name, NAME) loadOne(name, "gl" #name, getProcAddress);
    SIMFLEX_GL_LATER_FUNCTIONS(SIMFLEX_GL_LOAD)
#undef SIMFLEX_GL_LOAD
}

}  // namespace simflex
