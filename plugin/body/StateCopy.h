#pragma once
/** @file
Copies of States (private header). Simbody 3.7 copies values that were computed lazily too, such as
Force::Gravity's forces and energy, each with the number of changes that the original had seen when
it was computed. A copy counts its own changes, and when it has seen as many, those of the original
pass for its own. Every State of ours that is a copy is therefore made here. **/

#include "SimTKcommon/internal/State.h"

namespace simflex {

/** A State with the same variables, in which nothing above Stage::Instance is computed. **/
SimTK::State copyState(const SimTK::State& state);
/** @param to  becomes copyState(from) **/
void copyState(const SimTK::State& from, SimTK::State& to);

}  // namespace simflex
