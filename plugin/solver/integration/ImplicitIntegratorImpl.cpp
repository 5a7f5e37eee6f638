#include "simflex/solver/integration/ImplicitIntegratorImpl.h"

#include <omp.h>

#include <sstream>
#include <utility>

#include "simflex/base/FlushDenormals.h"
#include "simflex/body/LinearRangeReporter.h"
#include "simflex/solver/integration/FailureDiagnosis.h"

namespace simflex {

using SimTK::Array_;
using SimTK::Real;
using SimTK::Stage;
using SimTK::State;
using SimTK::Vector;
using Clock = std::chrono::steady_clock;

namespace {

const SimTK::MultibodySystem& requireMultibodySystem(const SimTK::System& system,
                                                     const std::string& integrator) {
    if (!SimTK::MultibodySystem::isInstanceOf(system))
        throw std::invalid_argument(integrator +
                                    ": the System is not a SimTK::MultibodySystem; for other "
                                    "equations take one of Simbody's integrators");
    return SimTK::MultibodySystem::downcast(system);
}

}  // namespace

ImplicitIntegrator::Implementation::Implementation(
    std::string integratorName, const SimTK::System& system,
    std::unique_ptr<IntegrationScheme> integrationScheme)
    : name(std::move(integratorName)),
      m_system(requireMultibodySystem(system, name)),
      m_scheme(std::move(integrationScheme)),
      m_events(m_system),
      m_image(m_system) {}

void ImplicitIntegrator::Implementation::requireInitialized(const char* method) const {
    if (!m_isInitialized) throw std::logic_error(name + "::" + method + "() before initialize()");
}

void ImplicitIntegrator::Implementation::requireNotInitialized(const char* method) const {
    if (m_isInitialized)
        throw std::logic_error(name + "::" + method +
                               "() after initialize(): an integration keeps the settings it was "
                               "begun with; set them before, or make another integrator");
}

void ImplicitIntegrator::Implementation::setFinalTime(Real time) {
    if (m_isInitialized && !(time >= m_history[0].t))
        throw std::invalid_argument(name + "::setFinalTime(): time " + std::to_string(time) +
                                    " s is before " + std::to_string(m_history[0].t) +
                                    " s, which is reached already");
    finalTime = time;
    const bool isReached = !(m_visible.t < finalTime);
    m_isFinished = m_isFinished && isReached;
    m_isFinalTimeReturned = m_isFinalTimeReturned && isReached;
    m_isOver = m_isOver && isReached;
}

void ImplicitIntegrator::Implementation::setWaiting(Real Waiting::*setting, Real value) {
    m_waiting.*setting = value;
    if (!m_isInitialized) adoptSettings();
}

void ImplicitIntegrator::Implementation::adoptSettings() {
    accuracy = m_waiting.accuracy;
    constraintTolerance = m_waiting.constraintTolerance;
    initialStep = m_waiting.initialStep;
}

void ImplicitIntegrator::Implementation::setMinimumStep(Real h) {
    if (m_isInitialized && maximumStep > 0 && h > maximumStep)
        throw std::invalid_argument(name + "::setMinimumStepSize(): above setMaximumStepSize()");
    minimumStep = h;
}

void ImplicitIntegrator::Implementation::setMaximumStep(Real h) {
    if (m_isInitialized && h < std::max(minimumStep, fixedStep))
        throw std::invalid_argument(name +
                                    "::setMaximumStepSize(): below setMinimumStepSize() or "
                                    "setFixedStep()");
    maximumStep = h;
    if (m_isInitialized) m_longestStep = h;
}

void ImplicitIntegrator::Implementation::setFixedStep(Real h) {
    if (m_isInitialized && maximumStep > 0 && h > maximumStep)
        throw std::invalid_argument(name + "::setFixedStep(): above setMaximumStepSize()");
    fixedStep = m_nextStep = h;
    m_longestStep = std::max(m_longestStep, double(h));
}

void ImplicitIntegrator::Implementation::setForceFullNewton(bool force) {
    forceFullNewton = force;
    if (m_step) m_step->forceFullNewton = force;
}

void ImplicitIntegrator::Implementation::setNumThreads(int threads) {
    numThreads = threads;
    if (m_isInitialized) m_step->setNumThreads(numThreads);
}

void ImplicitIntegrator::Implementation::setNewtonSystemObserver(
    std::function<void(const NewtonSystem&)> newObserver) {
    observer = std::move(newObserver);
    if (m_isInitialized) m_step->observer = observer;
}

//-------------------------------------------------------------------------------------------------
// start

void ImplicitIntegrator::Implementation::setUp(const State& state) {
    requireTopology(m_system, state, name + "::initialize()");
    prepare(state);
    m_image.startFrom(m_state);
}

void ImplicitIntegrator::Implementation::prepare(const State& state) {
    m_isInitialized = m_isTerminated = m_isFinished = false;
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
    m_step = std::make_unique<ImplicitStep>(*m_equations, statistics);
    chooseSettings();
    m_step->blockForm = blockForm;
    m_step->accuracy = accuracy;
    m_step->forceFullNewton = forceFullNewton;
    m_step->observer = observer;
    if (numThreads > 0)
        m_step->setNumThreads(numThreads);
    else
        m_step->chooseNumThreads(omp_get_max_threads());

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
    // What remembers at the ends of steps alone wants short ones. Trackers of contacts only find
    // again what they have found.
    m_remembers = false;
    for (const SimTK::DiscreteVarKey& key : listAutoUpdates(m_state)) {
        const SimTK::Subsystem& subsystem = m_system.getSubsystem(key.first);
        m_remembers = m_remembers || !SimTK::ContactTrackerSubsystem::isInstanceOf(subsystem);
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
    if (!hasOwnConstraintTolerance)
        constraintTolerance = isRelative ? PartOfAccuracy * accuracy : TightTolerance;
    m_step->tolerances = newtonTolerances;
    // Errors of speeds count there as they are, not by what they do in a step.
    if (hasOwnNewtonTolerances || !isRelative || !hasHighOrder) return;
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
    const bool isProjected = project && m_equations->getTopology().numMultipliers > 0 &&
                             projectsByWeights() && projectStateByWeights(forced);
    SolutionPoint& point = m_visible;
    point.t = m_state.getTime();
    enterSmoothSpan(point.t);
    m_equations->getBlocks().getFromState(m_state, point.q.data(), point.u.data());
    for (size_t i = 0; i < point.z.size(); ++i) point.z[i] = m_state.getZ()[int(i)];
    m_equations->updSimbody().setZ(point.z.data());
    m_equations->prescribe(point.t, 0, nullptr, point.q.data(), point.u.data());
    if (project && m_equations->getTopology().numMultipliers > 0 &&
        !(isProjected &&
          m_step->isAssembled(point.t, m_waiting.constraintTolerance, point.q, point.u)))
        m_step->assemble(point.t, m_waiting.constraintTolerance, point.q, point.u);
    m_equations->getBlocks().normalizeQ(point.q.data());
}

void ImplicitIntegrator::Implementation::completeStart(SolutionPoint& point) {
    m_equations->updFunctions().forget();
    m_equations->updSimbody().setZ(point.z.data());
    m_step->calcAccelerations(point.t, point.q, point.u, point.uDot, point.lambda);
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
    ++statistics.starts;
    m_numRedundantAtStart = statistics.redundantConstraints;
    m_controller.restart();
    constexpr Real LongestFraction = 1e-2;  // of the system's time scale
    m_nextStep = chooseInitialStep(m_visible, LongestFraction * m_system.getDefaultTimeScale());
    m_order = std::min(m_scheme->getLowestOrder(), m_scheme->getHighestOrder(m_history));
    m_stepsAtOrder = 0;
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
        const double allowed =
            StepController::Target * accuracy / std::max(m_scheme->getFirstErrorConstant(), 1e-2);
        if (jerk > 0) h = std::cbrt(allowed / jerk);
        const double jerkSize = m_equations->updErrorNorm().calcChange(m_errorU.data(), 0);
        if (jerkSize > 0) h = std::min(h, std::sqrt(allowed / jerkSize));
    } catch (const std::runtime_error&) {
        h = delta;  // the first step will say what is wrong
    }
    return std::min(std::max(std::min(h, longest), 10 * minimumStep), m_longestStep);
}

//-------------------------------------------------------------------------------------------------
// single step

bool ImplicitIntegrator::Implementation::attemptStep(double h, int order, double* error) {
    ++statistics.stepsAttempted;
    const long iterationsBefore = statistics.newtonIterations;
    const double t = m_history[0].t + h;
    m_equations->updErrorNorm().setReference(m_history[0].q.data(), m_history[0].u.data(),
                                             m_history[0].z.data());
    m_scheme->calcFormula(m_history, order, t, m_formula);
    m_new.t = t;
    const SolutionHistory::Weights prediction =
        m_history.calcInterpolation(std::min(order + 1, m_history.numNodes()), t);
    m_history.combineQ(prediction, m_new.q);
    m_history.combineU(prediction, m_new.u);
    m_history.combineZ(prediction, m_new.z);
    const int pointsOfLambda =
        m_equations->updErrorNorm().isInMetres() ? 2 : std::clamp(order, 2, 4);
    m_history.extrapolateLambda(pointsOfLambda, t, m_new.lambda);

    m_outcome = m_solvesPositions ? m_step->solveNearSingularity(m_formula, m_new)
                                  : m_step->solve(m_formula, formulation, m_new);
    if (!m_outcome.converged) {
        statistics.divergentIterations += statistics.newtonIterations - iterationsBefore;
        return false;
    }

    if (formulation == Formulation::StabilizedIndex2) {
        m_new.constraintError = m_step->projectPositions(t, constraintTolerance, m_new.q, m_new.u,
                                                         &m_worstProjectedRow);
        if (!(m_new.constraintError <= constraintTolerance) || m_step->mayLoseCount()) return false;
        if (m_solvesPositions && !m_step->projectStepSpeeds(m_formula, m_new, &m_worstProjectedRow))
            return false;
    } else {
        m_new.constraintError = m_step->calcPositionError(t, m_new.q, m_new.u);
    }
    m_new.power = m_equations->calcPower(m_new.q.data(), m_new.u.data(), m_new.uDot.data(),
                                         m_new.lambda.data());
    m_new.work = m_formula.workHist + m_formula.quadrature * m_new.power;
    m_equations->getBlocks().normalizeQ(m_new.q.data());
    m_scheme->completePoint(m_history, m_formula, m_new);
    if (fixedStep > 0)
        *error = 0;
    else
        *error = m_history.numNodes() > order ? calcError(order) : calcFirstError();
    if (fixedStep == 0 && *error <= 1) *error = std::max(*error, calcUnseenError(order));
    return true;
}

double ImplicitIntegrator::Implementation::calcError(int order) {
    const IntegrationScheme::ErrorFactors factors =
        m_scheme->calcErrorFactors(m_history, order, m_new.t);
    const SolutionHistory::Weights prediction = m_history.calcInterpolation(order + 1, m_new.t);
    m_history.combineQ(prediction, m_errorQ);
    m_history.combineU(prediction, m_errorU);
    m_history.combineZ(prediction, m_errorZ);
    for (size_t i = 0; i < m_errorQ.size(); ++i)
        m_errorQ[i] = factors.q * (m_new.q[i] - m_errorQ[i]);
    for (size_t i = 0; i < m_errorU.size(); ++i)
        m_errorU[i] = factors.u * (m_new.u[i] - m_errorU[i]);
    for (size_t i = 0; i < m_errorZ.size(); ++i)
        m_errorZ[i] = factors.u * (m_new.z[i] - m_errorZ[i]);
    m_equations->getSimbody().clearPrescribedErrors(m_errorQ.data(), m_errorU.data());
    return std::max(
               m_equations->updErrorNorm().calcSize(m_errorQ.data(), m_errorU.data(),
                                                    m_new.t - m_history[0].t, &m_worstErrorBlock),
               m_equations->updErrorNorm().calcZSize(m_errorZ.data())) /
           accuracy;
}

double ImplicitIntegrator::Implementation::calcFirstError() {
    const SolutionPoint& last = m_history[0];
    const double h = m_new.t - last.t, factor = m_scheme->getFirstErrorConstant() * h;
    std::fill(m_errorQ.begin(), m_errorQ.end(), 0.0);
    for (size_t i = 0; i < m_errorU.size(); ++i)
        m_errorU[i] = factor * (m_new.uDot[i] - last.uDot[i]);
    for (size_t i = 0; i < m_errorZ.size(); ++i)
        m_errorZ[i] = factor * (m_new.zDot[i] - last.zDot[i]);
    m_equations->getSimbody().clearPrescribedErrors(m_errorQ.data(), m_errorU.data());
    return std::max(m_equations->updErrorNorm().calcSize(m_errorQ.data(), m_errorU.data(), h,
                                                         &m_worstErrorBlock),
                    m_equations->updErrorNorm().calcZSize(m_errorZ.data())) /
           accuracy;
}

void ImplicitIntegrator::Implementation::chooseNextStep(double error, double h, int order) {
    const int lowest = m_scheme->getLowestOrder();
    const int highest = m_scheme->getHighestOrder(m_history);
    if (fixedStep > 0) {
        m_nextStep = fixedStep;
        m_order = std::min(std::max(order + 1, lowest), highest);
        return;
    }
    // Candidate orders k−1, k, k+1; the one that allows the longest step wins. A higher one has to
    // promise more: where error terms do not fall with the order, the method is near instability.
    constexpr double Preference = 1.2;
    const auto growth = [](double err, int k) {
        return std::pow(StepController::Target / std::max(err, 1e-10), 1.0 / (k + 1));
    };
    ++m_stepsAtOrder;
    double best = growth(error, order);
    int bestOrder = order;
    if (order > lowest && m_stepsAtOrder > 1) {
        const double lower = growth(calcError(order - 1), order - 1);
        if (lower > best) best = lower, bestOrder = order - 1;
    }
    if (order < highest && (order < lowest || m_stepsAtOrder > order) &&
        m_history.numNodes() > order + 1) {
        const double higher = growth(calcError(order + 1), order + 1);
        if (higher > Preference * best || order < lowest) best = higher, bestOrder = order + 1;
    }
    // Ratios to which the formulas are zero-stable with some room.
    const double largest = bestOrder <= 2 ? 2.0 : 1.5;
    if (bestOrder == order) {
        m_nextStep = h * m_controller.calcRatio(error, order, largest);
    } else {
        m_controller.restart();
        m_stepsAtOrder = 0;
        m_nextStep = h * std::clamp(best, 0.5, largest);
    }
    m_order = bestOrder;
    m_nextStep = std::min(m_nextStep, m_longestStep);
}

void ImplicitIntegrator::Implementation::passBreak() {
    // What does not depend on time is the same on both sides to the last bit.
    constexpr double SmallestJump = 1e-9;
    SolutionPoint& point = m_history.newest();
    const std::vector<double> before = m_step->calcLoads(point.t, point.q, point.u);
    enterSmoothSpan(point.t);
    m_equations->prescribe(point.t, 0, nullptr, point.q.data(), point.u.data());
    const std::vector<double> after = m_step->calcLoads(point.t, point.q, point.u);
    bool jumps = false;
    for (size_t i = 0; i < before.size(); ++i)
        jumps = jumps || !(std::abs(after[i] - before[i]) <=
                           SmallestJump * std::max(std::abs(before[i]), std::abs(after[i])));
    if (!jumps) {
        // There may be a kink, through which no polynomial of high order goes.
        m_stepsAtOrder = 0;
        m_order = std::min(m_order, m_scheme->getLowestOrder());
        return;
    }
    restartAtNewest();
    m_nextStep = chooseInitialStep(point, m_nextStep);
}

void ImplicitIntegrator::Implementation::acceptStep(double h, int order) {
    if (lastStep > 0 && statistics.stepsTaken > 0) {
        statistics.sumOfSquaredLogRatios += std::pow(std::log(h / lastStep), 2);
        ++statistics.stepRatios;
    }
    // The whole point is copied: every array has its size already.
    m_history.push() = m_new;
    m_equations->updBlocks().followPose();
    ++statistics.stepsTaken;
    ++statistics.stepsAtOrder[size_t(order)];
    statistics.timeCovered += h;
    statistics.largestStep = std::max(statistics.largestStep, h);
    statistics.smallestStep = statistics.stepsTaken == 1 ? h : std::min(statistics.smallestStep, h);
    if (SimTK::isNaN(firstStep)) firstStep = h;
    lastStep = h;
    lastOrder = order;
}

void ImplicitIntegrator::Implementation::takeStep(double limit) {
    double h = std::min(m_nextStep, m_longestStep);
    bool isCut = false;
    const double remaining = limit - m_history[0].t;
    if (h >= remaining * (1 - 1e-10)) {
        isCut = h > remaining * (1 + 1e-10);
        h = remaining;
    } else if (fixedStep == 0 && h > 0.5 * remaining) {
        h = 0.5 * remaining;  // two equal steps rather than a long and a tiny one
        isCut = true;
    }
    const double wanted = m_nextStep;
    int order = std::min(m_order, m_history.numNodes());
    int failures = 0, retries = 0;
    m_solvesPositions = false;
    for (;;) {
        double error = 0;
        const bool isSolved = attemptStep(h, order, &error);
        if (isSolved && error <= 1) {
            // m_history still lacks the new point: the estimates of other orders need it so.
            chooseNextStep(error, h, order);
            if (isCut && failures == 0 && m_nextStep < wanted)
                m_nextStep = std::max(m_nextStep, std::min(wanted, 2 * h));
            acceptStep(h, order);
            return;
        }
        if (isSolved) {
            ++statistics.errorTestFailures;
            h *= m_controller.calcRatioAfterRejection(error, order);
            ++failures;
        } else {
            ++(m_outcome.converged  ? statistics.projectionFailures
               : m_outcome.isFinite ? statistics.convergenceFailures
                                    : statistics.nonFiniteFailures);
            if (!m_outcome.converged && m_outcome.retryWorthwhile && retries++ < 2) continue;
            retries = 0;
            // Near a singular position the velocity equations outrun the iteration.
            if (!m_solvesPositions && !m_outcome.converged && m_outcome.isFinite &&
                formulation == Formulation::StabilizedIndex2 &&
                m_equations->getTopology().numMultipliers > 0) {
                m_solvesPositions = true;
                continue;
            }
            m_solvesPositions = false;
            if (fixedStep > 0)
                failStep(h, m_outcome.converged ? Failure::Projection : Failure::Convergence, 0);
            m_controller.restart();
            h *= 0.25;
            ++failures;
        }
        m_stepsAtOrder = 0;
        if (!(h >= minimumStep))
            failStep(h,
                     isSolved              ? Failure::ErrorTest
                     : m_outcome.converged ? Failure::Projection
                                           : Failure::Convergence,
                     error);
        if (failures == 3) {
            // The past is no guide: something jumped here.
            restartAtNewest();
            order = m_order;
        }
    }
}

void ImplicitIntegrator::Implementation::failStep(double h, Failure failure, double error) {
    const std::vector<std::string> redundancies = m_step->describeRedundancies();
    const FailureDiagnosis diagnosis(*m_equations);
    const FailureDiagnosis::FailedStep step{m_history[0],
                                            m_new,
                                            h,
                                            m_outcome,
                                            redundancies,
                                            m_numRedundantAtStart,
                                            !differentiated.empty(),
                                            accuracy};
    std::ostringstream text;
    text << name << ": no step could be taken from t = " << m_history[0].t << " s (h = " << h
         << " s): ";
    if (!m_outcome.isFinite)
        text << diagnosis.explainNonFinite(step);
    else if (failure == Failure::ErrorTest)
        text << "the error test keeps failing: "
             << diagnosis.explainLargeError(step, error, m_errorQ.data(), m_errorU.data(),
                                            m_errorZ);
    else if (failure == Failure::Convergence)
        text << "Newton's iteration does not converge: " << diagnosis.explainNoConvergence(step);
    else if (m_step->mayLoseCount())
        text << "it is too long to count the teeth and turns of gears and couplers; allow shorter "
                "steps";
    else if (m_worstProjectedRow >= 0)
        text << "the positions cannot be brought back onto the joints: "
             << diagnosis.explainNoProjection(step, m_worstProjectedRow, constraintTolerance);
    text << ". The last good State is kept";
    throw std::runtime_error(text.str());
}

//-------------------------------------------------------------------------------------------------
// output

void ImplicitIntegrator::Implementation::writeState(const SolutionPoint& point,
                                                    State& state) const {
    m_equations->getBlocks().putIntoState(point.t, point.q.data(), point.u.data(), state);
    if (!point.z.empty()) std::copy(point.z.begin(), point.z.end(), &state.updZ()[0]);
    m_system.realize(state, Stage::Velocity);
}

void ImplicitIntegrator::Implementation::showPoint(double t) {
    m_stateIsCurrent = false;
    calcPoint(t, m_visible);
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
    const int nodes = std::min(lastOrder + 1, m_history.numNodes());
    const SolutionHistory::Weights weights = m_history.calcInterpolation(nodes, t);
    m_history.combineQ(weights, point.q);
    m_history.combineU(weights, point.u);
    m_history.combineZ(weights, point.z);
    m_history.extrapolateLambda(nodes, t, point.lambda);
    point.work = m_history.combineWork(weights);
    m_equations->getBlocks().normalizeQ(point.q.data());
    m_equations->prescribe(t, 0, nullptr, point.q.data(), point.u.data());
    if (projectInterpolatedStates && m_equations->getTopology().numMultipliers > 0 &&
        m_step->canProject()) {
        point.constraintError =
            m_step->projectBetweenSteps(t, constraintTolerance, point.q, point.u);
        m_step->projectSpeeds(t, point.q, point.u);
    } else {
        point.constraintError = m_step->calcPositionError(t, point.q, point.u);
    }
    // Steps of high order are long.
    m_history.interpolateUDot(lastOrder > 2 ? lastOrder : 2, t, point.uDot);
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
    return Vector(joint->getNumEquations(),
                  m_visible.lambda.data() +
                      m_equations->getTopology().joints[size_t(joint->getIndex())].firstRow);
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
