#include "simflex/solver/equations/LoadTerms.h"

#include <algorithm>

#include "simflex/solver/equations/FlexibleBlock.h"

namespace simflex {

using namespace SimTK;

LoadTerms::LoadTerms(const Topology& topology, Blocks& blocks, const FunctionsOfTime& functions)
    : m_topology(topology), m_blocks(blocks), m_functions(functions) {
    for (const Topology::Element& element : topology.elements) {
        const unsigned frames = unsigned(element.frames.size());
        Workspace workspace;
        workspace.motions.resize(frames);
        workspace.forces.resize(frames);
        workspace.signs.resize(unsigned(element.numTerms), Real(1));
        workspace.directions.resize(unsigned(element.numRows()) * frames);
        m_workspaces.push_back(workspace);
    }
    m_states.resize(topology.states.size());
    for (size_t i = 0; i < m_states.size(); ++i)
        m_states[i] = topology.states[i].equation->getInitialValue();
    size_t mostU = 0, mostMoved = 0;
    for (const Topology::LoadedBlock& loaded : topology.loadedBlocks) {
        const Block& block = *blocks.all[size_t(loaded.block)];
        mostU = std::max(mostU, size_t(block.numU));
        mostMoved = std::max(mostMoved, size_t(block.numU) * size_t(block.numQ));
    }
    if (topology.loadedBlocks.empty()) return;
    m_scratch.movedQ.resize(mostMoved);
    m_scratch.q.resize(size_t(topology.numQ));
    m_scratch.u.resize(size_t(topology.numU));
    m_scratch.r.resize(mostU);
    m_scratch.r0.resize(mostU);
}

void LoadTerms::calcForces(int e, const TimeValues& values, const Array_<FrameMotion>& motions,
                           Forces& forces) const {
    const Topology::Element& element = m_topology.elements[size_t(e)];
    for (SpatialVec& force : forces) force = SpatialVec(Vec3(0), Vec3(0));
    element.element->addInForces(inputsAt(values.time), motions, forces);
    element.element->addInTimedForce(values.forces[size_t(element.timedForce)], motions, forces);
}

void LoadTerms::setStates(const double* z) {
    std::copy_n(z + m_topology.firstZ, m_states.size(), m_states.begin());
}

const Array_<FrameMotion>& LoadTerms::findFrames(const Topology::StateEquationRef& state) {
    m_stateFrames.resize(unsigned(state.frames.size()));
    for (size_t k = 0; k < state.frames.size(); ++k)
        m_stateFrames[unsigned(k)] = m_blocks.motionOf(state.frames[k]);
    return m_stateFrames;
}

void LoadTerms::startStates(double* z) {
    for (size_t i = 0; i < m_states.size(); ++i) {
        double& value = z[size_t(m_topology.firstZ) + i];
        const Topology::StateEquationRef& state = m_topology.states[i];
        value = m_states[i] = state.equation->calcStart(inputsNow(), value, findFrames(state));
    }
}

void LoadTerms::countTurns(double* z) {
    if (!m_topology.countsTurns) return;
    for (size_t i = 0; i < m_states.size(); ++i) {
        const Topology::StateEquationRef& state = m_topology.states[i];
        double& value = z[size_t(m_topology.firstZ) + i];
        if (state.equation->countsTurns())
            value = state.equation->calcStart(inputsNow(), value, findFrames(state));
    }
}

void LoadTerms::calcStateRates(double* zDot) {
    for (size_t i = 0; i < m_states.size(); ++i) {
        const Topology::StateEquationRef& state = m_topology.states[i];
        zDot[size_t(m_topology.firstZ) + i] =
            state.equation->calcRate(inputsNow(), findFrames(state));
    }
}

void LoadTerms::calcStateSlopes(Eigen::MatrixXd& F) {
    const size_t count = m_states.size();
    F.resize(Eigen::Index(count), Eigen::Index(count));
    std::vector<double> slopes(count);
    for (size_t i = 0; i < count; ++i) {
        std::fill(slopes.begin(), slopes.end(), 0.0);
        const Topology::StateEquationRef& state = m_topology.states[i];
        state.equation->addInStateSlopes(inputsNow(), findFrames(state), slopes.data());
        for (size_t j = 0; j < count; ++j) F(Eigen::Index(i), Eigen::Index(j)) = slopes[j];
    }
}

void LoadTerms::realize() {
    for (size_t e = 0; e < m_workspaces.size(); ++e) {
        const Topology::Element& element = m_topology.elements[e];
        Workspace& workspace = m_workspaces[e];
        for (size_t k = 0; k < element.frames.size(); ++k)
            workspace.motions[unsigned(k)] = m_blocks.motionOf(element.frames[k]);
        calcForcesAt(int(e), workspace.motions, workspace.forces);
    }
}

void LoadTerms::calcForcesAt(int e, const Array_<FrameMotion>& motions, Forces& forces) const {
    calcForces(e, m_functions.get(), motions, forces);
    // Elements with stiffness are no loads.
    const double fraction = m_blocks.context.loadFraction;
    if (fraction != 1 && m_topology.elements[size_t(e)].isLoad())
        for (SpatialVec& force : forces) force *= fraction;
}

void LoadTerms::clearStiffForces() {
    for (Workspace& workspace : m_workspaces)
        if (!workspace.directions.empty())
            for (SpatialVec& force : workspace.forces) force = SpatialVec(Vec3(0), Vec3(0));
}

void LoadTerms::subtractForces(double* r) const {
    for (size_t e = 0; e < m_workspaces.size(); ++e) {
        const std::vector<FrameRef>& frames = m_topology.elements[e].frames;
        for (size_t k = 0; k < frames.size(); ++k)
            m_blocks.subtractForce(frames[k], m_workspaces[e].forces[unsigned(k)], r);
    }
}

void LoadTerms::subtractForcesAt(const TimeValues& values, const double* q, double* r) {
    EvaluationContext context = m_blocks.context;
    context.timeValues = &values;
    for (FlexibleBlock* block : m_blocks.flexible)
        if (block->hasLoads()) block->subtractLoads(context, q + block->firstQ, r + block->firstU);
    for (size_t e = 0; e < m_workspaces.size(); ++e) {
        const std::vector<FrameRef>& frames = m_topology.elements[e].frames;
        m_trial.resize(unsigned(frames.size()));
        calcForces(int(e), values, m_workspaces[e].motions, m_trial);
        for (size_t k = 0; k < frames.size(); ++k)
            m_blocks.subtractForce(frames[k], m_trial[unsigned(k)], r);
    }
}

void LoadTerms::addInPower(double& power) const {
    for (size_t e = 0; e < m_workspaces.size(); ++e)
        power += m_topology.elements[e].element->calcPower(inputsNow(), m_workspaces[e].motions,
                                                           m_workspaces[e].forces);
}

void LoadTerms::balancePairs(const Topology::Element& element, Forces& directions) {
    const unsigned frames = unsigned(element.frames.size());
    for (int i = 0; i < element.numPairs; ++i) {
        SpatialVec* l = &directions[unsigned(element.numTerms + 2 * i) * frames];
        SpatialVec* r = l + frames;
        const auto calcLength = [&](const SpatialVec* d) {
            Real sum = 0;
            for (unsigned k = 0; k < frames; ++k) sum += d[k][0].normSqr() + d[k][1].normSqr();
            return std::sqrt(sum);
        };
        const Real ofL = calcLength(l), ofR = calcLength(r);
        const Real factor = ofL > 0 && ofR > 0 ? std::sqrt(ofR / ofL) : 0;
        for (unsigned k = 0; k < frames; ++k) {
            l[k] *= factor;
            r[k] *= factor > 0 ? 1 / factor : 0;
        }
    }
}

void LoadTerms::formColumns(const NewtonFactors& factors, NewtonSystem& system) {
    for (size_t e = 0; e < m_workspaces.size(); ++e) {
        const Topology::Element& element = m_topology.elements[e];
        Workspace& workspace = m_workspaces[e];
        if (element.isLoad()) continue;
        element.element->calcJacobian(inputsNow(), workspace.motions, factors.stiffness,
                                      workspace.signs, workspace.directions);
        balancePairs(element, workspace.directions);
        for (unsigned i = 0; i < workspace.signs.size(); ++i)
            system.compliance[size_t(element.firstRow) + i] = workspace.signs[i];
    }
    for (int b = 0; b < m_topology.numBlocks(); ++b)
        for (const Topology::BlockSide& side : m_topology.elementSides[size_t(b)]) {
            const Topology::Element& element = m_topology.elements[size_t(side.owner)];
            const Workspace& workspace = m_workspaces[size_t(side.owner)];
            const unsigned count = workspace.motions.size();
            for (int i = 0; i < element.numRows(); ++i)
                m_blocks.setColumn(b, element.frames[size_t(side.side)].frame, side.firstColumn + i,
                                   workspace.directions[unsigned(i) * count + unsigned(side.side)],
                                   system.blocks[size_t(b)]);
        }
}

void LoadTerms::clearColumns(NewtonSystem& system) const {
    for (int b = 0; b < m_topology.numBlocks(); ++b)
        for (const Topology::BlockSide& side : m_topology.elementSides[size_t(b)]) {
            const Topology::Element& element = m_topology.elements[size_t(side.owner)];
            for (int i = 0; i < element.numRows(); ++i)
                m_blocks.setColumn(b, element.frames[size_t(side.side)].frame, side.firstColumn + i,
                                   SpatialVec(Vec3(0), Vec3(0)), system.blocks[size_t(b)]);
        }
}

void LoadTerms::calcResidual(const Topology::LoadedBlock& loaded, const double* q, const double* u,
                             double* r) {
    Block& block = *m_blocks.all[size_t(loaded.block)];
    m_scratch.block.clear();
    if (loaded.block < m_topology.numFlexible)
        m_scratch.block.push_back(m_blocks.flexible[size_t(loaded.block)]);
    FlexibleBlock::calcShapeProducts(m_scratch.block, q, u);
    block.realize(m_blocks.context, q + block.firstQ, u + block.firstU);
    std::fill_n(r, block.numU, 0.0);
    if (block.hasLoads()) block.subtractLoads(m_blocks.context, q + block.firstQ, r);
    for (int e : loaded.elements) {
        Workspace& element = m_workspaces[size_t(e)];
        const int frame = m_topology.elements[size_t(e)].frames[0].frame;
        element.motions[0] = block.frames[size_t(frame)];
        calcForces(e, m_functions.get(), element.motions, element.forces);
        if (m_blocks.context.loadFraction != 1) element.forces[0] *= m_blocks.context.loadFraction;
        block.subtractForce(frame, element.forces[0], r);
    }
}

void LoadTerms::addInJacobian(const Topology::LoadedBlock& loaded, const NewtonFactors& factors,
                              const double* q, const double* u, NewtonSystem::Block& block) {
    const Block& own = *m_blocks.all[size_t(loaded.block)];
    const size_t n = size_t(own.numU), nq = size_t(own.numQ);
    const double *ownQ = q + own.firstQ, *ownU = u + own.firstU;
    auto& [own_, movedQ, wholeQ, wholeU, r, r0] = m_scratch;
    block.form = NewtonSystem::Block::Form::General;
    // While the block is still at q.
    std::fill_n(r.begin(), n, 0.0);
    for (size_t j = 0; j < n; ++j) {
        double* moved = movedQ.data() + j * nq;
        std::copy_n(ownQ, nq, moved);
        r[j] = loaded.steps[j];
        own.moveQ(m_blocks.context, r.data(), moved);
        r[j] = 0;
    }
    calcResidual(loaded, q, u, r0.data());
    double *atQ = wholeQ.data() + own.firstQ, *atU = wholeU.data() + own.firstU;
    std::copy_n(ownU, n, atU);
    for (size_t j = 0; j < n; ++j) {
        const double h = loaded.steps[j];
        std::copy_n(movedQ.data() + j * nq, nq, atQ);
        atU[j] += h / factors.stiffness;
        calcResidual(loaded, wholeQ.data(), wholeU.data(), r.data());
        atU[j] = ownU[j];
        for (size_t i = 0; i < n; ++i)
            block.matrix[i + j * n] += factors.stiffness / h * (r[i] - r0[i]);
    }
    calcResidual(loaded, q, u, r0.data());  // back to its position
}

void LoadTerms::addInJacobians(const NewtonFactors& factors, const double* q, const double* u,
                               NewtonSystem& system) {
    for (const Topology::LoadedBlock& loaded : m_topology.loadedBlocks)
        addInJacobian(loaded, factors, q, u, system.blocks[size_t(loaded.block)]);
}

}  // namespace simflex
