#include "simflex/solver/equations/TimedLoads.h"

#include <algorithm>
#include <cstring>
#include <typeinfo>

#include "simflex/body/StateCopy.h"
#include "simflex/solver/equations/FlexibleBlock.h"
#include "simflex/solver/equations/ForceElements.h"
#include "simflex/solver/equations/StateImage.h"

namespace simflex {

using namespace SimTK;

namespace {

struct CustomConstraint : Constraint::Custom {
    static const char* getTypeName(const Constraint& constraint) {
        const auto getImplementation = &CustomConstraint::getImplementation;
        return typeid((Constraint::Custom::downcast(constraint).*getImplementation)()).name();
    }
};

/** Couplers are custom constraints, but their functions depend on coordinates and speeds only. **/
bool mayDependOnTime(const Constraint& constraint) {
    if (!Constraint::Custom::isInstanceOf(constraint)) return false;
    const char* type = CustomConstraint::getTypeName(constraint);
    return !std::strstr(type, "5SimTK10Constraint21CoordinateCouplerImpl") &&
           !std::strstr(type, "5SimTK10Constraint16SpeedCouplerImpl");
}

}  // namespace

TimedLoads::TimedLoads(const Topology& topology, Blocks& blocks, const SimbodyBridge& simbody,
                       FunctionsOfTime& functions)
    : m_topology(topology), m_blocks(blocks), m_simbody(simbody), m_functions(functions) {
    if (topology.setting != Topology::Setting::Implicit) return;
    const SimbodyMatterSubsystem& matter = topology.system->getMatterSubsystem();
    if (topology.hasForeignForces)
        for (const GeneralForceSubsystem* forces : listGeneralForceSubsystems(*topology.system))
            for (ForceIndex f(0); f < forces->getNumForces(); ++f)
                if (Force::Custom::isInstanceOf(forces->getForce(f)) &&
                    !forces->isForceDisabled(simbody.m_private, f))
                    m_forces.push_back(
                        &getImplementation(Force::Custom::downcast(forces->getForce(f))));
    for (const Topology::SimbodyRow& row : topology.simbodyRows)
        m_hasConstraints =
            m_hasConstraints || mayDependOnTime(matter.getConstraint(row.constraint));
    const PrescribedMotion* prescribed = simbody.getPrescribed();
    m_hasLoads = !m_forces.empty() || m_hasConstraints || !topology.elements.empty() ||
                 (prescribed && prescribed->hasAccelerationMotions());
    for (const FlexibleBlock* block : blocks.flexible) m_hasLoads = m_hasLoads || block->hasLoads();
    for (const Topology::Joint& joint : topology.joints)
        m_hasLoads = m_hasLoads || joint.record->equations->dependsOnTime();
    if (m_forces.empty() && !m_hasConstraints && !hasMotions()) return;
    copyState(simbody.m_private, m_state);
    m_bodyForces.resize(matter.getNumBodies());
    m_mobilityForces.resize(matter.getNumMobilities());
    m_particleForces.resize(matter.getNumParticles());
    if (hasMotions()) m_motion = std::make_unique<PrescribedMotion>(*prescribed);
}

bool TimedLoads::hasMotions() const {
    return m_simbody.getPrescribed() && m_simbody.getPrescribed()->hasMotions();
}

void TimedLoads::calc(double time, const NewtonFactors& factors, const double* q, const double* u,
                      const double* uDot, const JointTerms& joints, LoadTerms& loads, double* r,
                      double* g) {
    time = m_functions.clampTime(time);
    const PrescribedMotion* prescribed = m_simbody.getPrescribed();
    const SimbodyConstraints* constraints = m_simbody.getConstraints();
    std::fill_n(r, m_topology.numU, 0.0);
    std::fill_n(g, m_topology.numMultipliers, 0.0);
    const TimeValues& values = m_functions.calc(time);
    // At the end of a step the private State is usually at this point already.
    const bool isKnown = m_simbody.isPlaced(time, q, u) && !m_topology.hasForeignZ() &&
                         m_simbody.m_private.getSystemStage() >= Stage::Velocity;
    const State& state = isKnown ? m_simbody.m_private : m_state;
    if (!isKnown && (!m_forces.empty() || m_hasConstraints)) {
        m_blocks.putIntoState(time, q, u, m_state);
        m_topology.system->realize(m_state, Stage::Velocity);
    }
    for (const Force::Custom::Implementation* force : m_forces) {
        m_bodyForces = SpatialVec(Vec3(0), Vec3(0));
        m_mobilityForces = Real(0);
        force->calcForce(state, m_bodyForces, m_particleForces, m_mobilityForces);
        for (const auto& block : m_blocks.all)
            block->subtractSimbodyForces(m_bodyForces, m_mobilityForces, r + block->firstU);
    }
    loads.subtractForcesAt(values, q, r);
    if (prescribed) prescribed->clearResidual(r);
    if (m_hasConstraints) {
        constraints->calcPositionErrors(state, g + m_topology.firstSimbodyRow);
        std::vector<double> errors(size_t(constraints->numRows()));
        const auto takeRows = [&](MotionLevel level, double factor) {
            for (int k = 0; k < constraints->numRows(); ++k)
                if (constraints->getLevel(k) == level)
                    g[m_topology.firstSimbodyRow + k] = factor * errors[size_t(k)];
        };
        constraints->calcVelocityErrors(state, errors.data());
        takeRows(MotionLevel::Velocity, factors.stiffness);
        if (constraints->hasAccelerationRows()) {
            constraints->calcAccelerationErrors(state, m_blocks.calcSimbodyUDot(q, uDot),
                                                errors.data());
            takeRows(MotionLevel::Acceleration, factors.stiffness * factors.mass);
        }
    }
    joints.calcErrorsAt(values, g);
    if (!prescribed || !prescribed->hasAccelerationMotions()) return;
    m_blocks.putIntoState(time, q, u, m_state);
    m_motion->updateFromSimbody(m_state);
    m_motion->subtractAccelerations(factors.mass, q, r);
}

void TimedLoads::calcMotions(double time, double* q, double* u) {
    m_blocks.putIntoState(m_functions.clampTime(time), q, u, m_state);
    m_motion->updateFromSimbody(m_state);
    m_motion->apply(0, nullptr, q, u);
}

void TimedLoads::takeVariables(const std::vector<DiscreteVarKey>& keys, const State& from) {
    if (m_state.getNumSubsystems() > 0) copyVariables(keys, from, m_state);
}

}  // namespace simflex
