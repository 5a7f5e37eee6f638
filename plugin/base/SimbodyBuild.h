#pragma once
/** @file
Stops the build of a program in which Simbody's State would not fit Simbody's and simflex's
libraries: the layout of its cache depends on NDEBUG, and a copy of a State would crash. The CMake
target simflex::simflex sets NDEBUG as it must be; other builds say -UNDEBUG for Debian's Simbody.
**/

#include "simflex/base/StandardBuild.h"

#ifndef SIMFLEX_SIMBODY_HAS_NDEBUG
#define SIMFLEX_SIMBODY_HAS_NDEBUG \
    0  // as Debian builds Simbody, unless simflex's CMake target says 1
#endif

#if defined(NDEBUG) != SIMFLEX_SIMBODY_HAS_NDEBUG
#error \
    "NDEBUG must be as Simbody was built, usually -UNDEBUG: it changes the layout of SimTK::State"
#endif
