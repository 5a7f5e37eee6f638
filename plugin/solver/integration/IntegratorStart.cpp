// Start of an integration: equations, consistent initial point.
#include "simflex/base/FlushDenormals.h"
#include "simflex/body/LinearRangeReporter.h"
#include "simflex/body/StateCopy.h"
#include "simflex/solver/integration/ImplicitIntegratorImpl.h"
#include "simflex/solver/integration/Impulse.h"

namespace simflex {

using SimTK::Array_;
using SimTK::Real;
using SimTK::Stage;
using SimTK::State;
using SimTK::Vector;
using Clock = std::chrono::steady_clock;

namespace {

/** Tolerance of a start and of handlers' States unless the user sets one [m, rad]. Simbody's norm
may allow steps more. **/
constexpr Real LoosestAssembly = 1e-10;

}  // namespace

void ImplicitIntegrator::Implementation::setUp(const State& state) {
    requireTopology(m_system, state, name + "::initialize()");
    prepare(state);
    m_image.startFrom(m_state);
}

void ImplicitIntegrator::Implementation::prepare(const State& state) {
    m_isInitialized = m_isTerminated = m_isFinished = false;
    m_topologyVersion = m_system.getSystemTopologyCacheVersion();
    settings = m_waiting;
    m_areAdjusted = false;
    checkSettings(state.getTime());
    m_state = makeFreshState(m_system, state);
    m_system.realize(m_state, Stage::Velocity);
    m_stepper.reset();
    statistics = statisticsAtReset = IntegratorStatistics();
    stepsTaken = StepsTaken();
    m_hasTriggered = m_isTimeAdvancePending = false;
    m_isFinalTimeReturned = m_isOver = false;
    m_isIntervalStart = true;
    m_pending = Pending::Nothing;
    m_triggersBefore.resize(0);
    m_triggersAfter.resize(0);
    buildEquations();
    m_visible.work = 0;
    m_events.initialize(m_state);
}

void ImplicitIntegrator::Implementation::checkSettings(Real startTime) const {
    const auto refuse = [&](const std::string& what) {
        throw std::invalid_argument(name + ": " + what);
    };
    if (!dynamic_cast<OneStageScheme*>(m_scheme.get()) &&
        settings.formulation == Formulation::Index3)
        refuse("its formulation is StabilizedIndex2; for Index3 take BdfIntegrator");
    if (settings.maximumStep > 0 && settings.fixedStep > settings.maximumStep)
        refuse("setMaximumStepSize() is below setFixedStep()");
    if (settings.maximumStep > 0 && settings.minimumStep > settings.maximumStep)
        refuse("setMaximumStepSize() is below setMinimumStepSize()");
    if (finalTime < startTime)
        refuse("setFinalTime() " + std::to_string(finalTime) + " s is before the State's time " +
               std::to_string(startTime) + " s");
}

void ImplicitIntegrator::Implementation::buildEquations() {
    copyState(m_state, m_builtFrom);
    copyState(m_state, m_scratch);
    m_isKept = false;
    m_laterVariables = listLaterVariables(m_state);
    if (m_stepper) m_stepper->bookPhases();
    m_stepper.reset();
    m_stepper = std::make_unique<Stepper>(name, m_system, m_state, *m_scheme, settings, stepsTaken,
                                          statistics);
    m_stepper->resize(m_visible);
    m_stepper->resize(m_trial);
}

void ImplicitIntegrator::Implementation::start() {
    m_stepper->start(m_visible);
    noteStart();
}

void ImplicitIntegrator::Implementation::noteStart() {
    m_stateIsCurrent = false;
    m_isBalanced = true;
    m_hasTriggered = m_isTimeAdvancePending = false;
    if (m_events.hasTriggers()) m_events.calcTriggers(getState(), m_triggersBefore);
}

void ImplicitIntegrator::Implementation::runStart(const std::function<void()>& work) {
    requireNotRunning("initialize");
    runAlone([&] {
        const auto start_ = Clock::now();
        work();
        m_isInitialized = true;
        refreshAdvancedState();
        statistics.totalSeconds += secondsSince(start_);
    });
}

void ImplicitIntegrator::Implementation::initialize(const State& state) {
    runStart([&] {
        setUp(state);
        const FlexibleBodySubsystem* flexible = FlexibleBodySubsystem::find(m_system);
        if (flexible && projectInitialState)
            requireLinearRange(*flexible, m_state, name + "::initialize()");
        takeState(Occasion::Start, true);
        if (flexible && projectInitialState) checkAssembly(*flexible);
        if (initializeSystem())
            takeState(Occasion::Start, true);
        else
            takeZ(m_state, m_visible);
        updateDiscreteVariablesAtStart();
        start();
    });
}

void ImplicitIntegrator::Implementation::checkAssembly(const FlexibleBodySubsystem& flexible) {
    const State given = copyState(m_state);
    writeState(m_visible, m_state);
    requireUnforcedShapes(flexible, given, m_state);
}

bool ImplicitIntegrator::Implementation::initializeSystem() {
    writeState(m_visible, m_state);
    const EventDriver::Outcome outcome = [&] {
        const Scope scope(m_activity, Activity::Calling);
        return m_events.handleInitialization(m_state, settings.constraintTolerance);
    }();
    m_system.realize(m_state, Stage::Velocity);
    if (!outcome.hasChangedState) return false;
    if (outcome.lowestChange > Stage::Instance)
        takeLaterVariables(m_state);
    else
        buildEquations();
    return true;
}

bool ImplicitIntegrator::Implementation::projectsByWeights() const {
    if (projectionNorm != ProjectionNorm::Automatic)
        return projectionNorm == ProjectionNorm::Weights;
    const FlexibleBodySubsystem* flexible = FlexibleBodySubsystem::find(m_system);
    return !flexible || flexible->getNumBodies() == 0;
}

bool ImplicitIntegrator::Implementation::projectStateByWeights(Occasion occasion, bool forced) {
    using SimTK::ProjectOptions;
    ProjectOptions options(settings.ownConstraintTolerance.value_or(LoosestAssembly));
    if (forced) options.setOption(ProjectOptions::ForceProjection);
    options.setOption(ProjectOptions::ForceFullNewton);
    if (settings.useInfinityNorm) options.setOption(ProjectOptions::UseInfinityNorm);
    const Vector q = m_state.getQ(), u = m_state.getU();
    const SimTK::SimbodyMatterSubsystem& matter = m_system.getMatterSubsystem();
    try {
        SimTK::ProjectResults results;
        Vector noErrors;
        m_system.realize(m_state, Stage::Time);
        m_system.prescribeQ(m_state);
        m_system.realize(m_state, Stage::Position);
        // Simbody 3.7 crashes if nothing is free.
        if (!matter.getFreeQIndex(m_state).empty())
            m_system.projectQ(m_state, noErrors, options, results);
        if (occasion == Occasion::Start) {
            m_system.prescribeU(m_state);
            m_system.realize(m_state, Stage::Velocity);
            if (!matter.getFreeUIndex(m_state).empty())
                m_system.projectU(m_state, noErrors, options, results);
        }
        m_system.realize(m_state, Stage::Velocity);
        return true;
    } catch (const std::exception&) {
        m_state.updQ() = q;
        m_state.updU() = u;
        m_system.realize(m_state, Stage::Velocity);
        return false;
    }
}

void ImplicitIntegrator::Implementation::takeSpeedsBeforeLocks(std::vector<double>& u) const {
    // Simbody's lock() writes the locked values into the State immediately.
    std::vector<double> q(m_visible.q.size()), moving(u.size());
    getEquations().getBlocks().getFromState(m_kept, q.data(), moving.data());
    for (size_t i = 0; i < u.size(); ++i)
        if (getEquations().isSpeedKnown(i)) u[i] = moving[i];
}

void ImplicitIntegrator::Implementation::takeZ(const State& state, SolutionPoint& point) {
    for (size_t i = 0; i < point.z.size(); ++i) point.z[i] = state.getZ()[int(i)];
}

void ImplicitIntegrator::Implementation::takePoint(const State& state, SolutionPoint& point) const {
    point.t = state.getTime();
    getEquations().getBlocks().getFromState(state, point.q.data(), point.u.data());
    takeZ(state, point);
}

void ImplicitIntegrator::Implementation::takeState(Occasion occasion, bool forced) {
    // The first step closes the gaps that a start leaves, and counts them as its own error.
    constexpr Real Closest = 1e-13;  // [m, rad], limited by round-off
    const Real tolerance = std::min(settings.ownConstraintTolerance.value_or(LoosestAssembly),
                                    std::max(settings.constraintTolerance, Closest));
    const bool project = occasion == Occasion::Event || projectInitialState;
    const bool hasJoints = getEquations().getTopology().numMultipliers > 0;
    bool isProjected =
        project && hasJoints && projectsByWeights() && projectStateByWeights(occasion, forced);
    SolutionPoint& point = m_visible;
    takePoint(m_state, point);
    m_stepper->enterSmoothSpan(point.t);
    updEquations().setZ(point.z.data());
    // An event that prescribes speeds causes an impact. A run begins with its prescribed speeds.
    std::vector<double> before = point.u;
    updEquations().prescribe(point.t, 0, nullptr, point.q.data(), point.u.data());
    if (project && hasJoints &&
        !(isProjected && m_stepper->updStep().isAssembled(point.t, tolerance, point.q, point.u))) {
        m_stepper->updStep().assemble(point.t, tolerance, point.q, point.u);
        isProjected = false;
    }
    if (project && !(occasion == Occasion::Start && isProjected)) {
        if (occasion == Occasion::Start)
            before = point.u;
        else
            takeSpeedsBeforeLocks(before);
        applyImpulse(
            m_system, getEquations(), m_stepper->updStep(), point.t, point.q, before, point.u,
            m_scratch,
            occasion == Occasion::Start ? ImplicitStep::Shapes::Kept : ImplicitStep::Shapes::Free);
    }
    getEquations().getBlocks().normalizeQ(point.q.data());
    if (getEquations().getTopology().states.empty()) return;
    updEquations().realize(point.t, point.q.data(), point.u.data());
    updEquations().updLoads().startStates(point.z.data());
}

void ImplicitIntegrator::Implementation::checkHistory(const Array_<State>& history,
                                                      int wantedOrder) const {
    const Real spacing = m_waiting.fixedStep;
    const auto refuse = [&](const std::string& what) {
        throw std::invalid_argument(name + "::initialize(): " + what);
    };
    if (history.empty()) refuse("empty history");
    if (!(spacing > 0)) refuse("a starting history needs setFixedStep()");
    if (history.size() > unsigned(SolutionHistory::Capacity))
        refuse("a history holds at most 7 states");
    if (int(history.size()) < wantedOrder)
        refuse("order " + std::to_string(wantedOrder) + " needs as many past states, not " +
               std::to_string(history.size()));
    for (unsigned i = 1; i < history.size(); ++i)
        if (std::abs(history[i].getTime() - history[i - 1].getTime() - spacing) > 1e-9 * spacing)
            refuse("states of the history must be " + std::to_string(spacing) +
                   " s apart, oldest first");
}

void ImplicitIntegrator::Implementation::initialize(const Array_<State>& history, int wantedOrder) {
    runStart([&] {
        checkHistory(history, wantedOrder);
        setUp(history.back());
        takePoint(m_state, m_visible);
        writeState(m_visible, m_state);
        const Vector given = m_state.getY();
        initializeSystem();
        if ((m_state.getY() - given).normInf() > 0) {
            // The run begins with the handlers' State, to which the history does not lead.
            takeState(Occasion::Start, true);
            updateDiscreteVariablesAtStart();
            start();
            return;
        }
        takePoint(m_state, m_visible);
        updateDiscreteVariablesAtStart();
        std::vector<SolutionPoint> points(history.size());
        for (unsigned i = 0; i < history.size(); ++i) {
            State past = copyState(history[i]);
            m_system.realize(past, Stage::Velocity);
            m_stepper->resize(points[i]);
            takePoint(past, points[i]);
        }
        m_stepper->startFrom(points, wantedOrder);
        m_visible = points.back();
        noteStart();
    });
}

}  // namespace simflex
