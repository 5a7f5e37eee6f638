#pragma once
/** @file
How much memory this process may still take. Internal to reduction. **/

#include <cstdint>
#include <string>

namespace simflex {

/** Bytes that can be had without swapping: what the kernel calls available, less where a control
group (a container, a batch job) allows less; the largest number if the system does not say. **/
std::int64_t calcAvailableMemory();

/** "12.3 GiB", "456 MiB". **/
std::string formatMemory(double bytes);

}  // namespace simflex
