#pragma once
/** @file Where a part's interface is. **/

#include <Simbody.h>

#include "simflex/part/ReducedBody.h"

namespace simflex::examples {

/** In the part's frame [m]. **/
inline SimTK::Vec3 positionOf(const ReducedBody& part, const std::string& interface) {
    const auto& s = part.getInterface(interface).position;
    return {s[0], s[1], s[2]};
}

}  // namespace simflex::examples
