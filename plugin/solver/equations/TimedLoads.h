#pragma once
/** @file
How loads and motions depend on time alone, all else as at the last evaluation (private header). Of
Simbody's forces and constraints those that may: Force::Custom, Constraint::Custom and
Constraint::PrescribedMotion. **/

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

    /** What may depend on time, elsewhere zero.
    @param[out] r  forces in the equations' sign; of prescribed accelerations, what they add to
        speeds in a step
    @param[out] g  errors of constraints in positions; of those of speeds and accelerations, what a
        step makes of them **/
    void calc(double time, const NewtonFactors& factors, const double* q, const double* u,
              const double* uDot, const JointTerms& joints, LoadTerms& loads, double* r, double* g);
    /** Writes the q and u that Motions prescribe at another time. **/
    void calcMotions(double time, double* q, double* u);

    void takeVariables(const std::vector<SimTK::DiscreteVarKey>& keys, const SimTK::State& from);

private:
    const Topology& m_topology;
    Blocks& m_blocks;
    const SimbodyBridge& m_simbody;
    FunctionsOfTime& m_functions;
    bool m_hasLoads = false, m_hasConstraints = false;
    std::vector<const SimTK::Force::Custom::Implementation*> m_forces;
    SimTK::State m_state;  ///< on which Simbody evaluates these
    SimTK::Vector_<SimTK::SpatialVec> m_bodyForces;
    SimTK::Vector m_mobilityForces;
    SimTK::Vector_<SimTK::Vec3> m_particleForces;
    std::unique_ptr<PrescribedMotion> m_motion;
};

}  // namespace simflex
