#pragma once
/** @file
The force subsystem that owns a system's flexible bodies, their joints and their forces.

Construct it after every other force subsystem; elements may be added to those at any time. It
applies elastic, damping and velocity-dependent forces, and those of the elements in simflex/forces,
whenever Simbody itself realizes Stage::Dynamics.

Simbody's mass matrix lacks `ΔM = [I(ξ)−I₀, C; Cᵀ, 0]` of a flexible body. The subsystem therefore
reads the forces of all others, solves for the exact u̇ by block elimination and also applies `−ΔM
u̇`. Simbody's own accelerations, multipliers and reaction forces are then exact, and any
SimTK::Integrator can run the model:

    State state = system.realizeTopology();
    ...                                  // place the bodies
    flexible.initializeNative(state);    // joints assembled, weights in metres
    RungeKuttaMersonIntegrator integrator(system);
    integrator.setAccuracy(1e-6);
    TimeStepper stepper(system, integrator);
    stepper.initialize(state);
    stepper.stepTo(0.1);

BdfIntegrator evaluates everything itself and is much faster with many modes or joints.

Native runs do not support joints with friction, bodies mobilized on the frame or a modal mobilizer
of a flexible body, constraints on the *body* of a modal mobilizer, or Motions of method Fast:
realizing Stage::Dynamics throws an exception naming them. Forces on the body of a modal mobilizer
have no effect; those on its mobilities are modal forces. **/

#include <map>
#include <memory>
#include <string>

#include "simflex/body/Attachment.h"

namespace simflex {

class FlexibleBody;
class ForceElement;
class StateEquation;
class Joint;
SimTK_DEFINE_UNIQUE_INDEX_TYPE(JointIndex)

    class FlexibleBodySubsystem : public SimTK::ForceSubsystem {
public:
    class Guts;

    FlexibleBodySubsystem(SimTK::MultibodySystem& system, SimTK::SimbodyMatterSubsystem& matter);

    /** Returns the flexible subsystem of a system, or null. **/
    static const FlexibleBodySubsystem* find(const SimTK::System& system);

    int getNumBodies() const;
    FlexibleBody getBody(FlexibleBodyIndex index) const;
    /** Sets a rigid body's name for messages: "crank" instead of "body 3". **/
    void nameBody(SimTK::MobilizedBodyIndex body, const std::string& name);
    int getNumJoints() const;
    Joint getJoint(JointIndex index) const;
    /** Returns the constraint status of a State: 1 for each enabled Simbody constraint and 0 for
    each disabled one, then the lock position of each joint. Stage::Model. **/
    SimTK::Vector getHolding(const SimTK::State& state) const;
    /** Restores the result of getHolding(). @throws std::invalid_argument if it is of another
    system. **/
    void setHolding(SimTK::State& state, const SimTK::Vector& holding) const;

    /** Adds a force element and takes ownership of it. **/
    void adoptForceElement(std::unique_ptr<ForceElement> element);
    /** @name Force elements outside their valid range (ForceElement::describeOutOfRange()) **/
    /**@{**/
    bool hasElementsWithRange() const;
    /** Returns the warnings by element index. Stage::Velocity.
    @param elapsed  simulated time since the State checked last [s] **/
    std::map<int, std::string> describeElementsOutOfRange(const SimTK::State& state,
                                                          SimTK::Real elapsed = 0) const;
    /**@}**/

    /** @name First-order equations in addition to the equations of motion **/
    /**@{**/
    /** Adds an equation and takes ownership of it.
    @returns its index in ElementInputs::states. **/
    int adoptState(std::unique_ptr<StateEquation> equation);
    int getNumStates() const;
    const std::string& getStateName(int index) const;
    SimTK::Real getStateValue(const SimTK::State& state, int index) const;
    void setStateValue(SimTK::State& state, int index, SimTK::Real value) const;
    /**@}**/

    /** Prepares a State for one of Simbody's own integrators: sets locked and prescribed
    coordinates, assembles joints and constraints and makes speeds consistent as
    ImplicitIntegrator::initialize() does, so that both start from the same State. Assembly uses the
    least deformation and keeps bodies rigid as far as the joints allow; systems without flexible
    bodies use Simbody's own projection.

    Then sets the weights of speeds in Simbody's error norms and projections so that accuracies and
    tolerances mean metres for flexible bodies: 1 for translation, the part's radius for rotation,
    the largest displacement caused by a mode for its speed. Weights of other bodies are unchanged.
    States that follow from positions are initialised. The State is realized to Stage::Velocity.
    @param tolerance  largest constraint error left [m, rad]
    @throws std::invalid_argument as requireLinearRange() (LinearRangeReporter.h), and if a joint
    has friction
    @throws std::runtime_error if the constraints cannot be assembled, naming the worst one; the
    State is then unchanged. **/
    void initializeNative(SimTK::State& state, SimTK::Real tolerance = 1e-10) const;
    /** The part of initializeNative() that sets positions and speeds, for any integrator. Throws
    the same exceptions, except for friction. **/
    void closeJoints(SimTK::State& state, SimTK::Real tolerance = 1e-10) const;

    /** Holds the modal coordinates of all bodies in a SimTK::Assembler at their values in its
    State. The Assembler knows no stiffness and would otherwise bend parts by metres.

        Assembler assembler(system);
        flexible.lockModes(assembler);
        assembler.assemble(state);

    Parts then move rigidly. If they must bend to close the joints, leave the assembly to
    ImplicitIntegrator or initializeNative(), which find the least deformation. **/
    void lockModes(SimTK::Assembler& assembler) const;

    /** @name Quantities of the whole system, with the full inertia of flexible bodies. They are the
    same in native runs and those of BdfIntegrator; MultibodySystem::calcKineticEnergy() and
    SimbodyMatterSubsystem's momenta lack ΔM. **/
    /**@{**/
    /** Stage::Velocity. **/
    SimTK::Real calcKineticEnergy(const SimTK::State& state) const;
    /** Returns the angular momentum about Ground's origin and the linear momentum, in Ground [kg
    m²/s, kg m/s]. Stage::Velocity. **/
    SimTK::SpatialVec calcMomentum(const SimTK::State& state) const;
    /** Returns strain energy, gravity and all other stored energy. Stage::Velocity; Stage::Dynamics
    with those Simbody elements that compute their energy only then (HuntCrossleyForce, for
    instance). **/
    SimTK::Real calcPotentialEnergy(const SimTK::State& state) const;
    /** Returns kinetic plus potential energy of the whole system. Stage as for
    calcPotentialEnergy(). **/
    SimTK::Real calcEnergy(const SimTK::State& state) const;
    /**@}**/

    const SimTK::MultibodySystem& getMultibodySystem() const;

    const Guts& getGuts() const;
    Guts& updGuts();
};

}  // namespace simflex
