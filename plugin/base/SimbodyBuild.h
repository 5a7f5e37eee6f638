#pragma once
/** @file
Stops the build of a program whose SimTK::State has another layout than that of Simbody's and
simflex's libraries: the layout of its cache depends on NDEBUG, and copying a State would crash. The
CMake target simflex::simflex sets NDEBUG correctly; other builds need -UNDEBUG with Debian's
Simbody. **/

#include "simflex/base/StandardBuild.h"

#ifndef SIMFLEX_SIMBODY_HAS_NDEBUG
#define SIMFLEX_SIMBODY_HAS_NDEBUG \
    0  // as in Debian's build of Simbody, unless simflex's CMake target sets 1
#endif

#if defined(NDEBUG) != SIMFLEX_SIMBODY_HAS_NDEBUG
#error \
    "NDEBUG must be as Simbody was built, usually -UNDEBUG: it changes the layout of SimTK::State"
#endif
