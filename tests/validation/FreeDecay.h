#pragma once
/** @file
A clamped beam with stiffness-proportional damping, D = βK. Deflected at its tip and released, it
decays with ζ = ½βω. **/

#include "simflex/forces/AttachmentForce.h"
#include "validation/Cantilever.h"

namespace simflex::test {

class FreeDecay {
public:
    static constexpr SimTK::Real Deflection = 1e-4;  ///< of the tip at first [m]

    /** @param ratio  ζ of the lowest mode **/
    explicit FreeDecay(SimTK::Real ratio);

    /** Returns the lowest Euler-Bernoulli frequency [rad/s]. **/
    static SimTK::Real calcFrequency();

    struct History {
        std::vector<double> time, tip;  ///< [s, m]
    };
    /** Runs with generalized-α. **/
    History run(SimTK::Real numPeriods, SimTK::Real accuracy);

private:
    Cantilever m_model;
};

/** Returns ζ by the logarithmic decrement between the fourth upper peak and the last. By then the
higher modes, initially excited by 3 %, have decayed. **/
double recoverDampingRatio(const FreeDecay::History& history);

}  // namespace simflex::test
