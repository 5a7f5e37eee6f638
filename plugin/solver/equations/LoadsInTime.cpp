// How loads and motions depend on time alone.

#include <algorithm>
#include <cstring>
#include <typeinfo>

#include "simflex/solver/equations/FlexibleBlock.h"
#include "simflex/solver/equations/ForceElements.h"
#include "simflex/solver/equations/MultibodyEquations.h"
#include "simflex/solver/equations/RigidTree.h"

namespace simflex {

using namespace SimTK;

namespace {

struct CustomConstraint : Constraint::Custom {
    static const char* getTypeName(const Constraint& constraint) {
        const auto getImplementation = &CustomConstraint::getImplementation;
        return typeid((Constraint::Custom::downcast(constraint).*getImplementation)()).name();
    }
};

/** Couplers are custom constraints, but their functions are of coordinates alone. **/
bool mayDependOnTime(const Constraint& constraint) {
    if (!Constraint::Custom::isInstanceOf(constraint)) return false;
    const char* type = CustomConstraint::getTypeName(constraint);
    return !std::strstr(type, "5SimTK10Constraint21CoordinateCouplerImpl") &&
           !std::strstr(type, "5SimTK10Constraint16SpeedCouplerImpl");
}

}  // namespace

void MultibodyEquations::findTimedLoads() {
    const SimbodyMatterSubsystem& matter = m_system.getMatterSubsystem();
    if (m_hasForeignForces)
        for (const GeneralForceSubsystem* forces : listGeneralForceSubsystems(m_system))
            for (ForceIndex f(0); f < forces->getNumForces(); ++f)
                if (Force::Custom::isInstanceOf(forces->getForce(f)) &&
                    !forces->isForceDisabled(m_private, f))
                    m_timedForces.push_back(
                        &getImplementation(Force::Custom::downcast(forces->getForce(f))));
    if (m_constraints)
        for (ConstraintIndex c : findSimbodyConstraints(m_private))
            m_hasTimedConstraints =
                m_hasTimedConstraints || mayDependOnTime(matter.getConstraint(c));
    m_hasTimedLoads = !m_timedForces.empty() || m_hasTimedConstraints || !m_elements.empty() ||
                      (m_prescribed && m_prescribed->hasAccelerationMotions());
    for (const FlexibleBlock* block : m_flexible)
        m_hasTimedLoads = m_hasTimedLoads || block->hasLoads();
    for (const JointRef& joint : m_joints)
        m_hasTimedLoads = m_hasTimedLoads || joint.record->equations->dependsOnTime();
    if (m_timedForces.empty() && !m_hasTimedConstraints && !hasTimedMotions()) return;
    m_timedState = m_private;
    m_timedBodyForces.resize(matter.getNumBodies());
    m_timedMobilityForces.resize(matter.getNumMobilities());
    m_timedParticleForces.resize(matter.getNumParticles());
    if (hasTimedMotions()) m_timedMotion = std::make_unique<PrescribedMotion>(*m_prescribed);
}

void MultibodyEquations::calcTimedLoads(double time, const NewtonFactors& factors, const double* q,
                                        const double* u, const double* uDot, double* r, double* g) {
    time = std::clamp(time, m_firstTime, m_lastTime);
    std::fill_n(r, m_numU, 0.0);
    std::fill_n(g, m_numMultipliers, 0.0);
    EvaluationContext context = m_context;
    const TimeValues& values = m_functions.calc(time);
    context.timeValues = &values;
    if (!m_timedForces.empty() || m_hasTimedConstraints) {
        putIntoState(time, q, u, m_timedState);
        m_system.realize(m_timedState, Stage::Velocity);
    }
    for (const Force::Custom::Implementation* force : m_timedForces) {
        m_timedBodyForces = SpatialVec(Vec3(0), Vec3(0));
        m_timedMobilityForces = Real(0);
        force->calcForce(m_timedState, m_timedBodyForces, m_timedParticleForces,
                         m_timedMobilityForces);
        for (const auto& block : m_blocks)
            block->subtractSimbodyForces(m_timedBodyForces, m_timedMobilityForces,
                                         r + block->firstU);
    }
    for (FlexibleBlock* block : m_flexible)
        if (block->hasLoads()) block->subtractLoads(context, q + block->firstQ, r + block->firstU);
    for (const ElementRef& element : m_elements) {
        m_timedElementForces.resize(unsigned(element.frames.size()));
        calcElementForces(element, values, m_timedElementForces);
        for (size_t k = 0; k < element.frames.size(); ++k) {
            const FrameRef& ref = element.frames[k];
            if (ref.block >= 0)
                m_blocks[size_t(ref.block)]->subtractForce(ref.frame,
                                                           m_timedElementForces[unsigned(k)],
                                                           r + m_blocks[size_t(ref.block)]->firstU);
        }
    }
    if (m_prescribed) m_prescribed->clearResidual(r);
    if (m_hasTimedConstraints) {
        m_constraints->calcPositionErrors(m_timedState, g + m_firstSimbodyRow);
        std::vector<double> errors(size_t(m_constraints->numRows()));
        const auto takeRows = [&](MotionLevel level, double factor) {
            for (int k = 0; k < m_constraints->numRows(); ++k)
                if (m_constraints->getLevel(k) == level)
                    g[m_firstSimbodyRow + k] = factor * errors[size_t(k)];
        };
        m_constraints->calcVelocityErrors(m_timedState, errors.data());
        takeRows(MotionLevel::Velocity, factors.stiffness);
        if (m_constraints->hasAccelerationRows()) {
            m_constraints->calcAccelerationErrors(m_timedState, calcSimbodyUDot(q, uDot),
                                                  errors.data());
            takeRows(MotionLevel::Acceleration, factors.stiffness * factors.mass);
        }
    }
    for (const JointRef& joint : m_joints)
        if (joint.record->equations->dependsOnTime())
            joint.record->equations->calcErrors(values.drives[size_t(joint.drive)],
                                                joint.motions.data(), g + joint.firstRow);
    if (!m_prescribed || !m_prescribed->hasAccelerationMotions()) return;
    putIntoState(time, q, u, m_timedState);
    m_timedMotion->updateFromSimbody(m_timedState);
    m_timedMotion->subtractAccelerations(factors.mass, q, r);
}

void MultibodyEquations::calcTimedMotions(double time, double* q, double* u) {
    putIntoState(std::clamp(time, m_firstTime, m_lastTime), q, u, m_timedState);
    m_timedMotion->updateFromSimbody(m_timedState);
    m_timedMotion->apply(0, nullptr, q, u);
}

}  // namespace simflex
