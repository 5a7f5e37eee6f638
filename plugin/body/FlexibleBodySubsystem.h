#pragma once
/** @file
The force subsystem that owns a system's flexible bodies, their joints and their forces.

Construct it after every other force subsystem; elements may be added to those at any time. It
applies elastic, damping and velocity-dependent forces, and those of the elements in simflex/forces,
whenever Simbody itself realizes Stage::Dynamics.

Simbody's mass matrix lacks `ΔM = [I(ξ)−I₀, C; Cᵀ, 0]` of a flexible body. The subsystem reads the
forces of all others, solves for the exact u̇ by block elimination and applies `−ΔM u̇` too, so that
Simbody's own accelerations, multipliers and reaction forces are exact and any SimTK::Integrator can
run the model:

    State state = system.realizeTopology();
    ...                                  // place the bodies
    flexible.initializeNative(state);    // joints assembled, weights in metres
    RungeKuttaMersonIntegrator integrator(system);
    integrator.setAccuracy(1e-6);
    TimeStepper stepper(system, integrator);
    stepper.initialize(state);
    stepper.stepTo(0.1);

BdfIntegrator evaluates everything itself and is much faster with many modes or joints.

What a native run refuses, by name, when Stage::Dynamics is realized: joints with friction, bodies
mobilized on the frame or on a modal mobilizer of a flexible body, constraints on the *body* of a
modal mobilizer, Motions of method Fast. Forces on the body of a modal mobilizer are none; those on
its mobilities are modal forces. **/

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

    /** The flexible subsystem of a system, or null. **/
    static const FlexibleBodySubsystem* find(const SimTK::System& system);

    int getNumBodies() const;
    FlexibleBody getBody(FlexibleBodyIndex index) const;
    /** What messages call a rigid body: "crank" instead of "body 3". **/
    void nameBody(SimTK::MobilizedBodyIndex body, const std::string& name);
    int getNumJoints() const;
    Joint getJoint(JointIndex index) const;
    /** What a State holds together beyond its coordinates: 1 for each of Simbody's constraints that
    is enabled, 0 for others, then where each joint is locked. Stage::Model. **/
    SimTK::Vector getHolding(const SimTK::State& state) const;
    /** @throws std::invalid_argument if it is of another system. **/
    void setHolding(SimTK::State& state, const SimTK::Vector& holding) const;

    /** Adds a force element; the subsystem takes it over. **/
    void adoptForceElement(std::unique_ptr<ForceElement> element);
    /** @name Force elements that have left their range (ForceElement::describeOutOfRange())
     **/
    /**@{**/
    bool hasElementsWithRange() const;
    /** What is said of them, by number of the element. Stage::Velocity.
    @param elapsed  time of the motion between the last State that was looked at and this [s] **/
    std::map<int, std::string> describeElementsOutOfRange(const SimTK::State& state,
                                                          SimTK::Real elapsed = 0) const;
    /**@}**/

    /** @name First-order equations beside those of motion **/
    /**@{**/
    /** Adds one; the subsystem takes it over.
    @returns its number, which is that of its value among ElementInputs::states. **/
    int adoptState(std::unique_ptr<StateEquation> equation);
    int getNumStates() const;
    const std::string& getStateName(int index) const;
    SimTK::Real getStateValue(const SimTK::State& state, int index) const;
    void setStateValue(SimTK::State& state, int index, SimTK::Real value) const;
    /**@}**/

    /** Gets a State ready for one of Simbody's own integrators: sets locked and prescribed
    coordinates, assembles joints and constraints and makes speeds consistent as
    ImplicitIntegrator::initialize() does (by least deformation, and as if bodies were rigid, as far
    as joints allow; without flexible bodies by Simbody's own projection), so that both begin alike.
    Then sets the speeds' weights in Simbody's error norms and projections so that an accuracy or
    tolerance means metres for flexible bodies: 1 for translation, the part's radius for rotation,
    for a mode the largest displacement it causes. Weights of other bodies are left alone. States
    that follow from where the bodies are begin at their values. The State is realized to
    Stage::Velocity.
    @param tolerance  largest constraint error left [m, rad]
    @throws std::invalid_argument as requireLinearRange() (LinearRangeReporter.h) does.
    @throws std::runtime_error if the constraints cannot be assembled, naming the worst one; the
    State is what it was then. **/
    void initializeNative(SimTK::State& state, SimTK::Real tolerance = 1e-10) const;
    /** The positions and speeds of that, whatever integrates then. @throws the same, but for
    friction. **/
    void closeJoints(SimTK::State& state, SimTK::Real tolerance = 1e-10) const;

    /** Holds the modal coordinates of all bodies in a SimTK::Assembler as they are in its State.
    Without that it bends parts by metres for nothing, since it knows no stiffness.

        Assembler assembler(system);
        flexible.lockModes(assembler);
        assembler.assemble(state);

    Parts then move rigidly; where they have to bend to meet, leave the assembly to
    ImplicitIntegrator or initializeNative(), which find the least deformation. **/
    void lockModes(SimTK::Assembler& assembler) const;

    /** @name Quantities of the whole system, flexible bodies with their full inertia. The same in
    native runs and in those of BdfIntegrator; MultibodySystem::calcKineticEnergy() and
    SimbodyMatterSubsystem's momenta lack the flexible bodies' ΔM. **/
    /**@{**/
    /** Stage::Velocity. **/
    SimTK::Real calcKineticEnergy(const SimTK::State& state) const;
    /** Angular momentum about Ground's origin and linear momentum, in Ground [kg m²/s, kg m/s].
     * Stage::Velocity. **/
    SimTK::SpatialVec calcMomentum(const SimTK::State& state) const;
    /** Strain energy, gravity and whatever else stores energy. Stage::Velocity; Stage::Dynamics
    with elements of Simbody's that know their energy then only (HuntCrossleyForce, say). **/
    SimTK::Real calcPotentialEnergy(const SimTK::State& state) const;
    /** Kinetic plus potential energy of the whole system. Stage as for the potential energy. **/
    SimTK::Real calcEnergy(const SimTK::State& state) const;
    /**@}**/

    const SimTK::MultibodySystem& getMultibodySystem() const;

    const Guts& getGuts() const;
    Guts& updGuts();
};

}  // namespace simflex
