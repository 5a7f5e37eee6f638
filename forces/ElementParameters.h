#pragma once
/** @file
Names of force elements and checks of their parameters (private header). **/

#include <cmath>
#include <stdexcept>
#include <string>

#include "simflex/body/FlexibleBodySubsystem.h"
#include "simflex/body/ForceElement.h"

namespace simflex {

/** Name of an element in messages: its own, or its class and frames if it has none. **/
inline std::string nameElement(const char* kind, const Attachment& F, const Attachment& M,
                               const std::string& name) {
    return name.empty() ? kind + (" between " + F.getName() + " and ") + M.getName()
                        : "'" + name + "'";
}
inline std::string nameElement(const char* kind, const Attachment& on, const std::string& name) {
    return name.empty() ? kind + (" on " + on.getName()) : "'" + name + "'";
}

inline void adoptNamed(FlexibleBodySubsystem& subsystem, std::unique_ptr<ForceElement> element,
                       const std::string& name) {
    element->setName(name);
    subsystem.adoptForceElement(std::move(element));
}

/** @throws std::invalid_argument "TwoPointSpringDamper between A and B: stiffness is -1; …". **/
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
