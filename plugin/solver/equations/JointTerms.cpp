#include "simflex/solver/equations/JointTerms.h"

#include <algorithm>

#include "simflex/base/ParallelFor.h"
#include "simflex/solver/equations/FlexibleBlock.h"

namespace simflex {

using namespace SimTK;

JointTerms::JointTerms(const Topology& topology, const Blocks& blocks,
                       const FunctionsOfTime& functions)
    : m_topology(topology), m_blocks(blocks), m_functions(functions) {
    size_t most = 0, numD = 0;
    for (const Topology::Joint& joint : topology.joints) {
        Workspace workspace;
        for (const FrameRef& side : joint.sides)
            workspace.motions.push_back(&blocks.motionOf(side));
        workspace.firstD = numD;
        numD += joint.sides.size() * size_t(joint.numRows());
        if (joint.record->equations->dependsOnTime()) m_timed.push_back(int(m_workspaces.size()));
        most = std::max(most, joint.sides.size());
        m_workspaces.push_back(std::move(workspace));
    }
    m_D.resize(numD);
    for (const std::vector<Topology::BlockSide>& sides : topology.blockSides) {
        m_firstSide.push_back(int(m_sides.size()));
        for (const Topology::BlockSide& side : sides) {
            const Topology::Joint& joint = topology.joints[size_t(side.owner)];
            const size_t firstD = m_workspaces[size_t(side.owner)].firstD +
                                  size_t(side.side) * size_t(joint.numRows());
            m_sides.push_back({joint.sides[size_t(side.side)].frame, side.firstColumn,
                               joint.firstRow, joint.numRows(), firstD});
        }
    }
    m_firstSide.push_back(int(m_sides.size()));
    m_accelerated.resize(most);
    for (const FrameMotion& motion : m_accelerated) m_acceleratedFrames.push_back(&motion);
}

/** Calls visit(joint, equations, drive, motions) for each joint, in parallel. **/
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
        const Workspace& workspace = m_workspaces[size_t(k)];
        equations.calcJacobian(getDrive(k), workspace.motions.data(), updD(k));
        if (m_isAligning) equations.alignJacobian(getDrive(k), workspace.motions.data(), updD(k));
    });
    m_hasJacobians = true;
}

void JointTerms::update(int k, MotionLevel level, double* errors) {
    const Topology::Joint& joint = m_topology.joints[size_t(k)];
    const JointEquations& equations = *joint.record->equations;
    const FrameMotion* const* motions = m_workspaces[size_t(k)].motions.data();
    if (level == MotionLevel::Position)
        equations.calcErrors(getDrive(k), motions, errors + joint.firstRow);
    else
        equations.calcErrorDots(getDrive(k), motions, errors + joint.firstRow);
    equations.calcJacobian(getDrive(k), motions, updD(k));
}

void JointTerms::calcErrors(double* g) const {
    visitAll([&](const Topology::Joint& joint, const JointEquations& equations,
                 const JointEquations::Drive& drive, const FrameMotion* const* motions) {
        equations.calcErrors(drive, motions, g + joint.firstRow);
        if (m_isAligning) equations.alignErrors(drive, motions, g + joint.firstRow);
    });
}

void JointTerms::calcErrors(int k, double* g) const {
    const Topology::Joint& joint = m_topology.joints[size_t(k)];
    joint.record->equations->calcErrors(getDrive(k), m_workspaces[size_t(k)].motions.data(),
                                        g + joint.firstRow);
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
    for (const int k : m_timed) {
        const Topology::Joint& joint = m_topology.joints[size_t(k)];
        joint.record->equations->calcErrors(values.drives[size_t(joint.drive)],
                                            m_workspaces[size_t(k)].motions.data(),
                                            g + joint.firstRow);
    }
}

void JointTerms::addInForces(int b, const double* lambda, double* r) const {
    for (int s = m_firstSide[size_t(b)]; s < m_firstSide[size_t(b) + 1]; ++s) {
        const Side& side = m_sides[size_t(s)];
        const SpatialVec* D = &m_D[side.firstD];
        SpatialVec force(Vec3(0), Vec3(0));
        for (int k = 0; k < side.numRows; ++k) {
            const double factor = lambda[side.firstRow + k];
            for (int half = 0; half < 2; ++half)
                for (int a = 0; a < 3; ++a) force[half][a] -= factor * D[k][half][a];
        }
        m_blocks.all[size_t(b)]->subtractForce(side.frame, force, r);
    }
}

void JointTerms::formColumns(int b, NewtonSystem::Block& block) const {
    if (block.columns == NewtonSystem::Block::Columns::Own)
        std::fill(block.Gt.begin(), block.Gt.end(), 0.0);
    for (int s = m_firstSide[size_t(b)]; s < m_firstSide[size_t(b) + 1]; ++s) {
        const Side& side = m_sides[size_t(s)];
        for (int k = 0; k < side.numRows; ++k)
            m_blocks.setColumn(b, side.frame, side.firstColumn + k, m_D[side.firstD + size_t(k)],
                               block);
    }
}

void JointTerms::addInPower(const double* lambda, double& power) const {
    for (const int j : m_timed) {
        const Topology::Joint& joint = m_topology.joints[size_t(j)];
        // The joint's forces −Gᵀλ have power −λᵀGu = λᵀ ∂g/∂t.
        double timeRate[JointEquations::MaxEquations] = {};
        joint.record->equations->addInTimeRate(getDrive(j), m_workspaces[size_t(j)].motions.data(),
                                               timeRate);
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
