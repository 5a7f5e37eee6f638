#pragma once
/** @file
Force elements of simflex/forces in the equations of motion, with their derivatives and states
(private header). Springs, dampers and laws enter the Newton system as rows of their own with a
compliance; derivatives of loads, by differences, enter the dense form of a block. **/

#include <Eigen/Dense>
#include <vector>

#include "simflex/solver/equations/Blocks.h"
#include "simflex/solver/equations/FunctionsOfTime.h"
#include "simflex/solver/equations/NewtonFactors.h"

namespace simflex {

// SimTK declares a class Eigen, which makes the name ambiguous for clang after
// `using namespace SimTK`.
namespace Eigen = ::Eigen;

class LoadTerms {
public:
    using Forces = SimTK::Array_<SimTK::SpatialVec>;

    LoadTerms(const Topology& topology, Blocks& blocks, const FunctionsOfTime& functions);

    /** Sets the states of elements and equations from the next realize() on. **/
    void setStates(const double* z);
    /** Computes forces of all elements at the blocks' realized positions. **/
    void realize();
    /** Initialises states at the start of a run, at the realized positions. **/
    void startStates(double* z);
    /** Ends a step at the realized positions: synchronises counted turns with the frames. **/
    void countTurns(double* z);
    /** ż of the topology's states. **/
    void calcStateRates(double* zDot);
    /** ∂ż/∂z of the topology's states. **/
    void calcStateSlopes(Eigen::MatrixXd& F);
    /** Sets the forces of elements with columns to zero. **/
    void clearStiffForces();
    /** r −= Jᵀf. **/
    void subtractForces(double* r) const;
    /** The same at another time, including loads on whole bodies. **/
    void subtractForcesAt(const TimeValues& values, const double* q, double* r);
    void addInPower(double& power) const;

    void formColumns(const NewtonFactors& factors, NewtonSystem& system);
    /** Clears the columns, because springs and dampers do not enter acceleration systems. **/
    void clearColumns(NewtonSystem& system) const;
    /** Adds the Jacobians of loads: O(n) evaluations of the loads on a block of n speeds. **/
    void addInJacobians(const NewtonFactors& factors, const double* q, const double* u,
                        NewtonSystem& system);

    /** Forces of an element on frames at other positions, as in realize(). **/
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
    /** Scales l and r of every pair to equal length; their product is unchanged. **/
    static void balancePairs(const Topology::Element& element, Forces& directions);
    void addInJacobian(const Topology::LoadedBlock& loaded, const NewtonFactors& factors,
                       const double* q, const double* u, NewtonSystem::Block& block);
    /** Moves a block to q and u of the whole system, and writes −Q of the loads on it. **/
    void calcResidual(const Topology::LoadedBlock& loaded, const double* q, const double* u,
                      double* r);

    const Topology& m_topology;
    Blocks& m_blocks;
    const FunctionsOfTime& m_functions;
    std::vector<Workspace> m_workspaces;  ///< by element
    Forces m_trial;                       ///< of one element
    std::vector<double> m_states;
    SimTK::Array_<FrameMotion> m_stateFrames;  ///< of one equation
    /** Workspace used by the loaded blocks in turn. **/
    struct {
        std::vector<FlexibleBlock*> block;  ///< block to be moved, if it is flexible
        std::vector<double> movedQ;         ///< the block's q, moved along each speed
        std::vector<double> q, u;           ///< of the whole system; only the block's part is used
        std::vector<double> r, r0;
    } m_scratch;
};

}  // namespace simflex
