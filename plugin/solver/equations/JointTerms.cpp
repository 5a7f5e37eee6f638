#include "simflex/solver/equations/JointTerms.h"

#include <algorithm>

#include "simflex/base/ParallelFor.h"
#include "simflex/solver/equations/FlexibleBlock.h"

namespace simflex {

using namespace SimTK;

JointTerms::JointTerms(const Topology& topology, const Blocks& blocks,
                       const FunctionsOfTime& functions)
    : m_topology(topology), m_blocks(blocks), m_functions(functions) {
    size_t most = 0;
    for (const Topology::Joint& joint : topology.joints) {
        Workspace workspace;
        for (const FrameRef& side : joint.sides)
            workspace.motions.push_back(&blocks.motionOf(side));
        workspace.D.resize(joint.sides.size() * size_t(joint.numRows()));
        most = std::max(most, joint.sides.size());
        m_workspaces.push_back(std::move(workspace));
    }
    m_accelerated.resize(most);
    for (const FrameMotion& motion : m_accelerated) m_acceleratedFrames.push_back(&motion);
}

const SpatialVec* JointTerms::rowsOf(const Topology::BlockSide& side) const {
    const size_t numRows = size_t(m_topology.joints[size_t(side.owner)].numRows());
    return &m_workspaces[size_t(side.owner)].D[size_t(side.side) * numRows];
}

/** Calls visit(joint, its equations, its drive, its motions) for each, in parallel. **/
template <class Visit>
void JointTerms::visitAll(Visit visit) const {
    parallelFor(int(m_workspaces.size()), m_blocks.numThreads, [&](int k) {
        const Topology::Joint& joint = m_topology.joints[size_t(k)];
        visit(joint, *joint.record->equations, getDrive(k), m_workspaces[size_t(k)].motions.data());
    });
}

void JointTerms::updateJacobians() {
    if (m_hasJacobians) return;
    parallelFor(int(m_workspaces.size()), m_blocks.numThreads, [&](int k) {
        const JointEquations& equations = *m_topology.joints[size_t(k)].record->equations;
        Workspace& workspace = m_workspaces[size_t(k)];
        equations.calcJacobian(getDrive(k), workspace.motions.data(), workspace.D.data());
        if (m_isAligning)
            equations.alignJacobian(getDrive(k), workspace.motions.data(), workspace.D.data());
    });
    m_hasJacobians = true;
}

void JointTerms::calcErrors(double* g) const {
    visitAll([&](const Topology::Joint& joint, const JointEquations& equations,
                 const JointEquations::Drive& drive, const FrameMotion* const* motions) {
        equations.calcErrors(drive, motions, g + joint.firstRow);
        if (m_isAligning) equations.alignErrors(drive, motions, g + joint.firstRow);
    });
}

void JointTerms::calcErrorDots(double* gDot) const {
    visitAll([&](const Topology::Joint& joint, const JointEquations& equations,
                 const JointEquations::Drive& drive, const FrameMotion* const* motions) {
        equations.calcErrorDots(drive, motions, gDot + joint.firstRow);
    });
}

void JointTerms::calcErrorDotDots(const double* u, const double* uDot, double* gDotDot) {
    for (const std::vector<FlexibleBlock*>& batch : m_blocks.batches)
        FlexibleBlock::calcAccelerationProducts(batch, uDot);
    for (size_t k = 0; k < m_workspaces.size(); ++k) {
        const Topology::Joint& joint = m_topology.joints[k];
        for (size_t side = 0; side < joint.sides.size(); ++side) {
            const FrameRef& ref = joint.sides[side];
            m_accelerated[side] = m_blocks.motionOf(ref);
            if (ref.block < 0) continue;
            const Block& block = *m_blocks.all[size_t(ref.block)];
            m_accelerated[side].A =
                block.calcFrameAcceleration(ref.frame, u + block.firstU, uDot + block.firstU);
        }
        joint.record->equations->calcErrorDotDots(getDrive(int(k)), m_acceleratedFrames.data(),
                                                  gDotDot + joint.firstRow);
    }
}

void JointTerms::calcErrorsAt(const TimeValues& values, double* g) const {
    for (size_t k = 0; k < m_workspaces.size(); ++k) {
        const Topology::Joint& joint = m_topology.joints[k];
        if (joint.record->equations->dependsOnTime())
            joint.record->equations->calcErrors(values.drives[size_t(joint.drive)],
                                                m_workspaces[k].motions.data(), g + joint.firstRow);
    }
}

void JointTerms::addInForces(int b, const double* lambda, double* r) const {
    for (const Topology::BlockSide& side : m_topology.blockSides[size_t(b)]) {
        const Topology::Joint& joint = m_topology.joints[size_t(side.owner)];
        const SpatialVec* D = rowsOf(side);
        SpatialVec force(Vec3(0), Vec3(0));
        for (int k = 0; k < joint.numRows(); ++k) force -= lambda[joint.firstRow + k] * D[k];
        m_blocks.all[size_t(b)]->subtractForce(joint.sides[size_t(side.side)].frame, force, r);
    }
}

void JointTerms::formColumns(int b, NewtonSystem::Block& block) const {
    if (block.columns == NewtonSystem::Block::Columns::Own)
        std::fill(block.Gt.begin(), block.Gt.end(), 0.0);
    for (const Topology::BlockSide& side : m_topology.blockSides[size_t(b)]) {
        const Topology::Joint& joint = m_topology.joints[size_t(side.owner)];
        const SpatialVec* D = rowsOf(side);
        for (int k = 0; k < joint.numRows(); ++k)
            m_blocks.setColumn(b, joint.sides[size_t(side.side)].frame, side.firstColumn + k, D[k],
                               block);
    }
}

void JointTerms::addInPower(const double* lambda, double& power) const {
    for (size_t j = 0; j < m_workspaces.size(); ++j) {
        const Topology::Joint& joint = m_topology.joints[j];
        const JointEquations& equations = *joint.record->equations;
        if (!equations.dependsOnTime()) continue;
        // The joint's forces −Gᵀλ have power −λᵀGu = λᵀ ∂g/∂t.
        double timeRate[JointEquations::MaxEquations] = {};
        equations.addInTimeRate(getDrive(int(j)), m_workspaces[j].motions.data(), timeRate);
        for (int k = 0; k < joint.numRows(); ++k) power += lambda[joint.firstRow + k] * timeRate[k];
    }
}

double JointTerms::calcMisalignment() const {
    double largest = 0;
    for (size_t k = 0; k < m_workspaces.size(); ++k)
        largest =
            std::max<double>(largest, m_topology.joints[k].record->equations->calcMisalignment(
                                          getDrive(int(k)), m_workspaces[k].motions.data()));
    return largest;
}

const std::string* JointTerms::findFlipped() const {
    for (size_t k = 0; k < m_workspaces.size(); ++k) {
        const JointRecord& record = *m_topology.joints[k].record;
        if (record.equations->isFlipped(getDrive(int(k)), m_workspaces[k].motions.data()))
            return &record.name;
    }
    return nullptr;
}

}  // namespace simflex
