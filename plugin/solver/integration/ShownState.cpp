// States, accelerations and multipliers of the solution at a time.
#include "simflex/base/FlushDenormals.h"
#include "simflex/solver/integration/ImplicitIntegratorImpl.h"

namespace simflex {

using SimTK::Stage;
using SimTK::State;
using SimTK::Vector;
using Clock = std::chrono::steady_clock;

void ImplicitIntegrator::Implementation::writeState(const SolutionPoint& point,
                                                    State& state) const {
    getEquations().getBlocks().putIntoState(point.t, point.q.data(), point.u.data(), state);
    if (!point.z.empty()) std::copy(point.z.begin(), point.z.end(), &state.updZ()[0]);
    if (const auto* guts = getEquations().getTopology().guts) guts->setShown(state);
    // After the system has changed, only coordinates, speeds and z are available.
    if (hasSameSystem()) m_system.realize(state, Stage::Velocity);
}

void ImplicitIntegrator::Implementation::showPoint(double t) {
    const auto start_ = Clock::now();
    m_stateIsCurrent = false;
    m_isBalanced = false;
    m_stepper->calcPoint(t, m_visible);
    statistics.outputSeconds += secondsSince(start_);
}

void ImplicitIntegrator::Implementation::balanceVisible() {
    if (m_isBalanced || !hasSameSystem()) return;
    const StandardArithmetic standard;
    const auto start_ = Clock::now();
    const bool isAlone = !isRunning();
    const Scope scope(m_activity, Activity::Evaluating);
    m_stepper->balance(m_visible);
    m_isBalanced = true;
    const double seconds = secondsSince(start_);
    statistics.outputSeconds += seconds;
    if (isAlone) statistics.totalSeconds += seconds;  // otherwise runTimed() counts them
}

const State& ImplicitIntegrator::Implementation::getState() {
    if (!m_stateIsCurrent) {
        writeState(m_visible, m_state);
        m_stateIsCurrent = true;
    }
    return m_state;
}

std::string ImplicitIntegrator::Implementation::getErrorSource() const {
    if (stepsTaken.worstBlock < 0 || !m_stepper ||
        stepsTaken.worstBlock >= getEquations().getTopology().numBlocks())
        return {};
    return getEquations().getBlock(stepsTaken.worstBlock).name;
}

Vector ImplicitIntegrator::Implementation::calcUDot() {
    balanceVisible();
    return getEquations().getBlocks().calcSimbodyUDot(m_visible.q.data(), m_visible.uDot.data());
}

Vector ImplicitIntegrator::Implementation::calcMultipliers(const SimTK::Constraint& constraint) {
    balanceVisible();
    const std::pair<int, int> rows =
        getEquations().getTopology().findRows(constraint.getConstraintIndex());
    return Vector(rows.second, m_visible.lambda.data() + rows.first);
}

Vector ImplicitIntegrator::Implementation::calcMultipliers(const Joint* joint) {
    balanceVisible();
    if (!joint) return Vector(int(m_visible.lambda.size()), m_visible.lambda.data());
    const int first = getEquations().getTopology().findFirstRow(joint->getIndex());
    if (first < 0) return Vector(joint->getNumEquations(), 0.0);
    return Vector(joint->getNumEquations(), m_visible.lambda.data() + first);
}

Vector ImplicitIntegrator::Implementation::calcFrictionForces(const Joint& joint) {
    balanceVisible();
    const Topology& topology = getEquations().getTopology();
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
    updEquations().takeVariables(m_events.getAutoUpdates(), m_state);
    statistics.simbodySeconds += secondsSince(start_);
}

void ImplicitIntegrator::Implementation::updateDiscreteVariablesAtStart() {
    if (!m_events.hasAutoUpdates()) return;
    updateDiscreteVariables(m_visible);
    // The swap put initial values into the cache, which were never computed. Simbody's integrators
    // recompute them, too.
    m_state.invalidateAllCacheAtOrAbove(Stage::Instance);
}

}  // namespace simflex
