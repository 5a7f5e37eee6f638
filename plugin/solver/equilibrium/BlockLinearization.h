#pragma once
/** @file
The equations of small motions about a State (private header), as Linearization.h has them, in
blocks:

    M δ̈ + D δ̇ + K δ + Gᵀδλ = 0,   G δ = 0

in O(N) for N bodies at rest, or with twists that are constant (see SteadyMotion.h). Where the
speeds of the steady motion depend on where other bodies are, or Simbody has a say, there is a block
for each pair of bodies. **/

#include <functional>
#include <optional>
#include <string>

#include "simflex/solver/equilibrium/BlockTangent.h"
#include "simflex/solver/equilibrium/SteadyMotion.h"

namespace simflex {

class BlockLinearization {
public:
    /** The equations at one moment of the motion. **/
    struct Instant {
        SolutionPoint point;  ///< with the accelerations of the motion: zero at rest
        SteadyMotion motion;
        Eigen::VectorXd moreUDot;  ///< what the State accelerates besides
        std::optional<BlockMass> mass;
        std::optional<BlockMatrix<double>> K;
        std::optional<BlockMatrix<double>> D;  ///< none if nothing damps, and nothing moves
        /** ω² of modes by themselves: the lowest, and the largest of all coordinates. **/
        double softest = 0, stiffest = 0;
        Eigen::VectorXd scale;  ///< of speeds, for elimination: zero where they are held
    };

    /** @param observer  called before evaluations of forces **/
    BlockLinearization(const SimTK::MultibodySystem& system, const SimTK::State& state,
                       std::function<void()> observer);

    /** Why it does not do; empty if it does. **/
    const std::string& getObstacle() const { return m_obstacle; }

    /** At the State. **/
    void calcNow(Instant& now);
    /** The same motion a radian later. @returns why there is none; empty if there is **/
    std::string calcLater(const Instant& now, Instant& later);

    /** Where the forces lead that accelerate bodies besides the motion, held by springs and
    inertia; and what joints bear of them. **/
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
