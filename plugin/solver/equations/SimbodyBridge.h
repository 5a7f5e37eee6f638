#pragma once
/** @file
Evaluates on private States what only Simbody can compute for the equations of motion (private
header): foreign forces, Simbody's constraints, Motions, auxiliary variables z, and poses and N(q)
of mobilizers unknown to simflex. Gravity and linear forces on mobilities are not foreign forces:
their parameters are read once, and again when variables change, and the blocks apply them. Within
Simbody's own realization (Topology::Setting::Native) all foreign forces, gravity included, are
given, and Simbody is evaluated on the State being realized. **/

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "simflex/solver/equations/Blocks.h"
#include "simflex/solver/equations/ForceDifferences.h"
#include "simflex/solver/equations/NewtonFactors.h"
#include "simflex/solver/equations/PrescribedMotion.h"
#include "simflex/solver/equations/SimbodyConstraints.h"

namespace simflex {

class Checkpoint;

class SimbodyBridge {
public:
    SimbodyBridge(const Topology& topology, Blocks& blocks, const SimTK::State& state);

    /** Null if there are none. **/
    const SimbodyConstraints* getConstraints() const { return m_constraints.get(); }
    const PrescribedMotion* getPrescribed() const { return m_prescribed.get(); }
    /** The State on which Simbody was last evaluated. **/
    const SimTK::State& getState() const { return *m_now; }

    /** Scales gravity, loads and Simbody's force elements from the next realize() on; springs
    between attachment frames act in full. Default 1. **/
    void setLoadFraction(double fraction);

    /** Writes the q and u prescribed by locks and Motions at this time. With `uHist`, prescribed
    accelerations give u = u_hist + γu̇. **/
    void prescribe(double time, double gamma, const double* uHist, double* q, double* u);

    /** True for a Simbody force element that the blocks apply, and that is disabled in
    getState(). **/
    bool isMobilityForce(const SimTK::Force& force) const;

    /** Zeroes the errors of prescribed q and u. **/
    void clearPrescribedErrors(double* errorQ, double* errorU) const;

    /** Brings the private State to this point, as far as Simbody is needed. **/
    void realize(double time, const double* q, const double* u);
    /** Evaluates Simbody on `state` from now on. **/
    void realizeNatively(const SimTK::State& state,
                         const SimTK::Vector_<SimTK::SpatialVec>& bodyForces,
                         const SimTK::Vector& mobilityForces);

    /** @name After realize() **/
    /**@{**/
    /** Sums foreign forces and −Gᵀλ of Simbody's constraints, for subtractForces(). **/
    void collectForces(const double* lambda);
    void subtractForces(Block& block, double* r) const;
    /** Writes the columns of Simbody's constraints, and the identity for prescribed speeds. **/
    void formColumns(MotionLevel level, NewtonSystem& system) const;
    /** Terms of differenced forces, as columns or as matrices within one block. **/
    void formDifferencedColumns(const NewtonFactors& factors, NewtonSystem& system);
    void clearDifferencedColumns(NewtonSystem& system) const;
    void addInDifferencedMatrices(const NewtonFactors& factors, NewtonSystem& system);
    /**@}**/

    /** Copies these variables, for force elements from the next realize() on. **/
    void takeVariables(const std::vector<SimTK::DiscreteVarKey>& keys, const SimTK::State& from);

    /** @name Auxiliary variables z **/
    /**@{**/
    /** Sets z for Simbody's elements from the next realize() on. **/
    void setZ(const double* z);
    /** Computes ż of Simbody's elements and Measures, if there are any; those that depend on
    accelerations use the given u̇. **/
    void calcZDot(double time, const double* q, const double* u, const double* uDot,
                  const double* z, double* zDot);
    /**@}**/

    /** Saves or restores what the next evaluation depends on: values of Motions, and the point at
    which N(q) was evaluated. **/
    void visit(Checkpoint& checkpoint);

    /** Returns and resets the wall time spent in Simbody since the last call [s]. **/
    double takeSeconds() { return std::exchange(m_seconds, 0); }

private:
    friend class TopologyBuilder;  // constructs it
    friend class TimedLoads;       // copies its private State

    void updateGravity(const SimTK::State& state);
    void updateMobilityForces(const SimTK::State& state);
    void updateKnownForces(const SimTK::State& state) {
        updateGravity(state);
        updateMobilityForces(state);
    }
    /** Writes a point into m_private; unchanged values are skipped, so that Simbody re-evaluates
    only what depends on the changes. **/
    void place(double time, const double* q, const double* u);
    bool isPlaced(double time, const double* q, const double* u) const {
        return m_placedTime == time && std::equal(m_placedQ.begin(), m_placedQ.end(), q) &&
               std::equal(m_placedU.begin(), m_placedU.end(), u);
    }
    /** Evaluates forces that change only with their variables (Topology::areForcesHeld). **/
    void updateHeldForces();
    /** Evaluates Motions at this time, unless already known. **/
    void updatePrescribed(double time, const double* q, const double* u);

    const SimTK::MultibodySystem& m_system;
    const Topology& m_topology;
    Blocks& m_blocks;
    SimTK::State m_private;                  ///< empty if Simbody is never needed
    const SimTK::State* m_now = &m_private;  ///< State on which Simbody is evaluated
    SimTK::State m_zState;                   ///< for evaluating ż; empty if m_private serves
    double m_placedTime = SimTK::NaN;        ///< point of m_private
    std::vector<double> m_placedQ, m_placedU;
    GravityField m_gravity, m_fullGravity;
    std::vector<const SimTK::Force::Gravity*> m_gravityForces;  ///< enabled ones
    std::vector<const SimTK::Force::UniformGravity*> m_uniformGravities;
    /** A linear force on one mobility, or on all (−1). **/
    struct MobilityForce {
        const SimTK::Force* force;
        int u;
        SimTK::Real damping;  ///< of a GlobalDamper
    };
    std::vector<MobilityForce> m_mobilityForceElements;  ///< enabled ones
    MobilityForces m_mobilities, m_fullMobilities;
    std::unique_ptr<SimbodyConstraints> m_constraints;
    std::unique_ptr<PrescribedMotion> m_prescribed;
    double m_prescribedTime = SimTK::NaN;            ///< time of the last evaluation of Motions
    std::vector<ForceDifferences> m_differences;     ///< of Topology::differenced
    SimTK::Vector_<SimTK::SpatialVec> m_bodyForces;  ///< of Simbody's elements and constraints
    SimTK::Vector m_mobilityForces;
    SimTK::Vector_<SimTK::SpatialVec> m_heldBodyForces;  ///< see Topology::areForcesHeld
    SimTK::Vector m_heldMobilityForces;
    double m_seconds = 0;
};

}  // namespace simflex
