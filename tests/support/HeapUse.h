#pragma once
/** @file
Memory that a program holds, as its heap counts it: other programs have no influence. **/

#include <cstddef>

namespace simflex {
namespace testing {

/** Allocated and not freed, by all threads [bytes]; 0 where a sanitizer brings a heap of its own,
which looks for leaks itself. **/
std::size_t getHeapUse();

}  // namespace testing
}  // namespace simflex
