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

/** Thrown by work that was told to stop. **/
class Cancelled : public std::runtime_error {
public:
    /** @param kept  what there is of it: "3 of 8 modes are in 'crank_modes'" **/
    explicit Cancelled(const std::string& kept = "nothing was written")
        : std::runtime_error("stopped; " + kept), m_kept(kept) {}
    const std::string& getKept() const { return m_kept; }

private:
    std::string m_kept;
};

/** Calls `progress`, if there is one. @throws Cancelled if it returns false. **/
inline void reportProgress(const ProgressCallback& progress, const std::string& phase,
                           double fraction) {
    if (progress && !progress(phase, fraction)) throw Cancelled();
}

}  // namespace simflex
