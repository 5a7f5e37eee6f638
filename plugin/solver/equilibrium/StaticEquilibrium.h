#pragma once
/** @file
Positions in which a multibody system stays at rest, or moves steadily:

    M u̇ + b(q, u) − f(q, u, t) + G(q)ᵀλ = 0,   g(q, t) = 0

with u = u̇ = 0, or with the speeds of the State and the accelerations of a steady motion. Solved by
Newton's method in q and λ with the full stiffness, ∂(Gᵀλ)/∂q and ∂(Mu̇)/∂q included, by block
elimination over bodies connected by joints or force elements. Where the stiffness is not positive
definite on the constraint manifold it is shifted until the step is a descent direction, so that a
pendulum is found hanging (unless it starts exactly upright, where there is no descent direction:
see getUnstableMotions()).

    StaticEquilibrium equilibrium(system);
    equilibrium.solve(state);
    const State& atRest = equilibrium.getState();
    Vector forces = equilibrium.getMultipliers(pin);

A step turns and bends a body by at most 0.3 of its size. Loads are applied at once. If this does
not converge, loads and squared speeds are raised from zero in increments, each starting from the
last. If that fails too, line searches shorten the corrections; as a last resort the system moves
downhill as in a viscous medium (see isByDampedMotion()). If loops of joints can be assembled in
several ways and the equilibrium is not next to the start, the same descent in short steps checks
whether it leads elsewhere (see getBranch()). Loads are gravity, AttachmentForces, DistributedLoads
and all of Simbody's force elements, springs included; springs and bushings between attachment
frames act in full. Loads are evaluated at the State's time and the given speeds.

A motion that nothing restrains is left alone if no load acts along it (see getFreeMotions()) and
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
    /** Longest step of any body [m]; default: only the limit on turning and bending. **/
    void setMaximumStep(SimTK::Real step) { m_maximumStep = step; }
    /** Maximum number of Newton iterations per load step; default 60. **/
    void setMaximumIterations(int iterations) { m_maximumIterations = iterations; }
    /** Called before every evaluation of forces, a few times per coordinate and iteration. An
    exception that it throws ends solve(), and earlier results are kept. **/
    void setObserver(std::function<void()> observer) { m_observer = std::move(observer); }
    /** Keeps the coordinates of this mobilizer fixed while the joints are assembled, and free after
    that. To fix coordinates for good, lock() them in the State. **/
    void holdDuringAssembly(const SimTK::MobilizedBody& mobod) {
        m_held.push_back(mobod.getMobilizedBodyIndex());
    }
    /**@}**/

    /** Finds the equilibrium at rest; u of the State is ignored.
    @throws std::invalid_argument that names an unsupported element (see ImplicitIntegrator)
    @throws std::runtime_error if the joints cannot be assembled, naming the worst joint; if a
    load acts along a free motion, naming the body that moves most in it; if the iteration does not
    converge, naming body, correction and joint error. **/
    void solve(const SimTK::State& state);

    /** Finds the equilibrium next to a State at rest, about which to linearise: bodies as placed do
    not yet carry the deformations and reactions that their loads cause.
    @returns false, without results, if the State moves, if the system has friction or states of its
    own (other than turns counted by springs), or if a few iterations find no equilibrium within a
    thousandth of each body's size **/
    bool solveNearby(const SimTK::State& state);

    /** As solve(), at the State's speeds: joints keep their relative twists, mobilizers their u,
    and bodies not linked to Ground their own twist (see setSteadyRotation()); modal speeds are
    zero. Finds the steady motion next to the State if Newton's method converges to it, as for a
    shaft that turns faster than it vibrates; but an unstable one, such as a conical pendulum
    hanging straight down, is replaced by a lower one.
    @throws std::runtime_error also if these speeds pull a joint apart, naming it. **/
    void solveSteadyMotion(const SimTK::State& state);

    /** @name Paths
    Equilibria at rest while all loads grow together from zero, through limit points, beyond which
    the loads have to decrease, as in the snap-through of an arch. Arc-length continuation (Riks;
    Crisfield),

        r(q, λ, f) = 0,   ⟨Δq, Δq₀⟩ = |Δq₀|²

    The scaled loads are those that solve() raises in increments; springs, bushings and forces that
    depend on the motion act in full, as do Motions. Step sizes are such that the slopes at both
    ends predict the change of f within a few percent, and that each motion whose stiffness may
    change sign can be followed from one end to the other. Zeros of that stiffness are located to
    1e-6 of f, whatever the step. Between two regular points the number of unstable motions changes
    by the limit points and bifurcations between them. **/
    /**@{**/
    struct PathPoint {
        enum class Kind {
            Regular,
            Limit,       ///< f has a local extremum
            Bifurcation  ///< another path crosses: stability changes while f keeps growing
        };
        SimTK::State state;         ///< realized to Stage::Velocity
        SimTK::Vector multipliers;  ///< as getMultipliers()
        SimTK::Real fraction;       ///< f, of the loads
        /** Independent unstable motions, 0 if stable; at limit points and bifurcations, the smaller
        number of the two sides. **/
        int numUnstable;
        Kind kind;
        /** At bifurcations: independent motions that gain or lose stability at once, which symmetry
        may make more than one. **/
        int numChanging;
    };
    struct PathSettings {
        /** Largest turning or bending of a body between points, relative to its size. **/
        SimTK::Real step = 0.1;
        int mostPoints = 1000;
    };
    /** Follows the path from no load until all loads act in full for the first time, or for at most
    mostPoints. The last point also becomes the result.
    @throws std::invalid_argument for systems with friction, states of their own or force elements
        of Simbody's other than gravity, and without loads; std::runtime_error as solve(), and if
        the path cannot be followed, stating how far it got. **/
    std::vector<PathPoint> followPath(const SimTK::State& state, const PathSettings& settings);
    /**@}**/

    /** @name Results **/
    /**@{**/
    /** The equilibrium, realized to Stage::Velocity. **/
    const SimTK::State& getState() const { return m_state; }
    /** All joints, in order, then Simbody's constraints; least norm where rows are redundant. **/
    const SimTK::Vector& getMultipliers() const { return m_multipliers; }
    SimTK::Vector getMultipliers(const Joint& joint) const;  ///< [N, N m]
    /** Motions that nothing restrains or drives, each named by the body that moves most in it. **/
    const std::vector<std::string>& getFreeMotions() const { return m_freeMotions; }
    /** Motions in which it falls away at the least push, of an equilibrium at rest, or the fastest
    of a steady motion: each the body that moves most in it. They follow from the stiffness, or,
    where forces have no potential (loads that follow the motion, controllers), from all modes. **/
    const std::vector<std::string>& getUnstableMotions() const { return m_unstableMotions; }
    int getNumIterations() const { return m_numIterations; }
    int getNumLoadSteps() const { return m_numLoadSteps; }
    /** True if Newton's method did not find the equilibrium from the given State, so that a
    strongly damped motion without inertia was followed until it came to rest; there may be other
    equilibria. **/
    bool isByDampedMotion() const { return m_isByDampedMotion; }
    /** Whether the equilibrium belongs to the State's assembly branch: loops of joints may be
    assembled in several ways that no motion connects. **/
    enum class Branch {
        Own,       ///< there are no loops, or a strongly damped motion also leads here
        Followed,  ///< Newton's method leaps to another branch; the damped motion comes to rest
                   ///< here
        Unknown    ///< the damped motion does not come to rest, or has more than 1000 speeds
    };
    Branch getBranch() const { return m_branch; }
    /** A one-sentence warning; empty for Branch::Own. **/
    std::string describeBranch() const;
    /**@}**/

private:
    class Search;
    enum class Speeds { Zero, OfState };
    enum class Reach { Anywhere, Nearby };
    /** @returns false if there is none within reach **/
    bool run(const SimTK::State& state, Speeds speeds, Reach reach = Reach::Anywhere);
    /** The assembled system, the data of a search, and its remainder. **/
    struct Start;
    Start begin(const SimTK::State& state, Speeds speeds);
    void finish(Search& search, Start& start);
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

/** The State found by solveNearby(), or `state` if there is none: the point to linearise
about. **/
SimTK::State findEquilibriumNearby(const SimTK::MultibodySystem& system, const SimTK::State& state,
                                   const std::function<void()>& observer = {});

/** Gives every flexible body, and every rigid body on a Free mobilizer on Ground, the speeds of a
rotation with `omega_G` [rad/s] about an axis through `point_G` [m]; modal speeds are zero.
@param state  realized to Stage::Position; receives the speeds **/
void setSteadyRotation(const SimTK::MultibodySystem& system, SimTK::State& state,
                       const SimTK::Vec3& omega_G, const SimTK::Vec3& point_G = SimTK::Vec3(0));

}  // namespace simflex
