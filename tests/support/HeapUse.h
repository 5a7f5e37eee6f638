#pragma once
/** @file
Memory use of the program as counted by its heap, unaffected by other programs. **/

#include <cstddef>

namespace simflex {
namespace testing {

/** Returns the bytes that all threads have allocated and not freed. Returns 0 under a sanitizer,
which brings its own heap and looks for leaks itself. **/
std::size_t getHeapUse();

}  // namespace testing
}  // namespace simflex
