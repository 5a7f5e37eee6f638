#pragma once
/** @file
An OpenGL 3.3 core context without a window. Internal to the renderer.

The library that makes the context is opened when the first picture is wanted, so that a program
which draws nothing runs on a machine without it. **/

#include <memory>
#include <string>

#include "GlFunctions.h"

namespace simflex {

class GlContext {
public:
    virtual ~GlContext() = default;

    /** Makes this context the calling thread's current one. **/
    virtual void makeCurrent() = 0;

    /** Leaves the calling thread without a current context, so that another thread, or another
    library on this one, can make its own current. **/
    virtual void release() = 0;

    /** Address of an OpenGL function, or null. **/
    virtual GlFunctions::ProcAddress getProcAddress(const char* name) = 0;

    /** "OSMesa" or "EGL". **/
    virtual std::string getName() const = 0;

    /** The first implementation that works on this machine: OSMesa, then EGL. Both draw at the same
    speed in software; OSMesa always does, so that pictures do not depend on the machine, while EGL
    takes a graphics card where it finds one. The environment variable SIMFLEX_GL ("osmesa", "egl")
    asks for one by name; SIMFLEX_OSMESA_LIBRARY and SIMFLEX_EGL_LIBRARY name other files of the
    libraries.
    @throws std::runtime_error with the reason of each implementation that failed. **/
    static std::unique_ptr<GlContext> create();
};

/** Makes a context current while it lives. **/
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
