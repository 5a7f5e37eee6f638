#pragma once
/** @file
Dependence of loads and motions on time alone, with everything else as at the last evaluation
(private header). Of Simbody's forces and constraints, these are Force::Custom, Constraint::Custom
and Constraint::PrescribedMotion. **/

#include <memory>
#include <vector>

#include "simflex/solver/equations/JointTerms.h"
#include "simflex/solver/equations/LoadTerms.h"
#include "simflex/solver/equations/SimbodyBridge.h"

namespace simflex {

class TimedLoads {
public:
    TimedLoads(const Topology& topology, Blocks& blocks, const SimbodyBridge& simbody,
               FunctionsOfTime& functions);

    bool hasLoads() const { return m_hasLoads; }
    bool hasMotions() const;

    /** Computes all terms that may depend on time, zero elsewhere.
    @param[out] r  forces with the sign of the equations; for prescribed accelerations, the change
    of speeds in a step
    @param[out] g  position errors of constraints; velocity and acceleration errors integrated over
    a step **/
    void calc(double time, const NewtonFactors& factors, const double* q, const double* u,
              const double* uDot, const JointTerms& joints, LoadTerms& loads, double* r, double* g);
    /** Writes the q and u prescribed by Motions at another time. **/
    void calcMotions(double time, double* q, double* u);

    void takeVariables(const std::vector<SimTK::DiscreteVarKey>& keys, const SimTK::State& from);

private:
    const Topology& m_topology;
    Blocks& m_blocks;
    const SimbodyBridge& m_simbody;
    FunctionsOfTime& m_functions;
    bool m_hasLoads = false, m_hasConstraints = false;
    std::vector<const SimTK::Force::Custom::Implementation*> m_forces;
    SimTK::State m_state;  ///< on which Simbody evaluates them
    SimTK::Vector_<SimTK::SpatialVec> m_bodyForces;
    SimTK::Vector m_mobilityForces;
    SimTK::Vector_<SimTK::Vec3> m_particleForces;
    std::unique_ptr<PrescribedMotion> m_motion;
};

}  // namespace simflex
