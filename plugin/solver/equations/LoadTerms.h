#pragma once
/** @file
Force elements of simflex/forces in the equations of motion, and what the motion of a block changes
in the loads on it (private header), and the equations of its states. Springs, dampers and laws
enter the Newton system as rows of their own with a compliance; loads, by differences, the dense
form of a block. **/

#include <Eigen/Dense>
#include <vector>

#include "simflex/solver/equations/Blocks.h"
#include "simflex/solver/equations/FunctionsOfTime.h"
#include "simflex/solver/equations/NewtonFactors.h"

namespace simflex {

// SimTK has a class Eigen: where `using namespace SimTK` reaches, clang would not know which is
// meant.
namespace Eigen = ::Eigen;

class LoadTerms {
public:
    using Forces = SimTK::Array_<SimTK::SpatialVec>;

    LoadTerms(const Topology& topology, Blocks& blocks, const FunctionsOfTime& functions);

    /** Elements and equations see these values of their states from the next realize() on. **/
    void setStates(const double* z);
    /** Forces of all elements where the blocks are. **/
    void realize();
    /** Where a run begins, where the blocks are. **/
    void startStates(double* z);
    /** Where a step ends, where the blocks are: turns that were counted agree with the frames. **/
    void countTurns(double* z);
    /** ż of the topology's states. **/
    void calcStateRates(double* zDot);
    /** ∂ż/∂z of those. **/
    void calcStateSlopes(Eigen::MatrixXd& F);
    /** From now on those that have columns are zero. **/
    void clearStiffForces();
    /** r −= Jᵀf. **/
    void subtractForces(double* r) const;
    /** The same at another time, with the loads on whole bodies. **/
    void subtractForcesAt(const TimeValues& values, const double* q, double* r);
    void addInPower(double& power) const;

    void formColumns(const NewtonFactors& factors, NewtonSystem& system);
    /** Springs and dampers have no part in accelerations. **/
    void clearColumns(NewtonSystem& system) const;
    /** Adds the Jacobians of loads: O(n) evaluations of the loads on a block of n speeds. **/
    void addInJacobians(const NewtonFactors& factors, const double* q, const double* u,
                        NewtonSystem& system);

    /** Forces of an element on frames that stand elsewhere, as realize() has them. **/
    void calcForcesAt(int element, const SimTK::Array_<FrameMotion>& motions, Forces& forces) const;
    const Forces& getForces(int element) const { return m_workspaces[size_t(element)].forces; }

private:
    struct Workspace {
        SimTK::Array_<FrameMotion> motions;
        Forces forces;
        SimTK::Array_<SimTK::Real> signs;
        Forces directions;
    };
    const SimTK::Array_<FrameMotion>& findFrames(const Topology::StateEquationRef& state);
    ElementInputs inputsAt(double time) const { return {time, m_states.data()}; }
    ElementInputs inputsNow() const { return inputsAt(m_functions.get().time); }
    void calcForces(int element, const TimeValues& values,
                    const SimTK::Array_<FrameMotion>& motions, Forces& forces) const;
    /** Makes l and r of every pair of one length; their product stays. **/
    static void balancePairs(const Topology::Element& element, Forces& directions);
    void addInJacobian(const Topology::LoadedBlock& loaded, const NewtonFactors& factors,
                       const double* q, const double* u, NewtonSystem::Block& block);
    /** Moves a block to q and u of the whole system and writes −Q of the loads on it. **/
    void calcResidual(const Topology::LoadedBlock& loaded, const double* q, const double* u,
                      double* r);

    const Topology& m_topology;
    Blocks& m_blocks;
    const FunctionsOfTime& m_functions;
    std::vector<Workspace> m_workspaces;  ///< by element
    Forces m_trial;                       ///< of one element
    std::vector<double> m_states;
    SimTK::Array_<FrameMotion> m_stateFrames;  ///< of one equation
    /** What loaded blocks share, one after the other. **/
    struct {
        std::vector<FlexibleBlock*> block;  ///< to be moved, if it is flexible
        std::vector<double> movedQ;         ///< the block's q, moved along each speed
        std::vector<double> q, u;           ///< of the whole system; the block's part counts
        std::vector<double> r, r0;
    } m_scratch;
};

}  // namespace simflex
