#pragma once
/** @file
The equations of small motions about a State (private header), as Linearization.h has them, in
blocks:

    M δ̈ + D δ̇ + K δ + Gᵀδλ = 0,   G δ = 0

in O(N) for N bodies at rest, or with constant twists (see SteadyMotion.h). Where the speeds of the
steady motion depend on the positions of other bodies, or Simbody evaluates forces, there is a block
for each pair of bodies. **/

#include <functional>
#include <optional>
#include <string>

#include "simflex/solver/equilibrium/BlockTangent.h"
#include "simflex/solver/equilibrium/SteadyMotion.h"

namespace simflex {

class BlockLinearization {
public:
    /** The equations at one instant of the motion. **/
    struct Instant {
        SolutionPoint point;  ///< with the accelerations of the motion: zero at rest
        SteadyMotion motion;
        Eigen::VectorXd moreUDot;  ///< accelerations of the State other than the motion's
        std::optional<BlockMass> mass;
        std::optional<BlockMatrix<double>> K;
        std::optional<BlockMatrix<double>> D;  ///< none without damping and motion
        /** ω² of individual modes: the lowest, and the largest of all coordinates. **/
        double softest = 0, stiffest = 0;
        Eigen::VectorXd scale;  ///< of speeds, for elimination: zero where they are held
    };

    /** @param observer  called before evaluations of forces **/
    BlockLinearization(const SimTK::MultibodySystem& system, const SimTK::State& state,
                       std::function<void()> observer);

    /** Why this method is not applicable; empty if it is. **/
    const std::string& getObstacle() const { return m_obstacle; }

    /** At the State. **/
    void calcNow(Instant& now);
    /** The same motion a radian later. @returns why there is none, or empty **/
    std::string calcLater(const Instant& now, Instant& later);

    /** Displacement caused by forces other than those of the motion, against springs and inertia;
    and the joint reactions to them. **/
    void calcDeparture(const Instant& instant, Eigen::VectorXd& delta,
                       Eigen::VectorXd& multipliers) const;

    Evaluation& updEquations() { return m_equations; }
    const Evaluation& getEquations() const { return m_equations; }
    const CoordinateScales& getScales() const { return m_scales; }
    const BlockGraph& getGraph() const { return *m_graph; }
    int getNumThreads() const { return m_equations.getBlocks().numThreads; }
    void observe() const {
        if (m_observer) m_observer();
    }

private:
    /** Writes u̇ and λ. **/
    void accelerate(SolutionPoint& point);
    void linearize(Instant& instant);
    void measure(Instant& instant) const;

    SimTK::State m_state;
    std::function<void()> m_observer;
    Evaluation m_equations;
    CoordinateScales m_scales;
    std::optional<BlockGraph> m_graph;
    std::string m_obstacle;
    SolutionPoint m_start;  ///< with true accelerations
    SteadyMotion m_motion;
};

}  // namespace simflex
