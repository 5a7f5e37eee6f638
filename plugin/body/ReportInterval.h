#pragma once
/** @file The interval of periodic event reporters. Internal to body. **/

#include <stdexcept>
#include <string>

namespace simflex {

/** Returns the interval [s]. @throws std::invalid_argument unless it is positive; `who` is the
class. **/
inline double checkReportInterval(double interval, const char* who) {
    if (interval > 0) return interval;
    throw std::invalid_argument(std::string(who) + ": the interval is " + std::to_string(interval) +
                                " s; it must be positive");
}

}  // namespace simflex
