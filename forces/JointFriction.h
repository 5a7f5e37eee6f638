#pragma once
/** @file
Dry friction in a joint, from the force that the joint transmits. FrictionEquations.h defines the
sliding rates and the load for each kind of joint.

    Joint::Pin pin(flexible, crank.interface("pin"), rod.interface("big_end"), "crank pin");
    FrictionCoefficients steelOnBronze;
    steelOnBronze.coulomb = 0.1;
    steelOnBronze.breakaway = 0.12;
    steelOnBronze.radius = 0.015;
    JointFriction friction(flexible, pin, steelOnBronze);

A sticking contact is held by a constraint, so that it does not creep; the friction of a sliding
contact follows its load at the same instant. The integrators of simflex solve for both together
with the motion. The energy that friction dissipates is part of ImplicitIntegrator::getWork(). A
StaticEquilibrium ignores friction. A Linearization holds sticking contacts and refuses sliding
ones. Native runs are refused. **/

#include "simflex/body/FrictionEquations.h"
#include "simflex/body/Joint.h"

namespace simflex {

class JointFriction {
public:
    /** Sets the friction of a joint, replacing any earlier one.
    @throws std::invalid_argument that names the joint, the value found and the value allowed. **/
    JointFriction(FlexibleBodySubsystem& subsystem, const Joint& joint,
                  const FrictionCoefficients& coefficients);
    /** Refers to the existing friction of a joint.
    @throws std::invalid_argument that names the joint if it has none. **/
    JointFriction(const FlexibleBodySubsystem& subsystem, const Joint& joint);
    static bool exists(const FlexibleBodySubsystem& subsystem, const Joint& joint);

    const Joint& getJoint() const { return m_joint; }
    const FrictionCoefficients& getCoefficients() const;
    /** Two for universal joints, one for all others. **/
    int getNumContacts() const;
    int getNumRates(int contact) const;
    int getNumRates() const;
    /** True if rates are angular [rad/s] and forces are torques [N m]. **/
    bool turns() const;

    struct Contact {
        SimTK::Real load = 0;   ///< normal load P [N or N m]
        SimTK::Vec3 rates{0};   ///< sliding rate v [m/s or rad/s]
        SimTK::Vec3 force{0};   ///< on M, along the rates [N or N m], including viscous friction
        SimTK::Real power = 0;  ///< [W], negative
    };
    /** Requires Stage::Velocity.
    @param multipliers  of the joint
    @param dryForces    ImplicitIntegrator::getFrictionForces() **/
    Contact calcContact(const SimTK::State& state, const SimTK::Vector& multipliers,
                        const SimTK::Vector& dryForces, int contact = 0) const;

    /** Sum over all contacts: spatial force (torque, force) on the body that carries F or M, at
    that frame's origin. Requires Stage::Velocity. **/
    SimTK::SpatialVec calcForce(const SimTK::State& state, const SimTK::Vector& dryForces,
                                Joint::Side on, Joint::Axes axes = Joint::Axes::Ground) const;

private:
    struct Sliding;
    const FrictionEquations& getEquations() const;
    const FlexibleBodySubsystem* m_subsystem;
    Joint m_joint;
};

}  // namespace simflex
