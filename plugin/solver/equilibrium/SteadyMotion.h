#pragma once
/** @file
Speeds of a steady motion as a field over positions (private header).

A steady motion is the flow q̇ = N(q) X(q) of a field that is a symmetry: near the position of a
State, X says how the system would turn if it were displaced. Here every joint keeps the relative
twist S that it has in the State, in the axes of its inboard frame F:

    V_M = V_F + R_GF S          a pin that is tilted with its hub spins about the tilted axis

from body to body along the joints, those that hold most first, beginning at Ground; a body that no
joint, spring or constraint links to Ground keeps its own twist, in Ground. Where motions drive the
system otherwise than the State says, relative twists change as little as they ask for: what hangs
on a driven joint goes along. Mobilizers other than
Free on Ground keep their u, flexible bodies their shape. What loops ask for besides is added by
turning the moving bodies as little as possible, so that G X + ∂g/∂t = 0.

Often that comes to the same twist of every body, in Ground, wherever it is displaced to: of a shaft
in bearings that stand on Ground, however many pieces it is made of. Then X of a body depends on its
own place alone, and all this takes time in proportion to the number of bodies; else it is O(n³) for
n speeds. **/

#include <string>

#include "simflex/solver/equations/Diagnosis.h"
#include "simflex/solver/equilibrium/TangentMatrices.h"

namespace simflex {

/** When a motion counts as steady. **/
struct Steadiness {
    /** What turns by less in a radian of the slowest mode is as good as at rest. **/
    static constexpr double SmallTurn = 5e-3;
    /** How much frequencies may change, of themselves, with the mean of matrices a radian apart.
     * **/
    static constexpr double SmallChange = 1e-3;
    /** How far constraints may come apart meanwhile, of a body's size, and per displacement. **/
    static constexpr double SmallGap = 1e-3;
    /** How far forces that do not turn along may lead, of a body's size: an unbalance does. **/
    static constexpr double LaterGap = 5e-3;
    /** Accelerations besides those of the motion, of all, that count as none; how often forces and
    stiffness are settled by each other. **/
    static constexpr double Settled = 1e-5;
    static constexpr int NumSettlings = 2;
};

class SteadyMotion {
public:
    /** At rest. **/
    SteadyMotion() = default;
    /** With the speeds of a point, but for ξ̇, which are zero: with its twists, if bodies stand
    elsewhere now. The equations must stay; they are left realized elsewhere, as by the other
    methods.
    @param state  instance variables
    @param given, u  where the speeds are those
    @param q  where bodies stand **/
    SteadyMotion(Evaluation& equations, const SimTK::State& state, double t,
                 const std::vector<double>& given, const std::vector<double>& u,
                 const std::vector<double>& q);

    bool isAtRest() const { return m_rate == 0; }
    /** How fast it turns: the largest angular velocity [rad/s]. **/
    double getRate() const { return m_rate; }

    /** Whether every body keeps its twist, in Ground, where it is displaced. **/
    bool hasConstantTwists() const { return m_hasConstantTwists; }
    /** Whether X of a body depends on its own place alone. **/
    bool isLocal() const { return isAtRest() || m_hasConstantTwists; }

    /** By how much each constraint would move apart at the speeds given [m/s, rad/s]. **/
    const std::vector<double>& getErrors() const { return m_errors; }

    /** A motion whose speeds are `factor` times these. **/
    void setFactor(double factor) { m_factor = factor; }

    /** What a point has besides X and its rate stays as it is, in Simbody's axes, wherever bodies
    are displaced: calcSpeeds() adds it from here on. **/
    void addBesides(const std::vector<double>& q, const std::vector<double>& u,
                    const std::vector<double>& uDot);
    const Eigen::VectorXd& getAccelerationsBesides() const { return m_uDotBesides; }
    void dropAccelerationsBesides() { m_uDotBesides.setZero(); }

    /** Writes X at a position, and its rate of change along the motion. **/
    void calcSpeeds(const std::vector<double>& q, std::vector<double>& u,
                    std::vector<double>& uDot) const;

    /** Where the motion leads from q in a time, but for what loops ask for. **/
    std::vector<double> flow(const std::vector<double>& q, double duration) const;

    /** Where a point is a radian later, with the speeds of the motion. **/
    void moveOn(SolutionPoint& point) const;

    /** What small displacements from q, a column each, become when the motion carries them along,
    for a duration that leads to `laterQ`.
    @param steps  of columns, for differences **/
    Eigen::MatrixXd carry(const std::vector<double>& q, double duration,
                          const std::vector<double>& laterQ, const Eigen::MatrixXd& delta,
                          const Eigen::VectorXd& steps) const;

    /** Equations about a position and what accelerates bodies there besides the motion. **/
    struct Balance {
        Eigen::MatrixXd M, K, G;
        Eigen::VectorXd moreUDot;
    };
    /** The δ to which the forces besides lead, held by springs and inertia. **/
    Eigen::VectorXd calcDeparture(const Balance& balance) const;
    /** Says which body the forces besides lead away while the motion turns by a radian, and how
    far; empty if none by more than what is allowed, of its size. **/
    std::string describeDeparture(const CoordinateScales& scales, const Eigen::VectorXd& departure,
                                  double allowed) const;

    /** Adds to δ, column by column, what lets the constraints hold where the motion was made: a
    motion of the moving bodies that turns them as little as possible. **/
    void close(Eigen::MatrixXd& delta) const;

private:
    /** A block that stands free in Ground or another frame fixed there, and its six speeds. **/
    struct Root {
        int block;
        bool isFlexible;
        int q0, p0, u0;         ///< where its turning, its place and its speeds stand
        SimTK::Transform X_GF;  ///< in which these are
    };
    /** A root that is reached through a link. **/
    struct Reach {
        int root, link, inboard;  ///< inboard: the link's side that is F
        SimTK::SpatialVec S;      ///< about F's origin, in F
    };
    using Twists = std::vector<SimTK::SpatialVec>;  ///< of roots, about Ground's origin

    void calcOwnSpeeds(const std::vector<double>& q, std::vector<double>& u,
                       std::vector<double>& uDot) const;
    void findRoots(const SimTK::State& state);
    /** In which ω of a root is given, in Ground; and where it is. **/
    SimTK::Rotation calcAxes(const Root& root, const std::vector<double>& q) const;
    SimTK::Vec3 calcPlace(const Root& root, const std::vector<double>& q) const;
    /** @pre realized with all speeds **/
    void findReaches();
    /** Whether constraints would move apart if nothing moved but what is prescribed. **/
    bool findDriven(const std::vector<double>& q) const;
    /** Whether time itself turns the system. **/
    bool isTimed(const SolutionPoint& point) const;
    /** Gives each root, in the order in which they are reached, the twist next to its own that all
    joints with those before it allow. **/
    void followJoints(const std::vector<double>& q);
    void followMotions(const std::vector<double>& q);
    void prepareClosing(const std::vector<double>& q);
    void closeLoops(const std::vector<double>& q, std::vector<double>& u) const;
    int findRoot(int block) const { return block < 0 ? -1 : m_rootOf[size_t(block)]; }
    /** Of a link's frame: as last realized, and as its root moves besides. **/
    SimTK::SpatialVec calcTwist(const Link& link, int side, const Twists& twists) const;
    Twists calcTwists(const std::vector<double>& q, const std::vector<double>& u) const;
    void putTwists(const Twists& twists, const std::vector<double>& q,
                   std::vector<double>& u) const;
    /** Writes X; returns its twists. **/
    Twists calcX(const std::vector<double>& q, std::vector<double>& u) const;
    /** Whether X keeps the constraints by itself, to first order. **/
    bool keepsConstraints(const std::vector<double>& q) const;
    /** Takes the twists as they are in m_u as those of the motion. **/
    void takeTwists(const std::vector<double>& q);
    /** Whether these, constant, keep the constraints, and are what X gives wherever bodies are
    displaced along them. **/
    bool canKeepTwists(const std::vector<double>& q) const;

    Evaluation* m_equations = nullptr;
    double m_t = 0, m_factor = 1, m_rate = 0;
    std::vector<double> m_u;  ///< of everything but roots
    std::vector<double> m_qBesides;
    Eigen::VectorXd m_uBesides, m_uDotBesides;
    std::vector<double> m_errors;
    std::vector<Root> m_roots;
    std::vector<int> m_rootOf;  ///< by block; −1: none
    Twists m_twists;            ///< where the motion was made
    bool m_hasConstantTwists = false;
    std::vector<Link> m_links;
    std::vector<Reach> m_reaches;
    Eigen::MatrixXd m_G, m_closing;  ///< G as there, and what undoes its errors
};

}  // namespace simflex
