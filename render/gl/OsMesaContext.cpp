#include "OsMesaContext.h"

#include <array>
#include <stdexcept>
#include <string>

#include "GlLibrary.h"

namespace simflex {

namespace {

// OSMesa's C interface, as in GL/osmesa.h, which includes the legacy gl.h.
using ContextHandle = void*;
using CreateContextAttribs = ContextHandle (*)(const int* attributes, ContextHandle share);
using DestroyContext = void (*)(ContextHandle);
using MakeCurrent = unsigned char (*)(ContextHandle, void* buffer, unsigned type, int width,
                                      int height);
using GetProcAddress = GlFunctions::ProcAddress (*)(const char*);

constexpr int formatAttribute = 0x22, rgbaFormat = 0x1908;
constexpr int depthBits = 0x30, stencilBits = 0x31, accumulationBits = 0x32;
constexpr int profileAttribute = 0x33, coreProfile = 0x34;
constexpr int majorAttribute = 0x36, minorAttribute = 0x37;

struct OsMesaLibrary {
    CreateContextAttribs createContextAttribs = nullptr;
    DestroyContext destroyContext = nullptr;
    MakeCurrent makeCurrent = nullptr;
    GetProcAddress getProcAddress = nullptr;
};

const OsMesaLibrary& getOsMesa() {
    static const OsMesaLibrary library = [] {
        const GlLibrary file("SIMFLEX_OSMESA_LIBRARY",
                             {"libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so"}, "libosmesa6");
        OsMesaLibrary result;
        file.load("OSMesaCreateContextAttribs", result.createContextAttribs);
        file.load("OSMesaDestroyContext", result.destroyContext);
        file.load("OSMesaMakeCurrent", result.makeCurrent);
        file.load("OSMesaGetProcAddress", result.getProcAddress);
        return result;
    }();
    return library;
}

class OsMesaContext : public GlContext {
public:
    OsMesaContext() : library(getOsMesa()) {
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
                                  majorAttribute,
                                  3,
                                  minorAttribute,
                                  3,
                                  0};
        handle = library.createContextAttribs(attributes, nullptr);
        if (!handle) throw std::runtime_error("libOSMesa gives no OpenGL 3.3 core context");
    }

    ~OsMesaContext() override { library.destroyContext(handle); }

    void makeCurrent() override {
        // Pictures are drawn to a framebuffer object; the context's own buffer is only required by
        // the API.
        if (!library.makeCurrent(handle, buffer.data(), 0x1401, bufferSize, bufferSize))
            throw std::runtime_error("libOSMesa cannot make its context current");
    }

    void release() override { library.makeCurrent(nullptr, nullptr, 0, 0, 0); }

    GlFunctions::ProcAddress getProcAddress(const char* name) override {
        return library.getProcAddress(name);
    }

    std::string getName() const override { return "OSMesa"; }

private:
    static constexpr int bufferSize = 16;
    const OsMesaLibrary& library;
    ContextHandle handle = nullptr;
    std::array<unsigned char, 4 * bufferSize * bufferSize> buffer{};
};

}  // namespace

std::unique_ptr<GlContext> createOsMesaContext() {
    return std::make_unique<OsMesaContext>();
}

}  // namespace simflex
