// What is seen of a solution: States, accelerations and multipliers at a time.
#include "simflex/solver/integration/ImplicitIntegratorImpl.h"

namespace simflex {

using SimTK::Stage;
using SimTK::State;
using SimTK::Vector;
using Clock = std::chrono::steady_clock;

void ImplicitIntegrator::Implementation::writeState(const SolutionPoint& point,
                                                    State& state) const {
    m_equations->getBlocks().putIntoState(point.t, point.q.data(), point.u.data(), state);
    if (!point.z.empty()) std::copy(point.z.begin(), point.z.end(), &state.updZ()[0]);
    // Of a system that has changed the coordinates and speeds can still be had.
    if (hasSameSystem()) m_system.realize(state, Stage::Velocity);
}

void ImplicitIntegrator::Implementation::showPoint(double t) {
    const auto start_ = Clock::now();
    m_stateIsCurrent = false;
    calcPoint(t, m_visible);
    statistics.outputSeconds += secondsSince(start_);
}

void ImplicitIntegrator::Implementation::calcPoint(double t, SolutionPoint& point) {
    const SolutionPoint& newest = m_history[0];
    if (!isLater(t, newest.t)) {
        point = newest;
        // An event at t must not stay ahead of the State by round-off: it would come for ever.
        point.t = std::max(t, newest.t);
        return;
    }
    point.t = t;
    const IntegrationScheme::DenseNodes nodes = m_scheme->getDenseNodes(lastOrder);
    const int valueNodes = std::min(nodes.values, m_history.numNodes());
    const SolutionHistory::Weights weights = m_history.calcInterpolation(valueNodes, t);
    m_history.combineQ(weights, point.q);
    m_history.combineU(weights, point.u);
    m_history.combineZ(weights, point.z);
    m_history.extrapolateLambda(std::min(nodes.lambda, valueNodes), t, point.lambda);
    point.work = m_history.combineWork(weights);
    m_equations->getBlocks().normalizeQ(point.q.data());
    m_equations->prescribe(t, 0, nullptr, point.q.data(), point.u.data());
    if (projectInterpolatedStates && m_equations->getTopology().numMultipliers > 0 &&
        m_step->canProject()) {
        point.constraintError =
            m_step->projectBetweenSteps(t, constraintTolerance, point.q, point.u);
        m_step->projectSpeeds(t, point.q, point.u);
    } else {
        const bool hasError =
            m_equations->getTopology().numMultipliers > 0 || m_equations->getBlocks().askForN();
        point.constraintError = hasError ? m_step->calcPositionError(t, point.q, point.u) : 0;
    }
    m_history.interpolateUDot(nodes.uDot, t, point.uDot);
}

const State& ImplicitIntegrator::Implementation::getState() const {
    if (!m_stateIsCurrent) {
        writeState(m_visible, const_cast<State&>(m_state));
        m_stateIsCurrent = true;
    }
    return m_state;
}

std::string ImplicitIntegrator::Implementation::getErrorSource() const {
    if (m_worstErrorBlock < 0 || !m_equations ||
        m_worstErrorBlock >= m_equations->getTopology().numBlocks())
        return {};
    return m_equations->getBlock(m_worstErrorBlock).name;
}

Vector ImplicitIntegrator::Implementation::calcUDot() const {
    return m_equations->getBlocks().calcSimbodyUDot(m_visible.q.data(), m_visible.uDot.data());
}

Vector ImplicitIntegrator::Implementation::calcMultipliers(
    const SimTK::Constraint& constraint) const {
    const std::pair<int, int> rows =
        m_equations->getTopology().findRows(constraint.getConstraintIndex());
    return Vector(rows.second, m_visible.lambda.data() + rows.first);
}

Vector ImplicitIntegrator::Implementation::calcMultipliers(const Joint* joint) const {
    if (!joint) return Vector(int(m_visible.lambda.size()), m_visible.lambda.data());
    const int first = m_equations->getTopology().findFirstRow(joint->getIndex());
    if (first < 0) return Vector(joint->getNumEquations(), 0.0);
    return Vector(joint->getNumEquations(), m_visible.lambda.data() + first);
}

Vector ImplicitIntegrator::Implementation::calcFrictionForces(const Joint& joint) const {
    const Topology& topology = m_equations->getTopology();
    std::vector<SimTK::Real> forces;
    for (const Topology::Friction& friction : topology.frictions)
        if (topology.joints[size_t(friction.joint)].record ==
            &topology.guts->joint(joint.getIndex()))
            for (int i = 0; i < friction.numRates; ++i)
                forces.push_back(-m_visible.lambda[size_t(friction.forceRow(i))]);
    return Vector(int(forces.size()), forces.data());
}

void ImplicitIntegrator::Implementation::updateDiscreteVariables(const SolutionPoint& point) {
    const auto start_ = Clock::now();
    m_stateIsCurrent = false;
    writeState(point, m_state);
    m_events.updateDiscreteVariables(m_state);
    m_equations->takeVariables(m_events.getAutoUpdates(), m_state);
    statistics.simbodySeconds += secondsSince(start_);
}

void ImplicitIntegrator::Implementation::updateDiscreteVariablesAtStart() {
    if (!m_events.hasAutoUpdates()) return;
    updateDiscreteVariables(m_visible);
    // What was swapped out was never computed: compute it anew, as Simbody's integrators do.
    m_state.invalidateAllCacheAtOrAbove(Stage::Instance);
}

}  // namespace simflex
