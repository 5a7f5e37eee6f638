#pragma once
/** @file
Progress reports and cancellation of long computations. **/

#include <functional>
#include <stdexcept>
#include <string>

namespace simflex {

/** Called from time to time with the current phase and its completed fraction, 0…1, or a negative
number if the fraction is unknown. Return false to cancel: the computation then throws
Cancelled. **/
using ProgressCallback = std::function<bool(const std::string& phase, double fraction)>;

/** Thrown by cancelled computations. **/
class Cancelled : public std::runtime_error {
public:
    /** @param kept  results that remain: "3 of 8 modes are in 'crank_modes'" **/
    explicit Cancelled(const std::string& kept = "nothing was written")
        : std::runtime_error("stopped; " + kept), m_kept(kept) {}
    const std::string& getKept() const { return m_kept; }

private:
    std::string m_kept;
};

/** Calls `progress` if it is set. @throws Cancelled if it returns false. **/
inline void reportProgress(const ProgressCallback& progress, const std::string& phase,
                           double fraction) {
    if (progress && !progress(phase, fraction)) throw Cancelled();
}

}  // namespace simflex
