#include "GlContext.h"

#include <algorithm>
#include <cstdlib>
#include <exception>
#include <stdexcept>

#include "EglContext.h"
#include "OsMesaContext.h"
#include "simflex/base/AsciiText.h"

namespace simflex {

namespace {

struct Implementation {
    const char* name;
    std::unique_ptr<GlContext> (*create)();
};

// In order of preference.
constexpr Implementation implementations[] = {{"osmesa", createOsMesaContext},
                                              {"egl", createEglContext}};

}  // namespace

std::unique_ptr<GlContext> GlContext::create() {
    const char* const chosen = std::getenv("SIMFLEX_GL");
    const std::string wanted = lowerCase(chosen ? chosen : "");
    std::string reasons, names;
    for (const Implementation& implementation : implementations) {
        names += std::string(names.empty() ? "'" : " or '") + implementation.name + "'";
        if (!wanted.empty() && wanted != implementation.name) continue;
        try {
            return implementation.create();
        } catch (const std::exception& e) {
            reasons += std::string("; ") + implementation.name + ": " + e.what();
        }
    }
    if (reasons.empty())
        reasons = std::string("; the environment variable SIMFLEX_GL asks for '") + chosen +
                  "', allowed is " + names;
    throw std::runtime_error("cannot create an off-screen OpenGL context" + reasons);
}

}  // namespace simflex
