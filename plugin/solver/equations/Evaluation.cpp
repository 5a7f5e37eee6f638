#include "simflex/solver/equations/Evaluation.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "simflex/base/Checkpoint.h"
#include "simflex/base/ParallelFor.h"
#include "simflex/solver/equations/FlexibleBlock.h"
#include "simflex/solver/equations/RigidTree.h"

namespace simflex {

using namespace SimTK;

Evaluation::Evaluation(const MultibodySystem& system, const State& state, Setting setting,
                       const std::vector<ForceSelection>& differentiated)
    : Evaluation(TopologyBuilder::build(system, state, setting, differentiated)) {}

Evaluation::Evaluation(TopologyBuilder::Result parts)
    : m_topology(std::move(parts.topology)),
      m_blocks(std::move(parts.blocks)),
      m_functions(std::move(parts.functions)),
      m_simbody(std::move(parts.simbody)),
      m_joints(*m_topology, *m_blocks, *m_functions),
      m_frictions(*m_topology, *m_blocks, m_joints),
      m_loads(*m_topology, *m_blocks, *m_functions),
      m_trees(*m_topology, *m_blocks),
      m_timedLoads(*m_topology, *m_blocks, *m_simbody, *m_functions),
      m_errorNorm(std::move(parts.errorNorm)) {
    makeGroups();
}

void Evaluation::makeGroups() {
    // As many blocks as fit a core's private cache, but enough groups for some threads.
    constexpr int LargestGroup = 8, FewestGroups = 16;  // batches, groups
    const int numBatches = int(m_topology->batches.size());
    const int size = std::clamp(numBatches / FewestGroups, 1, LargestGroup);
    std::vector<int> groupOf(size_t(m_topology->numBlocks()));
    for (int k = 0; k < numBatches; ++k) {
        if (k % size == 0) m_groups.push_back({k, std::min(k + size, numBatches), {}, {}});
        for (int b : m_topology->batches[size_t(k)]) groupOf[size_t(b)] = int(m_groups.size()) - 1;
    }
    constexpr int None = -1, Several = -2;
    std::vector<int> groupOfJoint;
    for (int j = 0; j < int(m_topology->joints.size()); ++j) {
        int group = None;
        for (const FrameRef& side : m_topology->joints[size_t(j)].sides) {
            if (side.block < 0) continue;
            const int other = groupOf[size_t(side.block)];
            group = group == None || group == other ? other : Several;
        }
        groupOfJoint.push_back(group);
        (group < 0 ? m_jointsBetween : m_groups[size_t(group)].joints).push_back(j);
    }
    for (int b = 0; b < m_topology->numBlocks(); ++b) {
        const std::vector<Topology::BlockSide>& sides = m_topology->blockSides[size_t(b)];
        const bool isInside = std::all_of(sides.begin(), sides.end(), [&](const auto& side) {
            return groupOfJoint[size_t(side.owner)] >= 0;
        });
        (isInside ? m_groups[size_t(groupOf[size_t(b)])].blocks : m_blocksBetween).push_back(b);
    }
}

void Evaluation::require(Stage stage, const char* method) const {
    if (m_stage < stage)
        throw std::logic_error(std::string("Evaluation::") + method + "() before " +
                               (stage == Stage::Residual ? "calcResidual()" : "realize()"));
}

void Evaluation::refusePoint(int block) const {
    throw UnusablePoint("positions or speeds of '" + getBlock(block).name +
                            "' are not finite numbers, or beyond any sense",
                        block);
}

void Evaluation::requireUsable(const double* q, const double* u) const {
    for (int b = 0; b < m_topology->numBlocks(); ++b)
        if (!getBlock(b).isUsable(q + getBlock(b).firstQ, u + getBlock(b).firstU)) refusePoint(b);
}

void Evaluation::prescribe(double time, double gamma, const double* uHist, double* q, double* u) {
    if (m_simbody->getPrescribed()) requireUsable(q, u);
    m_simbody->prescribe(m_functions->clampTime(time), gamma, uHist, q, u);
}

void Evaluation::realize(double time, const double* q, const double* u) {
    m_stage = Stage::Nothing;
    requireUsable(q, u);
    time = m_functions->clampTime(time);
    m_functions->moveTo(time);
    m_simbody->realize(time, q, u);
    realizeBlocks(q, u);
}

void Evaluation::realizeNatively(const State& state, const Vector_<SpatialVec>& bodyForces,
                                 const Vector& mobilityForces, const double* q, const double* u) {
    m_stage = Stage::Nothing;
    m_functions->forget();
    m_functions->moveTo(state.getTime());
    m_simbody->realizeNatively(state, bodyForces, mobilityForces);
    realizeBlocks(q, u);
}

void Evaluation::realizeBlocks(const double* q, const double* u) {
    m_blocks->context.timeValues = &m_functions->get();
    parallelFor(int(m_topology->batches.size()), m_blocks->numThreads,
                [&](int k) { realizeBatch(k, q, u); });
    m_joints.forgetJacobians();
    if (!m_frictions.isEmpty()) {
        m_joints.updateJacobians();
        m_frictions.update();
    }
    m_loads.realize();
    m_stage = Stage::Velocities;
}

void Evaluation::realizeBatch(int batch, const double* q, const double* u) {
    FlexibleBlock::calcShapeProducts(m_blocks->batches[size_t(batch)], q, u);
    for (int b : m_topology->batches[size_t(batch)]) {
        Block& block = *m_blocks->all[size_t(b)];
        block.realize(m_blocks->context, q + block.firstQ, u + block.firstU);
    }
}

void Evaluation::placeBatch(int batch, const BlockVisit& place, const double* q, const double* u,
                            std::atomic<int>& unusable) const {
    for (int b : m_topology->batches[size_t(batch)]) {
        place(b);
        if (!getBlock(b).isUsable(q + getBlock(b).firstQ, u + getBlock(b).firstU)) unusable = b;
    }
}

void Evaluation::calcBatchResidual(int batch, const double* q, const double* u, const double* uDot,
                                   double* r) {
    const std::vector<FlexibleBlock*>& flexible = m_blocks->batches[size_t(batch)];
    if (!flexible.empty())
        return FlexibleBlock::calcResiduals(flexible, m_blocks->context, q, u, uDot, r);
    for (int b : m_topology->batches[size_t(batch)]) {
        Block& block = *m_blocks->all[size_t(b)];
        block.calcResidual(m_blocks->context, q + block.firstQ, u + block.firstU,
                           uDot + block.firstU, r + block.firstU);
    }
}

bool Evaluation::canEvaluateByBlocks() const {
    return !m_topology->needsSimbody && !m_topology->hasForeignForces &&
           !m_simbody->getPrescribed() && m_frictions.isEmpty();
}

template <class OnBatch, class OnJoint, class OnBlock>
void Evaluation::visitGroups(const OnBatch& onBatch, const OnJoint& onJoint,
                             const OnBlock& onBlock) const {
    parallelFor(int(m_groups.size()), m_blocks->numThreads, [&](int g) {
        const Group& group = m_groups[size_t(g)];
        for (int k = group.firstBatch; k < group.endBatch; ++k) onBatch(k);
        for (int j : group.joints) onJoint(j);
        for (int b : group.blocks) onBlock(b);
    });
    parallelFor(int(m_jointsBetween.size()), m_blocks->numThreads,
                [&](int k) { onJoint(m_jointsBetween[size_t(k)]); });
    parallelFor(int(m_blocksBetween.size()), m_blocks->numThreads,
                [&](int k) { onBlock(m_blocksBetween[size_t(k)]); });
}

void Evaluation::moveTo(double time) {
    m_stage = Stage::Nothing;
    m_functions->moveTo(m_functions->clampTime(time));
    m_blocks->context.timeValues = &m_functions->get();
    m_joints.forgetJacobians();
}

void Evaluation::evaluate(double time, MotionLevel level, const NewtonFactors& factors,
                          const BlockVisit& place, const BlockVisit& finish, const double* q,
                          const double* u, const double* uDot, const double* lambda, double* r,
                          double* c) {
    moveTo(time);
    // Element forces come last, because they depend on all positions.
    const bool isFinishedByJoints = m_topology->elements.empty();
    std::atomic<int> unusable{-1};
    visitGroups(
        [&](int k) {
            placeBatch(k, place, q, u, unusable);
            realizeBatch(k, q, u);
            calcBatchResidual(k, q, u, uDot, r);
        },
        [&](int j) { m_joints.update(j, level, c); },
        [&](int b) {
            m_joints.addInForces(b, lambda, r + getBlock(b).firstU);
            if (isFinishedByJoints) finish(b);
        });
    if (unusable >= 0) refusePoint(unusable);
    m_joints.noteJacobians();
    if (level == MotionLevel::Position)
        for (int k = 0; k < m_topology->numMultipliers; ++k) c[k] /= factors.stiffness;
    m_loads.realize();
    m_loads.subtractForces(r);
    if (!isFinishedByJoints) parallelFor(m_topology->numBlocks(), m_blocks->numThreads, finish);
    m_stage = Stage::Residual;
    m_hasInertia = true;
}

void Evaluation::realizePositions(double time, const BlockVisit& place, const double* q,
                                  const double* u, double* g) {
    moveTo(time);
    std::atomic<int> unusable{-1};
    visitGroups(
        [&](int k) {
            placeBatch(k, place, q, u, unusable);
            realizeBatch(k, q, u);
        },
        [&](int j) { m_joints.calcErrors(j, g); }, [](int) {});
    if (unusable >= 0) refusePoint(unusable);
    clearFrictionRows(g);
    m_loads.realize();
    m_stage = Stage::Velocities;
}

void Evaluation::setZ(const double* z) {
    if (!areUsable(z, m_topology->numZ))
        throw UnusablePoint("auxiliary variables z are not finite numbers, or beyond any sense");
    m_simbody->setZ(z);
    m_loads.setStates(z);
}

void Evaluation::calcPrescribedUDot(const double* q, double* uDot) const {
    std::fill_n(uDot, m_topology->numU, 0.0);
    if (m_simbody->getPrescribed()) m_simbody->getPrescribed()->applyAccelerations(q, uDot);
}

void Evaluation::clearFrictionRows(double* rows) const {
    std::fill(rows + m_topology->firstFrictionRow, rows + m_topology->numMultipliers, 0.0);
}

void Evaluation::calcPositionErrors(double* g) const {
    require(Stage::Velocities, "calcPositionErrors");
    m_joints.calcErrors(g);
    clearFrictionRows(g);
    if (const SimbodyConstraints* constraints = m_simbody->getConstraints())
        constraints->calcPositionErrors(m_simbody->getState(), g + m_topology->firstSimbodyRow);
}

void Evaluation::calcVelocityErrors(double* gDot) const {
    require(Stage::Velocities, "calcVelocityErrors");
    m_joints.calcErrorDots(gDot);
    clearFrictionRows(gDot);
    if (const SimbodyConstraints* constraints = m_simbody->getConstraints())
        constraints->calcVelocityErrors(m_simbody->getState(), gDot + m_topology->firstSimbodyRow);
}

void Evaluation::calcStepErrors(MotionLevel level, const NewtonFactors& factors, const double* uDot,
                                const double* q, double* c) const {
    if (level == MotionLevel::Velocity)
        calcVelocityErrors(c);
    else
        calcPositionErrors(c);
    if (level == MotionLevel::Position)
        for (int k = 0; k < m_topology->numMultipliers; ++k) c[k] /= factors.stiffness;
    m_frictions.calcErrors(c);
    const SimbodyConstraints* constraints = m_simbody->getConstraints();
    if (!constraints) return;
    // Rows that are not holonomic are errors at their own level, in terms of Δu.
    double* rows = c + m_topology->firstSimbodyRow;
    std::vector<double> errors(size_t(constraints->numRows()));
    const auto takeRows = [&](MotionLevel which, double factor) {
        for (int k = 0; k < constraints->numRows(); ++k)
            if (constraints->getLevel(k) == which) rows[k] = factor * errors[size_t(k)];
    };
    if (level == MotionLevel::Position) {
        constraints->calcVelocityErrors(m_simbody->getState(), errors.data());
        takeRows(MotionLevel::Velocity, 1);
    }
    if (constraints->hasAccelerationRows()) {
        constraints->calcAccelerationErrors(m_simbody->getState(),
                                            m_blocks->calcSimbodyUDot(q, uDot), errors.data());
        takeRows(MotionLevel::Acceleration, factors.mass);
    }
}

void Evaluation::calcAccelerationErrors(const double* q, const double* u, const double* uDot,
                                        double* gDotDot) {
    require(Stage::Velocities, "calcAccelerationErrors");
    if (const SimbodyConstraints* constraints = m_simbody->getConstraints())
        constraints->calcAccelerationErrors(m_simbody->getState(),
                                            m_blocks->calcSimbodyUDot(q, uDot),
                                            gDotDot + m_topology->firstSimbodyRow);
    m_joints.calcErrorDotDots(u, uDot, gDotDot);
    m_frictions.calcErrorDots(u, uDot, gDotDot);
}

void Evaluation::calcResidual(const double* q, const double* u, const double* uDot,
                              const double* lambda, double* r) {
    require(Stage::Velocities, "calcResidual");
    calcUnclearedResidual(q, u, uDot, lambda, r);
    clearPrescribed(r);
    m_stage = Stage::Residual;
    m_hasInertia = true;
}

void Evaluation::clearPrescribed(double* r) const {
    if (m_simbody->getPrescribed()) m_simbody->getPrescribed()->clearResidual(r);
}

void Evaluation::calcUnknownForces(const double* q, const double* u, const double* uDot,
                                   double* r) {
    require(Stage::Velocities, "calcUnknownForces");
    m_scratch.assign(size_t(m_topology->numMultipliers), 0);
    m_simbody->collectForces(m_scratch.data());
    for (RigidTree* tree : m_blocks->rigid) {
        double* own = r + tree->firstU;
        if (tree->knowsDerivatives())
            std::fill_n(own, tree->numU, 0.0);
        else
            tree->calcResidual(m_blocks->context, q + tree->firstQ, u + tree->firstU,
                               uDot + tree->firstU, own);
        m_simbody->subtractForces(*tree, own);
    }
    m_loads.subtractForces(r);
    clearPrescribed(r);
}

void Evaluation::calcUnclearedResidual(const double* q, const double* u, const double* uDot,
                                       const double* lambda, double* r) {
    m_joints.updateJacobians();
    m_simbody->collectForces(lambda);
    parallelFor(int(m_topology->batches.size()), m_blocks->numThreads, [&](int k) {
        calcBatchResidual(k, q, u, uDot, r);
        for (int b : m_topology->batches[size_t(k)]) {
            double* own = r + getBlock(b).firstU;
            m_joints.addInForces(b, lambda, own);
            m_simbody->subtractForces(*m_blocks->all[size_t(b)], own);
        }
    });
    m_frictions.addInForces(lambda, r);
    m_loads.subtractForces(r);
}

double Evaluation::calcMomentum(const double* q, const double* u, const double* jump,
                                const double* impulses, double* momentum) {
    require(Stage::Velocities, "calcMomentum");
    const size_t nu = size_t(m_topology->numU);
    const std::vector<double> none(std::max(nu, size_t(m_topology->numMultipliers)), 0);
    m_scratch.resize(nu);
    calcUnclearedResidual(q, u, none.data(), none.data(), m_scratch.data());
    calcUnclearedResidual(q, u, jump, impulses, momentum);
    m_stage = Stage::Residual;
    m_hasInertia = true;
    double largest = 0;
    for (size_t i = 0; i < nu; ++i) {
        largest = std::max({largest, std::abs(momentum[i]), std::abs(m_scratch[i])});
        momentum[i] -= m_scratch[i];
    }
    constexpr double RoundOff = 1e-13;
    return RoundOff * largest;
}

bool Evaluation::canHavePower() const {
    const PrescribedMotion* prescribed = m_simbody->getPrescribed();
    return (prescribed && prescribed->canWork()) || m_simbody->getConstraints() ||
           !m_topology->elements.empty() || m_topology->numFlexible > 0 ||
           !m_topology->joints.empty();
}

double Evaluation::calcPower(const double* q, const double* u, const double* uDot,
                             const double* lambda) {
    require(Stage::Velocities, "calcPower");
    Real power = 0;
    const PrescribedMotion* prescribed = m_simbody->getPrescribed();
    if (prescribed && prescribed->canWork()) {
        m_scratch.resize(size_t(m_topology->numU));
        calcUnclearedResidual(q, u, uDot, lambda, m_scratch.data());
        power += prescribed->calcPower(m_scratch.data(), u);
    }
    if (const SimbodyConstraints* constraints = m_simbody->getConstraints())
        power +=
            constraints->calcPower(m_simbody->getState(), lambda + m_topology->firstSimbodyRow);
    m_loads.addInPower(power);
    m_blocks->addInPower(q, u, power);
    m_joints.addInPower(lambda, power);
    m_frictions.addInPower(lambda, power);
    return power;
}

void Evaluation::calcTimedLoads(double time, const NewtonFactors& factors, const double* q,
                                const double* u, const double* uDot, double* r, double* g) {
    require(Stage::Velocities, "calcTimedLoads");
    requireUsable(q, u);
    m_timedLoads.calc(time, factors, q, u, uDot, m_joints, m_loads, r, g);
}

void Evaluation::calcTimedMotions(double time, double* q, double* u) {
    requireUsable(q, u);
    m_timedLoads.calcMotions(time, q, u);
}

void Evaluation::calcZDot(const double* q, const double* u, const double* uDot, const double* z,
                          double* zDot) {
    if (m_topology->hasForeignZ()) requireUsable(q, u);
    m_simbody->calcZDot(m_functions->get().time, q, u, uDot, z, zDot);
    m_loads.calcStateRates(zDot);
}

void Evaluation::formNewtonSystem(const NewtonFactors& factors, bool dense, const double* q,
                                  const double* u, const double* uDot, NewtonSystem& system,
                                  MotionLevel level) {
    require(m_hasInertia ? Stage::Velocities : Stage::Residual, "formNewtonSystem");
    m_joints.updateJacobians();
    for (size_t p = 0; p < m_topology->parts.size(); ++p)
        m_blocks->flexible[size_t(m_topology->parts[p].firstBlock)]->calcDiagonal(
            factors, system.parts[p].diagonal.data());
    const BlockDerivatives ofFlexible =
        dense ? BlockDerivatives::Dense : BlockDerivatives::Constant;
    const BlockDerivatives ofTrees =
        level == MotionLevel::Acceleration ? m_trees.choose(dense) : BlockDerivatives::Constant;
    parallelFor(m_topology->numBlocks(), m_blocks->numThreads, [&](int b) {
        Block& block = *m_blocks->all[size_t(b)];
        block.formNewtonBlock(factors, b < m_topology->numFlexible ? ofFlexible : ofTrees,
                              m_blocks->context, q + block.firstQ, u + block.firstU,
                              uDot + block.firstU, system.blocks[size_t(b)]);
        m_joints.formColumns(b, system.blocks[size_t(b)]);
    });
    if (level == MotionLevel::Acceleration)
        m_frictions.form(FrictionTerms::By::Rates, system);
    else
        m_frictions.formReleased(system);
    m_loads.formColumns(factors, system);
    if (dense && level == MotionLevel::Acceleration && m_trees.areKnown()) {
        m_trees.addIn(factors, system);
    } else {
        m_simbody->formDifferencedColumns(factors, system);
        if (level == MotionLevel::Acceleration)
            m_simbody->addInDifferencedMatrices(factors, system);
        if (dense && level == MotionLevel::Acceleration)
            m_loads.addInJacobians(factors, q, u, system);
    }
    m_simbody->formColumns(level, system);
}

void Evaluation::formMassSystem(NewtonSystem& system, MotionLevel level) {
    require(Stage::Residual, "formMassSystem");
    m_joints.updateJacobians();
    for (NewtonSystem::Part& part : system.parts)
        std::fill(part.diagonal.begin(), part.diagonal.end(), 1.0);
    parallelFor(m_topology->numBlocks(), m_blocks->numThreads, [&](int b) {
        m_blocks->all[size_t(b)]->formMassBlock(system.blocks[size_t(b)]);
        m_joints.formColumns(b, system.blocks[size_t(b)]);
    });
    if (level == MotionLevel::Acceleration)
        m_frictions.form(FrictionTerms::By::Accelerations, system);
    else
        m_frictions.formReleased(system);
    m_loads.clearColumns(system);
    m_simbody->clearDifferencedColumns(system);
    m_simbody->formColumns(level, system);
}

void Evaluation::addInCouplingForces(const double* uDot, Vector_<SpatialVec>& bodyForces,
                                     Vector& mobilityForces) {
    require(Stage::Residual, "addInCouplingForces");
    for (FlexibleBlock* block : m_blocks->flexible)
        block->addInCouplingForces(uDot + block->firstU, bodyForces, mobilityForces);
}

void Evaluation::takeVariables(const std::vector<DiscreteVarKey>& keys, const State& from) {
    m_simbody->takeVariables(keys, from);
    m_timedLoads.takeVariables(keys, from);
}

void Evaluation::visit(Checkpoint& checkpoint) {
    for (const auto& block : m_blocks->all) block->visit(checkpoint);
    m_trees.visit(checkpoint);
    m_frictions.visit(checkpoint);
    m_simbody->visit(checkpoint);
    if (checkpoint.isReading()) m_functions->forget();
}

}  // namespace simflex
