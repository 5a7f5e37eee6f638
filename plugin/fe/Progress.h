#pragma once
/** @file
How long-running work reports where it is, and how it is told to stop. **/

#include <functional>
#include <stdexcept>
#include <string>

namespace simflex {

/** Called every now and then with what is being done and the part of it that is done, 0…1, or a
negative number where that is not known. Return false to stop: the work then throws Cancelled. **/
using ProgressCallback = std::function<bool(const std::string& phase, double fraction)>;

/** Thrown by work whose ProgressCallback returned false. Nothing of it is left behind. **/
class Cancelled : public std::runtime_error {
public:
    Cancelled() : std::runtime_error("stopped on request") {}
};

/** Calls `progress`, if there is one. @throws Cancelled if it returns false. **/
inline void reportProgress(const ProgressCallback& progress, const std::string& phase,
                           double fraction) {
    if (progress && !progress(phase, fraction)) throw Cancelled();
}

}  // namespace simflex
