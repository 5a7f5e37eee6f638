#pragma once
/** @file
Implicit integration of a SimTK::MultibodySystem with flexible bodies: what BdfIntegrator,
RadauIntegrator and GeneralizedAlphaIntegrator have in common. Every step solves

    M(q) u̇ + b(q, u) − f(q, u, t) + G(q)ᵀλ = 0

at its end, by Newton's iteration with block Gaussian elimination, together with `G u = 0`
(StabilizedIndex2; q is then projected onto the joints in the norm of the Newton matrix) or with
the position errors themselves (Index3).

    RadauIntegrator integrator(system);    // or BdfIntegrator, GeneralizedAlphaIntegrator
    integrator.setAccuracy(1e-6);
    integrator.initialize(state);   // assembles, finds consistent speeds and accelerations
    integrator.stepTo(0.1);
    const State& now = integrator.getState();

Names follow SimTK::Integrator and SimTK::TimeStepper, and so do events: Initialization handlers
and Measures are called by initialize(), reporters on interpolated states, scheduled and triggered
handlers (triggers located by root finding within their required window), TimeAdvanced and
Termination handlers at the ends of steps. Handlers may change anything in the State. Where a
handler changes forces only, and by so little that a step does not feel it, steps and orders go on
as if nothing had been; else the step after it starts at order 2 from new accelerations. Auto-update
variables (Measure::Extreme, Delay) are updated after every step, with the State realized to
Stage::Acceleration then: Simbody's exact accelerations and multipliers, which cost far more time
than a step where there are many joints. Auxiliary variables z (Measure::Integrate) are integrated
along, ż taken from Simbody with the scheme's own u̇ for accelerations; multipliers and reactions of
joints are not in them. Triggers that need Stage::Dynamics, and getState() realized so far or
further, cost one block elimination more; those that need Stage::Acceleration (a unilateral
contact's force, say) get Simbody's exact accelerations and multipliers, at the same price as
auto-update variables. Handlers find the State realized to Stage::Acceleration, with flexible bodies
to Stage::Velocity.

What else of Simbody may stand in the system:
- rigid bodies on any mobilizer, forward or reversed, with quaternions or Euler angles;
- force elements and contact subsystems of any kind; on the frame of a flexible body they move it
  but bend nothing, which forces in simflex/forces and on a Hub do;
- constraints of any kind, built-in or custom, holonomic, nonholonomic or on accelerations, on
  rigid bodies, on the frame of a flexible body and on its modal coordinates;
- lock() and lockAt() at any level and Motions on any mobilizer; with its modal mobilizers locked
  a flexible body is rigid.
Refused by name at initialize(): bodies mobilized on the frame or on a modal mobilizer of a flexible
body (put them on Ground and hold them with a Joint), constraints on the *body* of a modal mobilizer
(its coordinates can be constrained), Motions of method Fast, mobilizers whose velocities are not
the rates of their positions (Simbody 3.7's LineOrientation and FreeLine, reversed and with
quaternions). Joints and constraints that are disabled in the State hold nothing. Forces on the body
of a modal mobilizer have no effect; forces on its mobilities are modal forces.

The Newton matrix holds elasticity, damping, inertia, and the stiffness and damping of the elements
in simflex/forces. Where all is rigid, forces of any kind, contacts and friction among them, and
gyroscopic terms are taken in by differences as soon as the iteration does not do without. With
flexible bodies Simbody's own force elements, Force::Custom among them, act in the residual only
unless addForceJacobian() is told of them; what a body's motion changes in AttachmentForces and
DistributedLoads stands in its dense form alone. Very stiff ones slow Newton's iteration down and
shorten the step.

Near a singular position, where a mechanism can branch (all bars of a four-bar in one line), G loses
rank and changes faster than the iteration follows. A step of StabilizedIndex2 that fails to
converge is tried again with the position equations in Newton's system, whose exact derivative G is;
its end is projected onto the velocity equations too, u̇ and λ with it. So the mechanism stays on its
branch unless a step ends closer to the branching than its own error. Forces of joints do grow
without bound towards such a position. **/

#include <functional>
#include <iosfwd>
#include <memory>
#include <string>
#include <vector>

#include "simflex/body/Joint.h"
#include "simflex/solver/IntegratorStatistics.h"
#include "simflex/solver/IntegratorStatuses.h"

namespace simflex {

template <class Scalar>
struct BasicNewtonSystem;
using NewtonSystem = BasicNewtonSystem<double>;

class ImplicitIntegrator : public IntegratorStatuses {
public:
    enum class Formulation { StabilizedIndex2, Index3 };

    /** Inside a flexible body's block: `Arrow` leaves gyroscopic and centrifugal terms out of the
    Newton matrix, `Dense` has all; `Automatic` starts with Arrow and changes when it stops
    converging. The solution is the same. **/
    enum class BlockForm { Automatic, Arrow, Dense };

    /** What setAccuracy() is in. **/
    enum class AccuracyNorm {
        /** Displacement with a FlexibleBodySubsystem, with Index3 and with fixed steps; else
        StateWeights. **/
        Automatic,
        Displacement,  ///< metres of displacement anywhere on a body
        /** As SimTK::Integrator has it: relative to values of u and z, or to the units that the
        State's weights give, if these are larger; q through N. RMS or infinity norms, as
        setUseInfinityNorm() says. **/
        StateWeights
    };

    /** Thresholds of the Newton iteration; converged when changes of displacements *and*
    multipliers, or residuals of bodies *and* constraints, are below them. **/
    struct NewtonTolerances {
        /** Largest change γΔu, as a fraction of the accuracy. Unless set, 1e-3 for Radau, 1e-4
        where it keeps matrices for several steps because they are large, and 0.1 for BDF where the
        accuracy is Simbody's, which counts changes of u as well, and orders are high. **/
        SimTK::Real displacement = 3e-4;
        /** Change of λ relative to the largest λ, moments by the forces that do the same at the
        distance of a body's size; 1e-4 for Radau and in the same case of BDF. **/
        SimTK::Real multiplier = 1e-5;
        SimTK::Real bodyResidual = 1e-11;  ///< relative to the largest force, in the same way
        /** G u as a rate of displacements, angles by the lengths over which they act; relative to
        the largest speed of a displacement, or to the accuracy in 1e-6 s. **/
        SimTK::Real constraintResidual = 1e-12;
        int maxIterations = 8;
    };

    /** By what the speeds of an inconsistent State change least when they are brought onto the
    constraints, and its positions. `Weights`: as in SimTK::Integrator, by the State's uWeights, all
    1 unless set; flexible bodies bend for it. `Inertia`: by kinetic energy, as if by an impulse,
    and positions by strain energy first. `Automatic`: Weights where there are no flexible bodies,
    so that the start is Simbody's, Inertia where there are. **/
    enum class ProjectionNorm { Automatic, Weights, Inertia };

    /** Why stepTo() returned. It stands for one of Simbody's statuses too: the final time is
    EndOfSimulation when it was reached before. **/
    class StepStatus {
    public:
        /** Interrupted: before the time asked for, because of setStepObserver(),
        setReturnEveryInternalStep() or setInternalStepLimit(). **/
        enum Value { ReachedTime, ReachedFinalTime, Terminated, Interrupted };

        constexpr StepStatus() = default;
        constexpr StepStatus(Value value, SuccessfulStepStatus simbodys)
            : m_value(value), m_simbodys(simbodys) {}
        constexpr Value getValue() const { return m_value; }
        constexpr operator SuccessfulStepStatus() const { return m_simbodys; }
        friend constexpr bool operator==(StepStatus status, Value value) {
            return status.m_value == value;
        }
        friend constexpr bool operator!=(StepStatus status, Value value) {
            return status.m_value != value;
        }

    private:
        Value m_value = ReachedTime;
        SuccessfulStepStatus m_simbodys = InvalidSuccessfulStepStatus;
    };

    virtual ~ImplicitIntegrator();
    ImplicitIntegrator(ImplicitIntegrator&&) noexcept;
    ImplicitIntegrator& operator=(ImplicitIntegrator&&) noexcept;

    /** @name Settings
    Those that SimTK::Integrator has too may be called at any time, with the same meaning: accuracy,
    constraint tolerance and initial step size count from the next initialize() on, the others at
    once. So do setNumThreads() and the observers. An integration keeps the rest as it was begun
    with: after initialize() they are refused. **/
    /**@{**/
    /** Local error allowed per step; default 1e-6. With order p the global error falls as
    accuracy^(p/(p+1)); Radau's is about as large as the accuracy.

    In a system of Simbody's own parts it means what SimTK::Integrator's means, so that programs
    keep their numbers. With a FlexibleBodySubsystem it is metres of displacement anywhere on a
    body: speeds of modes have no size of their own, and near singular positions of joints speeds
    change as fast as they like. setAccuracyNorm() says otherwise. **/
    void setAccuracy(SimTK::Real accuracy);
    /** @throws std::invalid_argument from initialize(): StateWeights with a flexible body. **/
    void setAccuracyNorm(AccuracyNorm norm);
    /** Largest joint position error left by a step [m, rad]; default 1e-10, or a hundredth of the
    accuracy if that is less; a tenth of the accuracy where that is Simbody's. Index3 solves the
    position equations themselves and is not projected: its errors follow from the Newton
    tolerances. **/
    void setConstraintTolerance(SimTK::Real tolerance);
    void setFormulation(Formulation formulation);
    void setBlockForm(BlockForm form);
    void setInitialStepSize(SimTK::Real h);
    /** Default: the System's getDefaultTimeScale(), 0.1 s unless set. Nothing that happens is
    faster than that, and what begins while all is at rest has to be met: with it, loads that are
    off by more than the accuracy at any of four points inside of a step reject the step, so that a
    Force::Custom or AttachmentForce that acts for a third of the longest step or more is seen.
    Shorter ones need addBreakTimes(). Times of reports and of stepTo() have no part in it: they
    change no bit of the motion. **/
    void setMaximumStepSize(SimTK::Real h);
    void setMinimumStepSize(SimTK::Real h);
    /** Steps of exactly h with no error control, for convergence studies. **/
    void setFixedStep(SimTK::Real h);
    void setFixedStepSize(SimTK::Real h) { setFixedStep(h); }
    void setNewtonTolerances(const NewtonTolerances& tolerances);
    /** No step goes beyond this time; default infinity. **/
    void setFinalTime(SimTK::Real time);
    /** Threads for the bodies, at most; default as many as OpenMP offers (OMP_NUM_THREADS). No more
    than the bodies' size can feed, and one for as long as that is faster: where other programs have
    the processors, threads wait for each other. Results do not depend on it. **/
    void setNumThreads(int threads);
    /** Known times at which loads or motions jump or have a kink. A step ends at each, and the next
    begins with what holds after it: functions of time are evaluated a little (1e-14 s, or of t)
    before it and after, so it does not matter which side their own comparison takes. A load that
    acts between two steps' ends only is seen by sampling, or not at all; a break is never passed
    over. Times of several calls add up. **/
    void addBreakTimes(std::vector<SimTK::Real> times);
    /** The same for times without end, those of a pulse train, say.
    @param next  returns the first break after a time, Infinity if there is none **/
    void addBreakTimes(std::function<SimTK::Real(SimTK::Real time)> next);
    /** Skips the initial projection of positions and speeds: the State is taken as consistent
    already, however large its deformations are. **/
    void setProjectInitialState(bool project);
    /** How initialize() projects them, and the positions that a handler left. Its speeds always
    jump as by an impulse: momentum is kept wherever joints and prescribed speeds leave motions
    free. **/
    void setProjectionNorm(ProjectionNorm norm);
    /** Whether steps may go beyond times of reports, which then see interpolated States; default
    true. If not, a step ends at each and at every stepTo(): the motion depends on them. **/
    void setAllowInterpolation(bool shouldInterpolate);
    /** Whether those are brought onto the constraints; default true. **/
    void setProjectInterpolatedStates(bool shouldProject);
    /** Nothing to do: every step ends within the constraint tolerance. **/
    void setProjectEveryStep(bool) {}
    /** In AccuracyNorm::StateWeights, from the next initialize() on, and in the projection of the
    initial State by ProjectionNorm::Weights: infinity norms, where the worst coordinate counts,
    rather than root-mean-square ones, the default as in SimTK::Integrator. **/
    void setUseInfinityNorm(bool useInfinityNorm);
    bool isInfinityNormInUse() const;
    /** Forms and factors Newton's matrix in every iteration; costs time. **/
    void setForceFullNewton(bool forceFullNewton);
    /** At how many places of a step, its end one of them, event triggers are looked at; 1 unless
    set. What changes its sign twice between two of them is overlooked. **/
    void setTriggerSamples(int count);
    /** stepTo() and stepBy() return after so many internal steps; 0 or less: no limit. **/
    void setInternalStepLimit(int steps);
    /** stepTo() and stepBy() return after every internal step. **/
    void setReturnEveryInternalStep(bool shouldReturn);
    /** Takes the stiffness and damping
    of one of Simbody's force elements, a Force::Custom say, into the Newton matrix: by central
    differences in the speeds that it depends on, two evaluations of it for each speed whenever the
    matrix is formed. Only convergence changes, not the solution. What acts within one tree of rigid
    bodies is taken in full. Elsewhere it is the symmetric part, in its 24 largest terms: springs,
    dampers and contacts, not what follower forces and friction have besides.
    @param bodies  what it acts on and depends on. Flexible bodies by FlexibleBody::getFrame() and
        their modal mobilizers. None: those that it acts on or depends on in the State given to
        initialize(), found by trying, which does not see contacts that are open then. Of a
        CableSpring, which may be slack: those of its path. **/
    void addForceJacobian(const SimTK::Force& force,
                          const std::vector<SimTK::MobilizedBodyIndex>& bodies = {});
    /** The same for all of Simbody's force elements and contact subsystems together that act
    between these bodies. **/
    void addForceJacobian(const std::vector<SimTK::MobilizedBodyIndex>& bodies);
    /** Called with every Newton system just before it is solved; for tests and benchmarks. **/
    void setNewtonSystemObserver(std::function<void(const NewtonSystem&)> observer);
    /** Called after every internal step with the time that it has reached, maybe beyond that of
    getState(). If it returns false, stepTo() returns at once: getState() stays where it was, and a
    later stepTo() goes on as if nothing had been. **/
    void setStepObserver(std::function<bool(SimTK::Real time)> observer);
    /**@}**/

    /** Takes the State over: assembles joints and constraints, makes speeds, accelerations and
    multipliers consistent, and handles the Initialization event. Locked and prescribed coordinates
    are set first and stay. Systems without flexible bodies begin where SimTK::Integrator would, by
    the same projection (to this integrator's constraint tolerance), Joints among rigid bodies
    included; where that fails, and with flexible bodies, positions are found by least deformation
    and speeds by least kinetic energy: see setProjectionNorm().
    @throws std::invalid_argument that names what cannot be supported, or a flexible body that is
    deformed far beyond what modes describe, as SimTK::Assembler leaves it
    @throws std::runtime_error if the joints cannot be assembled, naming the worst joint and its
    error. **/
    void initialize(const SimTK::State& state);

    /** Advances to `time`, calling reporters and handlers on the way, as SimTK::TimeStepper does.
    @throws std::invalid_argument if `time` is not a number or already passed.
    @throws std::runtime_error if a step cannot be taken: body or joint, time and residual; the last
    good State stays. **/
    StepStatus stepTo(SimTK::Real time);

    /** Takes one internal step, of whatever size the error control chooses (a few with event
    triggers about), and calls the reporters and handlers it passes. **/
    StepStatus stepOnce();

    /** Calls a handler as if an event were due at the time of getState(): it may change anything in
    the State, and returns true to end the simulation.
    @throws std::logic_error within a step, isStateInterpolated(). **/
    void handle(const std::function<bool(SimTK::State& state)>& handler);

    /** @name Steps without events handled
    As in SimTK::Integrator: what is due is returned for the caller to handle, by
    `system.handleEvents(integrator.updAdvancedState(), …)` and reinitialize(), say. The first call
    after initialize() returns StartOfContinuousInterval without a step. **/
    /**@{**/
    /** No step passes `scheduledEventTime`. (stepTo() with one argument handles events; to have
    them returned, give Infinity here, or call through an IntegratorRef.) **/
    SuccessfulStepStatus stepTo(SimTK::Real reportTime, SimTK::Real scheduledEventTime);
    /** The same, with times from now on. **/
    SuccessfulStepStatus stepBy(SimTK::Real interval,
                                SimTK::Real scheduledEventInterval = SimTK::Infinity);
    /** Goes on from what was changed in updAdvancedState(); with shouldTerminate the simulation is
    over. **/
    void reinitialize(SimTK::Stage lowestChangedStage, bool shouldTerminate);

    /** @name After ReachedEventTrigger
    @throws std::logic_error at other times. **/
    /**@{**/
    SimTK::Vec2 getEventWindow() const;
    const SimTK::Array_<SimTK::EventId>& getTriggeredEvents() const;
    const SimTK::Array_<SimTK::Real>& getEstimatedEventTimes() const;
    const SimTK::Array_<SimTK::Event::Trigger>& getEventTransitionsSeen() const;
    /**@}**/
    /**@}**/

    bool isSimulationOver() const;
    TerminationReason getTerminationReason() const;

    /** @name Checkpoints **/
    /**@{**/
    /** Writes all that decides on the steps to come (binary; open the stream so): an integrator
    that reads it goes on with the same bits, in states, multipliers and counts, with any number of
    threads. What the system's own objects keep outside the State (a reporter's file, say) is not in
    it. Write to a new file and rename it, so that a killed run leaves a whole one.
    @throws std::runtime_error if the stream cannot take it, or naming the subsystem that keeps
        variables of a type that is not of numbers or text, if a handler has changed them or they
        change in every step: active contacts, Measure::Delay. **/
    void writeCheckpoint(std::ostream& stream);
    /** Instead of initialize(): goes on from a checkpoint of the same model, with the settings of
    that run; number of threads and final time may differ.
    @param start  the State that initialize() was given then
    @throws std::runtime_error if the file is damaged, or of another model or version, or other
        settings were in use **/
    void readCheckpoint(std::istream& stream, const SimTK::State& start);
    /**@}**/

    /** The State reached; realized to Stage::Velocity. **/
    const SimTK::State& getState() const;
    SimTK::Real getTime() const;
    /** True where getState() lies within the last step. **/
    bool isStateInterpolated() const;

    /** The end of the last step, which may be later than getState(). Whatever is changed in it, at
    any Stage, the next step begins with: from the changed State, projected onto the constraints,
    with new accelerations, as after an event handler. The reference is that of one State as long as
    the integrator lives. **/
    SimTK::State& updAdvancedState();
    const SimTK::State& getAdvancedState() const;
    /** The same to look at until the integrator is used next, from which nothing is taken over;
    realized to Stage::Velocity. Costs no copy of a State. **/
    const SimTK::State& showAdvancedState() const;
    SimTK::Real getAdvancedTime() const;

    /** @name At getState()
    Accelerations and multipliers are those of this State, with the loads of its time, and of its
    order, however far it is from the ends of steps. Asked for first they cost an evaluation and a
    factorization. **/
    /**@{**/
    /** u̇ in Simbody's numbering. **/
    SimTK::Vector getUDot() const;
    SimTK::Vector getMultipliers() const;  ///< all joints, in order, then Simbody's constraints,
                                           ///< then joints' friction
    SimTK::Vector getMultipliers(const Joint& joint) const;  ///< λ of one joint: [N, N m]
    /** λ of one of Simbody's own constraints, in its order: holonomic, nonholonomic, acceleration
    rows; empty if it is disabled. **/
    SimTK::Vector getMultipliers(const SimTK::Constraint& constraint) const;
    /** What a joint's dry friction does to M along its sliding rates, contact after contact
    [N, N m]; empty if it has none. See JointFriction. **/
    SimTK::Vector getFrictionForces(const Joint& joint) const;
    SimTK::Real getLastStepSize() const;
    int getLastOrder() const;
    /** The body whose error was largest in the last step, and so limits the steps; empty before the
    first. **/
    std::string getErrorSource() const;
    /** Work since initialize() of loads and dampers in simflex/forces, prescribed motions of
    joints, Motions, locked speeds and Simbody's working constraints [J], and the change of energy
    by event handlers and by the impacts that they cause. Gravity, elasticity and
    springs are potential energy; Simbody's other force elements are not counted. Integrated along
    with the scheme's own order. **/
    SimTK::Real getWork() const;
    /** Largest position error of any joint at getState() [m, rad]. **/
    SimTK::Real getLargestConstraintError() const;
    /** One line for each constraint equation that follows from others, as the last factorization
    found them: "equation 3 of 'gudgeon pin' follows from 'main bearing', 'crank pin'". Multipliers
    of such joints are those of least norm. **/
    std::vector<std::string> getRedundantConstraints() const;
    const IntegratorStatistics& getStatistics() const;
    /**@}**/

    /** @name The method **/
    /**@{**/
    const char* getMethodName() const;  ///< "Bdf", "Radau", "GeneralizedAlpha"
    int getMethodMinOrder() const;
    int getMethodMaxOrder() const;
    bool methodHasErrorControl() const { return true; }
    SimTK::Real getAccuracyInUse() const;
    SimTK::Real getConstraintToleranceInUse() const;
    /**@}**/

    /** @name Counts under SimTK::Integrator's names
    Since initialize() or resetAllStatistics(); getStatistics() goes on counting and says more. **/
    /**@{**/
    void resetAllStatistics();
    SimTK::Real getActualInitialStepSizeTaken() const;  ///< NaN before the first step
    SimTK::Real getPreviousStepSizeTaken() const { return getLastStepSize(); }
    SimTK::Real getPredictedNextStepSize() const;
    int getNumStepsAttempted() const;
    int getNumStepsTaken() const;
    /** Evaluations of the equations of motion: one for each iteration of Newton's, projection and
    start. **/
    int getNumRealizations() const;
    int getNumQProjections() const;
    int getNumUProjections() const;
    int getNumProjections() const { return getNumQProjections() + getNumUProjections(); }
    int getNumErrorTestFailures() const;
    int getNumConvergenceTestFailures() const;
    int getNumRealizationFailures() const;
    int getNumQProjectionFailures() const;
    int getNumUProjectionFailures() const { return 0; }
    int getNumProjectionFailures() const { return getNumQProjectionFailures(); }
    int getNumConvergentIterations() const;
    int getNumDivergentIterations() const;
    int getNumIterations() const;
    /**@}**/

protected:
    class Implementation;
    explicit ImplicitIntegrator(std::unique_ptr<Implementation> implementation);
    /** @throws std::logic_error if this integrator was moved from. **/
    Implementation& updImpl() const;

private:
    friend class TimeStepper;
    std::unique_ptr<Implementation> m_impl;
};

}  // namespace simflex
