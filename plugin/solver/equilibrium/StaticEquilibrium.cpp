#include "simflex/solver/StaticEquilibrium.h"

#include <omp.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <optional>
#include <sstream>

#include "simflex/base/DenseAlgebra.h"
#include "simflex/base/FlushDenormals.h"
#include "simflex/base/Progress.h"
#include "simflex/body/Assembly.h"
#include "simflex/body/StateCopy.h"
#include "simflex/solver/BlockEliminationSolver.h"
#include "simflex/solver/Eigenmodes.h"
#include "simflex/solver/equations/StateImage.h"
#include "simflex/solver/equilibrium/CriticalMotions.h"
#include "simflex/solver/equilibrium/SimbodyNumbering.h"
#include "simflex/solver/equilibrium/SteadyMotion.h"
#include "simflex/solver/equilibrium/TangentElimination.h"

namespace simflex {

using namespace SimTK;
using Eigen::Map;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double StepLimit = 0.3;  ///< relative to a body's size
constexpr double Nearby = 1e-3;    ///< relative to a body's size
/** Following the damped motion where loops may have other assemblies: step, relative to a body's
size, short enough to stay on the system's own path; largest number of speeds and of steps. **/
constexpr double LongestCreep = 0.1;
constexpr int MostSpeedsFollowed = 1000, MostFollowingSteps = 300;
constexpr int NearbyIterations = 8;
constexpr double ZeroStiffness = 1e-12;  ///< relative to the softest mode's
/** Residual along a free motion that counts as round-off, relative to the force components; strain
of a body's size by which springs may be preloaded against each other. **/
constexpr double ZeroForce = 1e-9, HiddenStrain = 1e-6;
/** The same along a steady motion, limited by the accuracy of force differences. **/
constexpr double LoadedSpin = 1e-6;
constexpr int MostMotionIterations = 20;
constexpr double SmallestLoadStep = 1.0 / 64;
/** σ of K + σ·softest·M; the least one is negligible in nearly all directions. **/
constexpr double LeastShift = 1e-9, LargestShift = 1e6, ShiftGrowth = 30;
/** Skew part of the scaled stiffness beyond which Newton's iteration needs it. **/
constexpr double WholeSkew = 1e-3;
constexpr double SlowestOfRate = 1e-3, SameMotion = 1e-4;
/** Smallest significant ω² [1/s²]. **/
constexpr double LeastStiffness = 1e-10;
/** Fraction of the work of a correction done by the shift above which a motion may be free. **/
constexpr double FreeShare = 1e-3;
/** If there are more soft motions than the most, only a few are computed. **/
constexpr int MostSoftMotions = 96, FewSoftMotions = 6, MoreDirections = 4;
constexpr int NumSubspacePasses = 6, NumFreePasses = 3, MaxGmresSteps = 30;
/** A step that is limited to less than LeastPart is repeated with a shift at least LeastStiffening
times as large; the next step starts with a shift divided by ShiftDecay. **/
constexpr double LeastPart = 0.3, LeastStiffening = 4, ShiftDecay = 10;
/** Part of the allowed step below which the shift is too large. **/
constexpr double ShortStep = 0.01;
constexpr int MostTrials = 8;
/** Work of a correction at its end, relative to that at its start, above which the step is
shortened, in up to MostLineTrials trials. **/
constexpr double LineSlack = 0.5;
constexpr int MostLineTrials = 10;
/** First, last and largest σ of the strongly damped motion; CreepAccuracy is that of a step,
relative to a body's size. **/
constexpr double FirstDamping = 1, LastDamping = 1e-8, LargestDamping = 1e12;
/** Path following: iterations per point; largest ratio of the actual to the predicted length; least
step relative to the requested one; tolerance and trials for locating a point within a step. **/
constexpr int MostPathIterations = 8, MostPathTrials = 40, MostPointsToLimit = 200;
constexpr double MostPathCurve = 1.5, LeastPathStep = 1e-6, PathSharpness = 1e-6;
/** Largest deviation of the load increment from that predicted by the slopes at both ends, relative
to that of the steeper one; least slope used for this, relative to the steepest so far. **/
constexpr double LargestSurprise = 0.05, FlatPath = 0.05;
/** Turning [rad] or relative displacement by all loads below which the path is parametrised by
load; factor to that of a point from which it has to be; turning relative to displacement that is no
round-off. **/
constexpr double LeastTurning = 1e-7, MoreTurning = 2, LeastTurn = 1e-6;
/** Relative to a path's step: increment for differencing stiffness; distance of a bifurcation from
the step's end at which no direction is known; first and last distance of the samples on both sides
of a bifurcation. ShortestLook, relative to the requested step, is the shortest step for separating
sign changes. **/
constexpr double SlopePart = 0.02, AtBifurcation = 1e-6, FirstAside = 0.03, LastAside = 3e-4,
                 ShortestLook = 1e-5;
/** Change of stiffness by round-off, relative to the softest mode's. **/
constexpr double StiffnessNoise = 1e-8;
/** Relative to the loads: tolerance for locating a bifurcation, and distance within which two are
the same. **/
constexpr double BifurcationSharpness = 1e-9, SameLoad = 1e-7;
constexpr int MostBifurcationTrials = 6, MostAsides = 5;
constexpr int MostCreepIterations = 12, MostCreepSteps = 6000;
constexpr double CreepAccuracy = 1e-6;

/** @throws std::runtime_error naming a constraint that the speeds pull apart. **/
void refuseUnsteady(const Evaluation& equations, const std::vector<double>& u,
                    const std::vector<double>& errors) {
    double fastest = 0;
    for (const double speed : u) fastest = std::max(fastest, std::abs(speed));
    for (size_t k = 0; k < errors.size(); ++k) {
        if (std::abs(errors[k]) <= 1e-7 * (1 + fastest)) continue;
        std::ostringstream text;
        text << "the speeds of the State are not those of a steady motion: "
             << equations.getTopology().describeConstraint(int(k)) << " moves apart at "
             << errors[k] << " m/s or rad/s";
        throw std::runtime_error(text.str());
    }
}

/** Gram–Schmidt, twice; drops dependent columns. **/
void orthonormalize(MatrixXd& V) {
    constexpr double Dependent = 1e-8;
    Eigen::Index count = 0;
    for (Eigen::Index j = 0; j < V.cols(); ++j) {
        VectorXd v = V.col(j);
        const double size = v.norm();
        for (int pass = 0; pass < 2; ++pass)
            v -= V.leftCols(count) * (V.leftCols(count).transpose() * v);
        if (!(v.norm() > Dependent * size)) continue;
        V.col(count++) = v.normalized();
    }
    V.conservativeResize(Eigen::NoChange, count);
}

/** Returns the λ of least norm with Gᵀλ = −r. **/
Vector calcMultipliers(Evaluation& equations, const VectorXd& r) {
    const int m = equations.getTopology().numMultipliers;
    Vector multipliers(m);
    if (!equations.getTopology().frictions.empty()) {
        MatrixXd M, G;
        calcMassAndJacobian(equations, M, G);
        const VectorXd lambda = solveLeastSquares(G.transpose(), -r, 1e-10);
        for (int k = 0; k < m; ++k) multipliers[k] = lambda[k];
        return multipliers;
    }
    NewtonSystem system = equations.getTopology().makeNewtonSystem();
    equations.formMassSystem(system);
    std::copy_n(r.data(), r.size(), system.r.begin());
    std::fill(system.c.begin(), system.c.end(), 0.0);
    BlockEliminationSolver solver(system);
    solver.factor(system);
    solver.solve(system);
    for (int k = 0; k < m; ++k) multipliers[k] = solver.getDeltaLambda()[k];
    return multipliers;
}

}  // namespace

/** Newton's method for one system. **/
class StaticEquilibrium::Search {
public:
    Search(const StaticEquilibrium& settings, Evaluation& equations, const State& assembled,
           const SolutionPoint& start, SteadyMotion motion)
        : m_settings(settings),
          m_equations(equations),
          m_scales(equations.getBlocks()),
          // The speeds of a steady motion may depend on the positions of all bodies.
          m_graph(equations,
                  motion.isLocal() ? BlockGraph::Links::OfJoints : BlockGraph::Links::Everywhere),
          m_isHeld(equations.getTopology().isPrescribed),
          m_hasOwnStates(!equations.getTopology().listOwnStates().empty()),
          m_point(start),
          m_motion(std::move(motion)),
          m_mostIterations(settings.m_maximumIterations) {
        const Topology& topology = equations.getTopology();
        for (int b = 0; b < topology.numFlexible; ++b)
            m_places.push_back(equations.getBlock(b).firstU + 3);
        const SimbodyMatterSubsystem& matter = topology.system->getMatterSubsystem();
        for (MobilizedBodyIndex i(1); i < matter.getNumBodies(); ++i) {
            const MobilizedBody& mobod = matter.getMobilizedBody(i);
            int q0, nq, u0;
            if (!equations.getBlocks().findRigidSlots(topology, i, q0, nq, u0)) continue;
            for (int k = 0; k < mobod.getNumU(assembled); ++k) {
                const Real radians = mobod.getHCol(assembled, MobilizerUIndex(k))[0].norm();
                if (radians > 0) m_turns.emplace_back(u0 + k, radians);
            }
            if (MobilizedBody::Free::isInstanceOf(mobod) &&
                mobod.getParentMobilizedBody().getMobilizedBodyIndex() == GroundIndex)
                m_places.push_back(u0 + 3);
        }
    }

    /** Raises the loads to their full size. @throws as solve(). **/
    void run();
    /** Finds the steady motion next to the start, which need not be a minimum of energy.
    @returns false if there is none nearby **/
    bool runToMotion();
    /** Number of negative eigenvalues of the stiffness. **/
    int countNegative();
    /** Finds a steady motion of least energy. @returns false if there is none **/
    bool runLower();
    /** "'rod'": the body that moves most in a motion δ. **/
    std::string nameMostMoved(const VectorXd& delta) const;
    /** @returns whether an equilibrium next to the start was found **/
    bool runNearby();

    /** See StaticEquilibrium::followPath(); visits points in their order. **/
    using Kind = PathPoint::Kind;
    enum class Next { GoOn, Stop };
    /** A PathPoint without state and multipliers. **/
    struct PathMark {
        double fraction;
        int numUnstable;
        Kind kind;
        int numChanging;
    };
    using Visit = std::function<Next(const PathMark& mark)>;
    void follow(const PathSettings& settings, const Visit& visit);

    const SolutionPoint& getPoint() const { return m_point; }
    /** Names free and unstable motions of the equilibrium. **/
    void describeMotions(std::vector<std::string>& free, std::vector<std::string>& unstable);
    /** False where forces follow the motion or a controller acts: describeMotions() and points of
    paths then know nothing of stability. **/
    bool hasPotential() const { return m_hasPotential; }
    int numIterations = 0, numLoadSteps = 0;
    bool isByDampedMotion = false;
    Branch branch = Branch::Own;

private:
    /** Linear system of a correction. Unknowns are x/s of all speeds, s = 0 for held ones. **/
    struct Tangent {
        VectorXd s;
        BlockMatrix<double> K;
        const BlockMass& mass;
        double softest;  ///< ω² of the softest mode
        VectorXd r, g;
        StateTangent states;
        VectorXd turning;  ///< largest torque per radian that forces can exert on turning bodies
        VectorXd forces;   ///< by block: largest component of any force, scaled as r
        bool isFinite = false;
    };
    /** A scaled motion y of little stiffness: yᵀKy = κ·softest·yᵀMy. **/
    struct SoftMotion {
        double stiffness;
        VectorXd y;
    };

    /** Tangent of a path; its length 1 turns or bends a body by its size, at most. **/
    struct Direction {
        VectorXd delta, lambda;
        double fraction = 0;
        double turning = 0;     ///< by all loads
        bool isByLoad = false;  ///< parametrised by load, because bodies move little
        int numUnstable = 0;
        double softest = 0;
        std::vector<CriticalMotion> motions;

        void leadByLoad() {
            const double size = 1 / std::abs(fraction);
            delta *= size;
            lambda *= size;
            fraction *= size;
            for (CriticalMotion& motion : motions) motion.slope *= size;
            isByLoad = true;
        }
    };
    /** A point of the path. **/
    struct Place {
        double at;  ///< along a direction
        double fraction;
        SolutionPoint point;
    };
    /** A limit point or a bifurcation. **/
    struct Special {
        Place place;
        Kind kind;
        int change;       ///< of the number of unstable motions
        int numChanging;  ///< number of motions that change in either direction
    };
    /** Tangent of the path at an equilibrium, continuing `before`; the first one adds loads. **/
    Direction calcDirection(const Direction& before);
    /** Moves to the equilibrium at about that arc length. @returns false if it is not found **/
    bool goAlong(const SolutionPoint& from, double fraction, const Direction& direction,
                 double length);
    /** Locates a zero of a function between `start` and `end` along a direction, at which its signs
    differ, and moves there. **/
    std::optional<double> seekAlong(const SolutionPoint& from, double fraction,
                                    const Direction& direction, double end, double atStart,
                                    double atEnd, const std::function<double()>& calc,
                                    double start = 0);
    /** Finds the limit points and bifurcations of a step, in order; between them loads are
    monotone. Empty if they cannot be separated. **/
    std::optional<std::vector<Special>> findSpecials(const Place& start, const Direction& direction,
                                                     const Place& end, const Direction& next,
                                                     double longest);
    /** Locates the zero of a motion's stiffness. **/
    std::optional<Place> seekBifurcation(const Place& start, const Direction& direction,
                                         const Place& end, const StabilityChange& change);
    /** Sets the slopes of the motions' stiffness. @pre the point is that of the direction **/
    void differenceMotions(Direction& direction, double length);
    /** Component of another direction along this one, relative to its length. **/
    double calcShare(const Direction& direction, const Direction& other) const {
        if (direction.isByLoad) return other.fraction / direction.fraction;
        return multiplySizes(direction.delta, other.delta) /
               multiplySizes(direction.delta, direction.delta);
    }
    void setFraction(double fraction) {
        m_fraction = fraction;
        m_equations.updSimbody().setLoadFraction(fraction);
    }
    /** Derivative of r with respect to the load fraction. **/
    VectorXd calcLoadSlope();
    /** Solves K x + Gᵀλ = f, G x = g with the current factors. **/
    void solveFor(const Tangent& tangent, const VectorXd& f, const VectorXd& g, VectorXd& x,
                  VectorXd& lambda);
    /** Describes where the path of equilibria turns back or another one crosses it before all loads
    act; empty if unknown. **/
    std::string describeTurn(const SolutionPoint& start);
    /** Inner product of displacements, relative to the bodies' sizes. **/
    double multiplySizes(const VectorXd& a, const VectorXd& b) const;
    /** Largest turning or bending of a body, relative to its size. **/
    double calcTurning(VectorXd delta) const;

    /** Follows the damped motion if Newton's iteration may have leapt to another equilibrium on the
    way. **/
    void stayOnBranch(const SolutionPoint& start);
    /** Whether loops of joints, or forces that depend on the motion, may have several stable
    equilibria. **/
    bool mayHaveBranches() const;
    /** Largest displacement of a body from there, relative to its size. **/
    double calcDistance(const std::vector<double>& from) const;

    /** Finds an equilibrium, however far from the start. **/
    void findAny();
    bool converge(double fraction);
    /** Plain Newton iteration for a steady motion, without safeguards. **/
    bool convergeToMotion();
    /** Returns the steady motion itself, scaled, if joints allow it: the direction of time, along
    which nothing changes. Empty if there is none. **/
    VectorXd findSpin(const Tangent& tangent) const;
    /** Part of a correction at which the work of forces along it nearly vanishes. **/
    double searchLine(const Tangent& tangent, const VectorXd& delta, const VectorXd& deltaLambda);
    void move(const VectorXd& delta, const VectorXd& deltaLambda);
    /** Lets the system move downhill as in a viscous medium, without inertia, by implicit steps of
    σM δ + r = 0, G δ + g = 0 of increasing length. Forces and joints are satisfied to CreepAccuracy
    in every step, so that the motion does not leap as Newton steps may.
    @param longest  longest step, relative to a body's size by which it turns or bends **/
    bool creep(double longest = Infinity, int mostSteps = MostCreepSteps);
    Tangent calcTangent();
    /** The same; not finite where evaluation fails. **/
    Tangent tryTangent();
    void evaluate(const std::vector<double>& q, VectorXd& r);
    /** Matrix added to K where it is not positive, or steps are too long. **/
    enum class Brake {
        Inertia,  ///< σ·softest·M
        /** Turning stiffness as large as the forces on a body can drive it: a chain reaches its
        hanging position in as many steps as a single link, which takes many more with inertia. **/
        Turning
    };
    /** Factors with the least σ, from this one up, that makes the matrix positive along the
    joints. **/
    double factorPositive(const Tangent& tangent, double sigma, Brake brake);
    void factor(const Tangent& tangent, double sigma, Brake brake = Brake::Inertia);
    /** Solves for x, Δλ, Δz with the current factors; no refinement if the step is too long anyway.
    @returns false if states are not determined. **/
    bool solve(const Tangent& tangent, double sigma, VectorXd& x, VectorXd& deltaLambda,
               VectorXd& dz);
    /** Solves without the `count` free motions, except for loads along them, which lead far. **/
    VectorXd solveBesideFree(const Tangent& tangent, int count, VectorXd b,
                             const std::function<VectorXd(const VectorXd& b)>& solveStiff);
    VectorXd multiplyMass(const Tangent& tangent, const VectorXd& y) const {
        return tangent.softest *
               tangent.s.cwiseProduct(tangent.mass.multiply(tangent.s.cwiseProduct(y)));
    }
    /** Number of motions with zero or negative stiffness. **/
    int countSoftMotions(const Tangent& tangent);
    /** factor() with LeastShift. @returns in how many motions an equilibrium falls away: what paths
    and single equilibria are judged by **/
    int factorAndCountUnstable(const Tangent& tangent);
    /** Measures how far K is from symmetric: without a potential, its negative eigenvalues say
    nothing of stability, and Newton's iteration is to know both halves. **/
    void findPotential(const Tangent& tangent) {
        const double skew = tangent.K.findSkew(tangent.s);
        m_isSkew = skew > WholeSkew;
        m_hasPotential = tangent.states.F.rows() == 0 && skew <= LargestSkewOfPotential;
    }
    VectorXd multiplyScaled(const Tangent& tangent, const VectorXd& rowScale,
                            const VectorXd& y) const;
    /** Returns these motions, only some if there are many. @pre factor() with LeastShift, or where
    the matrix is positive **/
    std::vector<SoftMotion> findSoftMotions(const Tangent& tangent, int count);
    /** Stiffness that counts as zero, including that of motions much slower than a steady
    motion. **/
    double calcZero(const Tangent& tangent) const {
        return std::max(ZeroStiffness,
                        square(SlowestOfRate * m_motion.getRate()) / tangent.softest);
    }
    /** Multipliers for which a residual causes the least accelerations. **/
    VectorXd balance(const Tangent& tangent, const VectorXd& r);
    /** Whether long steps may be braked: the speeds of a steady motion only hold for positions near
    its own. **/
    bool canBrake() const { return m_goesDownhill && m_motion.isAtRest(); }
    /** Bound of the work of all force components along a scaled motion. **/
    double calcForceScale(const Tangent& tangent, const VectorXd& y) const;
    /** Allowed part of δ; m_shortfall.change is the size of all of it. **/
    double limitStep(VectorXd delta);
    [[noreturn]] void fail(double fraction);

    const StaticEquilibrium& m_settings;
    Evaluation& m_equations;
    CoordinateScales m_scales;
    const BlockGraph m_graph;
    const std::vector<char>& m_isHeld;
    const bool m_hasOwnStates;  ///< other than turns counted by springs
    double m_leadingTurn = LeastTurning;
    std::vector<int> m_places;  ///< first speed of the position of bodies free in Ground
    std::vector<std::pair<int, double>> m_turns;  ///< rigid bodies' speeds, and radians per unit
    SolutionPoint m_point;
    SteadyMotion m_motion;
    int m_mostIterations;
    std::optional<BlockMass> m_mass;
    std::optional<TangentElimination<double>> m_elimination;
    bool m_goesDownhill = true, m_searchesLines = false;
    bool m_hasPotential = true, m_isSkew = false;
    double m_fraction = 1;   ///< of the loads
    VectorXd m_loads;        ///< their part of r
    double m_loadsOf = NaN;  ///< load fraction of m_loads
    /** Distance of the last iteration from an equilibrium. **/
    struct Shortfall {
        double change = 0, error = 0;
        int worstBlock = 0, worstRow = -1;
        std::string reason;
    };
    Shortfall m_shortfall;
};

void StaticEquilibrium::Search::run() {
    const SolutionPoint start = m_point;
    findAny();
    if (!isByDampedMotion) stayOnBranch(start);
}

void StaticEquilibrium::Search::findAny() {
    const SolutionPoint start = m_point;
    if (converge(1)) return;
    // A steady motion, or what a controller or a force that follows the motion holds, is none of
    // least energy, and may be stable at a saddle of it.
    const auto hasLeastEnergy = [&] { return m_motion.isAtRest() && !m_hasOwnStates && !m_isSkew; };
    if (!hasLeastEnergy()) {
        m_point = start;
        m_goesDownhill = false;
        // On the way, forces that have a potential may seem to have none.
        if (converge(1) && !hasLeastEnergy()) return;
        m_goesDownhill = true;
    }
    // Load increments from zero.
    const SolutionPoint stuck = m_point;
    const Shortfall whereStuck = m_shortfall;
    m_point = start;
    double reached = 0, part = 0.5;
    while (reached < 1 && part >= SmallestLoadStep) {
        const SolutionPoint before = m_point;
        const double fraction = std::min(1.0, reached + part);
        if (converge(fraction)) {
            reached = fraction;
            part *= 1.5;
        } else {
            m_point = before;
            part *= 0.5;
        }
    }
    if (reached == 1) return;
    const SolutionPoint last = reached == 0 ? stuck : m_point;
    const Shortfall shortfall = reached == 0 ? whereStuck : m_shortfall;
    if (m_motion.isAtRest()) {
        m_point = start;
        m_searchesLines = true;
        if (converge(1)) return;
        m_point = start;
        if (!m_hasOwnStates && creep() && converge(1)) {
            isByDampedMotion = true;
            return;
        }
    }
    const std::string turn = reached > 0 ? describeTurn(start) : "";
    m_point = last;
    m_shortfall = shortfall;
    m_shortfall.reason = turn + shortfall.reason;
    fail(reached);
}

bool StaticEquilibrium::Search::runLower() {
    const SolutionPoint start = m_point;
    if (converge(1)) return true;
    m_point = start;
    return false;
}

bool StaticEquilibrium::Search::runToMotion() {
    const SolutionPoint start = m_point;
    if (m_motion.isAtRest()) return false;
    if (!convergeToMotion()) {
        m_point = start;
        return false;
    }
    return true;
}

int StaticEquilibrium::Search::countNegative() {
    const Tangent tangent = calcTangent();
    factor(tangent, calcZero(tangent));
    return m_elimination->countNegative();
}

VectorXd StaticEquilibrium::Search::findSpin(const Tangent& tangent) const {
    constexpr double Allowed = 1e-6;  // relative to the speeds of its bodies
    VectorXd x = VectorXd::Zero(tangent.s.size());
    double fastest = 0;
    for (Eigen::Index i = 0; i < x.size(); ++i) {
        if (m_isHeld[size_t(i)]) continue;
        x[i] = m_point.u[size_t(i)];
        fastest = std::max(fastest, std::abs(x[i]) * m_scales.metres[size_t(i)]);
    }
    const VectorXd gaps = tangent.mass.multiplyG(x);
    if (!(fastest > 0) || (gaps.size() > 0 && gaps.cwiseAbs().maxCoeff() > Allowed * fastest))
        return {};
    for (Eigen::Index i = 0; i < x.size(); ++i)
        if (tangent.s[i] > 0) x[i] /= tangent.s[i];
    return x.normalized();
}

bool StaticEquilibrium::Search::convergeToMotion() {
    setFraction(1);
    m_motion.setFactor(1);
    for (int iteration = 0; iteration < std::min(MostMotionIterations, m_mostIterations);
         ++iteration) {
        const Tangent tangent = tryTangent();
        ++numIterations;
        if (!tangent.isFinite) return false;
        const Eigen::Index n = tangent.s.size(), m = tangent.g.size();
        const double sigma = calcZero(tangent);
        BlockMatrix<double> A = tangent.K;
        A.addMass(tangent.mass, sigma * tangent.softest);
        m_elimination->factor(A, tangent.s, TangentElimination<double>::Symmetry::General);
        const VectorXd& rowScale = m_elimination->getRowScale();
        VectorXd y(n + m);
        y << -tangent.s.cwiseProduct(tangent.r), -rowScale.cwiseProduct(tangent.g);
        m_elimination->solveScaled(y);
        bool isLoaded = false;
        const VectorXd spin = findSpin(tangent);
        if (spin.size() > 0) {
            // The spin is solved for with its joint reactions: in pieces that turn as one, the
            // forces between them co-rotate.
            VectorXd turned = VectorXd::Zero(n + m);
            const VectorXd inert = multiplyMass(tangent, spin);
            turned.head(n) = inert;
            m_elimination->solveScaled(turned);
            y -= y.head(n).dot(inert) / turned.head(n).dot(inert) * turned;
            isLoaded = std::abs(spin.dot(tangent.s.cwiseProduct(tangent.r))) >
                       LoadedSpin * calcForceScale(tangent, spin);
        }
        const VectorXd delta = tangent.s.cwiseProduct(y.head(n)),
                       deltaLambda = rowScale.cwiseProduct(y.tail(m));
        m_shortfall.error = m > 0 ? tangent.g.cwiseAbs().maxCoeff() : 0;
        if (limitStep(delta) < 1) return false;
        move(delta, deltaLambda);
        if (m_shortfall.change > m_settings.m_tolerance ||
            m_shortfall.error > m_settings.m_constraintTolerance)
            continue;
        if (isLoaded) return false;
        ++numLoadSteps;
        VectorXd r;
        evaluate(m_point.q, r);
        return true;
    }
    return false;
}

bool StaticEquilibrium::Search::runNearby() {
    const std::vector<double> start = m_point.q;
    m_mostIterations = NearbyIterations;
    m_goesDownhill = false;
    return converge(1) && calcDistance(start) <= Nearby;
}

double StaticEquilibrium::Search::calcDistance(const std::vector<double>& from) const {
    double distance = 0;
    for (int b = 0; b < m_equations.getTopology().numBlocks(); ++b) {
        const Block& block = m_equations.getBlock(b);
        std::vector<double> moved(m_point.q.begin() + block.firstQ,
                                  m_point.q.begin() + block.firstQ + block.numQ);
        block.alignQ(&from[size_t(block.firstQ)], moved.data());
        for (size_t i = 0; i < moved.size(); ++i) moved[i] -= from[size_t(block.firstQ) + i];
        const double own = block.calcQDisplacement(moved.data()) / m_scales.lengths[size_t(b)];
        if (!(own <= distance)) distance = own;
    }
    return distance;
}

bool StaticEquilibrium::Search::mayHaveBranches() const {
    const Topology& topology = m_equations.getTopology();
    if (!topology.simbodyRows.empty() || topology.hasSimbodyForces() ||
        std::any_of(topology.elements.begin(), topology.elements.end(),
                    [](const Topology::Element& element) { return !element.isLoad(); }))
        return true;
    // Union-find over blocks, Ground last; trees are attached to it, except for free bodies.
    std::vector<int> with(size_t(topology.numBlocks() + 1));
    std::iota(with.begin(), with.end(), 0);
    const int ground = topology.numBlocks();
    const auto find = [&](int node) {
        while (with[size_t(node)] != node) node = with[size_t(node)];
        return node;
    };
    for (int b = topology.numFlexible; b < topology.numBlocks(); ++b) {
        const int first = m_equations.getBlock(b).firstU;
        if (std::find(m_places.begin(), m_places.end(), first + 3) == m_places.end())
            with[size_t(b)] = ground;
    }
    for (const Topology::Joint& joint : topology.joints) {
        if (joint.numRows() == 0 || joint.sides.size() != 2) continue;
        const auto nodeOf = [&](const FrameRef& side) {
            return find(side.block < 0 ? ground : side.block);
        };
        const int a = nodeOf(joint.sides[0]), b = nodeOf(joint.sides[1]);
        if (a == b) return true;
        with[size_t(a)] = b;
    }
    return false;
}

void StaticEquilibrium::Search::stayOnBranch(const SolutionPoint& start) {
    // A controlled system does not behave as if damped.
    if (!m_motion.isAtRest() || m_hasOwnStates || !m_equations.getTopology().frictions.empty() ||
        calcDistance(start.q) <= LongestCreep || !mayHaveBranches())
        return;
    branch = Branch::Unknown;
    if (m_equations.getTopology().numU > MostSpeedsFollowed) return;
    const SolutionPoint found = m_point;
    const int iterations = numIterations, loadSteps = numLoadSteps;
    m_point = start;
    if (creep(LongestCreep, MostFollowingSteps) && converge(1)) {
        branch = calcDistance(found.q) > Nearby ? Branch::Followed : Branch::Own;
        if (branch == Branch::Followed) return;
    } else {
        m_point = found;
        converge(1);
    }
    // Counts are those of Newton's method.
    numIterations = iterations;
    numLoadSteps = loadSteps;
}

void StaticEquilibrium::Search::evaluate(const std::vector<double>& q, VectorXd& r) {
    if (m_settings.m_observer) m_settings.m_observer();
    m_motion.calcSpeeds(q, m_point.u, m_point.uDot);
    std::vector<double>& moved = m_point.qDot;  // prescribed coordinates are in place already
    moved = q;
    m_equations.prescribe(m_point.t, 0, nullptr, moved.data(), m_point.u.data());
    m_equations.realize(m_point.t, q.data(), m_point.u.data());
    r.resize(m_equations.getTopology().numU);
    m_equations.calcResidual(q.data(), m_point.u.data(), m_point.uDot.data(), m_point.lambda.data(),
                             r.data());
}

StaticEquilibrium::Search::Tangent StaticEquilibrium::Search::calcTangent() {
    const int m = m_equations.getTopology().numMultipliers;
    VectorXd r;
    if (m_loadsOf != m_fraction) {
        // Loads change little with position, so they are computed once.
        VectorXd withoutLoads;
        m_equations.updSimbody().setLoadFraction(0);
        evaluate(m_point.q, withoutLoads);
        m_equations.updSimbody().setLoadFraction(m_fraction);
        evaluate(m_point.q, r);
        m_loads = r - withoutLoads;
        m_loadsOf = m_fraction;
    } else {
        evaluate(m_point.q, r);
    }
    m_mass = BlockMass(m_equations);
    if (!m_elimination) {
        m_elimination.emplace(m_graph, *m_mass);
        m_elimination->setNumThreads(m_equations.getBlocks().numThreads);
    }
    StateTangent states;
    const auto differentiate = [&] {
        states = calcStateTangent(m_equations, m_scales, m_point);
        return calcStiffness(
            m_equations, m_scales, m_graph, *m_mass, m_point,
            [&](const std::vector<double>& q, VectorXd& moved) { evaluate(q, moved); });
    };
    BlockMatrix<double> K = differentiate();
    // Differencing has changed the speeds.
    if (!m_motion.isAtRest()) evaluate(m_point.q, r);
    const VectorXd withoutLoads =
        r - m_loads - m_mass->multiplyGt(Map<const VectorXd>(m_point.lambda.data(), m));
    Tangent tangent{{},          std::move(K),      *m_mass, 0, std::move(r),
                    VectorXd(m), std::move(states), {},      {}};
    m_equations.calcPositionErrors(tangent.g.data());
    const VectorXd stiffness = tangent.K.getDiagonal(), inertia = tangent.mass.getDiagonal();
    tangent.isFinite = tangent.r.allFinite() && tangent.g.allFinite() && stiffness.allFinite();
    // Rigid coordinates, which may have little stiffness, are scaled by the softest mode.
    double& softest = tangent.softest;
    for (int b = 0; b < m_equations.getTopology().numFlexible; ++b) {
        const Block& block = m_equations.getBlock(b);
        for (int i = block.firstU + 6; i < block.firstU + block.numU; ++i)
            if (stiffness[i] > 0 && (softest == 0 || stiffness[i] < softest))
                softest = stiffness[i];
    }
    const bool isRigid = softest == 0;
    for (Eigen::Index i = 0; i < stiffness.size() && isRigid; ++i)
        if (!m_isHeld[size_t(i)]) softest = std::max(softest, std::abs(stiffness[i]) / inertia[i]);
    if (softest < LeastStiffness) softest = 1;
    VectorXd reactions = VectorXd::Zero(stiffness.size());
    for (size_t b = 0; b < tangent.mass.Gt.size(); ++b)
        for (size_t k = 0; k < tangent.mass.rows[b].size(); ++k)
            reactions.segment(m_graph.firstU[b], m_graph.sizes[b]) +=
                std::abs(m_point.lambda[size_t(tangent.mass.rows[b][k])]) *
                tangent.mass.Gt[b].col(Eigen::Index(k)).cwiseAbs();
    tangent.turning = VectorXd::Zero(stiffness.size());
    for (const int place : m_places) {
        const auto loads = m_loads.segment<3>(place);
        tangent.turning.segment<3>(place - 3).setConstant(
            std::max(reactions.segment<3>(place - 3).maxCoeff(),
                     m_scales.metres[size_t(place - 3)] * loads.norm()));
    }
    tangent.s = VectorXd::Zero(stiffness.size());
    for (Eigen::Index i = 0; i < stiffness.size(); ++i) {
        if (m_isHeld[size_t(i)]) continue;
        tangent.s[i] = 1 / std::sqrt(std::abs(stiffness[i]) + softest * inertia[i]);
    }
    tangent.forces = VectorXd::Zero(Eigen::Index(m_graph.sizes.size()));
    for (size_t b = 0; b < m_graph.sizes.size(); ++b)
        for (int i = m_graph.firstU[b]; i < m_graph.firstU[b] + m_graph.sizes[b]; ++i) {
            // Forces of springs that are preloaded against each other may far exceed their sum.
            const double metres = m_scales.metres[size_t(i)],
                         hidden = HiddenStrain * std::abs(stiffness[i]) * m_scales.lengths[b] /
                                  std::max(metres, 1e-12);
            const double parts =
                std::abs(withoutLoads[i]) + std::abs(m_loads[i]) + reactions[i] +
                inertia[i] * square(m_motion.getRate()) * std::min(1.0, 1 / metres) + hidden;
            double& largest = tangent.forces[Eigen::Index(b)];
            largest = std::max(largest, tangent.s[i] * parts);
        }
    if (tangent.isFinite) findPotential(tangent);
    return tangent;
}

StaticEquilibrium::Search::Tangent StaticEquilibrium::Search::tryTangent() {
    try {
        return calcTangent();
    } catch (const UnusablePoint&) {
        if (!m_mass) throw;
    } catch (const SimTK::Exception::Base&) {
        if (!m_mass) throw;
    }
    m_equations.updSimbody().setLoadFraction(m_fraction);
    return {{}, BlockMatrix<double>(m_graph), *m_mass, 1, {}, {}, {}, {}, {}};
}

double StaticEquilibrium::Search::calcForceScale(const Tangent& tangent, const VectorXd& y) const {
    double scale = 0;
    for (size_t b = 0; b < m_graph.sizes.size(); ++b)
        scale +=
            tangent.forces[Eigen::Index(b)] * y.segment(m_graph.firstU[b], m_graph.sizes[b]).norm();
    return scale;
}

void StaticEquilibrium::Search::factor(const Tangent& tangent, double sigma, Brake brake) {
    double inertia = sigma, turning = 0;
    if (brake == Brake::Turning && sigma > LeastShift && !m_places.empty()) {
        turning = sigma / (LeastShift * ShiftGrowth);
        inertia = LeastShift * std::max(1.0, turning);
    }
    BlockMatrix<double> A = tangent.K;
    A.addMass(tangent.mass, inertia * tangent.softest);
    for (const int place : m_places) {
        if (turning == 0) break;
        const auto next = std::upper_bound(m_graph.firstU.begin(), m_graph.firstU.end(), place - 3);
        const int b = int(next - m_graph.firstU.begin()) - 1;
        A.at(b, b).diagonal().segment<3>(place - 3 - m_graph.firstU[size_t(b)]) +=
            turning * tangent.turning.segment<3>(place - 3);
    }
    // Stiffness of controllers and of forces that follow the motion is not symmetric.
    using Symmetry = TangentElimination<double>::Symmetry;
    const bool isGeneral = !m_goesDownhill && (tangent.states.F.rows() > 0 || m_isSkew);
    m_elimination->factor(A, tangent.s, isGeneral ? Symmetry::General : Symmetry::Symmetric);
}

double StaticEquilibrium::Search::factorPositive(const Tangent& tangent, double sigma,
                                                 Brake brake) {
    factor(tangent, sigma, brake);
    while (m_goesDownhill && m_elimination->countNegative() > 0 && sigma < LargestShift) {
        sigma *= ShiftGrowth;
        factor(tangent, sigma, brake);
    }
    return sigma;
}

int StaticEquilibrium::Search::countSoftMotions(const Tangent& tangent) {
    factor(tangent, -calcZero(tangent));
    return std::max(0, m_elimination->countNegative());
}

int StaticEquilibrium::Search::factorAndCountUnstable(const Tangent& tangent) {
    factor(tangent, LeastShift);
    return std::max(0, m_elimination->countNegative());
}

VectorXd StaticEquilibrium::Search::multiplyScaled(const Tangent& tangent, const VectorXd& rowScale,
                                                   const VectorXd& y) const {
    const Eigen::Index n = tangent.s.size();
    const VectorXd x = tangent.s.cwiseProduct(y.head(n)),
                   lambda = rowScale.cwiseProduct(y.segment(n, rowScale.size()));
    VectorXd result(n + rowScale.size());
    result << tangent.s.cwiseProduct(tangent.K.multiply(x) + tangent.mass.multiplyGt(lambda)),
        rowScale.cwiseProduct(tangent.mass.multiplyG(x));
    return result;
}

std::vector<StaticEquilibrium::Search::SoftMotion> StaticEquilibrium::Search::findSoftMotions(
    const Tangent& tangent, int count) {
    const Eigen::Index n = tangent.s.size(), m = tangent.g.size();
    if (count == 0) return {};
    if (count > MostSoftMotions) count = FewSoftMotions;
    // Subspace iteration: free motions stand out by orders of magnitude.
    MatrixXd V(n, count + MoreDirections);
    for (Eigen::Index j = 0; j < V.cols(); ++j)
        for (Eigen::Index i = 0; i < n; ++i)
            V(i, j) = tangent.s[i] > 0 ? std::cos(1.3 * double((i + 1) * (j + 1)) + double(j)) : 0;
    const auto invert = [&](const VectorXd& of) {
        VectorXd y = VectorXd::Zero(n + m);
        y.head(n) = multiplyMass(tangent, of);
        m_elimination->solveScaled(y);
        return VectorXd(y.head(n).normalized());
    };
    SymmetricEigen eigen;
    for (int pass = 0; pass < NumSubspacePasses; ++pass) {
        for (Eigen::Index j = 0; j < V.cols(); ++j) V.col(j) = invert(V.col(j));
        orthonormalize(V);
        if (V.cols() == 0) return {};
        MatrixXd KV(n, V.cols()), MV(n, V.cols());
        for (Eigen::Index j = 0; j < V.cols(); ++j) {
            KV.col(j) =
                tangent.s.cwiseProduct(tangent.K.multiply(tangent.s.cwiseProduct(V.col(j))));
            MV.col(j) = multiplyMass(tangent, V.col(j));
        }
        MatrixXd stiffness = V.transpose() * KV, inertia = V.transpose() * MV;
        stiffness = (0.5 * (stiffness + stiffness.transpose())).eval();
        inertia = (0.5 * (inertia + inertia.transpose())).eval();
        eigen = calcSymmetricEigen(stiffness, inertia);
        V = (V * eigen.vectors).eval();
    }
    std::vector<SoftMotion> soft;
    const double zero = calcZero(tangent);
    const bool isPositive = m_goesDownhill && m_elimination->countNegative() == 0;
    for (Eigen::Index k = 0; k < V.cols() && eigen.values[k] < zero; ++k)
        // Where K is indefinite, what has not converged may have any quotient. Made positive by
        // inertia, it has no more negative ones than there are ways to fall.
        if ((isPositive && eigen.values[k] < -zero) ||
            1 - std::abs(invert(V.col(k)).dot(V.col(k).normalized())) < SameMotion)
            soft.push_back({eigen.values[k], V.col(k)});
    return soft;
}

VectorXd StaticEquilibrium::Search::solveBesideFree(
    const Tangent& tangent, int count, VectorXd b,
    const std::function<VectorXd(const VectorXd& b)>& solveStiff) {
    const Eigen::Index n = tangent.s.size();
    if (count <= MostSoftMotions) {
        std::vector<VectorXd> free, inert;
        for (const SoftMotion& motion : findSoftMotions(tangent, count)) {
            if (!(std::abs(motion.stiffness) < calcZero(tangent))) continue;
            free.push_back(motion.y);
            inert.push_back(multiplyMass(tangent, motion.y));
        }
        std::vector<double> forces;
        for (size_t k = 0; k < free.size(); ++k) {
            forces.push_back(free[k].dot(b.head(n)));
            b.head(n) -= forces.back() / inert[k].dot(free[k]) * inert[k];
        }
        VectorXd y = solveStiff(b);
        for (size_t k = 0; k < free.size(); ++k) {
            double moved = -inert[k].dot(y.head(n));
            if (std::abs(forces[k]) > ZeroForce * calcForceScale(tangent, free[k]))
                moved += forces[k] / LeastShift;
            y.head(n) += moved / inert[k].dot(free[k]) * free[k];
        }
        return y;
    }
    // σ(K + σM)⁻¹M preserves free motions and makes all others small.
    const auto keepFree = [&](VectorXd y) {
        for (int pass = 0; pass < NumFreePasses; ++pass) {
            VectorXd next = VectorXd::Zero(y.size());
            next.head(n) = LeastShift * multiplyMass(tangent, y.head(n));
            m_elimination->solveScaled(next);
            y.head(n) = next.head(n);
        }
        return VectorXd(y.head(n));
    };
    VectorXd moved = b;
    m_elimination->solveScaled(moved);
    const VectorXd free = keepFree(moved), forces = LeastShift * multiplyMass(tangent, free);
    b.head(n) -= forces;
    VectorXd y = solveStiff(b);
    y.head(n) -= keepFree(y);
    if (std::abs(free.dot(forces)) > ZeroForce * calcForceScale(tangent, free)) y.head(n) += free;
    return y;
}

bool StaticEquilibrium::Search::solve(const Tangent& tangent, double sigma, VectorXd& x,
                                      VectorXd& deltaLambda, VectorXd& dz) {
    const Eigen::Index n = tangent.s.size(), m = tangent.g.size(), s = tangent.states.F.rows();
    const VectorXd& rowScale = m_elimination->getRowScale();
    VectorXd b(n + m + s);
    b << -tangent.s.cwiseProduct(tangent.r), -rowScale.cwiseProduct(tangent.g), VectorXd::Zero(s);
    // Stationary states, in the units of their equations.
    MatrixXd B(n + m, s), C(s, n), F = tangent.states.F;
    for (Eigen::Index j = 0; j < s; ++j) {
        B.col(j) << tangent.s.cwiseProduct(tangent.states.B.col(j)), VectorXd::Zero(m);
        C.row(j) = tangent.states.C.row(j).cwiseProduct(tangent.s.transpose());
    }
    for (Eigen::Index j = 0; j < s; ++j) {
        const double size =
            std::max(F.row(j).cwiseAbs().maxCoeff(), C.row(j).cwiseAbs().maxCoeff());
        if (!(size > 0)) return false;
        F.row(j) /= size;
        C.row(j) /= size;
        b[n + m + j] = -tangent.states.rates[j] / size;
    }
    MatrixXd solvedB = B;
    for (Eigen::Index j = 0; j < s; ++j) {
        VectorXd column = B.col(j);
        m_elimination->solveScaled(column);
        solvedB.col(j) = column;
    }
    const MatrixXd schur = F - C * solvedB.topRows(n);
    VectorXd units = schur.colwise().norm();
    for (double& unit : units) {
        if (!(unit > 0)) return false;
        unit = 1 / unit;
    }
    std::optional<SquareSystem> states;
    if (s > 0) states.emplace(schur * units.asDiagonal());
    if (states && !(states->getSmallestPivot() > ZeroStiffness)) return false;
    const auto precondition = [&](const VectorXd& right) {
        VectorXd y = right.head(n + m);
        m_elimination->solveScaled(y);
        if (!states) return y;
        const VectorXd z = units.cwiseProduct(states->solve(right.tail(s) - C * y.head(n)));
        VectorXd result(n + m + s);
        result << y - solvedB * z, z;
        return result;
    };
    const auto multiply = [&](const VectorXd& y) {
        VectorXd result(n + m + s);
        result << multiplyScaled(tangent, rowScale, y) + B * y.tail(s),
            C * y.head(n) + F * y.tail(s);
        return result;
    };
    const auto solveStiff = [&](const VectorXd& right) {
        return solveByGmres(multiply, precondition, right, MaxGmresSteps);
    };
    VectorXd y = precondition(b);
    x = tangent.s.cwiseProduct(y.head(n));
    // Compared with the work of elasticity, excluding that of the joints' compliance.
    const double inertia = sigma * y.head(n).dot(multiplyMass(tangent, y.head(n))),
                 elastic = std::abs(x.dot(tangent.K.multiply(x)));
    const double part = limitStep(x);
    const bool isTooLong = canBrake() && part < LeastPart;
    if (sigma == LeastShift && !isTooLong) {
        // A load along a free motion leads far, but its direction is kept.
        const bool mayBeFree = s == 0 && inertia > FreeShare * (inertia + elastic);
        const int count = mayBeFree ? countSoftMotions(tangent) : 0;
        if (count > 0) factor(tangent, sigma);
        y = count > 0 ? solveBesideFree(tangent, count, b, solveStiff) : solveStiff(b);
    }
    x = tangent.s.cwiseProduct(y.head(n));
    deltaLambda = rowScale.cwiseProduct(y.segment(n, m));
    dz = y.tail(s);
    return true;
}

VectorXd StaticEquilibrium::Search::balance(const Tangent& tangent, const VectorXd& r) {
    BlockMatrix<double>::Modes modes = tangent.K.modes;
    for (BlockModes<double>& own : modes) own.diagonal.setZero();
    BlockMatrix<double> M(m_graph, std::move(modes));
    M.addMass(tangent.mass, 1);
    VectorXd scale = tangent.mass.getDiagonal().cwiseSqrt().cwiseInverse();
    for (Eigen::Index i = 0; i < scale.size(); ++i)
        if (m_isHeld[size_t(i)]) scale[i] = 0;
    m_elimination->factor(M, scale, TangentElimination<double>::Symmetry::Symmetric);
    VectorXd f = -r, g = VectorXd::Zero(tangent.g.size());
    m_elimination->solve(f, g);
    return g;
}

double StaticEquilibrium::Search::limitStep(VectorXd delta) {
    m_shortfall.change =
        m_equations.getBlocks().calcDisplacement(delta.data(), &m_shortfall.worstBlock);
    double factor = 1;
    const auto limit = [&](double part) {
        for (int b = 0; b < m_equations.getTopology().numBlocks(); ++b) {
            const Block& block = m_equations.getBlock(b);
            const double displacement = block.calcDisplacement(delta.data() + block.firstU);
            const double allowed = part * m_scales.lengths[size_t(b)];
            if (displacement > allowed) factor = std::min(factor, allowed / displacement);
        }
    };
    if (m_shortfall.change > m_settings.m_maximumStep)
        factor = m_settings.m_maximumStep / m_shortfall.change;
    // Limits turning and bending; bodies free in Ground may translate without limit.
    for (const int place : m_places) delta.segment<3>(place).setZero();
    limit(StepLimit);
    // A small link may turn far before its tree has moved by its size.
    for (const auto& [speed, radians] : m_turns) {
        if (!m_motion.isAtRest()) break;
        const double turned = std::abs(delta[speed]) * radians;
        if (turned > StepLimit) factor = std::min(factor, StepLimit / turned);
    }
    return factor;
}

void StaticEquilibrium::Search::move(const VectorXd& delta, const VectorXd& deltaLambda) {
    m_equations.realize(m_point.t, m_point.q.data(), m_point.u.data());
    m_equations.getBlocks().moveQ(delta.data(), m_point.q.data());
    m_equations.getBlocks().normalizeQ(m_point.q.data());
    for (size_t k = 0; k < m_point.lambda.size(); ++k)
        m_point.lambda[k] += deltaLambda[Eigen::Index(k)];
    if (m_equations.getTopology().states.empty()) return;
    // Springs that count turns need every intermediate position.
    m_equations.realize(m_point.t, m_point.q.data(), m_point.u.data());
    m_equations.updLoads().startStates(m_point.z.data());
}

double StaticEquilibrium::Search::searchLine(const Tangent& tangent, const VectorXd& delta,
                                             const VectorXd& deltaLambda) {
    const double before = delta.dot(tangent.r);
    if (!(before < 0)) return 1;
    const SolutionPoint from = m_point;
    VectorXd r;
    const auto calcWork = [&](double part) {
        m_point = from;
        move(part * delta, part * deltaLambda);
        evaluate(m_point.q, r);
        m_point = from;
        return delta.dot(r);
    };
    double low = 0, high = 1, atLow = before, atHigh = calcWork(1), part = 1;
    if (!(atHigh > LineSlack * std::abs(before))) return 1;
    for (int trial = 0; trial < MostLineTrials; ++trial) {
        // Secant step, kept away from both ends.
        part = low + (high - low) * std::min(0.9, std::max(0.1, atLow / (atLow - atHigh)));
        const double now = calcWork(part);
        if (std::abs(now) <= LineSlack * std::abs(before)) break;
        (now < 0 ? low : high) = part;
        (now < 0 ? atLow : atHigh) = now;
    }
    return part;
}

bool StaticEquilibrium::Search::creep(double longest, int mostSteps) {
    m_fraction = 1;
    m_equations.updSimbody().setLoadFraction(1);
    double sigma = FirstDamping, boldness = 8;
    for (int step = 0; step < mostSteps && sigma < LargestDamping; ++step) {
        const SolutionPoint before = m_point;
        VectorXd gone = VectorXd::Zero(m_scales.metres.size());
        bool hasArrived = false;
        double gap = Infinity;
        int iteration = 0;
        while (iteration < MostCreepIterations && !hasArrived) {
            Tangent tangent = tryTangent();
            ++numIterations;
            ++iteration;
            if (!tangent.isFinite) break;
            tangent.r += sigma * tangent.softest * tangent.mass.multiply(gone);
            sigma = factorPositive(tangent, sigma, Brake::Inertia);
            VectorXd delta, deltaLambda, dz;
            if (!solve(tangent, sigma, delta, deltaLambda, dz)) return false;
            const double part = limitStep(delta);
            delta *= part;
            deltaLambda *= part;
            if (part == 1) {
                // No farther than where forces without the drag reverse.
                const double line = searchLine(tangent, delta, deltaLambda);
                delta *= line;
                deltaLambda *= line;
            }
            move(delta, deltaLambda);
            gone += delta;
            double change = 0;
            for (int b = 0; b < m_equations.getTopology().numBlocks(); ++b) {
                const Block& block = m_equations.getBlock(b);
                change = std::max(change, block.calcDisplacement(delta.data() + block.firstU) /
                                              m_scales.lengths[size_t(b)]);
            }
            // Growing corrections: try a shorter step.
            if (iteration > 4 && change > 2 * gap) break;
            gap = std::min(gap, change);
            hasArrived = part == 1 && change <= CreepAccuracy;
        }
        const double share = hasArrived ? calcTurning(gone) / longest : 0;
        if (!hasArrived || share > 1) {
            m_point = before;
            if (!m_point.z.empty()) m_equations.setZ(m_point.z.data());
            // Shorten a step that was too long.
            sigma *= share > 0 ? std::min(8.0, 1.5 * share) : boldness;
            if (!hasArrived) boldness = std::max(1.2, std::sqrt(boldness));
        } else if (sigma <= LastDamping) {
            return true;
        } else {
            sigma /= std::min(iteration <= 4   ? boldness
                              : iteration <= 7 ? std::sqrt(boldness)
                                               : 1.0,
                              0.8 / share);
            boldness = std::min(8.0, 1.1 * boldness);
        }
    }
    return false;
}

double StaticEquilibrium::Search::multiplySizes(const VectorXd& a, const VectorXd& b) const {
    double sum = 0;
    for (size_t k = 0; k < m_graph.firstU.size(); ++k)
        for (int i = m_graph.firstU[k]; i < m_graph.firstU[k] + m_graph.sizes[k]; ++i)
            sum += square(m_scales.metres[size_t(i)] / m_scales.lengths[k]) * a[i] * b[i];
    return sum;
}

double StaticEquilibrium::Search::calcTurning(VectorXd delta) const {
    const auto calcLargest = [&] {
        double largest = 0;
        for (int b = 0; b < m_equations.getTopology().numBlocks(); ++b) {
            const Block& block = m_equations.getBlock(b);
            largest = std::max(largest, block.calcDisplacement(delta.data() + block.firstU) /
                                            m_scales.lengths[size_t(b)]);
        }
        return largest;
    };
    const double moved = calcLargest();
    for (const int place : m_places) delta.segment<3>(place).setZero();
    double turned = calcLargest();
    for (const auto& [speed, radians] : m_turns)
        turned = std::max(turned, std::abs(delta[speed]) * radians);
    return turned > LeastTurn * moved ? turned : moved;
}

VectorXd StaticEquilibrium::Search::calcLoadSlope() {
    const double fraction = m_fraction;
    VectorXd here, more;
    setFraction(fraction + 1);
    evaluate(m_point.q, more);
    setFraction(fraction);
    evaluate(m_point.q, here);
    return more - here;
}

void StaticEquilibrium::Search::solveFor(const Tangent& tangent, const VectorXd& f,
                                         const VectorXd& g, VectorXd& x, VectorXd& lambda) {
    const VectorXd& rowScale = m_elimination->getRowScale();
    VectorXd b(f.size() + g.size());
    b << tangent.s.cwiseProduct(f), rowScale.cwiseProduct(g);
    const VectorXd y =
        solveByGmres([&](const VectorXd& of) { return multiplyScaled(tangent, rowScale, of); },
                     [&](VectorXd of) {
                         m_elimination->solveScaled(of);
                         return of;
                     },
                     b, MaxGmresSteps);
    x = tangent.s.cwiseProduct(y.head(f.size()));
    lambda = rowScale.cwiseProduct(y.tail(g.size()));
}

StaticEquilibrium::Search::Direction StaticEquilibrium::Search::calcDirection(
    const Direction& before) {
    const VectorXd slope = calcLoadSlope();
    const Tangent tangent = calcTangent();
    Direction direction;
    direction.numUnstable = factorAndCountUnstable(tangent);
    direction.softest = tangent.softest;
    if (!m_hasPotential) direction.numUnstable = 0;
    if (m_hasPotential)
        direction.motions = calcCriticalMotions(
            tangent.s, [&](const VectorXd& x) { return tangent.mass.multiply(x); },
            [&](VectorXd f) {
                VectorXd g = VectorXd::Zero(tangent.g.size());
                m_elimination->solve(f, g);
                return f;
            });
    solveFor(tangent, -slope, VectorXd::Zero(tangent.g.size()), direction.delta, direction.lambda);
    double turning = calcTurning(direction.delta);
    if (!std::isfinite(turning)) {
        // For motions without stiffness, a little inertia determines a direction.
        direction.delta = -slope;
        direction.lambda = VectorXd::Zero(tangent.g.size());
        m_elimination->solve(direction.delta, direction.lambda);
        turning = calcTurning(direction.delta);
    }
    if (!(slope.norm() > 0) || !std::isfinite(turning))
        throw std::runtime_error(
            "no path of equilibria can be followed: there are no loads, or they act on what "
            "nothing holds");
    direction.turning = turning;
    direction.isByLoad = turning < m_leadingTurn;
    const bool isFirst = before.delta.size() == 0;
    const bool turnsBack =
        !isFirst &&
        (before.isByLoad ? before.fraction < 0 : multiplySizes(before.delta, direction.delta) < 0);
    const double size = (turnsBack ? -1 : 1) / (direction.isByLoad ? 1 : turning);
    direction.delta *= size;
    direction.lambda *= size;
    direction.fraction = size;
    return direction;
}

bool StaticEquilibrium::Search::goAlong(const SolutionPoint& from, double fraction,
                                        const Direction& direction, double length) {
    m_point = from;
    setFraction(fraction + length * direction.fraction);
    VectorXd gone = length * direction.delta;
    move(gone, length * direction.lambda);
    const double size = multiplySizes(direction.delta, direction.delta);
    for (int iteration = 0; iteration < MostPathIterations; ++iteration) {
        const VectorXd slope = calcLoadSlope();
        const Tangent tangent = tryTangent();
        ++numIterations;
        if (!tangent.isFinite) return false;
        m_shortfall.error = tangent.g.size() > 0 ? tangent.g.cwiseAbs().maxCoeff() : 0;
        factor(tangent, LeastShift);
        VectorXd delta, lambda, byLoad, lambdaByLoad;
        solveFor(tangent, -tangent.r, -tangent.g, delta, lambda);
        solveFor(tangent, -slope, VectorXd::Zero(tangent.g.size()), byLoad, lambdaByLoad);
        // In the plane orthogonal to the path.
        const double more = direction.isByLoad ? 0
                                               : -multiplySizes(direction.delta, delta) /
                                                     multiplySizes(direction.delta, byLoad);
        if (!std::isfinite(more)) return false;
        delta += more * byLoad;
        lambda += more * lambdaByLoad;
        if (limitStep(delta) < 1) return false;
        move(delta, lambda);
        setFraction(m_fraction + more);
        gone += delta;
        if (direction.isByLoad ? calcTurning(gone) > length
                               : multiplySizes(gone, gone) > square(MostPathCurve * length) * size)
            return false;
        if (m_shortfall.change <= m_settings.m_tolerance &&
            m_shortfall.error <= m_settings.m_constraintTolerance)
            return true;
    }
    return false;
}

std::optional<double> StaticEquilibrium::Search::seekAlong(
    const SolutionPoint& from, double fraction, const Direction& direction, double end,
    double atStart, double atEnd, const std::function<double()>& calc, double start) {
    double at = end;
    const double sharpness = PathSharpness * end;
    for (int trial = 0; trial < MostPathTrials && end - start > sharpness; ++trial) {
        const double share = atStart / (atStart - atEnd);
        at = start + (end - start) * std::min(0.98, std::max(0.02, share));
        if (!goAlong(from, fraction, direction, at)) return std::nullopt;
        const double now = calc();
        const bool isBefore = (now > 0) == (atStart > 0);
        // Illinois method: halve the value at an end that stays.
        (isBefore ? atEnd : atStart) *= 0.5;
        (isBefore ? atStart : atEnd) = now;
        (isBefore ? start : end) = at;
        if (now == 0) break;
    }
    return at;
}

void StaticEquilibrium::Search::differenceMotions(Direction& direction, double length) {
    const SolutionPoint here = m_point;
    const double fraction = m_fraction, part = SlopePart * length;
    setFraction(fraction + part * direction.fraction);
    move(part * direction.delta, part * direction.lambda);
    const Direction ahead = calcDirection(direction);
    m_point = here;
    setFraction(fraction);
    for (CriticalMotion& motion : direction.motions) {
        const CriticalMotion* later = findSameMotion(motion, ahead.motions);
        const double change = later ? later->stiffness - motion.stiffness : 0;
        motion.slope = std::abs(change) > StiffnessNoise * direction.softest ? change / part : 0;
    }
}

std::optional<StaticEquilibrium::Search::Place> StaticEquilibrium::Search::seekBifurcation(
    const Place& start, const Direction& direction, const Place& end,
    const StabilityChange& change) {
    std::vector<Place> places{start, end};
    std::vector<std::pair<double, double>> values{{start.at, change.start.stiffness},
                                                  {end.at, change.end.stiffness}};
    // Samples near the zero, but far enough that round-off does not dominate the stiffness.
    const auto look = [&](double at) {
        if (!goAlong(start.point, start.fraction, direction, at)) return false;
        const Place place{at, m_fraction, m_point};
        const std::vector<CriticalMotion> motions = calcDirection(direction).motions;
        const CriticalMotion* same = findSameMotion(change.start, motions);
        if (!same) same = findSameMotion(change.end, motions);
        if (!same) return false;
        const size_t index =
            size_t(std::lower_bound(values.begin(), values.end(), std::make_pair(at, -Infinity)) -
                   values.begin());
        values.insert(values.begin() + std::ptrdiff_t(index), {at, same->stiffness});
        places.insert(places.begin() + std::ptrdiff_t(index), place);
        return true;
    };
    double zero = change.at, aside = FirstAside * end.at;
    size_t first = 0;
    std::vector<double> weights;
    const auto calcFraction = [&] {
        double fraction = 0;
        for (size_t k = 0; k < places.size(); ++k) fraction += weights[k] * places[k].fraction;
        return fraction;
    };
    for (int trial = 0; trial < MostBifurcationTrials; ++trial) {
        for (const double side : {-1.0, 1.0}) {
            bool isFound = false;
            for (int k = 0; k < MostAsides && !isFound; ++k) {
                const double at = zero + side * aside * std::pow(0.8, k);
                isFound = at <= start.at || at >= end.at || look(at);
            }
            if (!isFound) return std::nullopt;
        }
        const double before = zero;
        zero = interpolateZero(values, first, weights);
        const double slope = (places[first + 1].fraction - places[first].fraction) /
                             (places[first + 1].at - places[first].at);
        if (trial > 1 &&
            std::abs((zero - before) * slope) <= BifurcationSharpness * std::abs(calcFraction()))
            break;
        aside = std::max(LastAside * end.at, std::min(0.1 * aside, 10 * std::abs(zero - before)));
    }
    // Interpolated, because Newton's method would choose between both paths by round-off there.
    const SolutionPoint& low = places[first].point;
    Place place{zero, calcFraction(), low};
    for (size_t p = 0; p < places.size(); ++p) {
        const SolutionPoint& own = places[p].point;
        for (size_t i = 0; i < low.q.size(); ++i)
            place.point.q[i] += weights[p] * (own.q[i] - low.q[i]);
        for (size_t k = 0; k < low.lambda.size(); ++k)
            place.point.lambda[k] += weights[p] * (own.lambda[k] - low.lambda[k]);
    }
    m_equations.realize(low.t, low.q.data(), low.u.data());
    m_equations.getBlocks().normalizeQ(place.point.q.data());
    return place;
}

auto StaticEquilibrium::Search::findSpecials(const Place& start, const Direction& direction,
                                             const Place& end, const Direction& next,
                                             double longest)
    -> std::optional<std::vector<Special>> {
    const bool turns = next.fraction * direction.fraction < 0;
    const int change = next.numUnstable - direction.numUnstable;
    std::vector<CriticalMotion> last = next.motions;
    const double share = calcShare(direction, next);
    for (CriticalMotion& motion : last) motion.slope /= share;
    const std::optional<std::vector<StabilityChange>> changes =
        findStabilityChanges(direction.motions, last, end.at, change);
    // At a force that jumps, no shorter step separates the changes.
    const bool isSharp = end.at < ShortestLook * longest;
    if (!changes && !isSharp) return std::nullopt;
    std::vector<Special> specials;
    if (turns) {
        const std::optional<double> at =
            seekAlong(start.point, start.fraction, direction, end.at, direction.fraction,
                      next.fraction, [&] { return calcDirection(direction).fraction; });
        if (!at) return std::nullopt;
        specials.push_back({{*at, m_fraction, m_point}, Kind::Limit, 0, 0});
    }
    if (!changes) {
        if (turns)
            specials.back().change = change;
        else if (change != 0)
            specials.push_back({end, Kind::Bifurcation, change, std::abs(change)});
        return specials;
    }
    for (const StabilityChange& own : *changes) {
        const std::optional<Place> place = seekBifurcation(start, direction, end, own);
        if (!place) return std::nullopt;
        specials.push_back({*place, Kind::Bifurcation, own.getSign(), 1});
    }
    if (turns) {
        // One motion changes sign at the limit point itself: that is no other path.
        const double limit = specials.front().place.at;
        const auto isNearer = [&](const Special& a, const Special& b) {
            return std::abs(a.place.at - limit) < std::abs(b.place.at - limit);
        };
        const auto own = std::min_element(specials.begin() + 1, specials.end(), isNearer);
        if (own == specials.end() || std::abs(own->place.at - limit) > LastAside * end.at) {
            if (!isSharp) return std::nullopt;
        } else {
            specials.front().change = own->change;
            specials.erase(own);
        }
    }
    std::stable_sort(specials.begin(), specials.end(),
                     [](const Special& a, const Special& b) { return a.place.at < b.place.at; });
    std::vector<Special> merged;
    for (const Special& special : specials) {
        const double fraction = special.place.fraction;
        if (!merged.empty() && merged.back().kind == Kind::Bifurcation &&
            special.kind == Kind::Bifurcation &&
            std::abs(fraction - merged.back().place.fraction) <= SameLoad * std::abs(fraction)) {
            merged.back().change += special.change;
            ++merged.back().numChanging;
        } else {
            merged.push_back(special);
        }
    }
    return merged;
}

void StaticEquilibrium::Search::follow(const PathSettings& settings, const Visit& visit) {
    if (!converge(0)) fail(0);
    m_goesDownhill = false;
    m_leadingTurn = LeastTurning;
    Place from{0, 0, m_point};
    double length = settings.step, steepest = 0;
    Direction direction = calcDirection({});
    differenceMotions(direction, length);
    if (visit({0, direction.numUnstable, Kind::Regular, 0}) == Next::Stop) return;
    int numPoints = 1;
    while (numPoints < settings.mostPoints) {
        const auto shorten = [&](const std::string& reason) {
            length /= 4;
            if (length >= LeastPathStep * settings.step) return;
            if (!direction.isByLoad && direction.fraction != 0) {
                // If loads stiffen the system, as tension does, it turns less and less: continue
                // with the load as parameter.
                direction.leadByLoad();
                m_leadingTurn = MoreTurning * direction.turning;
                length = settings.step;
                return;
            }
            std::ostringstream text;
            text << "the path of equilibria cannot be followed beyond " << 100 * from.fraction
                 << " % of the loads, " << numPoints << " points from its beginning: " << reason;
            throw std::runtime_error(text.str());
        };
        if (!goAlong(from.point, from.fraction, direction, length)) {
            std::ostringstream reason;
            reason << "the largest correction is " << m_shortfall.change << " m at '"
                   << m_equations.getBlock(m_shortfall.worstBlock).name << "'";
            shorten(reason.str());
            continue;
        }
        const Place reached{length, m_fraction, m_point};
        Direction next = calcDirection(direction);
        // A step over two limit points would miss both.
        steepest = std::max({steepest, std::abs(direction.fraction), std::abs(next.fraction)});
        const double slope =
            std::max({std::abs(direction.fraction), std::abs(next.fraction), FlatPath * steepest});
        const double surprise = std::abs(reached.fraction - from.fraction -
                                         0.5 * length * (direction.fraction + next.fraction)) /
                                (length * slope);
        // Contact with a stop bends the path, however short the step, to between both slopes.
        const auto [low, high] = std::minmax(direction.fraction, next.fraction);
        const double gain = (reached.fraction - from.fraction) / length,
                     slack = LargestSurprise * slope;
        const bool isKink = surprise > LargestSurprise && gain >= low - slack &&
                            gain <= high + slack && length < ShortestLook * settings.step;
        if (!(surprise <= LargestSurprise) && !isKink) {
            shorten("the loads turn too sharply along it");
            continue;
        }
        differenceMotions(next, length);
        // Next to a bifurcation, round-off decides between the paths.
        const bool isAtBifurcation =
            std::any_of(next.motions.begin(), next.motions.end(), [&](const CriticalMotion& own) {
                return std::abs(own.stiffness) < AtBifurcation * length * std::abs(own.slope);
            });
        if (isAtBifurcation && length > ShortestLook * settings.step) {
            length *= 0.9;
            continue;
        }
        const std::optional<std::vector<Special>> specials =
            findSpecials(from, direction, reached, next, settings.step);
        if (!specials) {
            shorten(
                "motions gain or lose stability there too close to each other to be told "
                "apart");
            continue;
        }
        // Where all loads act for the first time: before, between or after special points.
        const auto crosses = [](double a, double b) { return (a < 1) != (b < 1); };
        Place before = from;
        int numUnstable = direction.numUnstable;
        bool isOver = false;
        const auto endsBefore = [&](const Place& place) {
            if (!crosses(before.fraction, place.fraction)) return false;
            if (!seekAlong(
                    from.point, from.fraction, direction, place.at, before.fraction - 1,
                    place.fraction - 1, [&] { return m_fraction - 1; }, before.at))
                m_point = place.point;
            const SolutionPoint near = m_point;
            if (!converge(1) || !(calcDistance(near.q) <= settings.step)) {
                // Newton's method does not converge at a bifurcation; use the located point.
                const bool isThere = std::abs(place.fraction - 1) <= SameLoad;
                if (!isThere && std::abs(before.fraction - 1) > SameLoad) fail(from.fraction);
                m_point = isThere ? place.point : before.point;
                setFraction(1);
            }
            visit({1, numUnstable, Kind::Regular, 0});
            return true;
        };
        for (const Special& special : *specials) {
            isOver = endsBefore(special.place);
            if (isOver) break;
            before = special.place;
            m_point = before.point;
            setFraction(before.fraction);
            ++numPoints;
            const int fewest = numUnstable + std::min(0, special.change);
            numUnstable += special.change;
            isOver =
                visit({before.fraction, fewest, special.kind, special.numChanging}) == Next::Stop ||
                numPoints >= settings.mostPoints;
            if (isOver) break;
        }
        if (isOver || endsBefore(reached)) break;
        from = reached;
        from.at = 0;
        m_point = from.point;
        setFraction(from.fraction);
        direction = next;
        ++numPoints;
        if (visit({from.fraction, direction.numUnstable, Kind::Regular, 0}) == Next::Stop) break;
        if (isKink)
            length = 0.25 * settings.step;
        else if (surprise < 0.25 * LargestSurprise)
            length = std::min(settings.step, 2 * length);
    }
    m_goesDownhill = true;
}

std::string StaticEquilibrium::Search::describeTurn(const SolutionPoint& start) {
    if (!m_motion.isAtRest() || m_hasOwnStates || !m_equations.getTopology().frictions.empty())
        return "";
    m_point = start;
    std::ostringstream text;
    try {
        PathSettings settings;
        settings.mostPoints = MostPointsToLimit;
        follow(settings, [&](const PathMark& mark) {
            const double fraction = mark.fraction;
            if (mark.kind == Kind::Regular || !(fraction < 1)) return Next::GoOn;
            if (mark.kind == Kind::Limit)
                text << "the path of equilibria turns at " << 100 * fraction
                     << " % of the loads, a limit point (snap-through)";
            else
                text << "the equilibrium loses its stability at " << 100 * fraction
                     << " % of the loads, where another path crosses (buckling)";
            text << ": follow it by followPath(), `path:` of a static analysis; ";
            return Next::Stop;
        });
    } catch (const Cancelled&) {
        throw;
    } catch (const std::runtime_error&) {
        // Unknown.
    }
    m_goesDownhill = true;
    return text.str();
}

bool StaticEquilibrium::Search::converge(double fraction) {
    setFraction(fraction);
    m_motion.setFactor(std::sqrt(fraction));
    if (!m_point.z.empty()) m_equations.setZ(m_point.z.data());
    double firstShift = LeastShift;
    for (int iteration = 0; iteration < m_mostIterations; ++iteration) {
        const Tangent tangent = tryTangent();
        ++numIterations;
        m_shortfall.error = 0;
        for (Eigen::Index k = 0; k < tangent.g.size(); ++k)
            if (!(std::abs(tangent.g[k]) <= m_shortfall.error)) {
                m_shortfall.error = std::abs(tangent.g[k]);
                m_shortfall.worstRow = int(k);
            }
        if (!tangent.isFinite) {
            m_shortfall.reason = "forces or positions are not finite numbers";
            return false;
        }
        VectorXd delta, deltaLambda, dz;
        const Brake brake = canBrake() ? Brake::Turning : Brake::Inertia;
        double sigma = factorPositive(tangent, firstShift, brake), part = 1;
        bool isBraked = firstShift > LeastShift;
        double tooLittle = 0, tooMuch = 0;  // bounds of σ
        for (int trial = 0;; ++trial) {
            if (!solve(tangent, sigma, delta, deltaLambda, dz)) {
                m_shortfall.reason = "no values of the states keep them from changing";
                return false;
            }
            part = limitStep(delta);
            if (!canBrake() || trial == MostTrials) break;
            // More inertia shortens too long a step in the softest directions.
            if (part < LeastPart) {
                tooLittle = sigma;
                sigma = tooMuch > 0 ? std::sqrt(tooLittle * tooMuch)
                                    : sigma * std::max(LeastStiffening, LeastPart / part);
            } else if (tooLittle > 0 && sigma > square(LeastStiffening) * tooLittle &&
                       calcTurning(delta) < ShortStep * StepLimit) {
                tooMuch = sigma;
                sigma = std::sqrt(tooLittle * tooMuch);
            } else {
                break;
            }
            isBraked = true;
            factor(tangent, sigma, brake);
        }
        firstShift = canBrake() && part < 1 && sigma > ShiftGrowth * LeastShift ? sigma / ShiftDecay
                                                                                : LeastShift;
        delta *= part;
        if (part < (canBrake() ? LeastPart : 1)) {
            deltaLambda = balance(tangent, tangent.r + tangent.K.multiply(delta));
        } else if (m_searchesLines && canBrake() && dz.size() == 0 &&
                   m_shortfall.change > m_settings.m_tolerance) {  // below it, forces are round-off
            const double line = searchLine(tangent, delta, deltaLambda);
            delta *= line;
            deltaLambda *= line;
            part *= line;
        }
        move(delta, deltaLambda);
        double largestState = 0;
        for (Eigen::Index i = 0; i < dz.size(); ++i) {
            const int state = tangent.states.states[size_t(i)];
            m_point.z[size_t(state)] += part * dz[i];
            const Topology& topology = m_equations.getTopology();
            const auto& equation = *topology.states[size_t(state - topology.firstZ)].equation;
            largestState = std::max(largestState, std::abs(dz[i]) / equation.getScale());
        }
        if (dz.size() > 0) m_equations.setZ(m_point.z.data());
        // A step that is short because it was braked has not converged.
        if (part == 1 && !isBraked && largestState <= m_settings.m_tolerance &&
            m_shortfall.change <= m_settings.m_tolerance &&
            m_shortfall.error <= m_settings.m_constraintTolerance) {
            ++numLoadSteps;
            VectorXd r;
            evaluate(m_point.q, r);
            return true;
        }
    }
    m_shortfall.reason = "it does not converge within " +
                         std::to_string(m_settings.m_maximumIterations) + " iterations";
    return false;
}

std::string StaticEquilibrium::Search::nameMostMoved(const VectorXd& delta) const {
    int worst = 0;
    m_equations.getBlocks().calcDisplacement(delta.data(), &worst);
    return "'" + m_equations.getBlock(worst).name + "'";
}

void StaticEquilibrium::Search::describeMotions(std::vector<std::string>& free,
                                                std::vector<std::string>& unstable) {
    const Tangent tangent = calcTangent();
    const auto name = [&](const SoftMotion& motion) {
        return nameMostMoved(tangent.s.cwiseProduct(motion.y));
    };
    const int count = countSoftMotions(tangent);
    if (count == 0) return;
    const int numUnstable = factorAndCountUnstable(tangent);
    for (const SoftMotion& motion : findSoftMotions(tangent, count))
        if (motion.stiffness > -calcZero(tangent))
            free.push_back(name(motion) + " is free to move");
    // A steady motion may be stable all the same.
    if (!m_motion.isAtRest() || numUnstable == 0 || !m_hasPotential) return;
    factorPositive(tangent, LeastShift, Brake::Inertia);
    for (const SoftMotion& motion : findSoftMotions(tangent, count))
        if (motion.stiffness < -calcZero(tangent))
            unstable.push_back(name(motion) + " falls away from it");
    // In how many is known better than what moves in them.
    if (m_goesDownhill)
        unstable.resize(size_t(numUnstable),
                        unstable.empty() ? "something falls away from it" : unstable.back());
}

void StaticEquilibrium::Search::fail(double fraction) {
    m_fraction = 1;
    m_equations.updSimbody().setLoadFraction(1);
    m_motion.setFactor(1);
    std::ostringstream text;
    text << "no static equilibrium: ";
    const Tangent tangent = tryTangent();
    if (tangent.isFinite) {
        const int count = countSoftMotions(tangent);
        factor(tangent, LeastShift);
        for (const SoftMotion& motion : findSoftMotions(tangent, count)) {
            const double force = motion.y.dot(tangent.s.cwiseProduct(tangent.r));
            if (std::abs(motion.stiffness) > calcZero(tangent) ||
                std::abs(force) <= 1e-6 * calcForceScale(tangent, motion.y))
                continue;
            text << nameMostMoved(tangent.s.cwiseProduct(motion.y))
                 << " is free to move and loads act along that motion; hold it by a joint or lock, "
                    "or give it a spring";
            throw std::runtime_error(text.str());
        }
    }
    text << m_shortfall.reason << "; the largest correction is " << m_shortfall.change << " m at '"
         << m_equations.getBlock(m_shortfall.worstBlock).name << "' (allowed "
         << m_settings.m_tolerance << " m)";
    if (m_shortfall.worstRow >= 0)
        text << ", the largest joint error " << m_shortfall.error << " at "
             << m_equations.getTopology().describeConstraint(m_shortfall.worstRow) << " (allowed "
             << m_settings.m_constraintTolerance << ")";
    if (fraction > 0) text << "; " << 100 * fraction << " % of the loads could be applied";
    if (tangent.isFinite) {
        std::vector<std::string> free, unstable;
        describeMotions(free, unstable);
        if (!unstable.empty()) text << "; the place reached is unstable: " << unstable.front();
    }
    text << "; start closer to the equilibrium: a damped motion leads there";
    throw std::runtime_error(text.str());
}

State StaticEquilibrium::assemble(const State& state) const {
    State start = makeFreshState(m_system, state);
    m_system.realize(start, Stage::Velocity);
    State held = copyState(start);
    const SimbodyMatterSubsystem& matter = m_system.getMatterSubsystem();
    for (MobilizedBodyIndex index : m_held) matter.getMobilizedBody(index).lock(held);
    simflex::assemble(m_system, held, m_constraintTolerance);
    start.updQ() = held.getQ();
    m_system.realize(start, Stage::Velocity);
    return start;
}

void StaticEquilibrium::solve(const State& state) {
    run(state, Speeds::Zero);
}

bool StaticEquilibrium::solveNearby(const State& state) {
    if (state.getU().normInf() > 0) return false;
    try {
        return run(state, Speeds::Zero, Reach::Nearby);
    } catch (const Cancelled&) {
        throw;
    } catch (const std::runtime_error&) {
        return false;  // a load along a free motion, or sliding friction
    }
}

void StaticEquilibrium::solveSteadyMotion(const State& state) {
    run(state, Speeds::OfState);
}

/** A system and point from which a search starts; the point becomes its result. **/
struct StaticEquilibrium::Start {
    State placed, assembled;
    std::unique_ptr<Evaluation> equations;
    SolutionPoint point;
    SteadyMotion motion;
};

StaticEquilibrium::Start StaticEquilibrium::begin(const State& state, Speeds speeds) {
    requireTopology(m_system, state, "StaticEquilibrium::solve()");
    m_numIterations = m_numLoadSteps = 0;
    m_isByDampedMotion = false;
    m_branch = Branch::Own;
    Start start;
    copyState(state, start.placed);
    m_system.realize(start.placed, Stage::Velocity);
    if (speeds == Speeds::Zero) start.placed.updU() = 0;
    // Assembly moves bodies, but their twists are the State's.
    start.assembled = assemble(start.placed);
    m_system.realize(start.placed, Stage::Velocity);
    start.equations = std::make_unique<Evaluation>(m_system, start.assembled);
    Evaluation& equations = *start.equations;
    SolutionPoint& point = start.point;
    point.resize(equations.getTopology().numQ, equations.getTopology().numU,
                 equations.getTopology().numMultipliers, equations.getTopology().numZ);
    point.t = start.assembled.getTime();
    equations.getBlocks().getFromState(start.assembled, point.q.data(), point.u.data());
    for (size_t i = 0; i < point.z.size(); ++i) point.z[i] = start.assembled.getZ()[int(i)];
    equations.setZ(point.z.data());
    if (speeds == Speeds::OfState && !equations.getTopology().listOwnStates().empty())
        throw std::invalid_argument(
            "no steady motion is looked for in a system with states of its own; let a motion "
            "settle");
    if (speeds == Speeds::OfState) {
        std::vector<double> given = point.q;
        equations.getBlocks().getFromState(start.placed, given.data(), point.u.data());
        equations.prescribe(point.t, 0, nullptr, point.q.data(), point.u.data());
        start.motion = SteadyMotion(equations, start.placed, point.t, given, point.u, point.q);
        refuseUnsteady(equations, point.u, start.motion.getErrors());
    }
    equations.prescribe(point.t, 0, nullptr, point.q.data(), point.u.data());
    equations.updBlocks().chooseNumThreads(omp_get_max_threads());
    return start;
}

void StaticEquilibrium::keep(const Start& start, State& state, Vector& multipliers) {
    Evaluation& equations = *start.equations;
    // Multipliers of least norm, as in the integrators.
    SolutionPoint point = start.point;
    const int n = equations.getTopology().numU, m = equations.getTopology().numMultipliers;
    multipliers.resize(m);
    if (m > 0) {
        VectorXd r(n);
        equations.realize(point.t, point.q.data(), point.u.data());
        std::fill(point.lambda.begin(), point.lambda.end(), 0.0);
        equations.calcResidual(point.q.data(), point.u.data(), point.uDot.data(),
                               point.lambda.data(), r.data());
        multipliers = calcMultipliers(equations, r);
    }
    state = makeFreshState(m_system, start.placed);
    equations.getBlocks().putIntoState(point.t, point.q.data(), point.u.data(), state);
    for (size_t i = 0; i < point.z.size(); ++i) state.updZ()[int(i)] = point.z[i];
    m_system.realize(state, Stage::Velocity);
}

bool StaticEquilibrium::run(const State& state, Speeds speeds, Reach reach) {
    const StandardArithmetic standard;
    Start start = begin(state, speeds);
    Evaluation& equations = *start.equations;
    m_system.realize(start.assembled, Stage::Velocity);
    Search search(*this, equations, start.assembled, start.point, start.motion);
    if (search.runToMotion()) {
        const SolutionPoint placed = start.point;
        finish(search, start);
        if (m_unstableMotions.empty()) return true;
        // There may be a lower one.
        Search lower(*this, equations, start.assembled, placed, start.motion);
        if (lower.runLower()) finish(lower, start);
        return true;
    }
    const auto describeRanges = [&] {
        State reached;
        Vector multipliers;
        start.point = search.getPoint();
        keep(start, reached, multipliers);
        std::string text;
        if (const FlexibleBodySubsystem* flexible = FlexibleBodySubsystem::find(m_system))
            for (const auto& [element, reason] : flexible->describeElementsOutOfRange(reached))
                text += "; there " + reason;
        return text;
    };
    if (reach == Reach::Anywhere) try {
            search.run();
        } catch (const std::runtime_error& error) {
            // A quantity outside its valid range may be the cause.
            const std::string ranges = describeRanges();
            if (ranges.empty()) throw;
            throw std::runtime_error(error.what() + ranges);
        }
    else if (!equations.getTopology().listOwnStates().empty() ||
             !equations.getTopology().frictions.empty() || !search.runNearby())
        return false;
    finish(search, start);
    return true;
}

std::vector<std::string> StaticEquilibrium::listGrowing(const Start& start, const State& state,
                                                        Growth growth) {
    std::vector<std::string> growing;
    bool isStopped = false;
    const auto observer = [&] {
        try {
            if (m_observer) m_observer();
        } catch (...) {
            isStopped = true;
            throw;
        }
    };
    try {
        for (const Eigenmode& mode : calcGrowingModes(m_system, state, observer)) {
            if (growth == Growth::Steady && mode.oscillates()) continue;
            Vector shape(mode.shape.size());
            for (int i = 0; i < shape.size(); ++i) shape[i] = mode.shape[i].real();
            State scratch = copyState(state);
            const VectorXd delta = takeFromSimbody(*start.equations, scratch, shape);
            int worst = 0;
            start.equations->getBlocks().calcDisplacement(delta.data(), &worst);
            growing.push_back(
                "'" + start.equations->getBlock(worst).name + "' " +
                (mode.oscillates() ? "oscillates with a growing amplitude" : "falls away from it"));
        }
    } catch (const std::exception&) {
        if (isStopped) throw;  // otherwise there are no modes about it
    }
    return growing;
}

void StaticEquilibrium::finish(Search& search, Start& start) {
    Evaluation& equations = *start.equations;
    m_numIterations = search.numIterations;
    m_numLoadSteps = search.numLoadSteps;
    m_isByDampedMotion = search.isByDampedMotion;
    m_branch = search.branch;
    m_freeMotions.clear();
    m_unstableMotions.clear();
    search.describeMotions(m_freeMotions, m_unstableMotions);
    start.point = search.getPoint();
    if (!start.motion.isAtRest()) {
        std::vector<double> errors(size_t(equations.getTopology().numMultipliers), 0);
        equations.calcVelocityErrors(errors.data());
        refuseUnsteady(equations, start.point.u, errors);
    }
    m_firstRows.clear();
    if (const FlexibleBodySubsystem* flexible = FlexibleBodySubsystem::find(m_system))
        for (JointIndex j(0); j < flexible->getNumJoints(); ++j)
            m_firstRows.push_back(equations.getTopology().findFirstRow(j));
    keep(start, m_state, m_multipliers);
    if (!start.motion.isAtRest()) {
        // With negative stiffness, gyroscopic forces may stabilise it.
        if (search.countNegative() > 0)
            m_unstableMotions = listGrowing(start, m_state, Growth::Steady);
    } else if (!search.hasPotential()) {
        m_unstableMotions = listGrowing(start, m_state, Growth::Any);
    }
}

std::vector<StaticEquilibrium::PathPoint> StaticEquilibrium::followPath(
    const State& state, const PathSettings& settings) {
    const StandardArithmetic standard;
    if (!(settings.step > 0) || settings.mostPoints < 2)
        throw std::invalid_argument(
            "StaticEquilibrium::followPath(): it takes a positive step and two points or more");
    Start start = begin(state, Speeds::Zero);
    const Topology& topology = start.equations->getTopology();
    if (!topology.listOwnStates().empty() || !topology.frictions.empty())
        throw std::invalid_argument(
            "no path of equilibria is followed in a system with friction or states of its own; "
            "leave them out");
    if (topology.hasSimbodyForces())
        throw std::invalid_argument(
            "no path of equilibria is followed with force elements of Simbody's: springs among "
            "them would grow with the loads; use those of simflex");
    m_system.realize(start.assembled, Stage::Velocity);
    Search search(*this, *start.equations, start.assembled, start.point, start.motion);
    std::vector<PathPoint> path;
    search.follow(settings, [&](const Search::PathMark& mark) {
        start.point = search.getPoint();
        path.push_back(
            {State(), Vector(), mark.fraction, mark.numUnstable, mark.kind, mark.numChanging});
        keep(start, path.back().state, path.back().multipliers);
        if (!search.hasPotential())
            path.back().numUnstable =
                int(listGrowing(start, path.back().state, Growth::Any).size());
        return Search::Next::GoOn;
    });
    finish(search, start);
    // States copied while the vector grew are not realized.
    for (const PathPoint& point : path) m_system.realize(point.state, Stage::Velocity);
    return path;
}

std::string StaticEquilibrium::describeBranch() const {
    switch (m_branch) {
        case Branch::Own:
            return "";
        case Branch::Followed:
            return "Newton's iteration leaps to another equilibrium, where joints may be assembled "
                   "in another way or connectors reversed; this is where a strongly damped motion "
                   "from the start comes to rest";
        case Branch::Unknown:
            break;
    }
    return "joints may be assembled in another way here than at the start, or connectors reversed: "
           "whether a motion leads from there to this equilibrium has not been found out; start "
           "closer to it to be sure";
}

Vector StaticEquilibrium::getMultipliers(const Joint& joint) const {
    const int first = m_firstRows.at(size_t(joint.getIndex())), count = joint.getNumEquations();
    Vector multipliers(count, 0.0);
    for (int k = 0; k < count && first >= 0; ++k) multipliers[k] = m_multipliers[first + k];
    return multipliers;
}

State findEquilibriumNearby(const MultibodySystem& system, const State& state,
                            const std::function<void()>& observer) {
    StaticEquilibrium equilibrium(system);
    equilibrium.setObserver(observer);
    return equilibrium.solveNearby(state) ? equilibrium.getState() : state;
}

void setSteadyRotation(const MultibodySystem& system, State& state, const Vec3& omega_G,
                       const Vec3& point_G) {
    const StandardArithmetic standard;
    const SimbodyMatterSubsystem& matter = system.getMatterSubsystem();
    system.realize(state, Stage::Position);
    for (MobilizedBodyIndex i(1); i < matter.getNumBodies(); ++i) {
        const MobilizedBody& mobod = matter.getMobilizedBody(i);
        if (!MobilizedBody::Free::isInstanceOf(mobod) ||
            mobod.getParentMobilizedBody().getMobilizedBodyIndex() != GroundIndex)
            continue;
        system.realize(state, Stage::Position);
        const Vec3 p = mobod.getBodyOriginLocation(state);
        mobod.setUToFitVelocity(state, SpatialVec(omega_G, omega_G % (p - point_G)));
    }
}

}  // namespace simflex
