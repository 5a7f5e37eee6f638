#pragma once
/** @file
Memory available to this process. **/

#include <cstdint>
#include <string>

namespace simflex {

/** Returns the bytes available without swapping: the kernel's estimate, or less if a control group
(a container, a batch job) or `ulimit -v` allows less; the largest number if the system does not
report it. **/
std::int64_t calcAvailableMemory();

/** "12.3 GiB", "456 MiB". **/
std::string formatMemory(double bytes);

}  // namespace simflex
