#pragma once
/** @file
Counts allocations of the whole test program by `new`. **/

namespace simflex {
namespace test {

/** Returns the count since program start, over all threads. **/
long getNumAllocations();

}  // namespace test
}  // namespace simflex
