#include "GlContext.h"

#include <cstdlib>
#include <exception>
#include <stdexcept>

#include "OsMesaContext.h"

namespace simflex {

namespace {

struct Implementation {
    const char* name;
    std::unique_ptr<GlContext> (*create)();
};

// In order of preference.
constexpr Implementation implementations[] = {{"osmesa", createOsMesaContext}};

}  // namespace

std::unique_ptr<GlContext> GlContext::create() {
    const char* wanted = std::getenv("SIMFLEX_GL");
    std::string reasons;
    for (const Implementation& implementation : implementations) {
        if (wanted && std::string(wanted) != implementation.name) continue;
        try {
            return implementation.create();
        } catch (const std::exception& e) {
            reasons += std::string("; ") + implementation.name + ": " + e.what();
        }
    }
    if (reasons.empty()) {
        reasons = std::string("; SIMFLEX_GL asks for '") + wanted + "', but there is only";
        for (const Implementation& implementation : implementations)
            reasons += std::string(" ") + implementation.name;
    }
    throw std::runtime_error("cannot create an off-screen OpenGL context" + reasons);
}

}  // namespace simflex
