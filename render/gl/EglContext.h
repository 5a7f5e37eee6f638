#pragma once
/** @file
An EGL context without a surface: on Mesa's surfaceless platform, in software or on a graphics card,
or else on the first device with OpenGL. **/

#include <memory>

#include "GlContext.h"

namespace simflex {

/** @throws std::runtime_error if libEGL is not installed or none of its platforms provides OpenGL
3.3 core without a window. **/
std::unique_ptr<GlContext> createEglContext();

}  // namespace simflex
