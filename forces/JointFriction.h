#pragma once
/** @file
Dry friction in a joint, from the force that the joint transmits: see FrictionEquations.h for what
slides, by which load, in joints of each kind.

    Joint::Pin pin(flexible, crank.interface("pin"), rod.interface("big_end"), "crank pin");
    FrictionCoefficients steelOnBronze;
    steelOnBronze.coulomb = 0.1;
    steelOnBronze.breakaway = 0.12;
    steelOnBronze.radius = 0.015;
    JointFriction friction(flexible, pin, steelOnBronze);

A contact that sticks is held as by a joint, so that it does not creep; one that slides has the
friction of its load at the same instant. The integrators of simflex find both together with the
motion. What friction takes is in their work, ImplicitIntegrator::getWork(). In a StaticEquilibrium
there is none; in a Linearization contacts that stick are held, and those that slide are refused. So
are native runs. **/

#include "simflex/body/FrictionEquations.h"
#include "simflex/body/Joint.h"

namespace simflex {

class JointFriction {
public:
    /** Instead of any that the joint has had.
    @throws std::invalid_argument that names the joint, the value found and what is allowed. **/
    JointFriction(FlexibleBodySubsystem& subsystem, const Joint& joint,
                  const FrictionCoefficients& coefficients);
    /** That of a joint which has some.
    @throws std::invalid_argument that names the joint if it has none. **/
    JointFriction(const FlexibleBodySubsystem& subsystem, const Joint& joint);
    static bool exists(const FlexibleBodySubsystem& subsystem, const Joint& joint);

    const Joint& getJoint() const { return m_joint; }
    const FrictionCoefficients& getCoefficients() const;
    /** Universals have two, others one. **/
    int getNumContacts() const;
    /** Of a contact, and of all. **/
    int getNumRates(int contact) const;
    int getNumRates() const;
    /** Whether rates are those of angles, and forces torques. **/
    bool turns() const;

    struct Contact {
        SimTK::Real load = 0;   ///< P [N or N m]
        SimTK::Vec3 rates{0};   ///< v [m/s or rad/s]
        SimTK::Vec3 force{0};   ///< on M, along them [N or N m], viscous friction included
        SimTK::Real power = 0;  ///< [W], negative
    };
    /** Stage::Velocity.
    @param multipliers  of the joint
    @param dryForces    ImplicitIntegrator::getFrictionForces() **/
    Contact calcContact(const SimTK::State& state, const SimTK::Vector& multipliers,
                        const SimTK::Vector& dryForces, int contact = 0) const;

    /** All of it: spatial force (torque, force) on the body that carries F or M, at that frame's
    origin. Stage::Velocity. **/
    SimTK::SpatialVec calcForce(const SimTK::State& state, const SimTK::Vector& dryForces,
                                Joint::Side on, Joint::Axes axes = Joint::Axes::Ground) const;

private:
    struct Sliding;
    const FrictionEquations& getEquations() const;
    const FlexibleBodySubsystem* m_subsystem;
    Joint m_joint;
};

}  // namespace simflex
