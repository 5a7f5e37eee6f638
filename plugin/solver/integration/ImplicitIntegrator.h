#pragma once
/** @file
Implicit integration of a SimTK::MultibodySystem with flexible bodies: the common base of
BdfIntegrator, RadauIntegrator and GeneralizedAlphaIntegrator. Each step solves

    M(q) u̇ + b(q, u) − f(q, u, t) + G(q)ᵀλ = 0

at its end by Newton's method with block Gaussian elimination, together with `G u = 0`
(StabilizedIndex2; q is then projected onto the joints in the norm of the Newton matrix) or with
the position constraints themselves (Index3).

    RadauIntegrator integrator(system);    // or BdfIntegrator, GeneralizedAlphaIntegrator
    integrator.setAccuracy(1e-6);
    integrator.initialize(state);   // assembles, finds consistent speeds and accelerations
    integrator.stepTo(0.1);
    const State& now = integrator.getState();

Names and events follow SimTK::Integrator and SimTK::TimeStepper. initialize() calls Initialization
handlers and initializes Measures. Reporters see interpolated states. Triggered events are located
by root finding within their required window; TimeAdvanced and Termination handlers run at the ends
of steps. Handlers may change anything in the State, which is realized to Stage::Acceleration for
them, or to Stage::Velocity with flexible bodies. If a handler changes only forces, by too little to
affect the step, step size and order are kept; otherwise the next step starts at order 2 from new
accelerations.

Auto-update variables (Measure::Extreme, Delay) are updated after every step. This realizes the
State to Stage::Acceleration, with Simbody's exact accelerations and multipliers, which costs far
more than a step where there are many joints. Auxiliary variables z (Measure::Integrate) are
integrated too: Simbody evaluates ż at the scheme's own u̇, without multipliers and joint reactions.
Triggers at Stage::Dynamics, and getState() realized that far or further, cost one extra block
elimination. Triggers at Stage::Acceleration (a unilateral contact's force, say) use Simbody's exact
accelerations and multipliers, at the same cost as auto-update variables.

The system may also contain:
- rigid bodies on any mobilizer, forward or reversed, with quaternions or Euler angles;
- force elements and contact subsystems of any kind; on the frame of a flexible body they move it
  but do not bend it, unlike forces in simflex/forces and forces on a Hub;
- constraints of any kind, built-in or custom, holonomic, nonholonomic or on accelerations, on
  rigid bodies, on the frame of a flexible body and on its modal coordinates;
- lock() and lockAt() at any level and Motions on any mobilizer; a flexible body is rigid while its
  modal mobilizers are locked.
initialize() refuses by name: bodies mobilized on the frame or on a modal mobilizer of a flexible
body (put them on Ground and attach them with a Joint), constraints on the *body* of a modal
mobilizer (its coordinates can be constrained), Motions of method Fast, and mobilizers whose speeds
are not the rates of their positions (Simbody 3.7's LineOrientation and FreeLine, reversed and with
quaternions). Joints and constraints disabled in the State are ignored. Forces on the body of a
modal mobilizer have no effect; forces on its mobilities are modal forces.

The Newton matrix contains elasticity, damping, inertia, and the stiffness and damping of the
elements in simflex/forces. In all-rigid systems, forces of any kind, contact and friction included,
and gyroscopic terms are added by finite differences once the iteration needs them. With flexible
bodies, Simbody's own force elements, Force::Custom among them, enter the residual only, unless they
are registered with addForceJacobian(); the dependence of AttachmentForces and DistributedLoads on a
body's motion is in its dense form only. Very stiff force elements slow Newton's method down and
shorten the step.

Near a singular position, where a mechanism can branch (all bars of a four-bar in one line), G loses
rank and changes faster than the iteration can follow. A StabilizedIndex2 step that fails to
converge is retried with the position constraints in the Newton system, since G is their exact
derivative; its end is then projected onto the velocity constraints too, with u̇ and λ. The
mechanism stays on its branch unless a step ends closer to the singular position than its own
error. Joint forces grow without bound towards such a position. **/

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

    /** Newton matrix of a flexible body: `Arrow` omits gyroscopic and centrifugal terms, `Dense`
    includes all; `Automatic` starts with Arrow and switches when convergence fails. The solution is
    the same. **/
    enum class BlockForm { Automatic, Arrow, Dense };

    /** Norm in which setAccuracy() bounds the local error. **/
    enum class AccuracyNorm {
        /** Displacement with a FlexibleBodySubsystem, with Index3 and with fixed steps; otherwise
        StateWeights. **/
        Automatic,
        Displacement,  ///< metres of displacement anywhere on a body
        /** As in SimTK::Integrator: relative to the values of u and z, or to the units given by the
        State's weights if these are larger; q through N. RMS or infinity norm, see
        setUseInfinityNorm(). **/
        StateWeights
    };

    /** Thresholds of the Newton iteration. It has converged when changes of displacements *and*
    multipliers, or residuals of bodies *and* constraints, are below them. **/
    struct NewtonTolerances {
        /** Largest change γΔu, as a fraction of the accuracy. Default: 1e-3 for Radau, or 1e-4
        where it keeps large matrices for several steps; 0.1 for BDF at high orders where accuracy
        is measured as in Simbody, which counts changes of u as well; 3e-4 otherwise. **/
        SimTK::Real displacement = 3e-4;
        /** Change of λ relative to the largest λ; moments count as the forces that cause them at
        the distance of a body's size. Default: 1e-4 for Radau and in the same case of BDF. **/
        SimTK::Real multiplier = 1e-5;
        SimTK::Real bodyResidual = 1e-11;  ///< relative to the largest force, in the same way
        /** G u as a rate of displacements, angles by the lengths over which they act; relative to
        the largest speed of a displacement, or to the accuracy in 1e-6 s. **/
        SimTK::Real constraintResidual = 1e-12;
        int maxIterations = 8;
    };

    /** Norm in which bringing an inconsistent State onto the constraints changes it least.
    `Weights`: the State's uWeights, all 1 by default, as in SimTK::Integrator; bends flexible
    bodies. `Inertia`: kinetic energy for speeds, as by an impulse, and strain energy first for
    positions. `Automatic`: Weights without flexible bodies, so that the start is Simbody's, Inertia
    with them. **/
    enum class ProjectionNorm { Automatic, Weights, Inertia };

    /** Why stepTo() returned. Converts to Simbody's status: a final time reached in an earlier call
    is EndOfSimulation. **/
    class StepStatus {
    public:
        /** Interrupted: stopped before the requested time by setStepObserver(),
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
    Settings of SimTK::Integrator may be changed at any time, also by event handlers and observers:
    accuracy, its norm, constraint tolerance and initial step size take effect at the next
    initialize(), the others from the next step on, as do setNumThreads() and the observers. All
    other settings are fixed by initialize() and refused after it. **/
    /**@{**/
    /** Local error allowed per step; default 1e-6. At order p the global error falls as
    accuracy^(p/(p+1)); Radau's is about as large as the accuracy.

    In a system of Simbody's own parts the accuracy means the same as in SimTK::Integrator. With a
    FlexibleBodySubsystem it is metres of displacement anywhere on a body, because modal speeds have
    no natural scale and speeds can change arbitrarily fast near singular positions of joints. See
    setAccuracyNorm(). **/
    void setAccuracy(SimTK::Real accuracy);
    /** @throws std::invalid_argument from initialize() for StateWeights with a flexible body. **/
    void setAccuracyNorm(AccuracyNorm norm);
    /** Largest joint position error left by a step [m, rad]. Default: 1e-10, or a hundredth of the
    accuracy if that is less; a tenth of the accuracy in Simbody's norm. Index3 solves the position
    constraints without projection, so its errors follow from the Newton tolerances. **/
    void setConstraintTolerance(SimTK::Real tolerance);
    void setFormulation(Formulation formulation);
    void setBlockForm(BlockForm form);
    void setInitialStepSize(SimTK::Real h);
    /** Default: the System's getDefaultTimeScale(), which is 0.1 s unless set. The limit ensures
    that loads which begin while the system is at rest are detected: a step is rejected if loads at
    any of four points inside it are off by more than the accuracy, so a Force::Custom or
    AttachmentForce that acts for a third of the longest step or more is found. Shorter loads need
    addBreakTimes(). Report times and stepTo() times do not change a bit of the motion. **/
    void setMaximumStepSize(SimTK::Real h);
    void setMinimumStepSize(SimTK::Real h);
    /** Steps of exactly h with no error control, for convergence studies. What depends on it by
    default (order, tolerances, norm) follows when it is set. **/
    void setFixedStep(SimTK::Real h);
    void setFixedStepSize(SimTK::Real h) { setFixedStep(h); }
    void setNewtonTolerances(const NewtonTolerances& tolerances);
    /** No step goes beyond this time; default infinity. **/
    void setFinalTime(SimTK::Real time);
    /** Maximum number of threads for the bodies; default OpenMP's (OMP_NUM_THREADS). Small systems
    use fewer, and one while that is faster, because threads wait for each other when other programs
    occupy the processors. Results do not depend on it. **/
    void setNumThreads(int threads);
    /** Known times at which loads or motions jump or have a kink. A step ends at each. Functions of
    time are evaluated slightly (1e-14 s, or 1e-14 t) before and after it, so it does not matter to
    which side their own comparison assigns it. A load that acts only between two ends of steps is
    found by sampling or missed; a break time is never missed. Calls accumulate. **/
    void addBreakTimes(std::vector<SimTK::Real> times);
    /** Adds an unbounded sequence of break times, of a pulse train, say.
    @param next  returns the first break after a time, Infinity if there is none **/
    void addBreakTimes(std::function<SimTK::Real(SimTK::Real time)> next);
    /** False skips the initial projection of positions and speeds: the State is taken as
    consistent, however large its deformations are. **/
    void setProjectInitialState(bool project);
    /** Norm in which initialize() projects positions and speeds, and in which positions are
    projected after a handler. Speeds after a handler always jump as by an impulse: momentum is
    conserved along all motions that joints and prescribed speeds leave free. **/
    void setProjectionNorm(ProjectionNorm norm);
    /** Whether steps may pass report times, at which States are then interpolated; default true. If
    false, a step ends at each report and stepTo() time, so the motion depends on them. **/
    void setAllowInterpolation(bool shouldInterpolate);
    /** Whether interpolated States are projected onto the constraints; default true. **/
    void setProjectInterpolatedStates(bool shouldProject);
    /** No effect: every step ends within the constraint tolerance. **/
    void setProjectEveryStep(bool) {}
    /** Selects the infinity norm (worst coordinate) instead of the default RMS norm, as in
    SimTK::Integrator, for AccuracyNorm::StateWeights and for projections by
    ProjectionNorm::Weights. **/
    void setUseInfinityNorm(bool useInfinityNorm);
    bool isInfinityNormInUse() const;
    /** Forms and factors the Newton matrix in every iteration, at a cost in time. **/
    void setForceFullNewton(bool forceFullNewton);
    /** Number of points of a step, its end included, at which event triggers are evaluated; default
    1. Two sign changes between neighbouring points are missed. **/
    void setTriggerSamples(int count);
    /** Makes stepTo() and stepBy() return after this many internal steps; 0 or less: no limit. **/
    void setInternalStepLimit(int steps);
    /** Makes stepTo() and stepBy() return after every internal step. **/
    void setReturnEveryInternalStep(bool shouldReturn);
    /** Adds the stiffness and damping of one of Simbody's force elements, a Force::Custom say, to
    the Newton matrix, by central differences: two evaluations for each speed it depends on,
    whenever the matrix is formed. Only convergence changes, not the solution. Terms within one tree
    of rigid bodies are complete. Elsewhere only the 24 largest terms of the symmetric part are
    kept: springs, dampers and contacts, but not the unsymmetric part of follower forces and
    friction.
    @param bodies  bodies that the force acts on and depends on; flexible bodies by
        FlexibleBody::getFrame() and their modal mobilizers. If empty, they are found by probing in
        the State given to initialize(), where contacts that are open are missed; for a CableSpring,
        which may be slack, they are those of its path. **/
    void addForceJacobian(const SimTK::Force& force,
                          const std::vector<SimTK::MobilizedBodyIndex>& bodies = {});
    /** The same for the sum of all of Simbody's force elements and contact subsystems that act
    between these bodies. **/
    void addForceJacobian(const std::vector<SimTK::MobilizedBodyIndex>& bodies);
    /** Called with every Newton system before it is solved; for tests and benchmarks. **/
    void setNewtonSystemObserver(std::function<void(const NewtonSystem&)> observer);
    /** Called after every internal step with the time reached, which may be beyond getState(). If
    it returns false, stepTo() returns at once: getState() does not advance, and a later stepTo()
    continues as if not interrupted. **/
    void setStepObserver(std::function<bool(SimTK::Real time)> observer);
    /**@}**/

    /** Starts from this State: assembles joints and constraints, makes speeds, accelerations and
    multipliers consistent, and handles the Initialization event. Locked and prescribed coordinates
    are set first and stay fixed. Systems without flexible bodies, Joints among rigid bodies
    included, start where SimTK::Integrator would, by the same projection (to this integrator's
    constraint tolerance). If that fails, and with flexible bodies, positions are found by least
    deformation and speeds by least kinetic energy: see setProjectionNorm().
    @throws std::invalid_argument that names an unsupported element, or a flexible body deformed far
    beyond the range of its modes, as SimTK::Assembler may leave it
    @throws std::runtime_error if the joints cannot be assembled, naming the worst joint and its
    error. **/
    void initialize(const SimTK::State& state);

    /** Advances to `time`, calling reporters and handlers on the way, as SimTK::TimeStepper does.
    @throws std::invalid_argument if `time` is not a number or has passed.
    @throws std::runtime_error if a step fails, naming body or joint, time and residual; the last
    good State is kept. **/
    StepStatus stepTo(SimTK::Real time);

    /** Takes one internal step of the size chosen by error control (or a few near event triggers),
    and calls the reporters and handlers due in it. **/
    StepStatus stepOnce();

    /** Calls a handler as if an event were due at the time of getState(). It may change anything in
    the State, and returns true to end the simulation.
    @throws std::logic_error within a step, isStateInterpolated(). **/
    void handle(const std::function<bool(SimTK::State& state)>& handler);

    /** @name Steps without event handling
    As in SimTK::Integrator, due events are returned to the caller, who handles them by
    `system.handleEvents(integrator.updAdvancedState(), …)` and reinitialize(), say. The first call
    after initialize() returns StartOfContinuousInterval without a step. **/
    /**@{**/
    /** No step passes `scheduledEventTime`. stepTo() with one argument handles events itself; to
    have them returned, pass Infinity here, or call through an IntegratorRef. **/
    SuccessfulStepStatus stepTo(SimTK::Real reportTime, SimTK::Real scheduledEventTime);
    /** The same with intervals from the current time. **/
    SuccessfulStepStatus stepBy(SimTK::Real interval,
                                SimTK::Real scheduledEventInterval = SimTK::Infinity);
    /** Continues after changes to updAdvancedState(); with shouldTerminate the simulation ends. **/
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
    /** Writes everything that determines later steps (binary; open the stream as such). An
    integrator that reads it continues bit for bit in states, multipliers and counts, with any
    number of threads. Data that the system's own objects keep outside the State (a reporter's file,
    say) is not included. Write to a new file and rename it, so that a killed run leaves an intact
    file.
    @throws std::runtime_error if writing fails, or naming the subsystem whose variables are not of
        numbers or text, if a handler has changed them or they change in every step: active
        contacts, Measure::Delay. **/
    void writeCheckpoint(std::ostream& stream);
    /** Continues from a checkpoint of the same model, instead of initialize(). Settings must be
    those of that run; number of threads and final time may differ.
    @param start  the State given to initialize() in that run
    @throws std::runtime_error if the file is damaged, or of another model or version, or the
        settings differ **/
    void readCheckpoint(std::istream& stream, const SimTK::State& start);
    /**@}**/

    /** The current State, realized to Stage::Velocity. **/
    const SimTK::State& getState() const;
    SimTK::Real getTime() const;
    /** True if getState() lies within the last step. **/
    bool isStateInterpolated() const;

    /** The end of the last step, which may be later than getState(). The next step starts from the
    State as changed here, at any Stage: projected onto the constraints, with new accelerations, as
    after an event handler. The reference stays valid as long as the integrator lives.
    @throws std::logic_error from a reporter, handler or observer; a handler changes the State that
        it is given. **/
    SimTK::State& updAdvancedState();
    const SimTK::State& getAdvancedState() const;
    /** Read-only advanced State, realized to Stage::Velocity, without a copy; valid until the
    integrator is used next. **/
    const SimTK::State& showAdvancedState() const;
    SimTK::Real getAdvancedTime() const;

    /** @name At getState()
    Accelerations and multipliers are those of this State, with the loads of its time and at the
    order of the State itself, however far it is from the ends of steps. The first request costs an
    evaluation and a factorization.
    @throws std::logic_error from a force, constraint or Newton system's observer, within a step.
    **/
    /**@{**/
    /** u̇ in Simbody's numbering. **/
    SimTK::Vector getUDot() const;
    SimTK::Vector getMultipliers() const;  ///< all joints, in order, then Simbody's constraints,
                                           ///< then joints' friction
    SimTK::Vector getMultipliers(const Joint& joint) const;  ///< λ of one joint: [N, N m]
    /** λ of one of Simbody's own constraints, in its order: holonomic, nonholonomic, acceleration
    rows; empty if it is disabled. **/
    SimTK::Vector getMultipliers(const SimTK::Constraint& constraint) const;
    /** Contribution of a joint's dry friction to M along its sliding rates, contact by contact
    [N, N m]; empty if it has none. See JointFriction. **/
    SimTK::Vector getFrictionForces(const Joint& joint) const;
    SimTK::Real getLastStepSize() const;
    int getLastOrder() const;
    /** The body with the largest error in the last step, which limits the step size; empty before
    the first step. **/
    std::string getErrorSource() const;
    /** Work since initialize() of loads and dampers in simflex/forces, prescribed motions of
    joints, Motions, locked speeds and Simbody's working constraints [J], plus the energy changes by
    event handlers and by the impacts that they cause. Gravity, elasticity and springs are potential
    energy; Simbody's other force elements are not counted. Integrated at the order of the
    scheme. **/
    SimTK::Real getWork() const;
    /** Largest position error of any joint at getState() [m, rad]. **/
    SimTK::Real getLargestConstraintError() const;
    /** One line for each redundant constraint equation found by the last factorization: "equation 3
    of 'gudgeon pin' follows from 'main bearing', 'crank pin'". Multipliers of such joints are of
    least norm. **/
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
    Since initialize() or resetAllStatistics(), which does not reset getStatistics(). **/
    /**@{**/
    void resetAllStatistics();
    SimTK::Real getActualInitialStepSizeTaken() const;  ///< NaN before the first step
    SimTK::Real getPreviousStepSizeTaken() const { return getLastStepSize(); }
    SimTK::Real getPredictedNextStepSize() const;
    int getNumStepsAttempted() const;
    int getNumStepsTaken() const;
    /** Evaluations of the equations of motion: one for each Newton iteration, projection and
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
