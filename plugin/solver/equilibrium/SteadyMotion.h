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
turning the moving bodies as little as possible, so that G X + ∂g/∂t = 0. **/

#include <string>

#include "simflex/solver/equations/Diagnosis.h"
#include "simflex/solver/equilibrium/TangentMatrices.h"

namespace simflex {

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

    /** By how much each constraint would move apart at the speeds given [m/s, rad/s]. **/
    const std::vector<double>& getErrors() const { return m_errors; }

    /** A motion whose speeds are `factor` times these. **/
    void setFactor(double factor) { m_factor = factor; }

    /** Writes X at a position, and its rate of change along the motion. **/
    void calcSpeeds(const std::vector<double>& q, std::vector<double>& u,
                    std::vector<double>& uDot) const;

    /** Where the motion leads from q in a time, but for what loops ask for. **/
    std::vector<double> flow(const std::vector<double>& q, double duration) const;

    /** Equations about a position and what accelerates bodies there besides the motion. **/
    struct Balance {
        Eigen::MatrixXd M, K, G;
        Eigen::VectorXd moreUDot;
    };
    /** The δ to which the forces besides lead, held by springs and inertia. **/
    Eigen::VectorXd calcDeparture(const Balance& balance) const;
    /** Says which body the forces besides lead away while the motion turns by a radian, and how
    far; empty if none by more than what is allowed, of its size. **/
    std::string findDeparture(const CoordinateScales& scales, const Balance& balance,
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

    void findRoots(const SimTK::State& state);
    /** In which ω of a root is given, in Ground; and where it is. **/
    SimTK::Rotation calcAxes(const Root& root, const std::vector<double>& q) const;
    SimTK::Vec3 calcPlace(const Root& root, const std::vector<double>& q) const;
    void findReaches();
    /** Whether constraints would move apart if nothing moved but what is prescribed. **/
    bool findDriven(const std::vector<double>& q) const;
    void followMotions(const std::vector<double>& q);
    void prepareClosing(const std::vector<double>& q);
    void closeLoops(const std::vector<double>& q, std::vector<double>& u) const;
    int findRoot(int block) const;
    /** Of a link's frame: as last realized, and as its root moves besides. **/
    SimTK::SpatialVec calcTwist(const Link& link, int side, const Twists& twists) const;
    Twists calcTwists(const std::vector<double>& q, const std::vector<double>& u) const;
    void putTwists(const Twists& twists, const std::vector<double>& q,
                   std::vector<double>& u) const;
    /** Writes X; returns its twists. **/
    Twists calcX(const std::vector<double>& q, std::vector<double>& u) const;
    /** Whether X keeps the constraints by itself, to first order. **/
    bool keepsConstraints(const std::vector<double>& q) const;

    Evaluation* m_equations = nullptr;
    double m_t = 0, m_factor = 1, m_rate = 0;
    std::vector<double> m_u;  ///< of everything but roots
    std::vector<double> m_errors;
    std::vector<Root> m_roots;
    Twists m_twists;  ///< where the motion was made
    std::vector<Link> m_links;
    std::vector<Reach> m_reaches;
    Eigen::MatrixXd m_G, m_closing;  ///< G as there, and what undoes its errors
};

}  // namespace simflex
