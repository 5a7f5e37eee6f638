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

    /** Address of an OpenGL function, or null. **/
    virtual GlFunctions::ProcAddress getProcAddress(const char* name) = 0;

    /** "OSMesa" or another implementation's name, for messages. **/
    virtual std::string getName() const = 0;

    /** The first implementation that works on this machine; the environment variable SIMFLEX_GL
    ("osmesa") asks for one by name.
    @throws std::runtime_error with the reason of each implementation that failed. **/
    static std::unique_ptr<GlContext> create();
};

}  // namespace simflex
