#pragma once
/** @file
Interfaces of a part, as names and in a picture. **/

#include "simflex/part/ReducedBody.h"
#include "simflex/render/Image.h"

namespace simflex {
namespace cli {

inline const char* nameOf(TieType tie) {
    return tie == TieType::Rigid ? "rigid" : "distributing";
}

/** Draws the undeformed part, translucent; the tied nodes of each interface as dots of one colour,
with its name and the frame of its master point.
@throws std::runtime_error if there is no OpenGL or no font. **/
Image drawInterfaces(const ReducedBody& part);

}  // namespace cli
}  // namespace simflex
