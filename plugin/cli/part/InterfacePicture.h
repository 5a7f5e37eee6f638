#pragma once
/** @file
What a part's interfaces tie, by name and in a picture. **/

#include "simflex/part/ReducedBody.h"
#include "simflex/render/Image.h"

namespace simflex {
namespace cli {

inline const char* nameOf(TieType tie) {
    return tie == TieType::Rigid ? "rigid" : "distributing";
}

/** The undeformed part, translucent; the tied nodes of each interface as dots of one colour, its
name and the frame of its master point.
@throws std::runtime_error when there is no OpenGL or no font. **/
Image drawInterfaces(const ReducedBody& part);

}  // namespace cli
}  // namespace simflex
