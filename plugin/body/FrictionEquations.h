#pragma once
/** @file
Dry friction in a joint, proportional to the joint's own reaction. Each *contact* of a joint has one
to three sliding rates v [m/s or rad/s] and a load P [N or N m]:

    sliding:   f = −μ P v/|v| − c v        μ coulomb
    sticking:  v = 0,  |f| ≤ μ_s P         μ_s breakaway

| joint | v | P, with F the joint's force, a its axis |
|---|---|---|
| Pin | angle | r |F_⊥| + r_a |F_a| |
| Ball | angular velocity (3) | r |F| |
| Universal | each angle, as a separate contact | r |F| |
| Slider | displacement | |F_⊥| |
| Cylinder | r·angle, displacement | |F_⊥| |
| Screw | along the thread: r cos β·angle + sin β·displacement, tan β = p/r | |F_a|/cos β |

Moments transmitted by a joint cause no friction: model a pair of bearings that carries a moment as
two joints. **/

#include <memory>
#include <string>
#include <vector>

#include "simflex/body/JointEquations.h"

namespace simflex {

struct FrictionCoefficients {
    SimTK::Real coulomb = 0;             ///< sliding coefficient μ
    SimTK::Real breakaway = SimTK::NaN;  ///< sticking coefficient μ_s; NaN: as coulomb
    SimTK::Real viscous = 0;             ///< c [N s/m], or [N m s/rad] if the rates are angular
    SimTK::Real radius = 0;              ///< r [m]; not for sliders
    SimTK::Real axialRadius = 0;         ///< r_a [m]; for pins only
};

class FrictionEquations {
public:
    static constexpr int MaxRates = 3;

    /** @throws std::invalid_argument with the reason, without the joint's name. **/
    FrictionEquations(std::shared_ptr<const JointEquations> joint,
                      const FrictionCoefficients& coefficients);

    const FrictionCoefficients& getCoefficients() const { return m_coefficients; }
    int getNumContacts() const { return int(m_contacts.size()); }
    int getNumRates(int contact) const { return int(m_contacts[size_t(contact)].rates.size()); }

    /** Computes the coefficients of the frames' (ω, v) in the rates, in Ground: for all rates those
    of F, then those of M. **/
    void calcGradients(int contact, const SimTK::Transform& F, const SimTK::Transform& M,
                       SimTK::SpatialVec* D_F, SimTK::SpatialVec* D_M) const;
    /** Computes the derivatives of the rates while these are zero; uses X, V and A. **/
    void calcAccelerations(int contact, const FrameMotion& F, const FrameMotion& M,
                           SimTK::Real* accelerations) const;
    /** Returns P and computes its gradient with respect to the joint's multipliers.
    @param D_M  the joint's rows on M, see JointEquations::calcJacobian() **/
    SimTK::Real calcLoad(int contact, const SimTK::Transform& F, const SimTK::SpatialVec* D_M,
                         const SimTK::Real* lambda, SimTK::Real* gradient) const;

private:
    /** Σ weight·coordinate rate, or a component of the angular velocity in F's axes. **/
    struct Rate {
        struct Term {
            JointCoordinate coordinate;
            SimTK::Real weight;
        };
        std::vector<Term> terms;
        int turnAxis = -1;
    };
    struct Contact {
        std::vector<Rate> rates;
        int axis = -1;  ///< axis of F; −1: the whole force counts as transverse
        SimTK::Real acrossArm = 0, axialArm = 0;
    };
    void makeContacts();

    std::shared_ptr<const JointEquations> m_joint;
    FrictionCoefficients m_coefficients;
    std::vector<Contact> m_contacts;
};

}  // namespace simflex
