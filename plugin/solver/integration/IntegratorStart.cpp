// An integration begins: equations, a consistent point, the first step's length.
#include <omp.h>

#include "simflex/base/FlushDenormals.h"
#include "simflex/body/LinearRangeReporter.h"
#include "simflex/solver/integration/ImplicitIntegratorImpl.h"

namespace simflex {

using SimTK::Array_;
using SimTK::Real;
using SimTK::Stage;
using SimTK::State;
using SimTK::Vector;
using Clock = std::chrono::steady_clock;

void ImplicitIntegrator::Implementation::setUp(const State& state) {
    requireTopology(m_system, state, name + "::initialize()");
    prepare(state);
    m_image.startFrom(m_state);
}

void ImplicitIntegrator::Implementation::prepare(const State& state) {
    m_isInitialized = m_isTerminated = m_isFinished = false;
    m_topologyVersion = m_system.getSystemTopologyCacheVersion();
    checkSettings(state.getTime());
    m_longestStep =
        maximumStep > 0
            ? maximumStep
            : std::max({m_system.getDefaultTimeScale(), initialStep, minimumStep, fixedStep});
    m_state = makeFreshState(m_system, state);
    m_system.realize(m_state, Stage::Velocity);
    m_step.reset();
    m_equations.reset();
    statistics = statisticsAtReset = IntegratorStatistics();
    firstStep = SimTK::NaN;
    m_hasTriggered = m_isTimeAdvancePending = false;
    m_isFinalTimeReturned = m_isOver = false;
    m_isIntervalStart = true;
    m_pending = Pending::Nothing;
    m_triggersBefore.resize(0);
    m_triggersAfter.resize(0);
    m_stepsAtOrder = lastOrder = 0;
    lastStep = 0;
    buildEquations();
    m_visible.work = 0;
    m_events.initialize(m_state);
}

void ImplicitIntegrator::Implementation::checkSettings(Real startTime) const {
    const auto refuse = [&](const std::string& what) {
        throw std::invalid_argument(name + ": " + what);
    };
    if (!m_formulas && formulation == Formulation::Index3)
        refuse("its formulation is StabilizedIndex2; for Index3 take BdfIntegrator");
    if (maximumStep > 0 && fixedStep > maximumStep)
        refuse("setMaximumStepSize() is below setFixedStep()");
    if (maximumStep > 0 && minimumStep > maximumStep)
        refuse("setMaximumStepSize() is below setMinimumStepSize()");
    if (finalTime < startTime)
        refuse("setFinalTime() " + std::to_string(finalTime) + " s is before the State's time " +
               std::to_string(startTime) + " s");
}

void ImplicitIntegrator::Implementation::buildEquations() {
    m_scratch = m_builtFrom = m_state;
    m_isKept = false;
    m_laterVariables = listLaterVariables(m_state);
    if (m_equations) bookPhases();
    m_step.reset();
    m_equations = std::make_unique<Evaluation>(m_system, m_state, Topology::Setting::Implicit,
                                               differentiated);
    if (m_formulas)
        m_step = std::make_unique<ImplicitStep>(*m_equations, statistics);
    else
        m_step = std::make_unique<RadauStep>(*m_equations, statistics);
    chooseSettings();
    m_step->blockForm = blockForm;
    m_step->accuracy = accuracy;
    m_step->forceFullNewton = forceFullNewton;
    m_step->observer = observer;
    m_step->setNumThreads(numThreads > 0 ? numThreads : omp_get_max_threads());

    const int nq = m_equations->getTopology().numQ, nu = m_equations->getTopology().numU,
              m = m_equations->getTopology().numMultipliers, nz = m_equations->getTopology().numZ;
    m_history.resize(nq, nu, m, nz);
    m_new.resize(nq, nu, m, nz);
    m_visible.resize(nq, nu, m, nz);
    m_trial.resize(nq, nu, m, nz);
    m_formula.resize(nq, nu, nz);
    m_errorQ.assign(size_t(nq), 0);
    m_errorU.assign(size_t(nu), 0);
    m_errorZ.assign(size_t(nz), 0);
    m_samples.resize(nq, nu, m);
}

void ImplicitIntegrator::Implementation::chooseSettings() {
    // What remembers at the ends of steps alone wants short ones. Trackers of contacts and cables
    // only find again what they have found.
    m_remembers = false;
    for (const SimTK::DiscreteVarKey& key : listAutoUpdates(m_state)) {
        const SimTK::Subsystem& subsystem = m_system.getSubsystem(key.first);
        m_remembers = m_remembers || !(SimTK::ContactTrackerSubsystem::isInstanceOf(subsystem) ||
                                       SimTK::CableTrackerSubsystem::isInstanceOf(subsystem));
    }
    const bool isFree = !m_equations->getTopology().hasModes() && fixedStep == 0 && !m_remembers;
    const bool hasHighOrder = m_scheme->suit(isFree ? IntegrationScheme::Suitability::HighOrder
                                                    : IntegrationScheme::Suitability::AStable);
    using Norm = ErrorNorm::Kind;
    const bool isSimbodysOwn = !FlexibleBodySubsystem::find(m_system) &&
                               formulation == Formulation::StabilizedIndex2 && fixedStep == 0;
    const bool isRelative = accuracyNorm == AccuracyNorm::StateWeights ||
                            (accuracyNorm == AccuracyNorm::Automatic && isSimbodysOwn);
    if (isRelative && m_equations->getTopology().numFlexible > 0)
        throw std::invalid_argument(name +
                                    "::setAccuracyNorm(): StateWeights is for systems without "
                                    "flexible bodies, whose modes' "
                                    "weights follow from what they displace");
    m_equations->updErrorNorm().setKind(!isRelative       ? Norm::Displacement
                                        : useInfinityNorm ? Norm::Infinity
                                                          : Norm::RootMeanSquare);

    constexpr Real TightTolerance = 1e-10, PartOfAccuracy = 0.1;  // as in SimTK::Integrator
    // What is projected is noise to the error test.
    constexpr Real LargestNoise = 0.01;
    if (!hasOwnConstraintTolerance)
        constraintTolerance = isRelative ? PartOfAccuracy * accuracy
                                         : std::min(TightTolerance, LargestNoise * accuracy);
    m_step->tolerances = newtonTolerances;
    if (hasOwnNewtonTolerances) return;
    if (!m_formulas) {
        // Errors of steps may be far below the accuracy; those of the iteration should not stand
        // out. An old matrix leaves the same in every step.
        m_step->tolerances.displacement = updStages().keepsMatrices() ? 1e-4 : 1e-3;
        m_step->tolerances.multiplier = 1e-4;
        return;
    }
    // Errors of speeds count there as they are, not by what they do in a step.
    if (!isRelative || !hasHighOrder) return;
    m_step->tolerances.displacement = 0.1;
    m_step->tolerances.multiplier = 1e-4;
}

void ImplicitIntegrator::Implementation::initialize(const State& state) {
    const StandardArithmetic standard;
    adoptSettings();
    setUp(state);
    const FlexibleBodySubsystem* flexible = FlexibleBodySubsystem::find(m_system);
    if (flexible && projectInitialState)
        requireLinearRange(*flexible, m_state, name + "::initialize()");
    const auto start_ = Clock::now();
    takeState(projectInitialState, true);
    initializeSystem();
    updateDiscreteVariablesAtStart();
    start();
    m_isInitialized = true;
    refreshAdvancedState();
    statistics.totalSeconds += secondsSince(start_);
}

void ImplicitIntegrator::Implementation::initializeSystem() {
    writeState(m_visible, m_state);
    const EventDriver::Outcome outcome =
        m_events.handleInitialization(m_state, constraintTolerance);
    m_system.realize(m_state, Stage::Velocity);
    if (outcome.hasChangedState) {
        if (outcome.lowestChange > Stage::Instance)
            takeLaterVariables(m_state);
        else
            buildEquations();
        takeState(projectInitialState, true);
    } else {
        for (size_t i = 0; i < m_visible.z.size(); ++i) m_visible.z[i] = m_state.getZ()[int(i)];
    }
}

bool ImplicitIntegrator::Implementation::projectsByWeights() const {
    if (projectionNorm != ProjectionNorm::Automatic)
        return projectionNorm == ProjectionNorm::Weights;
    const FlexibleBodySubsystem* flexible = FlexibleBodySubsystem::find(m_system);
    return !flexible || flexible->getNumBodies() == 0;
}

bool ImplicitIntegrator::Implementation::projectStateByWeights(bool forced) {
    using SimTK::ProjectOptions;
    ProjectOptions options(m_waiting.constraintTolerance);
    if (forced) options.setOption(ProjectOptions::ForceProjection);
    options.setOption(ProjectOptions::ForceFullNewton);
    if (useInfinityNorm) options.setOption(ProjectOptions::UseInfinityNorm);
    const Vector q = m_state.getQ(), u = m_state.getU();
    const SimTK::SimbodyMatterSubsystem& matter = m_system.getMatterSubsystem();
    try {
        SimTK::ProjectResults results;
        Vector noErrors;
        m_system.realize(m_state, Stage::Time);
        m_system.prescribeQ(m_state);
        m_system.realize(m_state, Stage::Position);
        // Simbody 3.7 crashes where nothing is free.
        if (!matter.getFreeQIndex(m_state).empty())
            m_system.projectQ(m_state, noErrors, options, results);
        m_system.prescribeU(m_state);
        m_system.realize(m_state, Stage::Velocity);
        if (!matter.getFreeUIndex(m_state).empty())
            m_system.projectU(m_state, noErrors, options, results);
        m_system.realize(m_state, Stage::Velocity);
        return true;
    } catch (const std::exception&) {
        m_state.updQ() = q;
        m_state.updU() = u;
        m_system.realize(m_state, Stage::Velocity);
        return false;
    }
}

void ImplicitIntegrator::Implementation::takeState(bool project, bool forced) {
    // What the start leaves open the first step closes, and counts as its error.
    constexpr Real Closest = 1e-13;  // [m, rad] that round-off allows
    const Real tolerance =
        std::min(m_waiting.constraintTolerance, std::max(constraintTolerance, Closest));
    const bool isProjected = project && m_equations->getTopology().numMultipliers > 0 &&
                             projectsByWeights() && projectStateByWeights(forced);
    SolutionPoint& point = m_visible;
    point.t = m_state.getTime();
    enterSmoothSpan(point.t);
    m_equations->getBlocks().getFromState(m_state, point.q.data(), point.u.data());
    for (size_t i = 0; i < point.z.size(); ++i) point.z[i] = m_state.getZ()[int(i)];
    m_equations->setZ(point.z.data());
    m_equations->prescribe(point.t, 0, nullptr, point.q.data(), point.u.data());
    if (project && m_equations->getTopology().numMultipliers > 0 &&
        !(isProjected && m_step->isAssembled(point.t, tolerance, point.q, point.u)))
        m_step->assemble(point.t, tolerance, point.q, point.u);
    m_equations->getBlocks().normalizeQ(point.q.data());
    if (m_equations->getTopology().states.empty()) return;
    m_equations->realize(point.t, point.q.data(), point.u.data());
    m_equations->updLoads().startStates(point.z.data());
}

void ImplicitIntegrator::Implementation::completeStart(SolutionPoint& point) {
    m_equations->updFunctions().forget();
    m_equations->setZ(point.z.data());
    m_step->calcAccelerations(point.t, point.q, point.u, point.uDot, point.lambda);
    m_equations->updFrictions().keep();
    point.constraintError = m_step->calcPositionError(point.t, point.q, point.u);
    m_equations->updBlocks().followPose();
    m_equations->getBlocks().calcQDot(point.q.data(), point.u.data(), point.qDot.data());
    m_equations->calcZDot(point.q.data(), point.u.data(), point.uDot.data(), point.z.data(),
                          point.zDot.data());
    point.power = m_equations->calcPower(point.q.data(), point.u.data(), point.uDot.data(),
                                         point.lambda.data());
    point.a = point.uDot;
}

void ImplicitIntegrator::Implementation::start() {
    completeStart(m_visible);
    m_history.clear();
    m_history.push() = m_visible;
    m_history.startAtNewest();
    if (!m_formulas) updStages().forgetError();
    ++statistics.starts;
    m_numRedundantAtStart = statistics.redundantConstraints;
    m_controller.restart();
    constexpr Real LongestFraction = 1e-2;  // of the system's time scale
    m_nextStep = chooseInitialStep(m_visible, LongestFraction * m_system.getDefaultTimeScale());
    m_order = std::min(m_scheme->getLowestOrder(), m_scheme->getHighestOrder(m_history));
    m_stepsAtOrder = 0;
    m_speedTime = 0;
    m_stateIsCurrent = false;
    m_hasTriggered = m_isTimeAdvancePending = false;
    if (m_events.hasTriggers()) m_events.calcTriggers(getState(), m_triggersBefore);
}

void ImplicitIntegrator::Implementation::enterSmoothSpan(double time) {
    breaks.moveTo(time);
    m_equations->updFunctions().setSmoothSpan(breaks.getFirst(), breaks.getLast());
}

void ImplicitIntegrator::Implementation::restartAtNewest() {
    completeStart(m_history.newest());
    m_history.startAtNewest();
    if (!m_formulas) updStages().forgetError();
    ++statistics.starts;
    m_controller.restart();
    m_order = std::min(m_scheme->getLowestOrder(), m_scheme->getHighestOrder(m_history));
    m_stepsAtOrder = 0;
}

void ImplicitIntegrator::Implementation::initialize(const Array_<State>& history, int wantedOrder) {
    const StandardArithmetic standard;
    const auto refuse = [&](const std::string& what) {
        throw std::invalid_argument(name + "::initialize(): " + what);
    };
    if (history.empty()) refuse("empty history");
    if (!(fixedStep > 0)) refuse("a starting history needs setFixedStep()");
    if (history.size() > unsigned(SolutionHistory::Capacity))
        refuse("a history holds at most 7 states");
    if (int(history.size()) < wantedOrder)
        refuse("order " + std::to_string(wantedOrder) + " needs as many past states, not " +
               std::to_string(history.size()));
    for (unsigned i = 1; i < history.size(); ++i)
        if (std::abs(history[i].getTime() - history[i - 1].getTime() - fixedStep) >
            1e-9 * fixedStep)
            refuse("states of the history must be " + std::to_string(fixedStep) +
                   " s apart, oldest first");
    setUp(history.back());
    enterSmoothSpan(history.back().getTime());
    SolutionPoint& point = m_visible;
    for (unsigned i = 0; i < history.size(); ++i) {
        State past = history[i];
        m_system.realize(past, Stage::Velocity);
        const double lastPower = point.power;
        point.t = past.getTime();
        m_equations->getBlocks().getFromState(past, point.q.data(), point.u.data());
        for (size_t k = 0; k < point.z.size(); ++k) point.z[k] = past.getZ()[int(k)];
        m_equations->getBlocks().normalizeQ(point.q.data());
        // Quaternions of opposite sign are the same rotation; the polynomial needs one branch.
        for (int b = 0; i > 0 && b < m_equations->getTopology().numBlocks(); ++b) {
            const Block& block = m_equations->getBlock(b);
            block.alignQ(m_history[0].q.data() + block.firstQ, point.q.data() + block.firstQ);
        }
        completeStart(point);
        point.work = i > 0 ? point.work + 0.5 * fixedStep * (lastPower + point.power) : 0;
        m_history.push() = point;
    }
    ++statistics.starts;
    m_nextStep = fixedStep;
    m_order = wantedOrder;
    m_stateIsCurrent = false;
    if (m_events.hasTriggers()) m_events.calcTriggers(getState(), m_triggersBefore);
    m_isInitialized = true;
}

Real ImplicitIntegrator::Implementation::chooseInitialStep(const SolutionPoint& point,
                                                           Real longest) {
    if (fixedStep > 0) return fixedStep;
    if (initialStep > 0) return std::min(initialStep, m_longestStep);
    // How fast u̇ changes, from accelerations a short way along the Taylor series.
    const double acceleration = m_equations->getBlocks().calcDisplacement(point.uDot.data());
    double delta = 1e-2 * longest;
    if (acceleration > 0) delta = std::min(delta, 0.1 * std::sqrt(accuracy / acceleration));
    double h = longest;
    try {
        m_new = point;
        m_new.t = point.t + delta;
        for (size_t i = 0; i < point.u.size(); ++i) {
            m_errorU[i] = delta * point.u[i] + 0.5 * delta * delta * point.uDot[i];
            m_new.u[i] = point.u[i] + delta * point.uDot[i];
        }
        m_step->calcPositionError(point.t, point.q, point.u);
        m_equations->getBlocks().displaceQ(m_errorU.data(), m_new.q.data());
        m_step->calcAccelerations(m_new.t, m_new.q, m_new.u, m_new.uDot, m_new.lambda);
        for (size_t i = 0; i < point.u.size(); ++i)
            m_errorU[i] = (m_new.uDot[i] - point.uDot[i]) / delta;
        const double jerk = m_equations->getBlocks().calcDisplacement(m_errorU.data());
        const double allowed = StepController::Target * accuracy /
                               std::max(m_formulas ? m_formulas->getFirstErrorConstant() : 0, 1e-2);
        if (jerk > 0) h = std::cbrt(allowed / jerk);
        const double jerkSize = m_equations->updErrorNorm().calcChange(m_errorU.data(), 0);
        if (jerkSize > 0) h = std::min(h, std::sqrt(allowed / jerkSize));
    } catch (const std::runtime_error&) {
        h = delta;  // the first step will say what is wrong
    }
    return std::min(std::max(std::min(h, longest), 10 * minimumStep), m_longestStep);
}

}  // namespace simflex
