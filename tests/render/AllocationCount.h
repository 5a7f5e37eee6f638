#pragma once
/** @file
Counts what the whole test program allocates with `new`. **/

namespace simflex {
namespace test {

/** Since the program began, in all threads. **/
long getNumAllocations();

}  // namespace test
}  // namespace simflex
