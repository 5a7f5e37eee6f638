#pragma once
/** @file
Stops the build of a program whose standard containers have another layout than those of simflex's
libraries. Such a program would crash or corrupt memory. **/

#ifndef SIMFLEX_HAS_DEBUG_CONTAINERS
#define SIMFLEX_HAS_DEBUG_CONTAINERS 0  // simflex's CMake target may set 1
#endif

#if defined(_GLIBCXX_DEBUG) != SIMFLEX_HAS_DEBUG_CONTAINERS
#error "_GLIBCXX_DEBUG must be as simflex was built: it changes the layout of standard containers"
#endif
