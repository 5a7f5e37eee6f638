#pragma once
/** @file
Checks that force elements make of their parameters (private header). **/

#include <cmath>
#include <stdexcept>
#include <string>

#include "Simbody.h"

namespace simflex {

/** @throws std::invalid_argument "TwoPointSpringDamper between A and B: stiffness is -1, must be ≥
 * 0". **/
inline void checkNotNegative(const std::string& element, const char* name, SimTK::Real value) {
    if (std::isfinite(value) && value >= 0) return;
    throw std::invalid_argument(element + ": " + name + " is " + std::to_string(value) +
                                "; it must be a number, zero or positive");
}

inline void checkFinite(const std::string& element, const char* name, SimTK::Real value) {
    if (std::isfinite(value)) return;
    throw std::invalid_argument(element + ": " + name + " is not a number");
}

}  // namespace simflex
