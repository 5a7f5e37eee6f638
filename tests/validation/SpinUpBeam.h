#pragma once
/** @file
Spin-up of a flexible beam. J. C. Simo, L. Vu-Quoc, On the dynamics of flexible beams under large
overall motions – the plane case, J. Appl. Mech. 53 (1986) 849–863.

A beam of 10 m rotates about its root, from rest to 6 rad/s in 15 s. **/

#include "simflex/body/FlexibleBody.h"

namespace simflex::test {

class SpinUpBeam {
public:
    static constexpr SimTK::Real Length = 10, RampTime = 15, Speed = 6;
    /** From the paper: the largest lag of the tip and its time; the later amplitude about zero;
    steady extension [m, s]. **/
    static constexpr SimTK::Real PeakLag = -0.574, PeakTime = 6.76, Swing = 3.65e-3,
                                 Extension = 5.143e-4;

    SpinUpBeam();

    /** Returns angle, speed and acceleration of the root. **/
    static SimTK::Vec3 calcRootAngle(SimTK::Real t);

    /** Returns a State at rest with geometric stiffening enabled. **/
    SimTK::State makeState();

    /** Returns extension and lag of the tip relative to the rotating rigid beam [m]. **/
    SimTK::Vec2 calcTip(const SimTK::State& state) const;

    SimTK::MultibodySystem system;
    SimTK::SimbodyMatterSubsystem matter{system};
    FlexibleBodySubsystem flexible{system, matter};
    FlexibleBody beam;
};

}  // namespace simflex::test
