#pragma once
/** @file
A clamped beam with damping in proportion to its stiffness, D = βK: pulled aside by its tip and let
go, it decays with ζ = ½βω whatever holds it. **/

#include "simflex/forces/AttachmentForce.h"
#include "validation/Cantilever.h"

namespace simflex::test {

class FreeDecay {
public:
    static constexpr SimTK::Real Deflection = 1e-4;  ///< of the tip at first [m]

    /** @param ratio  ζ of the lowest mode **/
    explicit FreeDecay(SimTK::Real ratio);

    /** Of Euler and Bernoulli, lowest [rad/s]. **/
    static SimTK::Real calcFrequency();

    struct History {
        std::vector<double> time, tip;  ///< [s, m]
    };
    /** By generalized-α. **/
    History run(SimTK::Real numPeriods, SimTK::Real accuracy);

private:
    Cantilever m_model;
};

/** ζ by the logarithmic decrement between the fourth upper peak and the last:
by then the higher modes, which the pull excites by 3 %, are gone. **/
double recoverDampingRatio(const FreeDecay::History& history);

}  // namespace simflex::test
