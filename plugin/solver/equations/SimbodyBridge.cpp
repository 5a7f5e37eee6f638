#include "simflex/solver/equations/SimbodyBridge.h"

#include <algorithm>
#include <chrono>

#include "simflex/base/Checkpoint.h"
#include "simflex/body/StateCopy.h"
#include "simflex/solver/equations/RigidTree.h"
#include "simflex/solver/equations/StateImage.h"

namespace simflex {

using namespace SimTK;
using Clock = std::chrono::steady_clock;

SimbodyBridge::SimbodyBridge(const Topology& topology, Blocks& blocks, const State& state)
    : m_system(*topology.system),
      m_topology(topology),
      m_blocks(blocks),
      m_private(copyState(state)) {
    m_blocks.context.gravity = &m_gravity;
}

void SimbodyBridge::updateGravity(const State& state) {
    std::fill(m_gravity.atBody.begin(), m_gravity.atBody.end(), Vec3(0));
    for (const Force::Gravity* gravity : m_gravityForces)
        for (MobilizedBodyIndex i(1); i < int(m_gravity.atBody.size()); ++i)
            if (!gravity->getBodyIsExcluded(state, i))
                m_gravity.atBody[i] += gravity->getGravityVector(state);
    for (const Force::UniformGravity* gravity : m_uniformGravities)
        for (MobilizedBodyIndex i(1); i < int(m_gravity.atBody.size()); ++i)
            m_gravity.atBody[i] += gravity->getGravity();
}

void SimbodyBridge::updateMobilityForces(const State& state) {
    if (m_mobilityForceElements.empty()) return;
    const size_t n = size_t(state.getNU());
    for (auto* values : {&m_mobilities.constant, &m_mobilities.damping, &m_mobilities.stiffness})
        values->assign(n, 0);
    for (const MobilityForce& element : m_mobilityForceElements) {
        const size_t u = size_t(std::max(element.u, 0));
        if (Force::MobilityLinearSpring::isInstanceOf(*element.force)) {
            const auto& spring = Force::MobilityLinearSpring::downcast(*element.force);
            const Real stiffness = spring.getStiffness(state);
            m_mobilities.stiffness[u] += stiffness;
            m_mobilities.constant[u] += stiffness * spring.getQZero(state);
        } else if (Force::MobilityLinearDamper::isInstanceOf(*element.force)) {
            m_mobilities.damping[u] +=
                Force::MobilityLinearDamper::downcast(*element.force).getDamping(state);
        } else {
            for (double& damping : m_mobilities.damping) damping += element.damping;
        }
    }
    m_blocks.context.mobilities = &m_mobilities;
}

bool SimbodyBridge::isMobilityForce(const Force& force) const {
    return std::any_of(m_mobilityForceElements.begin(), m_mobilityForceElements.end(),
                       [&](const MobilityForce& element) {
                           return &element.force->getImpl() == &force.getImpl();
                       });
}

void SimbodyBridge::updateHeldForces() {
    if (!m_topology.areForcesHeld) return;
    m_system.realize(m_private, Stage::Dynamics);
    m_heldBodyForces = m_system.getRigidBodyForces(m_private, Stage::Dynamics);
    m_heldMobilityForces = m_system.getMobilityForces(m_private, Stage::Dynamics);
}

void SimbodyBridge::setLoadFraction(double fraction) {
    if (m_fullGravity.atBody.empty()) {
        m_fullGravity = m_gravity;
        m_fullMobilities = m_mobilities;
    }
    m_blocks.context.loadFraction = fraction;
    for (size_t i = 0; i < m_gravity.atBody.size(); ++i)
        m_gravity.atBody[i] = fraction * m_fullGravity.atBody[i];
    const auto scale = [&](const std::vector<double>& full, std::vector<double>& part) {
        std::transform(full.begin(), full.end(), part.begin(),
                       [&](double value) { return fraction * value; });
    };
    scale(m_fullMobilities.constant, m_mobilities.constant);
    scale(m_fullMobilities.damping, m_mobilities.damping);
    scale(m_fullMobilities.stiffness, m_mobilities.stiffness);
}

void SimbodyBridge::place(double time, const double* q, const double* u) {
    const bool hasSameQ = m_placedTime == time && std::equal(m_placedQ.begin(), m_placedQ.end(), q);
    if (isPlaced(time, q, u)) return;
    if (hasSameQ && m_blocks.flexible.empty()) {
        Vector& stateU = m_private.updU();
        for (const RigidTree* tree : m_blocks.rigid) tree->putSpeeds(u + tree->firstU, stateU);
    } else {
        m_blocks.putIntoState(time, q, u, m_private);
    }
    m_placedTime = time;
    m_placedQ.assign(q, q + m_topology.numQ);
    m_placedU.assign(u, u + m_topology.numU);
}

void SimbodyBridge::updatePrescribed(double time, const double* q, const double* u) {
    const bool isKnown = m_prescribedTime == time && !m_prescribed->dependsOnState();
    if (!m_prescribed->hasMotions() || isKnown) return;
    const auto start = Clock::now();
    place(time, q, u);
    m_prescribed->updateFromSimbody(m_private);
    if (!m_prescribed->dependsOnState()) {
        m_system.realize(m_private, Stage::Dynamics);
        m_prescribed->updateAccelerations(m_private);
    }
    m_prescribedTime = time;
    m_placedTime = NaN;  // m_private now holds values of Motions
    m_seconds += std::chrono::duration<double>(Clock::now() - start).count();
}

void SimbodyBridge::prescribe(double time, double gamma, const double* uHist, double* q,
                              double* u) {
    if (!m_prescribed) return;
    updatePrescribed(time, q, u);
    m_prescribed->apply(gamma, uHist, q, u);
}

void SimbodyBridge::clearPrescribedErrors(double* errorQ, double* errorU) const {
    if (m_prescribed) m_prescribed->clearErrors(errorQ, errorU);
}

void SimbodyBridge::realize(double time, const double* q, const double* u) {
    if (m_prescribed && !m_prescribed->dependsOnState()) updatePrescribed(time, q, u);
    if (!m_topology.needsSimbody) return;
    const auto start = Clock::now();
    place(time, q, u);
    if (m_prescribed && m_prescribed->dependsOnState()) {
        m_system.realize(m_private, Stage::Dynamics);
        m_prescribed->updateAccelerations(m_private);
    } else if (m_topology.needsKinematics) {
        m_system.realize(m_private, Stage::Velocity);
    }
    m_seconds += std::chrono::duration<double>(Clock::now() - start).count();
}

void SimbodyBridge::realizeNatively(const State& state, const Vector_<SpatialVec>& bodyForces,
                                    const Vector& mobilityForces) {
    m_now = m_blocks.context.state = &state;
    m_bodyForces = bodyForces;
    m_mobilityForces = mobilityForces;
    if (m_prescribed) m_prescribed->updateAccelerations(state);
}

void SimbodyBridge::collectForces(const double* lambda) {
    const double fraction = m_blocks.context.loadFraction;
    if (m_topology.setting == Topology::Setting::Native) {
        // Given.
    } else if (m_topology.hasForeignForces) {
        const bool areHeld = m_topology.areForcesHeld;
        const auto start = Clock::now();
        if (!areHeld) m_system.realize(*m_now, Stage::Dynamics);
        m_seconds += std::chrono::duration<double>(Clock::now() - start).count();
        m_bodyForces =
            areHeld ? m_heldBodyForces : m_system.getRigidBodyForces(*m_now, Stage::Dynamics);
        m_mobilityForces =
            areHeld ? m_heldMobilityForces : m_system.getMobilityForces(*m_now, Stage::Dynamics);
        if (fraction != 1) {
            m_bodyForces *= fraction;
            m_mobilityForces *= fraction;
        }
    } else if (m_constraints) {
        m_bodyForces.resize(m_system.getMatterSubsystem().getNumBodies());
        m_bodyForces = SpatialVec(Vec3(0), Vec3(0));
        m_mobilityForces.resize(m_topology.numSimbodyU);
        m_mobilityForces = Real(0);
    }
    if (m_constraints)
        m_constraints->addInForces(*m_now, lambda + m_topology.firstSimbodyRow, m_bodyForces,
                                   m_mobilityForces);
}

void SimbodyBridge::subtractForces(Block& block, double* r) const {
    if (m_topology.hasForeignForces || m_constraints)
        block.subtractSimbodyForces(m_bodyForces, m_mobilityForces, r);
}

void SimbodyBridge::formColumns(MotionLevel level, NewtonSystem& system) const {
    if (m_constraints) {
        std::vector<SimbodyConstraints::RowForces> rows;
        m_constraints->calcRowForces(*m_now, rows);
        Vector_<SpatialVec> bodyForces(m_system.getMatterSubsystem().getNumBodies(),
                                       SpatialVec(Vec3(0), Vec3(0)));
        Vector mobilityForces(m_topology.numSimbodyU, Real(0));
        for (int b = 0; b < m_topology.numBlocks(); ++b)
            for (const auto& [row, column] : m_topology.simbodyColumns[size_t(b)]) {
                NewtonSystem::Block& block = system.blocks[size_t(b)];
                double* Gt = block.Gt.data() + size_t(column) * size_t(block.size);
                std::fill_n(Gt, block.size, 0.0);
                const MotionLevel own = m_constraints->getLevel(row);
                const bool takesPart = own == MotionLevel::Position ||
                                       level == MotionLevel::Acceleration || own == level;
                if (!takesPart) continue;
                // Gᵀλ is on the left of the equations of motion, hence the sign.
                const SimbodyConstraints::RowForces& forces = rows[size_t(row)];
                for (const auto& [body, force] : forces.bodies) bodyForces[body] -= force;
                for (const auto& [speed, force] : forces.speeds) mobilityForces[speed] -= force;
                m_blocks.all[size_t(b)]->subtractSimbodyForces(bodyForces, mobilityForces, Gt);
                for (const auto& [body, force] : forces.bodies)
                    bodyForces[body] = SpatialVec(Vec3(0), Vec3(0));
                for (const auto& [speed, force] : forces.speeds) mobilityForces[speed] = 0;
            }
    }
    if (m_prescribed)
        for (int b = 0; b < m_topology.numBlocks(); ++b)
            if (m_prescribed->touches(m_blocks.all[size_t(b)]->firstU,
                                      m_blocks.all[size_t(b)]->numU))
                m_prescribed->mask(level, m_blocks.all[size_t(b)]->firstU,
                                   system.blocks[size_t(b)]);
}

void SimbodyBridge::formDifferencedColumns(const NewtonFactors& factors, NewtonSystem& system) {
    if (m_differences.empty()) return;
    const auto start = Clock::now();
    m_system.realize(m_private, Stage::Velocity);
    const Vector_<SpatialVec> bodyForces(m_system.getMatterSubsystem().getNumBodies(),
                                         SpatialVec(Vec3(0), Vec3(0)));
    Vector mobilityForces(m_topology.numSimbodyU, Real(0));
    std::vector<double> column;
    for (size_t k = 0; k < m_differences.size(); ++k) {
        const Topology::DifferencedForce& forces = m_topology.differenced[k];
        if (forces.ownBlock >= 0) continue;
        ForceDifferences& differences = m_differences[k];
        differences.calcTerms(m_private, factors.stiffness);
        for (int term = 0; term < differences.getNumTerms(); ++term)
            system.compliance[size_t(forces.firstRow + term)] = differences.getSign(term);
        for (const Topology::DifferencedForce::Side& side : forces.sides) {
            NewtonSystem::Block& block = system.blocks[size_t(side.block)];
            for (int term = 0; term < differences.getNumTerms(); ++term) {
                for (int s : side.speeds)
                    mobilityForces[differences.getSpeeds()[size_t(s)].u] =
                        -differences.getDirection(term, s);
                column.assign(size_t(block.size), 0.0);
                m_blocks.all[size_t(side.block)]->subtractSimbodyForces(bodyForces, mobilityForces,
                                                                        column.data());
                const int rows = block.heightOfGt();
                std::copy_n(column.data(), rows,
                            block.Gt.data() + size_t(side.firstColumn + term) * size_t(rows));
                for (int s : side.speeds) mobilityForces[differences.getSpeeds()[size_t(s)].u] = 0;
            }
        }
    }
    m_seconds += std::chrono::duration<double>(Clock::now() - start).count();
}

void SimbodyBridge::clearDifferencedColumns(NewtonSystem& system) const {
    for (const Topology::DifferencedForce& forces : m_topology.differenced)
        for (const Topology::DifferencedForce::Side& side : forces.sides) {
            NewtonSystem::Block& block = system.blocks[size_t(side.block)];
            const int rows = block.heightOfGt();
            std::fill_n(block.Gt.data() + size_t(side.firstColumn) * size_t(rows),
                        rows * forces.numTerms, 0.0);
        }
}

void SimbodyBridge::addInDifferencedMatrices(const NewtonFactors& factors, NewtonSystem& system) {
    const auto start = Clock::now();
    if (!m_differences.empty()) m_system.realize(m_private, Stage::Velocity);
    for (size_t k = 0; k < m_differences.size(); ++k) {
        const Topology::DifferencedForce& forces = m_topology.differenced[k];
        if (forces.ownBlock < 0) continue;
        const Eigen::MatrixXd& A = m_differences[k].calcMatrix(m_private, factors.stiffness);
        const std::vector<int>& rows = forces.ownRows;
        NewtonSystem::Block& block = system.blocks[size_t(forces.ownBlock)];
        block.form = NewtonSystem::Block::Form::General;
        for (size_t j = 0; j < rows.size(); ++j)
            for (size_t i = 0; i < rows.size(); ++i)
                block.matrix[size_t(rows[i] + rows[j] * block.size)] += A(int(i), int(j));
    }
    m_seconds += std::chrono::duration<double>(Clock::now() - start).count();
}

void SimbodyBridge::takeVariables(const std::vector<DiscreteVarKey>& keys, const State& from) {
    for (State* state : {&m_private, &m_zState})
        if (state->getNumSubsystems() > 0) copyVariables(keys, from, *state);
    // Place the point again: forces cached by a contact subsystem would outlive their contacts.
    m_placedTime = NaN;
    for (ForceDifferences& differences : m_differences) differences.takeVariables(keys, from);
    updateKnownForces(from);
    updateHeldForces();
    m_prescribedTime = NaN;
}

void SimbodyBridge::setZ(const double* z) {
    if (m_private.getNumSubsystems() == 0 || m_topology.numZ == 0) return;
    if (std::equal(z, z + m_topology.numZ, &m_private.getZ()[0])) return;
    std::copy_n(z, m_topology.numZ, &m_private.updZ()[0]);
}

void SimbodyBridge::calcZDot(double time, const double* q, const double* u, const double* uDot,
                             const double* z, double* zDot) {
    if (!m_topology.hasForeignZ()) return;
    const auto start = Clock::now();
    const bool hasOwnState = m_zState.getNumSubsystems() > 0;
    const State& state = hasOwnState ? m_zState : m_private;
    if (hasOwnState) {
        m_blocks.putIntoState(time, q, u, m_zState);
        std::copy_n(z, m_topology.numZ, &m_zState.updZ()[0]);
        m_topology.guts->setKnownAccelerations(m_zState, m_blocks.calcSimbodyUDot(q, uDot));
    } else {
        place(time, q, u);
        setZ(z);
    }
    m_system.realize(state, Stage::Acceleration);
    const Vector& stateZDot = state.getZDot();
    for (int i = 0; i < m_topology.numZ; ++i) zDot[i] = stateZDot[i];
    m_seconds += std::chrono::duration<double>(Clock::now() - start).count();
}

void SimbodyBridge::visit(Checkpoint& checkpoint) {
    if (m_prescribed) {
        checkpoint.visit(m_prescribedTime);
        m_prescribed->visit(checkpoint);
    }
    if (!m_topology.needsSimbody) return;
    double time = m_private.getTime();
    checkpoint.visit(time);
    const auto visitVector = [&](const Vector& now, auto upd) {
        std::vector<double> values(size_t(now.size()));
        for (int i = 0; i < now.size(); ++i) values[size_t(i)] = now[i];
        checkpoint.visit(values);
        if (!checkpoint.isReading()) return;
        Vector& vector = upd();
        for (int i = 0; i < vector.size(); ++i) vector[i] = values[size_t(i)];
    };
    visitVector(m_private.getQ(), [&]() -> Vector& { return m_private.updQ(); });
    visitVector(m_private.getU(), [&]() -> Vector& { return m_private.updU(); });
    visitVector(m_private.getZ(), [&]() -> Vector& { return m_private.updZ(); });
    if (!checkpoint.isReading()) return;
    m_placedTime = NaN;
    m_private.setTime(time);
    const bool hasForces = m_topology.hasForeignForces && !m_topology.areForcesHeld;
    m_system.realize(m_private, hasForces ? Stage::Dynamics : Stage::Velocity);
}

}  // namespace simflex
