#pragma once
/** @file Elapsed wall time. Internal. **/

#include <chrono>

namespace simflex {

/** [s] **/
inline double secondsSince(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace simflex
