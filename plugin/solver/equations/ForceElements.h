#pragma once
/** @file
Access to Simbody's individual force elements through the system (private header). An element's own
methods use the GeneralForceSubsystem handle that it was created with, which may no longer exist and
cannot be checked. **/

#include "Simbody.h"

namespace simflex {

/** True for a GeneralForceSubsystem, whose elements are SimTK::Forces. **/
bool isGeneralForceSubsystem(const SimTK::Subsystem& subsystem);

/** Force elements of a system, in order. **/
SimTK::Array_<const SimTK::GeneralForceSubsystem*> listGeneralForceSubsystems(
    const SimTK::MultibodySystem& system);

/** The subsystem that owns this element, or null. **/
const SimTK::GeneralForceSubsystem* findForceSubsystem(const SimTK::MultibodySystem& system,
                                                       const SimTK::Force& force);

/** Disables all elements but this one; an empty handle: all. Contact subsystems stay enabled. **/
void disableAllBut(const SimTK::Force& force, const SimTK::MultibodySystem& system,
                   SimTK::State& state);

/** True for an element whose forces, on mobilities and on bodies in Ground, depend on its variables
only, not on positions. **/
bool isHeldForce(const SimTK::Force& force);

/** Implementation of a Force::Custom, for calcForce(). **/
const SimTK::Force::Custom::Implementation& getImplementation(const SimTK::Force::Custom& force);

}  // namespace simflex
