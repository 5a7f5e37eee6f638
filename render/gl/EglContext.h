#pragma once
/** @file
A context of EGL without a surface: Mesa's surfaceless platform, in software or on a graphics card,
or else the first device that has OpenGL. **/

#include <memory>

#include "GlContext.h"

namespace simflex {

/** @throws std::runtime_error when libEGL is not on the machine or no platform of it has OpenGL 3.3
core without a window. **/
std::unique_ptr<GlContext> createEglContext();

}  // namespace simflex
