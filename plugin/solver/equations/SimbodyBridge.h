#pragma once
/** @file
What Simbody is asked for while equations of motion are evaluated, on private States (private
header): foreign forces, Simbody's constraints, Motions, auxiliary variables z, and poses and N(q)
of mobilizers that only Simbody knows. Gravity and linear forces on mobilities are no foreign
forces: their parameters are read once, and again when variables change, and the blocks apply them.
Within a realization of Simbody's own (Topology::Setting::Native) all foreign forces, gravity among
them, are given, and Simbody is asked on the State that is being realized. **/

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
    /** The State that Simbody was asked on last. **/
    const SimTK::State& getState() const { return *m_now; }

    /** Applies this part of gravity, of loads and of Simbody's force elements from the next
    realize() on, springs between attachment frames in full; 1 unless told. **/
    void setLoadFraction(double fraction);

    /** Writes the q and u that locks and Motions prescribe at this time. With `uHist`, prescribed
    accelerations make u = u_hist + γu̇. **/
    void prescribe(double time, double gamma, const double* uHist, double* q, double* u);

    /** True for one of Simbody's force elements that the blocks apply themselves, which is disabled
    in getState(). **/
    bool isMobilityForce(const SimTK::Force& force) const;

    /** Zeroes what is prescribed in errors of q and u. **/
    void clearPrescribedErrors(double* errorQ, double* errorU) const;

    /** Brings the State to this point as far as anybody asks Simbody. **/
    void realize(double time, const double* q, const double* u);
    /** From now on asks on this one. **/
    void realizeNatively(const SimTK::State& state,
                         const SimTK::Vector_<SimTK::SpatialVec>& bodyForces,
                         const SimTK::Vector& mobilityForces);

    /** @name After realize() **/
    /**@{**/
    /** Sums foreign forces and −Gᵀλ of Simbody's constraints, for subtractForces(). **/
    void collectForces(const double* lambda);
    void subtractForces(Block& block, double* r) const;
    /** Columns of Simbody's constraints, and the identity for what is prescribed. **/
    void formColumns(MotionLevel level, NewtonSystem& system) const;
    /** Terms of differenced forces, as columns and as matrices of their own blocks. **/
    void formDifferencedColumns(const NewtonFactors& factors, NewtonSystem& system);
    void clearDifferencedColumns(NewtonSystem& system) const;
    void addInDifferencedMatrices(const NewtonFactors& factors, NewtonSystem& system);
    /**@}**/

    /** Force elements see these variables' values from the next realize() on. **/
    void takeVariables(const std::vector<SimTK::DiscreteVarKey>& keys, const SimTK::State& from);

    /** @name Auxiliary variables z **/
    /**@{**/
    /** Simbody's elements see these z from the next realize() on. **/
    void setZ(const double* z);
    /** ż of Simbody's elements and Measures, if there are any; those that depend on accelerations
     * see these u̇. **/
    void calcZDot(double time, const double* q, const double* u, const double* uDot,
                  const double* z, double* zDot);
    /**@}**/

    /** What the next evaluation takes over from the last one: values of Motions, and where N(q) was
    evaluated. **/
    void visit(Checkpoint& checkpoint);

    /** Wall time spent in Simbody since the last call. **/
    double takeSeconds() { return std::exchange(m_seconds, 0); }

private:
    friend class TopologyBuilder;  // makes it
    friend class TimedLoads;       // its own State is a copy

    void updateGravity(const SimTK::State& state);
    void updateMobilityForces(const SimTK::State& state);
    void updateKnownForces(const SimTK::State& state) {
        updateGravity(state);
        updateMobilityForces(state);
    }
    /** Writes a point into m_private: no more than is new, so that Simbody evaluates the rest only.
     **/
    void place(double time, const double* q, const double* u);
    bool isPlaced(double time, const double* q, const double* u) const {
        return m_placedTime == time && std::equal(m_placedQ.begin(), m_placedQ.end(), q) &&
               std::equal(m_placedU.begin(), m_placedU.end(), u);
    }
    /** Asks for forces that no evaluation asks for again. **/
    void updateHeldForces();
    /** Asks for what Motions prescribe at this time, unless it is known. **/
    void updatePrescribed(double time, const double* q, const double* u);

    const SimTK::MultibodySystem& m_system;
    const Topology& m_topology;
    Blocks& m_blocks;
    SimTK::State m_private;                  ///< empty if Simbody is never asked
    const SimTK::State* m_now = &m_private;  ///< on which Simbody is asked
    SimTK::State m_zState;                   ///< on which it evaluates ż; empty if on m_private
    double m_placedTime = SimTK::NaN;        ///< where m_private is
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
    double m_prescribedTime = SimTK::NaN;            ///< at which Motions were asked for last
    std::vector<ForceDifferences> m_differences;     ///< of Topology::differenced
    SimTK::Vector_<SimTK::SpatialVec> m_bodyForces;  ///< of Simbody's elements and constraints
    SimTK::Vector m_mobilityForces;
    SimTK::Vector_<SimTK::SpatialVec> m_heldBodyForces;  ///< see Topology::areForcesHeld
    SimTK::Vector m_heldMobilityForces;
    double m_seconds = 0;
};

}  // namespace simflex
