#include "simflex/solver/equations/MultibodyEquations.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "simflex/base/Checkpoint.h"
#include "simflex/base/ParallelFor.h"
#include "simflex/solver/equations/FlexibleBlock.h"
#include "simflex/solver/equations/RigidTree.h"
#include "simflex/solver/equations/StateImage.h"

namespace simflex {

using namespace SimTK;
using Clock = std::chrono::steady_clock;

//---------------------------------------------------------------------------------------------------------
// evaluation

const FrameMotion& MultibodyEquations::motionOf(const FrameRef& frame) const {
    return frame.block < 0 ? frame.fixed : m_blocks[frame.block]->frames[frame.frame];
}

bool MultibodyEquations::hasModes() const {
    return std::any_of(m_blocks.begin(), m_blocks.begin() + numFlexibleBlocks(),
                       [](const auto& block) { return block->numU > 6; });
}

std::pair<int, int> MultibodyEquations::findRows(ConstraintIndex constraint) const {
    std::pair<int, int> rows{0, 0};
    if (m_constraints) rows = m_constraints->findRows(constraint);
    rows.first += m_firstSimbodyRow;
    return rows;
}

void MultibodyEquations::updatePrescribed(double time, const double* q, const double* u) {
    const bool isKnown = m_prescribedTime == time && !m_prescribed->dependsOnState();
    if (!m_prescribed->hasMotions() || isKnown) return;
    const auto start = Clock::now();
    putIntoState(time, q, u, m_private);
    m_prescribed->updateFromSimbody(m_private);
    if (!m_prescribed->dependsOnState()) {
        m_system.realize(m_private, Stage::Dynamics);
        m_prescribed->updateAccelerations(m_private);
    }
    m_prescribedTime = time;
    m_simbodySeconds += std::chrono::duration<double>(Clock::now() - start).count();
}

void MultibodyEquations::prescribe(double time, double gamma, const double* uHist, double* q,
                                   double* u) {
    if (!m_prescribed) return;
    updatePrescribed(std::clamp(time, m_firstTime, m_lastTime), q, u);
    m_prescribed->apply(gamma, uHist, q, u);
}

void MultibodyEquations::clearPrescribedErrors(double* errorQ, double* errorU) const {
    if (m_prescribed) m_prescribed->clearErrors(errorQ, errorU);
}

void MultibodyEquations::calcStepUDot(const double* q, const double* u, const double* uHist,
                                      double gamma, double* uDot) const {
    for (int i = 0; i < m_numU; ++i) uDot[i] = (u[i] - uHist[i]) / gamma;
    if (m_prescribed) m_prescribed->applyAccelerations(q, uDot);
}

void MultibodyEquations::calcPrescribedUDot(const double* q, double* uDot) const {
    std::fill_n(uDot, m_numU, 0.0);
    if (m_prescribed) m_prescribed->applyAccelerations(q, uDot);
}

void MultibodyEquations::realizeSimbody(double time, const double* q, const double* u) {
    const auto start = Clock::now();
    putIntoState(time, q, u, m_private);
    const bool hasMotions = m_prescribed && m_prescribed->dependsOnState();
    m_system.realize(m_private,
                     m_hasForeignForces || hasMotions ? Stage::Dynamics : Stage::Velocity);
    if (hasMotions) m_prescribed->updateAccelerations(m_private);
    m_simbodySeconds += std::chrono::duration<double>(Clock::now() - start).count();
}

void MultibodyEquations::setSmoothSpan(double first, double last) {
    m_firstTime = first;
    m_lastTime = last;
}

void MultibodyEquations::realize(double time, const double* q, const double* u) {
    time = std::clamp(time, m_firstTime, m_lastTime);
    moveFunctions(time);
    if (m_prescribed && !m_prescribed->dependsOnState()) updatePrescribed(time, q, u);
    if (m_needsSimbody) realizeSimbody(time, q, u);
    realizeBlocks(q, u);
}

void MultibodyEquations::realizeNatively(const State& state, const Vector_<SpatialVec>& bodyForces,
                                         const Vector& mobilityForces, const double* q,
                                         const double* u) {
    m_functions.forget();
    moveFunctions(state.getTime());
    m_now = m_context.state = &state;
    m_bodyForces = bodyForces;
    m_mobilityForces = mobilityForces;
    if (m_prescribed) m_prescribed->updateAccelerations(state);
    realizeBlocks(q, u);
}

void MultibodyEquations::moveFunctions(double time) {
    m_functions.moveTo(time);
    m_context.timeValues = &m_functions.get();
    m_time = time;
}

void MultibodyEquations::calcElementForces(const ElementRef& element, const TimeValues& values,
                                           Array_<SpatialVec>& forces) {
    for (SpatialVec& force : forces) force = SpatialVec(Vec3(0), Vec3(0));
    element.element->addInForces(values.time, element.motions, forces);
    element.element->addInTimedForce(values.forces[size_t(element.timedForce)], element.motions,
                                     forces);
}

void MultibodyEquations::realizeBlocks(const double* q, const double* u) {
    const int count = int(m_batches.size());
    parallelFor(count, m_numThreads, [&](int k) {
        FlexibleBlock::calcShapeProducts(m_batches[size_t(k)].flexible, q, u);
        for (int b : m_batches[size_t(k)].blocks)
            m_blocks[b]->realize(m_context, q + m_blocks[b]->firstQ, u + m_blocks[b]->firstU);
    });

    m_hasJacobians = false;
    for (ElementRef& element : m_elements) {
        for (size_t k = 0; k < element.frames.size(); ++k)
            element.motions[unsigned(k)] = motionOf(element.frames[k]);
        calcElementForces(element, m_functions.get(), element.forces);
        // What has a stiffness is no load.
        if (m_loadFraction != 1 && element.signs.empty())
            for (SpatialVec& force : element.forces) force *= m_loadFraction;
    }
}

void MultibodyEquations::updateJacobians() const {
    if (m_hasJacobians) return;
    parallelFor(int(m_joints.size()), m_numThreads, [&](int k) {
        JointRef& joint = m_joints[size_t(k)];
        joint.record->equations->calcJacobian(driveOf(joint), joint.motions.data(), joint.D.data());
        if (m_isAligning)
            joint.record->equations->alignJacobian(driveOf(joint), joint.motions.data(),
                                                   joint.D.data());
    });
    m_hasJacobians = true;
}

void MultibodyEquations::calcPositionErrors(double* g) const {
    parallelFor(int(m_joints.size()), m_numThreads, [&](int k) {
        const JointRef& joint = m_joints[size_t(k)];
        joint.record->equations->calcErrors(driveOf(joint), joint.motions.data(),
                                            g + joint.firstRow);
        if (m_isAligning)
            joint.record->equations->alignErrors(driveOf(joint), joint.motions.data(),
                                                 g + joint.firstRow);
    });
    if (m_constraints) m_constraints->calcPositionErrors(*m_now, g + m_firstSimbodyRow);
}

bool MultibodyEquations::mayLoseCount(const double* g, double scale) const {
    // Errors grow by 2³ = 8 where order 2 doubles its step, by 1.5⁶ = 11 at order 5.
    constexpr double LargestPart = 1.0 / 24;
    for (const auto& [row, period] : m_periods)
        if (std::abs(scale * g[row]) > LargestPart * period) return true;
    return false;
}

void MultibodyEquations::calcVelocityErrors(double* gDot) const {
    parallelFor(int(m_joints.size()), m_numThreads, [&](int k) {
        const JointRef& joint = m_joints[size_t(k)];
        joint.record->equations->calcErrorDots(driveOf(joint), joint.motions.data(),
                                               gDot + joint.firstRow);
    });
    if (m_constraints) m_constraints->calcVelocityErrors(*m_now, gDot + m_firstSimbodyRow);
}

void MultibodyEquations::calcStepErrors(MotionLevel level, const NewtonFactors& factors,
                                        const double* uDot, const double* q, double* c) const {
    if (level == MotionLevel::Velocity)
        calcVelocityErrors(c);
    else
        calcPositionErrors(c);
    if (level == MotionLevel::Position)
        for (int k = 0; k < m_numMultipliers; ++k) c[k] /= factors.stiffness;
    if (!m_constraints) return;
    // Rows that are not holonomic stand at their own level, in terms of Δu.
    double* rows = c + m_firstSimbodyRow;
    std::vector<double> errors(size_t(m_constraints->numRows()));
    const auto takeRows = [&](MotionLevel which, double factor) {
        for (int k = 0; k < m_constraints->numRows(); ++k)
            if (m_constraints->getLevel(k) == which) rows[k] = factor * errors[size_t(k)];
    };
    if (level == MotionLevel::Position) {
        m_constraints->calcVelocityErrors(*m_now, errors.data());
        takeRows(MotionLevel::Velocity, 1);
    }
    if (m_constraints->hasAccelerationRows()) {
        m_constraints->calcAccelerationErrors(*m_now, calcSimbodyUDot(q, uDot), errors.data());
        takeRows(MotionLevel::Acceleration, factors.mass);
    }
}

void MultibodyEquations::calcAccelerationErrors(const double* q, const double* u,
                                                const double* uDot, double* gDotDot) const {
    if (m_constraints)
        m_constraints->calcAccelerationErrors(*m_now, calcSimbodyUDot(q, uDot),
                                              gDotDot + m_firstSimbodyRow);
    for (const Batch& batch : m_batches)
        FlexibleBlock::calcAccelerationProducts(batch.flexible, uDot);
    for (const JointRef& joint : m_joints) {
        for (size_t side = 0; side < joint.sides.size(); ++side) {
            const FrameRef& ref = joint.sides[side];
            m_accelerated[side] = motionOf(ref);
            if (ref.block < 0) continue;
            const int first = m_blocks[ref.block]->firstU;
            m_accelerated[side].A =
                m_blocks[ref.block]->calcFrameAcceleration(ref.frame, u + first, uDot + first);
        }
        joint.record->equations->calcErrorDotDots(driveOf(joint), m_acceleratedFrames.data(),
                                                  gDotDot + joint.firstRow);
    }
}

void MultibodyEquations::calcResidual(const double* q, const double* u, const double* uDot,
                                      const double* lambda, double* r) {
    calcUnclearedResidual(q, u, uDot, lambda, r);
    if (m_prescribed) m_prescribed->clearResidual(r);
}

void MultibodyEquations::calcUnclearedResidual(const double* q, const double* u, const double* uDot,
                                               const double* lambda, double* r) {
    const bool hasSimbodyForces = m_hasForeignForces || m_constraints;
    updateJacobians();
    if (m_setting == Setting::Native) {
        // Given.
    } else if (m_hasForeignForces) {
        m_bodyForces = m_system.getRigidBodyForces(*m_now, Stage::Dynamics);
        m_mobilityForces = m_system.getMobilityForces(*m_now, Stage::Dynamics);
        if (m_loadFraction != 1) {
            m_bodyForces *= m_loadFraction;
            m_mobilityForces *= m_loadFraction;
        }
    } else if (m_constraints) {
        m_bodyForces.resize(m_system.getMatterSubsystem().getNumBodies());
        m_bodyForces = SpatialVec(Vec3(0), Vec3(0));
        m_mobilityForces.resize(m_numSimbodyU);
        m_mobilityForces = Real(0);
    }
    if (m_constraints)
        m_constraints->addInForces(*m_now, lambda + m_firstSimbodyRow, m_bodyForces,
                                   m_mobilityForces);
    const int count = int(m_batches.size());
    parallelFor(count, m_numThreads, [&](int k) {
        FlexibleBlock::calcInertiaProducts(m_batches[size_t(k)].flexible, q, u);
        for (int b : m_batches[size_t(k)].blocks) {
            Block& block = *m_blocks[b];
            double* rb = r + block.firstU;
            block.calcResidual(m_context, q + block.firstQ, u + block.firstU, uDot + block.firstU,
                               rb);
            subtractJointForces(b, lambda, rb);
            if (hasSimbodyForces) block.subtractSimbodyForces(m_bodyForces, m_mobilityForces, rb);
        }
    });
    for (const ElementRef& element : m_elements)
        for (size_t k = 0; k < element.frames.size(); ++k) {
            const FrameRef& ref = element.frames[k];
            if (ref.block >= 0)
                m_blocks[ref.block]->subtractForce(ref.frame, element.forces[unsigned(k)],
                                                   r + m_blocks[ref.block]->firstU);
        }
}

void MultibodyEquations::subtractJointForces(int b, const double* lambda, double* r) const {
    for (const BlockSide& blockSide : m_blockSides[b]) {
        const JointRef& joint = m_joints[blockSide.joint];
        const SpatialVec* D = joint.rowsOf(blockSide.side);
        SpatialVec force(Vec3(0), Vec3(0));
        for (int k = 0; k < joint.numRows(); ++k) force -= lambda[joint.firstRow + k] * D[k];
        m_blocks[b]->subtractForce(joint.sides[size_t(blockSide.side)].frame, force, r);
    }
}

double MultibodyEquations::calcPower(const double* q, const double* u, const double* uDot,
                                     const double* lambda) {
    Real power = 0;
    if (m_prescribed && m_prescribed->canWork()) {
        m_scratch.resize(size_t(m_numU));
        calcUnclearedResidual(q, u, uDot, lambda, m_scratch.data());
        power += m_prescribed->calcPower(m_scratch.data(), u);
    }
    if (m_constraints) power += m_constraints->calcPower(*m_now, lambda + m_firstSimbodyRow);
    for (const ElementRef& element : m_elements)
        power += element.element->calcPower(m_time, element.motions, element.forces);
    for (const auto& block : m_blocks)
        power += block->calcDampingPower(u + block->firstU) +
                 block->calcLoadPower(m_context, q + block->firstQ, u + block->firstU);
    for (const JointRef& joint : m_joints) {
        const JointEquations& equations = *joint.record->equations;
        if (!equations.dependsOnTime()) continue;
        // The joint's forces −Gᵀλ have power −λᵀGu = λᵀ ∂g/∂t.
        double timeRate[JointEquations::MaxEquations] = {};
        equations.addInTimeRate(driveOf(joint), joint.motions.data(), timeRate);
        for (int k = 0; k < equations.getNumEquations(); ++k)
            power += lambda[joint.firstRow + k] * timeRate[k];
    }
    return power;
}

double MultibodyEquations::calcMisalignment() const {
    double largest = 0;
    for (const JointRef& joint : m_joints)
        largest = std::max<double>(largest, joint.record->equations->calcMisalignment(
                                                driveOf(joint), joint.motions.data()));
    return largest;
}

const std::string* MultibodyEquations::findFlippedJoint() const {
    for (const JointRef& joint : m_joints)
        if (joint.record->equations->isFlipped(driveOf(joint), joint.motions.data()))
            return &joint.record->name;
    return nullptr;
}

void MultibodyEquations::formConstraintBlock(int b, NewtonSystem::Block& block) const {
    if (block.part < 0) std::fill(block.Gt.begin(), block.Gt.end(), 0.0);
    for (const BlockSide& blockSide : m_blockSides[b]) {
        const JointRef& joint = m_joints[blockSide.joint];
        const int frame = joint.sides[size_t(blockSide.side)].frame;
        const SpatialVec* D = joint.rowsOf(blockSide.side);
        for (int k = 0; k < joint.numRows(); ++k)
            setColumn(b, frame, blockSide.firstColumn + k, D[k], block);
    }
}

void MultibodyEquations::setColumn(int b, int frame, int column, const SpatialVec& d,
                                   NewtonSystem::Block& block) const {
    const size_t k = size_t(column);
    if (block.part < 0)
        m_blocks[size_t(b)]->addInRow(frame, d, block.Gt.data() + k * size_t(block.size));
    else
        m_flexible[size_t(b)]->calcColumn(frame, d, block.Gt.data() + 6 * k,
                                          block.coefficients.data() + 6 * k);
}

void MultibodyEquations::formElementColumns(const NewtonFactors& factors,
                                            NewtonSystem& system) const {
    if (m_numElementRows == 0) return;
    for (ElementRef& element : m_elements) {
        if (element.signs.empty()) continue;
        element.element->calcJacobian(m_time, element.motions, factors.stiffness, element.signs,
                                      element.directions);
        for (unsigned i = 0; i < element.signs.size(); ++i)
            system.compliance[size_t(element.firstRow) + i] = element.signs[i];
    }
    for (int b = 0; b < numBlocks(); ++b) {
        NewtonSystem::Block& block = system.blocks[size_t(b)];
        for (const ElementSide& side : m_elementSides[size_t(b)]) {
            const ElementRef& element = m_elements[size_t(side.element)];
            const unsigned count = element.motions.size();
            const int frame = element.frames[size_t(side.attachment)].frame;
            for (unsigned i = 0; i < element.signs.size(); ++i)
                setColumn(b, frame, side.firstColumn + int(i),
                          element.directions[i * count + unsigned(side.attachment)], block);
        }
    }
}

void MultibodyEquations::formDifferencedColumns(const NewtonFactors& factors,
                                                NewtonSystem& system) const {
    if (m_differenced.empty()) return;
    const auto start = Clock::now();
    const Vector_<SpatialVec> bodyForces(m_system.getMatterSubsystem().getNumBodies(),
                                         SpatialVec(Vec3(0), Vec3(0)));
    Vector mobilityForces(m_numSimbodyU, Real(0));
    std::vector<double> column;
    for (DifferencedForce& forces : m_differenced) {
        if (forces.ownBlock >= 0) continue;
        ForceDifferences& differences = forces.differences;
        differences.calcTerms(m_private, factors.stiffness);
        for (int term = 0; term < differences.getNumTerms(); ++term)
            system.compliance[size_t(forces.firstRow + term)] = differences.getSign(term);
        for (const DifferencedForce::Side& side : forces.sides) {
            NewtonSystem::Block& block = system.blocks[size_t(side.block)];
            for (int term = 0; term < differences.getNumTerms(); ++term) {
                for (int k : side.speeds)
                    mobilityForces[differences.getSpeeds()[size_t(k)].u] =
                        -differences.getDirection(term, k);
                column.assign(size_t(block.size), 0.0);
                m_blocks[size_t(side.block)]->subtractSimbodyForces(bodyForces, mobilityForces,
                                                                    column.data());
                const int rows = block.part < 0 ? block.size : 6;
                std::copy_n(column.data(), rows,
                            block.Gt.data() + size_t(side.firstColumn + term) * size_t(rows));
                for (int k : side.speeds) mobilityForces[differences.getSpeeds()[size_t(k)].u] = 0;
            }
        }
    }
    m_simbodySeconds += std::chrono::duration<double>(Clock::now() - start).count();
}

void MultibodyEquations::formSimbodyColumns(MotionLevel level, NewtonSystem& system) const {
    if (m_constraints) {
        std::vector<SimbodyConstraints::RowForces> rows;
        m_constraints->calcRowForces(*m_now, rows);
        Vector_<SpatialVec> bodyForces(m_system.getMatterSubsystem().getNumBodies(),
                                       SpatialVec(Vec3(0), Vec3(0)));
        Vector mobilityForces(m_numSimbodyU, Real(0));
        for (int b = 0; b < numBlocks(); ++b)
            for (const auto& [row, column] : m_simbodyColumns[size_t(b)]) {
                NewtonSystem::Block& block = system.blocks[size_t(b)];
                double* Gt = block.Gt.data() + size_t(column) * size_t(block.size);
                std::fill_n(Gt, block.size, 0.0);
                const MotionLevel own = m_constraints->getLevel(row);
                const bool takesPart = own == MotionLevel::Position ||
                                       level == MotionLevel::Acceleration || own == level;
                if (!takesPart) continue;
                // Constraint forces stand left of the equations' sign.
                const SimbodyConstraints::RowForces& forces = rows[size_t(row)];
                for (const auto& [body, force] : forces.bodies) bodyForces[body] -= force;
                for (const auto& [speed, force] : forces.speeds) mobilityForces[speed] -= force;
                m_blocks[size_t(b)]->subtractSimbodyForces(bodyForces, mobilityForces, Gt);
                for (const auto& [body, force] : forces.bodies)
                    bodyForces[body] = SpatialVec(Vec3(0), Vec3(0));
                for (const auto& [speed, force] : forces.speeds) mobilityForces[speed] = 0;
            }
    }
    if (m_prescribed)
        for (int b = 0; b < numBlocks(); ++b)
            if (m_prescribed->touches(m_blocks[size_t(b)]->firstU, m_blocks[size_t(b)]->numU))
                m_prescribed->mask(level, m_blocks[size_t(b)]->firstU, system.blocks[size_t(b)]);
}

void MultibodyEquations::calcLoadResidual(const LoadedBlock& loaded, const double* q,
                                          const double* u, double* r) {
    Block& block = *m_blocks[size_t(loaded.block)];
    FlexibleBlock::calcShapeProducts(loaded.flexible, q, u);
    block.realize(m_context, q + block.firstQ, u + block.firstU);
    std::fill_n(r, block.numU, 0.0);
    if (block.hasLoads()) block.subtractLoads(m_context, q + block.firstQ, r);
    for (int e : loaded.elements) {
        ElementRef& element = m_elements[size_t(e)];
        const int frame = element.frames[0].frame;
        element.motions[0] = block.frames[size_t(frame)];
        calcElementForces(element, m_functions.get(), element.forces);
        if (m_loadFraction != 1) element.forces[0] *= m_loadFraction;
        block.subtractForce(frame, element.forces[0], r);
    }
}

void MultibodyEquations::addInLoadJacobian(const LoadedBlock& loaded, const NewtonFactors& factors,
                                           const double* q, const double* u,
                                           NewtonSystem::Block& block) {
    const Block& own = *m_blocks[size_t(loaded.block)];
    const size_t n = size_t(own.numU), nq = size_t(own.numQ);
    const double *ownQ = q + own.firstQ, *ownU = u + own.firstU;
    auto& [movedQ, wholeQ, wholeU, r, r0] = m_loadScratch;
    block.form = NewtonSystem::Block::Form::General;
    // While the block still stands at q.
    std::fill_n(r.begin(), n, 0.0);
    for (size_t j = 0; j < n; ++j) {
        double* moved = movedQ.data() + j * nq;
        std::copy_n(ownQ, nq, moved);
        r[j] = loaded.steps[j];
        own.moveQ(m_context, r.data(), moved);
        r[j] = 0;
    }
    calcLoadResidual(loaded, q, u, r0.data());
    double *atQ = wholeQ.data() + own.firstQ, *atU = wholeU.data() + own.firstU;
    std::copy_n(ownU, n, atU);
    for (size_t j = 0; j < n; ++j) {
        const double h = loaded.steps[j];
        std::copy_n(movedQ.data() + j * nq, nq, atQ);
        atU[j] += h / factors.stiffness;
        calcLoadResidual(loaded, wholeQ.data(), wholeU.data(), r.data());
        atU[j] = ownU[j];
        for (size_t i = 0; i < n; ++i)
            block.matrix[i + j * n] += factors.stiffness / h * (r[i] - r0[i]);
    }
    calcLoadResidual(loaded, q, u, r0.data());  // back to where it stood
}

void MultibodyEquations::formNewtonSystem(const NewtonFactors& factors, bool dense, const double* q,
                                          const double* u, const double* uDot, NewtonSystem& system,
                                          MotionLevel level) {
    updateJacobians();
    for (size_t p = 0; p < m_parts.size(); ++p)
        m_flexible[size_t(m_parts[p].firstBlock)]->calcDiagonal(factors,
                                                                system.parts[p].diagonal.data());
    const int count = numBlocks();
    parallelFor(count, m_numThreads, [&](int b) {
        const int first = m_blocks[b]->firstU;
        m_blocks[b]->formNewtonBlock(factors, dense, u + first, uDot + first, system.blocks[b]);
        formConstraintBlock(b, system.blocks[b]);
    });
    formElementColumns(factors, system);
    if (dense && level == MotionLevel::Acceleration && m_hasTreeDerivatives) {
        addInTreeDerivatives(factors, system);
    } else {
        formDifferencedColumns(factors, system);
        if (level == MotionLevel::Acceleration) addInDifferencedMatrices(factors, system);
        if (dense && level == MotionLevel::Acceleration)
            for (const LoadedBlock& loaded : m_loadedBlocks)
                addInLoadJacobian(loaded, factors, q, u, system.blocks[size_t(loaded.block)]);
    }
    formSimbodyColumns(level, system);
}

std::vector<int> MultibodyEquations::listOwnRows(const DifferencedForce& forces) const {
    const SimbodyMatterSubsystem& matter = m_system.getMatterSubsystem();
    std::vector<int> rows;
    for (const ForceDifferences::Speed& speed : forces.differences.getSpeeds()) {
        const int first = matter.getMobilizedBody(speed.body).getFirstUIndex(m_private);
        rows.push_back(
            m_rigid[size_t(forces.ownBlock - numFlexibleBlocks())]->findSlots(speed.body).u0 +
            speed.u - first);
    }
    return rows;
}

void MultibodyEquations::addInDifferencedMatrices(const NewtonFactors& factors,
                                                  NewtonSystem& system) const {
    const auto start = Clock::now();
    for (DifferencedForce& forces : m_differenced) {
        if (forces.ownBlock < 0) continue;
        const Eigen::MatrixXd& A = forces.differences.calcMatrix(m_private, factors.stiffness);
        const std::vector<int> rows = listOwnRows(forces);
        NewtonSystem::Block& block = system.blocks[size_t(forces.ownBlock)];
        block.form = NewtonSystem::Block::Form::General;
        for (size_t j = 0; j < rows.size(); ++j)
            for (size_t i = 0; i < rows.size(); ++i)
                block.matrix[size_t(rows[i] + rows[j] * block.size)] += A(int(i), int(j));
    }
    m_simbodySeconds += std::chrono::duration<double>(Clock::now() - start).count();
}

bool MultibodyEquations::differentiateTrees(const double* q, const double* u, const double* uDot) {
    // Small against contacts' depths and the speeds at which friction turns round.
    constexpr double Shift = 1e-8, Speed = 1e-7;  // [m], [m/s]
    const double time = m_time;
    const size_t numU = size_t(m_numU);
    const std::vector<double> lambda(size_t(m_numMultipliers), 0);
    std::vector<double> r0(numU), r(numU), movedQ(q, q + m_numQ), movedU(u, u + numU), delta(numU);
    bool isFinite = true;
    // Elements with terms of their own have them already.
    const auto evaluate = [&](const double* atQ, const double* atU, double* residual) {
        realize(time, atQ, atU);
        for (ElementRef& element : m_elements)
            if (!element.signs.empty())
                for (SpatialVec& force : element.forces) force = SpatialVec(Vec3(0), Vec3(0));
        calcResidual(atQ, atU, uDot, lambda.data(), residual);
    };
    evaluate(q, u, r0.data());
    const auto visitSpeeds = [&](double size, auto&& matrixOf, const auto& move) {
        for (TreeDerivatives& tree : m_treeDerivatives) {
            const Block& block = *m_blocks[size_t(tree.block)];
            const size_t n = size_t(block.numU), first = size_t(block.firstU);
            for (size_t j = 0; j < n; ++j) {
                double h = size / std::max(m_metres[first + j], 1e-3);
                h = move(first + j, h);
                for (size_t i = 0; i < n; ++i) {
                    const double slope = (r[first + i] - r0[first + i]) / h;
                    isFinite = isFinite && std::isfinite(slope);
                    matrixOf(tree)[i + j * n] = slope;
                }
            }
        }
    };
    visitSpeeds(
        Speed, [](TreeDerivatives& tree) -> std::vector<double>& { return tree.byU; },
        [&](size_t speed, double h) {
            movedU[speed] = u[speed] + h;
            evaluate(q, movedU.data(), r.data());
            h = movedU[speed] - u[speed];
            movedU[speed] = u[speed];
            return h;
        });
    realize(time, q, u);
    visitSpeeds(
        Shift, [](TreeDerivatives& tree) -> std::vector<double>& { return tree.byQ; },
        [&](size_t speed, double h) {
            std::copy_n(q, m_numQ, movedQ.begin());
            if (asksForN()) realize(time, q, u);
            delta[speed] = h;
            displaceQ(delta.data(), movedQ.data());
            delta[speed] = 0;
            evaluate(movedQ.data(), u, r.data());
            return h;
        });
    realize(time, q, u);
    m_hasTreeDerivatives = isFinite;
    return isFinite;
}

void MultibodyEquations::addInTreeDerivatives(const NewtonFactors& factors,
                                              NewtonSystem& system) const {
    for (const TreeDerivatives& tree : m_treeDerivatives) {
        NewtonSystem::Block& block = system.blocks[size_t(tree.block)];
        block.form = NewtonSystem::Block::Form::General;
        for (size_t k = 0; k < tree.byQ.size(); ++k)
            block.matrix[k] += tree.byU[k] + factors.stiffness * tree.byQ[k];
    }
}

void MultibodyEquations::formMassSystem(NewtonSystem& system) const {
    updateJacobians();
    for (NewtonSystem::Part& part : system.parts)
        std::fill(part.diagonal.begin(), part.diagonal.end(), 1.0);
    parallelFor(numBlocks(), m_numThreads, [&](int b) {
        m_blocks[b]->formMassBlock(system.blocks[b]);
        formConstraintBlock(b, system.blocks[b]);
    });
    // Springs and dampers have no part in accelerations.
    for (int b = 0; b < numBlocks(); ++b)
        for (const ElementSide& side : m_elementSides[size_t(b)])
            for (unsigned i = 0; i < m_elements[size_t(side.element)].signs.size(); ++i)
                setColumn(b, m_elements[size_t(side.element)].frames[size_t(side.attachment)].frame,
                          side.firstColumn + int(i), SpatialVec(Vec3(0), Vec3(0)),
                          system.blocks[size_t(b)]);
    for (const DifferencedForce& forces : m_differenced)
        for (const DifferencedForce::Side& side : forces.sides) {
            NewtonSystem::Block& block = system.blocks[size_t(side.block)];
            const int rows = block.part < 0 ? block.size : 6;
            std::fill_n(block.Gt.data() + size_t(side.firstColumn) * size_t(rows),
                        rows * forces.differences.getNumTerms(), 0.0);
        }
    formSimbodyColumns(MotionLevel::Acceleration, system);
}

void MultibodyEquations::addInCouplingForces(const double* uDot, Vector_<SpatialVec>& bodyForces,
                                             Vector& mobilityForces) const {
    for (const FlexibleBlock* block : m_flexible)
        block->addInCouplingForces(uDot + block->firstU, bodyForces, mobilityForces);
}

//---------------------------------------------------------------------------------------------------------
// coordinates

void MultibodyEquations::integrateQ(const double* qHist, double gamma, const double* u,
                                    double* q) const {
    parallelFor(numBlocks(), m_numThreads, [&](int b) {
        const Block& block = *m_blocks[size_t(b)];
        block.integrateQ(m_context, qHist + block.firstQ, gamma, u + block.firstU,
                         q + block.firstQ);
    });
}

void MultibodyEquations::calcQDot(const double* q, const double* u, double* qDot) const {
    for (const auto& block : m_blocks)
        block->calcQDot(m_context, q + block->firstQ, u + block->firstU, qDot + block->firstQ);
}

void MultibodyEquations::displaceQ(const double* delta, double* q) const {
    parallelFor(numBlocks(), m_numThreads, [&](int b) {
        const Block& block = *m_blocks[size_t(b)];
        block.displaceQ(m_context, delta + block.firstU, q + block.firstQ);
    });
}

void MultibodyEquations::moveQ(const double* delta, double* q) const {
    for (const auto& block : m_blocks)
        block->moveQ(m_context, delta + block->firstU, q + block->firstQ);
}

void MultibodyEquations::normalizeQ(double* q) const {
    for (const auto& block : m_blocks) block->normalizeQ(q + block->firstQ);
}

double MultibodyEquations::calcDisplacement(const double* delta, int* worst) const {
    double largest = 0;
    for (int b = 0; b < numBlocks(); ++b) {
        const double displacement = m_blocks[b]->calcDisplacement(delta + m_blocks[b]->firstU);
        if (displacement <= largest) continue;
        largest = displacement;
        if (worst) *worst = b;
        if (std::isnan(largest)) return largest;
    }
    return largest;
}

void MultibodyEquations::setErrorNorm(Norm norm) {
    m_norm = norm;
}

void MultibodyEquations::setErrorReference(const double* q, const double* u, const double* z) {
    // A value counts as such where it is larger than its unit, 1/weight.
    const auto calcScale = [](double value, double weight) {
        return std::abs(value) * weight > 1 ? 1 / std::abs(value) : weight;
    };
    for (int i = 0; i < m_numZ; ++i) m_zScales[size_t(i)] = calcScale(z[i], m_zWeights[size_t(i)]);
    if (m_norm == Norm::Displacement) {
        m_zScales = m_zWeights;
        return;
    }
    std::copy_n(q, m_numQ, m_referenceQ.begin());
    for (int i = 0; i < m_numU; ++i) m_uScales[size_t(i)] = calcScale(u[i], m_uWeights[size_t(i)]);
}

double MultibodyEquations::calcNorm(int size, const double* values, const double* scales,
                                    int* worst) const {
    double largest = 0, sum = 0;
    for (int i = 0; i < size; ++i) {
        const double value = std::abs(scales ? scales[i] * values[i] : values[i]);
        if (!(value <= largest)) {
            largest = value;
            if (worst) *worst = i;
        }
        sum += value * value;
        if (std::isnan(value)) return value;
    }
    return m_norm == Norm::Infinity || size == 0 ? largest : std::sqrt(sum / size);
}

double MultibodyEquations::calcErrorSize(const double* deltaQ, const double* deltaU, double h,
                                         int* worst) const {
    double largest = 0;
    if (m_norm != Norm::Displacement) {
        for (const RigidTree* tree : m_rigid)
            tree->weighQ(m_referenceQ.data() + tree->firstQ, m_uWeights.data() + tree->firstU,
                         deltaQ + tree->firstQ, m_weighed.data() + tree->firstQ);
        int worstQ = 0, worstU = 0;
        const double ofQ = calcNorm(m_numQ, m_weighed.data(), nullptr, &worstQ);
        const double ofU = calcNorm(m_numU, deltaU, m_uScales.data(), &worstU);
        for (int b = 0; worst && b < numBlocks(); ++b)
            if (ofQ > ofU ? m_blocks[size_t(b)]->firstQ <= worstQ
                          : m_blocks[size_t(b)]->firstU <= worstU)
                *worst = b;
        return std::isnan(ofQ) ? ofQ : ofU > ofQ || std::isnan(ofU) ? ofU : ofQ;
    }
    for (int b = 0; b < numBlocks(); ++b) {
        const Block& block = *m_blocks[b];
        const double displacement = std::max(block.calcQDisplacement(deltaQ + block.firstQ),
                                             block.calcUDisplacement(deltaU + block.firstU, h));
        if (displacement <= largest) continue;
        largest = displacement;
        if (worst) *worst = b;
        if (std::isnan(largest)) return largest;
    }
    return largest;
}

double MultibodyEquations::calcChangeSize(const double* deltaU, double stiffness,
                                          int* worst) const {
    const double displacement = stiffness * calcDisplacement(deltaU, worst);
    if (m_norm == Norm::Displacement || !std::isfinite(displacement)) return displacement;
    // N W N⁺ δq = γ N W δu, about as large as γ W δu.
    return std::max(stiffness * calcNorm(m_numU, deltaU, m_uWeights.data(), nullptr),
                    calcNorm(m_numU, deltaU, m_uScales.data(), nullptr));
}

void MultibodyEquations::getFromState(const State& state, double* q, double* u) const {
    for (const auto& block : m_blocks)
        block->getFromState(state, q + block->firstQ, u + block->firstU);
}

void MultibodyEquations::putIntoState(double time, const double* q, const double* u,
                                      State& state) const {
    state.setTime(time);
    for (const auto& block : m_blocks)
        block->putIntoState(q + block->firstQ, u + block->firstU, state);
}

Vector MultibodyEquations::calcSimbodyUDot(const double* q, const double* uDot) const {
    Vector simbodyUDot(m_numSimbodyU, Real(0));
    for (const auto& block : m_blocks)
        block->putUDot(q + block->firstQ, uDot + block->firstU, simbodyUDot);
    return simbodyUDot;
}

void MultibodyEquations::takeVariables(const std::vector<DiscreteVarKey>& keys, const State& from) {
    for (State* state : {&m_private, &m_zState, &m_timedState})
        if (state->getNumSubsystems() > 0) copyVariables(keys, from, *state);
    for (DifferencedForce& forces : m_differenced) forces.differences.takeVariables(keys, from);
    updateGravity(from);
    m_prescribedTime = NaN;
}

//---------------------------------------------------------------------------------------------------------
// auxiliary variables

void MultibodyEquations::setZ(const double* z) {
    if (numZ() == 0) return;
    Vector& stateZ = m_private.updZ();
    std::copy_n(z, numZ(), &stateZ[0]);
}

void MultibodyEquations::calcZDot(const double* q, const double* u, const double* uDot,
                                  const double* z, double* zDot) {
    if (numZ() == 0) return;
    const auto start = Clock::now();
    putIntoState(m_time, q, u, m_zState);
    std::copy_n(z, numZ(), &m_zState.updZ()[0]);
    if (m_guts) m_guts->setKnownAccelerations(m_zState, calcSimbodyUDot(q, uDot));
    m_system.realize(m_zState, Stage::Acceleration);
    const Vector& stateZDot = m_zState.getZDot();
    for (int i = 0; i < numZ(); ++i) zDot[i] = stateZDot[i];
    m_simbodySeconds += std::chrono::duration<double>(Clock::now() - start).count();
}

double MultibodyEquations::calcZError(const double* deltaZ) const {
    double largest = 0;
    if (m_norm == Norm::RootMeanSquare) return calcNorm(m_numZ, deltaZ, m_zScales.data(), nullptr);
    for (int i = 0; i < numZ(); ++i)
        largest = std::max(largest, std::abs(m_zScales[size_t(i)] * deltaZ[i]));
    return largest;
}

bool MultibodyEquations::asksForN() const {
    return std::any_of(m_rigid.begin(), m_rigid.end(),
                       [](const RigidTree* tree) { return tree->asksForN(); });
}

void MultibodyEquations::followPose() {
    for (RigidTree* tree : m_rigid) tree->followPose();
}

void MultibodyEquations::visit(Checkpoint& checkpoint) {
    for (const auto& block : m_blocks) block->visit(checkpoint);
    checkpoint.visit(m_hasTreeDerivatives);
    if (m_hasTreeDerivatives)
        for (TreeDerivatives& tree : m_treeDerivatives) checkpoint.visit(tree.byQ, tree.byU);
    if (m_prescribed) {
        checkpoint.visit(m_prescribedTime);
        m_prescribed->visit(checkpoint);
    }
    if (checkpoint.isReading()) m_functions.forget();
    if (!m_needsSimbody) return;
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
    m_private.setTime(time);
    m_system.realize(m_private, m_hasForeignForces ? Stage::Dynamics : Stage::Velocity);
}

}  // namespace simflex
