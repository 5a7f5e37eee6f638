#pragma once
/** @file
Dry friction in a joint, by the force that the joint itself transmits. Each *contact* of a joint has
sliding rates v [m/s or rad/s], one, two or three, and a load P [N or N m] from the reaction:

    sliding:   f = −μ P v/|v| − c v        μ coulomb
    sticking:  v = 0,  |f| ≤ μ_s P         μ_s breakaway

| joint | v | P, with F the joint's force, a its axis |
|---|---|---|
| Pin | angle | r |F_⊥| + r_a |F_a| |
| Ball | angular velocity (3) | r |F| |
| Universal | each of its angles, a contact of its own | r |F| |
| Slider | displacement | |F_⊥| |
| Cylinder | r·angle, displacement | |F_⊥| |
| Screw | along the thread, r cos β·angle + sin β·displacement, tan β = p/r | |F_a|/cos β: that of
its flanks |

Moments that a joint transmits are not counted: where two bearings carry one, make two joints. **/

#include <memory>
#include <string>
#include <vector>

#include "simflex/body/JointEquations.h"

namespace simflex {

struct FrictionCoefficients {
    SimTK::Real coulomb = 0;             ///< μ of what slides
    SimTK::Real breakaway = SimTK::NaN;  ///< μ_s up to which it sticks; coulomb unless told
    SimTK::Real viscous = 0;      ///< c [N s/m, or N m s/rad where rates are those of angles]
    SimTK::Real radius = 0;       ///< r [m]; of all but sliders
    SimTK::Real axialRadius = 0;  ///< r_a [m], of pins
};

class FrictionEquations {
public:
    static constexpr int MaxRates = 3;

    /** @throws std::invalid_argument that says what is wrong, without the joint's name. **/
    FrictionEquations(std::shared_ptr<const JointEquations> joint,
                      const FrictionCoefficients& coefficients);

    const FrictionCoefficients& getCoefficients() const { return m_coefficients; }
    int getNumContacts() const { return int(m_contacts.size()); }
    int getNumRates(int contact) const { return int(m_contacts[size_t(contact)].rates.size()); }

    /** Factors of the frames' (ω, v) in the rates, in Ground: of all rates for F, then for M. **/
    void calcGradients(int contact, const SimTK::Transform& F, const SimTK::Transform& M,
                       SimTK::SpatialVec* D_F, SimTK::SpatialVec* D_M) const;
    /** Derivatives of the rates where they are zero; from X, V and A. **/
    void calcAccelerations(int contact, const FrameMotion& F, const FrameMotion& M,
                           SimTK::Real* accelerations) const;
    /** P and its gradient by the joint's multipliers.
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
        int axis = -1;  ///< of F; −1: all of the force is across
        SimTK::Real acrossArm = 0, axialArm = 0;
    };
    void makeContacts();

    std::shared_ptr<const JointEquations> m_joint;
    FrictionCoefficients m_coefficients;
    std::vector<Contact> m_contacts;
};

}  // namespace simflex
