#include "OsMesaContext.h"

#include <dlfcn.h>

#include <array>
#include <cstddef>
#include <stdexcept>
#include <string>

namespace simflex {

namespace {

// OSMesa's C interface, as in GL/osmesa.h; that header drags in the legacy gl.h.
using ContextHandle = void*;
using CreateContextAttribs = ContextHandle (*)(const int* attributes, ContextHandle share);
using DestroyContext = void (*)(ContextHandle);
using MakeCurrent = unsigned char (*)(ContextHandle, void* buffer, unsigned type, int width,
                                      int height);
using GetProcAddress = GlFunctions::ProcAddress (*)(const char*);

constexpr int formatAttribute = 0x22, rgbaFormat = 0x1908;
constexpr int depthBits = 0x30, stencilBits = 0x31, accumulationBits = 0x32;
constexpr int profileAttribute = 0x33, coreProfile = 0x34;
constexpr int majorVersion = 0x36, minorVersion = 0x37;

struct Library {
    CreateContextAttribs createContextAttribs = nullptr;
    DestroyContext destroyContext = nullptr;
    MakeCurrent makeCurrent = nullptr;
    GetProcAddress getProcAddress = nullptr;
};

template <class Function>
void loadSymbol(void* library, const char* name, Function& function) {
    function = reinterpret_cast<Function>(dlsym(library, name));
    if (!function) throw std::runtime_error(std::string("libOSMesa has no function ") + name);
}

// Stays open for the life of the process: its worker threads outlive a context.
const Library& getLibrary() {
    static const Library library = [] {
        void* handle = nullptr;
        for (const char* name : {"libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so"})
            if ((handle = dlopen(name, RTLD_NOW | RTLD_LOCAL))) break;
        if (!handle)
            throw std::runtime_error(
                "libOSMesa.so.8 is not on this machine (Debian package libosmesa6)");
        Library result;
        loadSymbol(handle, "OSMesaCreateContextAttribs", result.createContextAttribs);
        loadSymbol(handle, "OSMesaDestroyContext", result.destroyContext);
        loadSymbol(handle, "OSMesaMakeCurrent", result.makeCurrent);
        loadSymbol(handle, "OSMesaGetProcAddress", result.getProcAddress);
        return result;
    }();
    return library;
}

class OsMesaContext : public GlContext {
public:
    OsMesaContext() : library(getLibrary()) {
        const int attributes[] = {formatAttribute,
                                  rgbaFormat,
                                  depthBits,
                                  24,
                                  stencilBits,
                                  0,
                                  accumulationBits,
                                  0,
                                  profileAttribute,
                                  coreProfile,
                                  majorVersion,
                                  3,
                                  minorVersion,
                                  3,
                                  0};
        handle = library.createContextAttribs(attributes, nullptr);
        if (!handle) throw std::runtime_error("libOSMesa gives no OpenGL 3.3 core context");
    }

    ~OsMesaContext() override { library.destroyContext(handle); }

    void makeCurrent() override {
        // A picture is drawn to a framebuffer object; the context's own buffer is only a formality.
        if (!library.makeCurrent(handle, buffer.data(), 0x1401, bufferSize, bufferSize))
            throw std::runtime_error("libOSMesa cannot make its context current");
    }

    GlFunctions::ProcAddress getProcAddress(const char* name) override {
        return library.getProcAddress(name);
    }

    std::string getName() const override { return "OSMesa"; }

private:
    static constexpr int bufferSize = 16;
    const Library& library;
    ContextHandle handle = nullptr;
    std::array<unsigned char, 4 * bufferSize * bufferSize> buffer{};
};

}  // namespace

std::unique_ptr<GlContext> createOsMesaContext() {
    return std::make_unique<OsMesaContext>();
}

}  // namespace simflex
