#pragma once
/** @file
A heavy top with a flexible stem: a disc on a beam on a ball joint. With a stiff stem it is
Lagrange's top; J₃ is its moment of inertia along the stem, J₁ across it, about the foot. **/

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Hub.h"
#include "simflex/body/Joint.h"

namespace simflex::test {

/** The stem is along x of its body; the vertical is y. **/
class HeavyTop {
public:
    static constexpr SimTK::Real Gravity = 9.81, Length = 0.2, Spin = 300;
    static constexpr SimTK::Real Tilt = 0.6;  ///< of the stem from the vertical

    /** @param stiffening  factor on the stem's stiffness **/
    explicit HeavyTop(SimTK::Real stiffening);

    /** Returns a State of steady precession as a rigid top. **/
    SimTK::State makeSteadyState();
    /** Returns a State spinning about the stem, which is released from rest. **/
    SimTK::State makeReleasedState();

    /** Returns the disc's position relative to the foot. **/
    SimTK::Vec3 calcDisc(const SimTK::State& state) const;
    /** Returns the disc's azimuth about the vertical [rad]. **/
    SimTK::Real calcAzimuth(const SimTK::State& state) const;

    /** Returns the angular velocity of the disc about its own axis [rad/s]. **/
    SimTK::Real calcSpin(const SimTK::State& state) const;

    /** @name Quantities of the rigid top **/
    /**@{**/
    /** Returns J₃, J₁ [kg m²] and mass × distance of the mass centre [kg m]. **/
    static SimTK::Vec3 calcRigidProperties();
    /** Returns mass × gravity × distance of the mass centre [J]. **/
    static SimTK::Real calcWeightMoment();
    /** Returns the slower rate of steady precession: J₁Ω²cos θ − J₃ω₃Ω + mgd = 0. **/
    static SimTK::Real calcPrecession();
    /** Returns the tilt at which a released stem rises again, where u = cos θ satisfies
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
