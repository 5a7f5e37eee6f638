#pragma once
/** @file
A context of Mesa's off-screen library: software rendering without display or device. **/

#include <memory>

#include "GlContext.h"

namespace simflex {

/** @throws std::runtime_error if libOSMesa is not installed or has no OpenGL 3.3 core. **/
std::unique_ptr<GlContext> createOsMesaContext();

}  // namespace simflex
