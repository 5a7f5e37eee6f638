#pragma once
/** @file
A heavy top whose stem bends: a disc on a beam that stands on a ball joint. On a stiff stem it is
Lagrange's top; J₃ is its moment of inertia along the stem, J₁ across it, about the foot. **/

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Hub.h"
#include "simflex/body/Joint.h"

namespace simflex::test {

/** Stem along x of its body; the vertical is y. **/
class HeavyTop {
public:
    static constexpr SimTK::Real Gravity = 9.81, Length = 0.2, Spin = 300;
    static constexpr SimTK::Real Tilt = 0.6;  ///< of the stem from the vertical

    /** @param stiffening  factor on the stem's stiffness **/
    explicit HeavyTop(SimTK::Real stiffening);

    /** In steady precession as if rigid. **/
    SimTK::State makeSteadyState();
    /** Spinning about the stem, which is let go at rest. **/
    SimTK::State makeReleasedState();

    /** Of the disc, from the foot. **/
    SimTK::Vec3 calcDisc(const SimTK::State& state) const;
    /** Of the disc about the vertical [rad]. **/
    SimTK::Real calcAzimuth(const SimTK::State& state) const;

    /** Angular velocity of the disc along its own axis [rad/s]. **/
    SimTK::Real calcSpin(const SimTK::State& state) const;

    /** @name Of the rigid top **/
    /**@{**/
    /** J₃, J₁ [kg m²]; mass × distance of its centre [kg m]. **/
    static SimTK::Vec3 calcRigidProperties();
    /** Mass × gravity × distance of its centre [J]. **/
    static SimTK::Real calcWeightMoment();
    /** The slower rate of steady precession: J₁Ω²cos θ − J₃ω₃Ω + mgd = 0. **/
    static SimTK::Real calcPrecession();
    /** Tilt at which a stem let go turns up again, where u = cos θ meets
    (1 − u²) 2mgd/J₁ = (J₃ω₃/J₁)² (cos θ₀ − u). **/
    static SimTK::Real calcLowestTilt();
    /**@}**/

    SimTK::MultibodySystem system;
    SimTK::SimbodyMatterSubsystem matter{system};
    SimTK::GeneralForceSubsystem forces{system};
    SimTK::Force::Gravity gravity{forces, matter, -SimTK::YAxis, Gravity};
    FlexibleBodySubsystem flexible{system, matter};

private:
    SimTK::State makeState(SimTK::Real precession);

    FlexibleBody m_stem;
    Joint::Ball m_foot;
    Hub m_disc;
};

}  // namespace simflex::test
