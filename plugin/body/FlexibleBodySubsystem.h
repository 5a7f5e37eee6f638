#pragma once
/** @file
The force subsystem that owns a system's flexible bodies, their joints and their forces.

Add it after every other force subsystem. It applies elastic, damping and velocity-dependent forces,
and those of the elements in simflex/forces, whenever Simbody itself realizes Stage::Dynamics.

@note Simbody's mass matrix lacks `ΔM = [I(ξ)−I₀, C; Cᵀ, 0]`. A native realization to
Stage::Acceleration leaves it out and says so once on std::cerr; BdfIntegrator has it. **/

#include <memory>
#include <string>

#include "simflex/body/Attachment.h"

namespace simflex {

class FlexibleBody;
class ForceElement;
class Joint;
SimTK_DEFINE_UNIQUE_INDEX_TYPE(JointIndex)

    class FlexibleBodySubsystem : public SimTK::ForceSubsystem {
public:
    class Guts;

    FlexibleBodySubsystem(SimTK::MultibodySystem& system, SimTK::SimbodyMatterSubsystem& matter);

    /** The flexible subsystem of a system, or null. **/
    static const FlexibleBodySubsystem* find(const SimTK::System& system);

    int getNumBodies() const;
    FlexibleBody getBody(FlexibleBodyIndex index) const;
    int getNumJoints() const;
    Joint getJoint(JointIndex index) const;

    /** Adds a force element; the subsystem takes it over. **/
    void adoptForceElement(std::unique_ptr<ForceElement> element);

    /** Kinetic energy of the whole system, flexible bodies with their full inertia.
     * Stage::Velocity. **/
    SimTK::Real calcKineticEnergy(const SimTK::State& state) const;
    /** Kinetic plus potential energy of the whole system. Stage::Dynamics. **/
    SimTK::Real calcEnergy(const SimTK::State& state) const;

    const SimTK::MultibodySystem& getMultibodySystem() const;

    const Guts& getGuts() const;
    Guts& updGuts();
};

}  // namespace simflex
