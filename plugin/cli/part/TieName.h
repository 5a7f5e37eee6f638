#pragma once
/** @file How a tie is called. **/

#include "simflex/part/ReducedBody.h"

namespace simflex::cli {

inline const char* nameOf(TieType tie) {
    return tie == TieType::Rigid ? "rigid" : "distributing";
}

}  // namespace simflex::cli
