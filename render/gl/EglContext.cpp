#include "EglContext.h"

#include <cstdio>
#include <stdexcept>
#include <string>
#include <vector>

#include "GlLibrary.h"

namespace simflex {

namespace {

// EGL's C interface, as in EGL/egl.h and eglext.h, whose headers include those of a window system.
using Display = void*;
using Device = void*;
using Config = void*;
using ContextHandle = void*;
using Int = int;
using Boolean = unsigned;

constexpr Int none = 0x3038, extensions = 0x3055;
constexpr Int openGlApi = 0x30A2, openGlBit = 0x0008;
constexpr Int surfaceType = 0x3033, renderableType = 0x3040;
constexpr Int majorVersion = 0x3098, minorVersion = 0x30FB;
constexpr Int profileMask = 0x30FD, coreProfileBit = 0x0001;
constexpr Int surfacelessPlatform = 0x31DD, devicePlatform = 0x313F;

struct Library {
    Int (*getError)() = nullptr;
    Boolean (*initialize)(Display, Int* major, Int* minor) = nullptr;
    const char* (*queryString)(Display, Int name) = nullptr;
    Boolean (*bindApi)(unsigned api) = nullptr;
    Boolean (*chooseConfig)(Display, const Int* attributes, Config*, Int size, Int* num) = nullptr;
    ContextHandle (*createContext)(Display, Config, ContextHandle share,
                                   const Int* attributes) = nullptr;
    Boolean (*destroyContext)(Display, ContextHandle) = nullptr;
    Boolean (*makeCurrent)(Display, void* draw, void* read, ContextHandle) = nullptr;
    GlFunctions::ProcAddress (*getProcAddress)(const char* name) = nullptr;
    Display display = nullptr;
};

bool hasExtension(const char* list, const std::string& name) {
    const std::string words = std::string(" ") + (list ? list : "") + " ";
    return words.find(" " + name + " ") != std::string::npos;
}

std::string describeError(const Library& egl) {
    char text[32];
    std::snprintf(text, sizeof text, "EGL error 0x%04X", unsigned(egl.getError()));
    return text;
}

// Returns an initialized display for drawing without a surface, or null.
Display openDisplay(const Library& egl, Int platform, void* native, std::string& reason) {
    Display (*getPlatformDisplay)(Int platform, void* native, const Int* attributes) = nullptr;
    getPlatformDisplay = reinterpret_cast<decltype(getPlatformDisplay)>(
        egl.getProcAddress("eglGetPlatformDisplayEXT"));
    if (!getPlatformDisplay) {
        reason = "libEGL has no eglGetPlatformDisplayEXT";
        return nullptr;
    }
    const Display display = getPlatformDisplay(platform, native, nullptr);
    Int major = 0, minor = 0;
    if (!display || !egl.initialize(display, &major, &minor)) {
        reason = describeError(egl);
        return nullptr;
    }
    if (!hasExtension(egl.queryString(display, extensions), "EGL_KHR_surfaceless_context")) {
        reason = "no EGL_KHR_surfaceless_context";
        return nullptr;
    }
    return display;
}

Display openSurfacelessOrDevice(const Library& egl) {
    const char* client = egl.queryString(nullptr, extensions);
    std::string reason, all;
    if (hasExtension(client, "EGL_MESA_platform_surfaceless")) {
        if (Display display = openDisplay(egl, surfacelessPlatform, nullptr, reason))
            return display;
        all += "; surfaceless platform: " + reason;
    }
    Boolean (*queryDevices)(Int size, Device * devices, Int * num) = nullptr;
    queryDevices =
        reinterpret_cast<decltype(queryDevices)>(egl.getProcAddress("eglQueryDevicesEXT"));
    if (hasExtension(client, "EGL_EXT_platform_device") && queryDevices) {
        Int num = 0;
        std::vector<Device> devices(32);
        if (!queryDevices(Int(devices.size()), devices.data(), &num)) num = 0;
        for (int i = 0; i < num; ++i) {
            if (Display display = openDisplay(egl, devicePlatform, devices[i], reason))
                return display;
            all += "; device " + std::to_string(i) + ": " + reason;
        }
    }
    if (all.empty()) all = "; it has neither the surfaceless nor the device platform";
    throw std::runtime_error("libEGL gives no display without a window" + all +
                             " (Debian packages libegl-mesa0 and libgl1-mesa-dri)");
}

const Library& getLibrary() {
    static const Library library = [] {
        const GlLibrary file("SIMFLEX_EGL_LIBRARY", {"libEGL.so.1", "libEGL.so"}, "libegl1");
        Library egl;
        file.load("eglGetError", egl.getError);
        file.load("eglInitialize", egl.initialize);
        file.load("eglQueryString", egl.queryString);
        file.load("eglBindAPI", egl.bindApi);
        file.load("eglChooseConfig", egl.chooseConfig);
        file.load("eglCreateContext", egl.createContext);
        file.load("eglDestroyContext", egl.destroyContext);
        file.load("eglMakeCurrent", egl.makeCurrent);
        file.load("eglGetProcAddress", egl.getProcAddress);
        egl.display = openSurfacelessOrDevice(egl);
        return egl;
    }();
    return library;
}

class EglContext : public GlContext {
public:
    EglContext() : egl(getLibrary()) {
        egl.bindApi(openGlApi);
        const Int wanted[] = {surfaceType, 0, renderableType, openGlBit, none};
        Config config = nullptr;
        Int num = 0;
        if (!egl.chooseConfig(egl.display, wanted, &config, 1, &num) || num < 1)
            throw std::runtime_error("libEGL has no configuration for OpenGL, " +
                                     describeError(egl));
        const Int attributes[] = {majorVersion,   3,   minorVersion, 3, profileMask,
                                  coreProfileBit, none};
        handle = egl.createContext(egl.display, config, nullptr, attributes);
        if (!handle)
            throw std::runtime_error("libEGL gives no OpenGL 3.3 core context, " +
                                     describeError(egl));
    }

    ~EglContext() override { egl.destroyContext(egl.display, handle); }

    void makeCurrent() override {
        egl.bindApi(openGlApi);
        if (!egl.makeCurrent(egl.display, nullptr, nullptr, handle))
            throw std::runtime_error("libEGL cannot make its context current, " +
                                     describeError(egl));
    }

    void release() override {
        egl.bindApi(openGlApi);
        egl.makeCurrent(egl.display, nullptr, nullptr, nullptr);
    }

    GlFunctions::ProcAddress getProcAddress(const char* name) override {
        return egl.getProcAddress(name);
    }

    std::string getName() const override { return "EGL"; }

private:
    const Library& egl;
    ContextHandle handle = nullptr;
};

}  // namespace

std::unique_ptr<GlContext> createEglContext() {
    return std::make_unique<EglContext>();
}

}  // namespace simflex
