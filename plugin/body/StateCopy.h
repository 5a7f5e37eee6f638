#pragma once
/** @file
Copies of States (private header).

A State of Simbody 3.7 also copies lazily computed values, such as Force::Gravity's forces and
energy, each with the original's change count at the time of computation. The copy restarts its own
count, and once this reaches the stored one, stale values pass as current. Therefore all our copies
of States are made here. **/

#include "SimTKcommon/internal/State.h"

namespace simflex {

/** Returns a State with the same variables, in which nothing above Stage::Instance is computed. **/
SimTK::State copyState(const SimTK::State& state);
/** @param to  becomes copyState(from) **/
void copyState(const SimTK::State& from, SimTK::State& to);

}  // namespace simflex
