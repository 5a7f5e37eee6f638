#pragma once
/** @file
Positions in which a multibody system stays at rest, or in which it turns steadily:

    M u̇ + b(q, u) − f(q, u, t) + G(q)ᵀλ = 0,   g(q, t) = 0

with u = u̇ = 0, or with the speeds of the State and the accelerations of a steady motion. Newton's
iteration on q and λ with the whole stiffness, ∂(Gᵀλ)/∂q and ∂(Mu̇)/∂q included, in blocks: those
of bodies that a joint or force element joins, eliminated one after the other. Where it is not
positive along the joints it is stiffened until a step leads downhill, so that a pendulum is found
hanging (but if it starts exactly upright, where nothing tells it which way is down: see
getUnstableMotions()).

    StaticEquilibrium equilibrium(system);
    equilibrium.solve(state);
    const State& atRest = equilibrium.getState();
    Vector forces = equilibrium.getMultipliers(pin);

A step turns and bends a body by at most 0.3 of its size. Loads are applied at once; if that does
not converge, they, and the squares of speeds, are raised from zero in parts, each starting from the
last. Where that fails, too, corrections are shortened along their lines; at last the system goes
down by itself, as in a viscous medium (see isByDampedMotion()). Where loops of joints may be
assembled in several ways it goes down so in short steps, if the equilibrium is not next to the
start, and tells if that leads elsewhere (see getBranch()). Loads are gravity,
AttachmentForces, DistributedLoads and all of Simbody's force elements, its springs too; springs and
bushings between attachment frames act in full. They are those of the State's time and of the speeds
given.

A motion that nothing holds is left alone if no load acts along it (see getFreeMotions()) and
refused by name otherwise. **/

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "simflex/body/Joint.h"

namespace simflex {

class StaticEquilibrium {
public:
    explicit StaticEquilibrium(const SimTK::MultibodySystem& system) : m_system(system) {}

    /** @name Settings **/
    /**@{**/
    /** Largest last correction anywhere on a body [m]; default 1e-10. **/
    void setTolerance(SimTK::Real tolerance) { m_tolerance = tolerance; }
    /** Largest position error left in joints [m, rad]; default 1e-10. **/
    void setConstraintTolerance(SimTK::Real tolerance) { m_constraintTolerance = tolerance; }
    /** Longest step of any body [m]; default: no limit but that of turning and bending. **/
    void setMaximumStep(SimTK::Real step) { m_maximumStep = step; }
    /** Newton iterations of one load step; default 60. **/
    void setMaximumIterations(int iterations) { m_maximumIterations = iterations; }
    /** Called before every evaluation of forces, of which an iteration has a few for each
    coordinate. An exception that it throws ends solve(), with the results of before. **/
    void setObserver(std::function<void()> observer) { m_observer = std::move(observer); }
    /** Coordinates of this mobilizer stay exactly as they are while the joints are assembled; then
    they are free. What should stay for good, lock() in the State. **/
    void holdDuringAssembly(const SimTK::MobilizedBody& mobod) {
        m_held.push_back(mobod.getMobilizedBodyIndex());
    }
    /**@}**/

    /** Finds the equilibrium at rest; u of the State does not matter.
    @throws std::invalid_argument that names what cannot be supported (see ImplicitIntegrator)
    @throws std::runtime_error if the joints cannot be assembled, naming the worst joint; if a
    load acts along a free motion, naming the body that moves most in it; if the iteration does not
    converge, naming body, correction and joint error. **/
    void solve(const SimTK::State& state);

    /** The equilibrium next to a State at rest, which linearisations are made about: bodies as
    placed are not bent yet by their loads, and what holds them is not yet in them.
    @returns false if the State moves, if the system has friction or states of its own (others than
    turns that springs count), or if a
    few iterations find none from which each body is less than a thousandth of its size away; there
    are no results then **/
    bool solveNearby(const SimTK::State& state);

    /** As solve() at the State's speeds: joints keep their relative twists and mobilizers their u,
    what nothing links to Ground its own twist (see setSteadyRotation()); modal speeds are zero.
    It is the one next to the State, if Newton's iteration finds it, as of a shaft that turns
    faster than it vibrates; but one that falls away from itself, as a conical pendulum that hangs
    straight down, gives way to a lower one.
    @throws std::runtime_error also if these speeds move a joint apart, naming it. **/
    void solveSteadyMotion(const SimTK::State& state);

    /** @name Paths
    Equilibria at rest while all loads grow together from zero, through limit points, where they
    have to shrink for the path to go on: an arch that snaps through, step by step along the path's
    own length (Riks; Crisfield),

        r(q, λ, f) = 0,   ⟨Δq, Δq₀⟩ = |Δq₀|²

    Loads are those that solve() raises in parts; springs, bushings and forces that depend on the
    motion act in full, as Motions do. Steps are such that what f gains is what its slopes at both
    ends foretell, within some percent, and that each motion whose stiffness may change its sign is
    followed from one end to the other. Where it is zero is found to 1e-6 of f, whatever the step;
    from one regular point to the next the number of unstable motions changes by what happens at
    the limit points and bifurcations between them. **/
    /**@{**/
    struct PathPoint {
        enum class Kind {
            Regular,
            Limit,       ///< f is largest or least
            Bifurcation  ///< another path crosses: it gains or loses stability while f grows on
        };
        SimTK::State state;         ///< realized to Stage::Velocity
        SimTK::Vector multipliers;  ///< as getMultipliers()
        SimTK::Real fraction;       ///< f, of the loads
        /** Independent motions in which it falls away; 0: it is stable. Of limit points and
        bifurcations: on the side where there are fewer. **/
        int numUnstable;
        Kind kind;
        /** Of bifurcations: independent motions that gain or lose stability at once, of which
        symmetry may make more than one. **/
        int numChanging;
    };
    struct PathSettings {
        /** Longest step, of a body's size, by which it turns or bends between points. **/
        SimTK::Real step = 0.1;
        int mostPoints = 1000;
    };
    /** From no load to where all of it acts for the first time, or to as many points as there may
    be. The last point is the result, too.
    @throws std::invalid_argument for systems with friction, states of their own or force elements
        of Simbody's other than gravity, and without loads; std::runtime_error as solve(), and if
        the path cannot be followed: how far it went. **/
    std::vector<PathPoint> followPath(const SimTK::State& state, const PathSettings& settings);
    /**@}**/

    /** @name Results **/
    /**@{**/
    /** The equilibrium, realized to Stage::Velocity. **/
    const SimTK::State& getState() const { return m_state; }
    /** All joints, in order, then Simbody's constraints; of least norm where rows are redundant.
     * **/
    const SimTK::Vector& getMultipliers() const { return m_multipliers; }
    SimTK::Vector getMultipliers(const Joint& joint) const;  ///< [N, N m]
    /** Motions that nothing holds and no load drives: each the body that moves most in it. **/
    const std::vector<std::string>& getFreeMotions() const { return m_freeMotions; }
    /** Motions in which it falls away at the least push, of an equilibrium at rest, or the fastest
    of a steady motion: each the body that moves most in it. They follow from the stiffness, or,
    where forces have no potential (loads that follow the motion, controllers), from all modes. **/
    const std::vector<std::string>& getUnstableMotions() const { return m_unstableMotions; }
    int getNumIterations() const { return m_numIterations; }
    int getNumLoadSteps() const { return m_numLoadSteps; }
    /** True if Newton's iteration did not find it from the State given: the system was let down in
    a strongly damped motion, without inertia, and this is where it came to rest; there may be
    others.
    **/
    bool isByDampedMotion() const { return m_isByDampedMotion; }
    /** Loops of joints may be assembled in several ways, between which no motion leads. **/
    enum class Branch {
        Own,  ///< there are no loops, or a strongly damped motion leads from the State to here, too
        Followed,  ///< Newton's iteration leaps to elsewhere; the damped motion comes to rest here
        Unknown    ///< that motion does not come to rest, or has more than 1000 speeds
    };
    Branch getBranch() const { return m_branch; }
    /** A sentence to warn with; empty: own. **/
    std::string describeBranch() const;
    /**@}**/

private:
    class Search;
    enum class Speeds { Zero, OfState };
    enum class Reach { Anywhere, Nearby };
    /** @returns false if there is none within reach **/
    bool run(const SimTK::State& state, Speeds speeds, Reach reach = Reach::Anywhere);
    /** Assembled, all that a search needs, and what is left of it. **/
    struct Start;
    Start begin(const SimTK::State& state, Speeds speeds);
    void finish(Search& search, Start& start);
    /** Says what goes away from a steady motion that stiffness drives on; empty where gyroscopic
    forces hold it. **/
    std::string describeFall(const Start& start, Search& search);
    /** Motions about an equilibrium or a steady motion that grow by themselves, of those without
    oscillation or of all, each with the body that moves most in it; none if there are no modes. **/
    enum class Growth { Steady, Any };
    std::vector<std::string> listGrowing(const Start& start, const SimTK::State& state,
                                         Growth growth);
    void keep(const Start& start, SimTK::State& state, SimTK::Vector& multipliers);
    SimTK::State assemble(const SimTK::State& state) const;

    const SimTK::MultibodySystem& m_system;
    SimTK::Real m_tolerance = 1e-10, m_constraintTolerance = 1e-10;
    SimTK::Real m_maximumStep = SimTK::Infinity;
    int m_maximumIterations = 60;
    std::vector<SimTK::MobilizedBodyIndex> m_held;
    std::function<void()> m_observer;

    SimTK::State m_state;
    SimTK::Vector m_multipliers;
    std::vector<int> m_firstRows;  ///< by JointIndex
    std::vector<std::string> m_freeMotions, m_unstableMotions;
    int m_numIterations = 0, m_numLoadSteps = 0;
    bool m_isByDampedMotion = false;
    Branch m_branch = Branch::Own;
};

/** The State that solveNearby() finds, or this one: where to linearise about. **/
SimTK::State findEquilibriumNearby(const SimTK::MultibodySystem& system, const SimTK::State& state,
                                   const std::function<void()>& observer = {});

/** Gives every flexible body, and every rigid body on a Free mobilizer on Ground, the speeds of a
rotation with `omega_G` about an axis through `point_G`; modal speeds are zero.
@param state  realized to Stage::Position; set to the new speeds **/
void setSteadyRotation(const SimTK::MultibodySystem& system, SimTK::State& state,
                       const SimTK::Vec3& omega_G, const SimTK::Vec3& point_G = SimTK::Vec3(0));

}  // namespace simflex
