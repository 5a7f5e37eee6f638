#pragma once
/** @file
Stops the build of a program whose standard containers would not fit those of simflex's libraries:
it would crash, or worse. **/

#ifndef SIMFLEX_HAS_DEBUG_CONTAINERS
#define SIMFLEX_HAS_DEBUG_CONTAINERS 0  // of simflex's libraries, unless its CMake target says 1
#endif

#if defined(_GLIBCXX_DEBUG) != SIMFLEX_HAS_DEBUG_CONTAINERS
#error "_GLIBCXX_DEBUG must be as simflex was built: it changes the layout of standard containers"
#endif
