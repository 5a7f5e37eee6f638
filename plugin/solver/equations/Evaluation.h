#pragma once
/** @file
The equations of motion of a whole system, block by block, at one (t, q, u) (private header):

    r = M(q) u̇ + b(q, u) − f(q, u, t) + G(q)ᵀλ,    g(q, t),    ġ = G u + ∂g/∂t

Points that are not finite or absurdly large are never evaluated: methods that receive coordinates,
speeds or z throw UnusablePoint before Simbody or any force sees them.

Calls must follow in order: realize() (positions and velocities) → calcResidual() →
formNewtonSystem(); calls out of order are refused. The terms:

    inertia, gyroscopic and centrifugal, elasticity, damping    FlexibleBlock, RigidTree
    joints                                                      JointTerms
    friction of joints                                          FrictionTerms
    loads, springs, dampers                                     LoadTerms
    Simbody's forces, constraints, Motions, z                   SimbodyBridge

Flexible bodies, joints, gravity, the elements of simflex/forces and simple rigid mobilizers are
evaluated here; Simbody evaluates rigid trees with other mobilizers and foreign forces only.

    Evaluation equations(system, state);
    equations.realize(t, q, u);
    equations.calcResidual(q, u, uDot, lambda, r);

Half of its more than 25 methods give access to its parts. **/

#include <atomic>
#include <functional>
#include <memory>
#include <vector>

#include "simflex/solver/equations/ErrorNorm.h"
#include "simflex/solver/equations/FrictionTerms.h"
#include "simflex/solver/equations/JointTerms.h"
#include "simflex/solver/equations/LoadTerms.h"
#include "simflex/solver/equations/SimbodyBridge.h"
#include "simflex/solver/equations/TimedLoads.h"
#include "simflex/solver/equations/Topology.h"
#include "simflex/solver/equations/TopologyBuilder.h"
#include "simflex/solver/equations/TreeDerivatives.h"

namespace simflex {

class Evaluation {
public:
    using Setting = Topology::Setting;

    /** See TopologyBuilder. **/
    Evaluation(const SimTK::MultibodySystem& system, const SimTK::State& state,
               Setting setting = Setting::Implicit,
               const std::vector<ForceSelection>& differentiated = {});

    const Topology& getTopology() const { return *m_topology; }
    const Block& getBlock(int b) const { return *m_blocks->all[size_t(b)]; }
    const Blocks& getBlocks() const { return *m_blocks; }
    Blocks& updBlocks() { return *m_blocks; }
    FunctionsOfTime& updFunctions() { return *m_functions; }
    const SimbodyBridge& getSimbody() const { return *m_simbody; }
    SimbodyBridge& updSimbody() { return *m_simbody; }
    const JointTerms& getJoints() const { return m_joints; }
    JointTerms& updJoints() { return m_joints; }
    const FrictionTerms& getFrictions() const { return m_frictions; }
    FrictionTerms& updFrictions() { return m_frictions; }
    const LoadTerms& getLoads() const { return m_loads; }
    LoadTerms& updLoads() { return m_loads; }
    TreeDerivatives& updTrees() { return m_trees; }
    ErrorNorm& updErrorNorm() { return *m_errorNorm; }
    const TimedLoads& getTimedLoads() const { return m_timedLoads; }

    /** Writes the q and u prescribed by locks and Motions at this time; realize() must follow. With
    `uHist`, prescribed accelerations give u = u_hist + γu̇. **/
    void prescribe(double time, double gamma, const double* uHist, double* q, double* u);

    /** Sets all z, for force elements from the next realize() on. **/
    void setZ(const double* z);

    /** Positions, velocities, joint frames; first call of every evaluation. **/
    void realize(double time, const double* q, const double* u);
    /** The same for Setting::Native: reads locks and Motions, rigid trees and Simbody's constraints
    from `state`, which must live on while its matter subsystem is realized to Stage::Dynamics.
    @param bodyForces, mobilityForces  of all force elements except the flexible subsystem's **/
    void realizeNatively(const SimTK::State& state,
                         const SimTK::Vector_<SimTK::SpatialVec>& bodyForces,
                         const SimTK::Vector& mobilityForces, const double* q, const double* u);

    /** @name After realize() **/
    /**@{**/
    /** Writes prescribed u̇, and zero where it is free. **/
    void calcPrescribedUDot(const double* q, double* uDot) const;
    /** Zero in rows that are not holonomic. **/
    void calcPositionErrors(double* g) const;
    /** Zero in rows of acceleration-only constraints. **/
    void calcVelocityErrors(double* gDot) const;
    /** Constraint residual of a step: velocity errors, or position errors divided by the stiffness
    factor. Rows of constraints on lower levels have their own errors, as do friction rates. **/
    void calcStepErrors(MotionLevel level, const NewtonFactors& factors, const double* uDot,
                        const double* q, double* c) const;
    /** g̈ for the given accelerations. **/
    void calcAccelerationErrors(const double* q, const double* u, const double* uDot,
                                double* gDotDot);
    /** Writes M·jump + Gᵀ·impulses, the residual of the momentum balance for a jump of speeds with
    these joint impulses; rows of prescribed speeds contain their impulses. Computed from residuals
    of the equations of motion, to verify M and G independently.
    @returns its round-off **/
    double calcMomentum(const double* q, const double* u, const double* jump,
                        const double* impulses, double* momentum);
    /** True if this speed is prescribed. **/
    bool isSpeedKnown(size_t u) const {
        return m_simbody->getPrescribed() &&
               m_simbody->getPrescribed()->isKnown(MotionLevel::Velocity, u);
    }
    /** Zero in rows of prescribed speeds. **/
    void calcResidual(const double* q, const double* u, const double* uDot, const double* lambda,
                      double* r);
    /** True if blocks can be evaluated as soon as their positions are known: without Simbody,
    prescribed speeds and friction. **/
    bool canEvaluateByBlocks() const;
    /** Work on one block, called from several threads. **/
    using BlockVisit = std::function<void(int b)>;
    /** realize(), calcResidual() and calcStepErrors() in one pass over the blocks.
    @param place   writes the q, u and u̇ of a block
    @param finish  called when a block's part of r is complete
    @pre canEvaluateByBlocks() **/
    void evaluate(double time, MotionLevel level, const NewtonFactors& factors,
                  const BlockVisit& place, const BlockVisit& finish, const double* q,
                  const double* u, const double* uDot, const double* lambda, double* r, double* c);
    /** realize() and calcPositionErrors() in one pass over the blocks.
    @pre canEvaluateByBlocks() **/
    void realizePositions(double time, const BlockVisit& place, const double* q, const double* u,
                          double* g);
    /** Power of applied loads, damping, working constraints and prescribed motions [W]. **/
    double calcPower(const double* q, const double* u, const double* uDot, const double* lambda);
    /** False if calcPower() is always zero. **/
    bool canHavePower() const;
    /** The residual without multipliers and without the terms that trees can differentiate. **/
    void calcUnknownForces(const double* q, const double* u, const double* uDot, double* r);
    /** See TimedLoads. **/
    void calcTimedLoads(double time, const NewtonFactors& factors, const double* q, const double* u,
                        const double* uDot, double* r, double* g);
    void calcTimedMotions(double time, double* q, double* u);
    void calcZDot(const double* q, const double* u, const double* uDot, const double* z,
                  double* zDot);
    /**@}**/

    /** Forms J and G. Inertia is that of the last calcResidual(), at this point, or near it in a
    projection, where it defines the norm.
    @param dense  includes all terms that depend on a block's own q and u: gyroscopic and
    centrifugal terms, and the derivatives of loads on it (AttachmentForces and DistributedLoads, by
    differences)
    @param level  Position: only rows of holonomic constraints and coordinates with prescribed q;
    Velocity: all but prescribed accelerations. **/
    void formNewtonSystem(const NewtonFactors& factors, bool dense, const double* q,
                          const double* u, const double* uDot, NewtonSystem& system,
                          MotionLevel level = MotionLevel::Acceleration);

    /** @name After calcResidual() **/
    /**@{**/
    /** Forms J = M.
    @param level  as in formNewtonSystem(); friction is left out below Acceleration **/
    void formMassSystem(NewtonSystem& system, MotionLevel level = MotionLevel::Acceleration);
    /** Adds −ΔM u̇, the part of flexible bodies' inertia missing from Simbody's mass matrix. **/
    void addInCouplingForces(const double* uDot, SimTK::Vector_<SimTK::SpatialVec>& bodyForces,
                             SimTK::Vector& mobilityForces);
    /**@}**/

    /** See SimbodyBridge. **/
    void takeVariables(const std::vector<SimTK::DiscreteVarKey>& keys, const SimTK::State& from);
    /** Saves or restores what the next evaluation depends on. **/
    void visit(Checkpoint& checkpoint);

private:
    enum class Stage { Nothing, Velocities, Residual };

    /** @throws UnusablePoint **/
    void requireUsable(const double* q, const double* u) const;
    [[noreturn]] void refusePoint(int block) const;

    /** Batches processed by one thread in sequence, with the joints between their blocks and the
    blocks that have no other joints. **/
    struct Group {
        int firstBatch, endBatch;
        std::vector<int> joints, blocks;
    };

    explicit Evaluation(TopologyBuilder::Result parts);
    void makeGroups();
    /** @throws std::logic_error if the evaluation has not reached this stage. **/
    void require(Stage stage, const char* method) const;
    void realizeBlocks(const double* q, const double* u);
    void clearFrictionRows(double* rows) const;
    void realizeBatch(int batch, const double* q, const double* u);
    /** Places the blocks of a batch; `unusable` receives a block at an unusable point. **/
    void placeBatch(int batch, const BlockVisit& place, const double* q, const double* u,
                    std::atomic<int>& unusable) const;
    /** Excludes joints, Simbody and force elements. **/
    void calcBatchResidual(int batch, const double* q, const double* u, const double* uDot,
                           double* r);
    /** One pass over the blocks, in which each thread completes a group while it is in cache;
    joints between groups follow.
    @param onBatch, onJoint, onBlock  called with an index; a joint after all its batches, a block
        after all its joints **/
    template <class OnBatch, class OnJoint, class OnBlock>
    void visitGroups(const OnBatch& onBatch, const OnJoint& onJoint, const OnBlock& onBlock) const;
    /** Sets the time of all functions of time, and invalidates positions. **/
    void moveTo(double time);
    void calcUnclearedResidual(const double* q, const double* u, const double* uDot,
                               const double* lambda, double* r);
    void clearPrescribed(double* r) const;

    std::shared_ptr<const Topology> m_topology;
    std::unique_ptr<Blocks> m_blocks;
    std::unique_ptr<FunctionsOfTime> m_functions;
    std::unique_ptr<SimbodyBridge> m_simbody;
    JointTerms m_joints;
    FrictionTerms m_frictions;
    LoadTerms m_loads;
    TreeDerivatives m_trees;
    TimedLoads m_timedLoads;
    std::unique_ptr<ErrorNorm> m_errorNorm;
    Stage m_stage = Stage::Nothing;
    bool m_hasInertia = false;  ///< of some point
    std::vector<double> m_scratch;
    std::vector<Group> m_groups;
    std::vector<int> m_jointsBetween, m_blocksBetween;  ///< in no group
};

}  // namespace simflex
