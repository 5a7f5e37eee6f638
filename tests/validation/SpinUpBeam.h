#pragma once
/** @file
Spin-up of a flexible beam. J. C. Simo, L. Vu-Quoc, On the dynamics of flexible beams under large
overall motions – the plane case, J. Appl. Mech. 53 (1986) 849–863.

A beam of 10 m is turned about its root, from rest to 6 rad/s in 15 s. **/

#include "simflex/body/FlexibleBody.h"

namespace simflex::test {

class SpinUpBeam {
public:
    static constexpr SimTK::Real Length = 10, RampTime = 15, Speed = 6;
    /** Of the paper: the tip lags most, and when; afterwards it swings so far about zero; steady
    extension [m, s]. **/
    static constexpr SimTK::Real PeakLag = -0.574, PeakTime = 6.76, Swing = 3.65e-3,
                                 Extension = 5.143e-4;

    SpinUpBeam();

    /** Angle, speed and acceleration of the root. **/
    static SimTK::Vec3 calcRootAngle(SimTK::Real t);

    /** At rest; with geometric stiffening. **/
    SimTK::State makeState();

    /** Of the tip from the rotating rigid beam: extension, lag [m]. **/
    SimTK::Vec2 calcTip(const SimTK::State& state) const;

    SimTK::MultibodySystem system;
    SimTK::SimbodyMatterSubsystem matter{system};
    FlexibleBodySubsystem flexible{system, matter};
    FlexibleBody beam;
};

}  // namespace simflex::test
