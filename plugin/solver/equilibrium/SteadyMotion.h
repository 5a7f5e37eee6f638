#pragma once
/** @file
Speeds of a steady motion as a field over positions (private header).

A steady motion is the flow q̇ = N(q) X(q) of a field that is a symmetry: near the position of a
State, X gives the speeds of the displaced system. Every joint keeps the relative twist S that it
has in the State, in the axes of its inboard frame F:

    V_M = V_F + R_GF S          a pin that is tilted with its hub spins about the tilted axis

propagated along the joints from Ground, those with most constraints first; a body not linked to
Ground by joints, springs or constraints keeps its own twist in Ground. Where Motions prescribe
other speeds than the State has, relative twists change as little as possible, so that bodies
attached to a driven joint follow it. Mobilizers other than Free on Ground keep their u, flexible
bodies their shape. Closed loops are satisfied, G X + ∂g/∂t = 0, by additional motions that rotate
the moving bodies as little as possible.

Often every body then keeps a constant twist in Ground wherever it is displaced, as for a shaft in
bearings fixed to Ground, however many pieces it consists of. X of a body then depends on its own
position alone, and the cost is O(number of bodies); otherwise it is O(n³) for n speeds. **/

#include <string>

#include "simflex/solver/equations/Diagnosis.h"
#include "simflex/solver/equilibrium/TangentMatrices.h"

namespace simflex {

/** Criteria for a steady motion. **/
struct Steadiness {
    /** Rotation during a radian of the slowest mode [rad] below which a system counts as at
    rest. **/
    static constexpr double SmallTurn = 5e-3;
    /** Largest change of frequencies when matrices are averaged with those a radian later,
    relative. **/
    static constexpr double SmallChange = 1e-3;
    /** Largest constraint error a radian later, relative to a body's size, and per
    displacement. **/
    static constexpr double SmallGap = 1e-3;
    /** Largest displacement by forces that do not co-rotate, such as an unbalance, relative to a
    body's size. **/
    static constexpr double LaterGap = 5e-3;
    /** Accelerations other than those of the motion, relative to all, that count as zero; number of
    fixed-point iterations between forces and stiffness. **/
    static constexpr double Settled = 1e-5;
    static constexpr int NumSettlings = 2;
};

class SteadyMotion {
public:
    /** At rest. **/
    SteadyMotion() = default;
    /** The motion with the speeds of a point, except that ξ̇ = 0, transferred by its twists to the
    positions q. `equations` must outlive the motion; all methods leave them realized at other
    points.
    @param state  instance variables
    @param given, u  position and speeds of that point
    @param q  current position **/
    SteadyMotion(Evaluation& equations, const SimTK::State& state, double t,
                 const std::vector<double>& given, const std::vector<double>& u,
                 const std::vector<double>& q);

    bool isAtRest() const { return m_rate == 0; }
    /** Largest angular velocity [rad/s]. **/
    double getRate() const { return m_rate; }

    /** Whether every body keeps its twist in Ground when displaced. **/
    bool hasConstantTwists() const { return m_hasConstantTwists; }
    /** Whether X of a body depends on its own position alone. **/
    bool isLocal() const { return isAtRest() || m_hasConstantTwists; }

    /** Velocity errors of the constraints at the given speeds [m/s, rad/s]. **/
    const std::vector<double>& getErrors() const { return m_errors; }

    /** Multiplies the speeds of the motion by `factor`. **/
    void setFactor(double factor) { m_factor = factor; }

    /** Treats the difference between a point's speeds and accelerations and those of the motion as
    constant in Simbody's axes, wherever bodies are displaced; calcSpeeds() adds it from now on. **/
    void addBesides(const std::vector<double>& q, const std::vector<double>& u,
                    const std::vector<double>& uDot);
    const Eigen::VectorXd& getAccelerationsBesides() const { return m_uDotBesides; }
    void dropAccelerationsBesides() { m_uDotBesides.setZero(); }

    /** Writes X at a position, and its rate of change along the motion. **/
    void calcSpeeds(const std::vector<double>& q, std::vector<double>& u,
                    std::vector<double>& uDot) const;

    /** Moves q along the motion for a time, ignoring loop closure. **/
    std::vector<double> flow(const std::vector<double>& q, double duration) const;

    /** Moves a point along the motion by a radian, and sets its speeds. **/
    void moveOn(SolutionPoint& point) const;

    /** Maps small displacements from q, one per column, to those from `laterQ` after `duration`,
    carried along by the motion.
    @param steps  difference step of each column **/
    Eigen::MatrixXd carry(const std::vector<double>& q, double duration,
                          const std::vector<double>& laterQ, const Eigen::MatrixXd& delta,
                          const Eigen::VectorXd& steps) const;

    /** Matrices about a position, and accelerations there other than those of the motion. **/
    struct Balance {
        Eigen::MatrixXd M, K, G;
        Eigen::VectorXd moreUDot;
    };
    /** Returns the displacement δ caused by the remaining forces against springs and inertia. **/
    Eigen::VectorXd calcDeparture(const Balance& balance) const;
    /** Describes which body the remaining forces displace while the motion turns by a radian, and
    how far; empty if by no more than `allowed`, relative to its size. **/
    std::string describeDeparture(const CoordinateScales& scales, const Eigen::VectorXd& departure,
                                  double allowed) const;

    /** Adds to each column of δ the least rotation of the moving bodies that satisfies the
    constraints at the point of construction. **/
    void close(Eigen::MatrixXd& delta) const;

private:
    /** A block free in Ground or in a frame fixed to it, with six speeds. **/
    struct Root {
        int block;
        bool isFlexible;
        int q0, p0, u0;         ///< first indices of its orientation, position and speeds
        SimTK::Transform X_GF;  ///< frame in which they are expressed
    };
    /** A root reached through a link. **/
    struct Reach {
        int root, link, inboard;  ///< inboard: the side of the link that is F
        SimTK::SpatialVec S;      ///< about F's origin, in F
    };
    using Twists = std::vector<SimTK::SpatialVec>;  ///< of roots, about Ground's origin

    void calcOwnSpeeds(const std::vector<double>& q, std::vector<double>& u,
                       std::vector<double>& uDot) const;
    void findRoots(const SimTK::State& state);
    /** Axes in which ω of a root is expressed, in Ground; position of the root. **/
    SimTK::Rotation calcAxes(const Root& root, const std::vector<double>& q) const;
    SimTK::Vec3 calcPlace(const Root& root, const std::vector<double>& q) const;
    /** @pre realized with all speeds **/
    void findReaches();
    /** Whether constraints would be violated if only prescribed speeds were nonzero. **/
    bool findDriven(const std::vector<double>& q) const;
    /** Whether the system rotates as an explicit function of time. **/
    bool isTimed(const SolutionPoint& point) const;
    /** Gives each root, in the order of reach, the twist closest to its own that is compatible with
    all its joints to earlier roots. **/
    void followJoints(const std::vector<double>& q);
    void followMotions(const std::vector<double>& q);
    void prepareClosing(const std::vector<double>& q);
    void closeLoops(const std::vector<double>& q, std::vector<double>& u) const;
    int findRoot(int block) const { return block < 0 ? -1 : m_rootOf[size_t(block)]; }
    /** Twist of a link's frame: as last realized, plus the additional motion of its root. **/
    SimTK::SpatialVec calcTwist(const Link& link, int side, const Twists& twists) const;
    Twists calcTwists(const std::vector<double>& q, const std::vector<double>& u) const;
    void putTwists(const Twists& twists, const std::vector<double>& q,
                   std::vector<double>& u) const;
    /** Writes X; returns its twists. **/
    Twists calcX(const std::vector<double>& q, std::vector<double>& u) const;
    /** Whether X satisfies the constraints without corrections, to first order. **/
    bool keepsConstraints(const std::vector<double>& q) const;
    /** Adopts the twists of m_u for the motion. **/
    void takeTwists(const std::vector<double>& q);
    /** Whether constant twists satisfy the constraints and equal X at positions displaced along
    them. **/
    bool canKeepTwists(const std::vector<double>& q) const;

    Evaluation* m_equations = nullptr;
    double m_t = 0, m_factor = 1, m_rate = 0;
    std::vector<double> m_u;  ///< of all but roots
    std::vector<double> m_qBesides;
    Eigen::VectorXd m_uBesides, m_uDotBesides;
    std::vector<double> m_errors;
    std::vector<Root> m_roots;
    std::vector<int> m_rootOf;  ///< by block; −1: none
    Twists m_twists;            ///< at the point of construction
    bool m_hasConstantTwists = false;
    std::vector<Link> m_links;
    std::vector<Reach> m_reaches;
    Eigen::MatrixXd m_G, m_closing;  ///< G there, and the map from its errors to corrections
};

}  // namespace simflex
