#pragma once
/** @file
An OpenGL 3.3 core context without a window. Internal to the renderer.

The library is loaded for the first picture, so that programs that draw nothing run on machines
without it. **/

#include <memory>
#include <string>

#include "GlFunctions.h"

namespace simflex {

class GlContext {
public:
    virtual ~GlContext() = default;

    /** Makes this context the calling thread's current one. **/
    virtual void makeCurrent() = 0;

    /** Clears the calling thread's current context, so that another thread, or another library on
    this thread, can make its own current. **/
    virtual void release() = 0;

    /** Returns the address of an OpenGL function, or null. **/
    virtual GlFunctions::ProcAddress getProcAddress(const char* name) = 0;

    /** "OSMesa" or "EGL". **/
    virtual std::string getName() const = 0;

    /** Creates a context by the first implementation that works on this machine: OSMesa, then EGL.
    Both have the same speed in software. OSMesa always uses software, so pictures do not depend on
    the machine; EGL uses a graphics card if there is one. The environment variable SIMFLEX_GL
    ("osmesa", "egl") selects an implementation; SIMFLEX_OSMESA_LIBRARY and SIMFLEX_EGL_LIBRARY
    override the libraries' file names.
    @throws std::runtime_error with the reason for each implementation that failed. **/
    static std::unique_ptr<GlContext> create();
};

/** Makes a context current during its lifetime. **/
class GlContextUse {
public:
    explicit GlContextUse(GlContext& used) : context(used) { context.makeCurrent(); }
    ~GlContextUse() { context.release(); }
    GlContextUse(const GlContextUse&) = delete;
    GlContextUse& operator=(const GlContextUse&) = delete;

private:
    GlContext& context;
};

}  // namespace simflex
