#pragma once
/** @file
The context of Mesa's off-screen library: software rendering, no display, no device. **/

#include <memory>

#include "GlContext.h"

namespace simflex {

/** @throws std::runtime_error when libOSMesa is not on the machine or has no OpenGL 3.3 core. **/
std::unique_ptr<GlContext> createOsMesaContext();

}  // namespace simflex
