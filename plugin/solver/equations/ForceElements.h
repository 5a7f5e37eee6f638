#pragma once
/** @file
Simbody's force elements one by one, asked for through the system (private header). An element's own
methods go through the GeneralForceSubsystem handle that it was made with, which may be gone, and
then is not found to be so. **/

#include "Simbody.h"

namespace simflex {

/** True for a GeneralForceSubsystem, whose elements are SimTK::Forces. **/
bool isGeneralForceSubsystem(const SimTK::Subsystem& subsystem);

/** Those of a system, in order. **/
SimTK::Array_<const SimTK::GeneralForceSubsystem*> listGeneralForceSubsystems(
    const SimTK::MultibodySystem& system);

/** The one that has this element, or null. **/
const SimTK::GeneralForceSubsystem* findForceSubsystem(const SimTK::MultibodySystem& system,
                                                       const SimTK::Force& force);

/** Disables all elements but this one; an empty handle: all. Contact subsystems stay. **/
void disableAllBut(const SimTK::Force& force, const SimTK::MultibodySystem& system,
                   SimTK::State& state);

/** True for an element whose forces, on mobilities and on bodies in Ground, are what its variables
say, wherever bodies are. **/
bool isHeldForce(const SimTK::Force& force);

/** What a Force::Custom does, for calcForce(). **/
const SimTK::Force::Custom::Implementation& getImplementation(const SimTK::Force::Custom& force);

}  // namespace simflex
