#include "simflex/solver/BdfIntegratorImpl.h"

#include <omp.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <sstream>

namespace simflex {

using SimTK::Array_;
using SimTK::Real;
using SimTK::Stage;
using SimTK::State;
using SimTK::Vector;
using Clock = std::chrono::steady_clock;

namespace {

double secondsSince(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
}

/** As many threads as OpenMP offers and the bodies can feed: a parallel loop must outlast its
 * barrier. **/
int chooseNumThreads(const MultibodyEquations& equations) {
    constexpr double FlopsPerThread = 2e5;
    double flops = 0;  // two passes over the invariants, 36 n_f²
    for (int b = 0; b < equations.numBlocks(); ++b)
        flops += 36.0 * std::pow(equations.getBlock(b).numU, 2);
    return std::clamp(int(flops / FlopsPerThread), 1, omp_get_max_threads());
}

/** True if b is a later time than a by more than round-off. **/
bool isLater(double a, double b) {
    return b - a > 1e-13 * std::max(1.0, std::abs(a));
}

}  // namespace

BdfIntegrator::Implementation::Implementation(const SimTK::MultibodySystem& system)
    : m_system(system), m_events(system) {}

void BdfIntegrator::Implementation::requireInitialized(const char* method) const {
    if (!m_isInitialized)
        throw std::logic_error(std::string("BdfIntegrator::") + method + "() before initialize()");
}

//-------------------------------------------------------------------------------------------------------------
//start

void BdfIntegrator::Implementation::setUp(const State& state) {
    m_isInitialized = m_isTerminated = false;
    if (!m_system.systemTopologyHasBeenRealized())
        throw std::invalid_argument(
            "BdfIntegrator::initialize(): call realizeTopology() on the system first");
    if (state.getSystemStage() < Stage::Topology)
        throw std::invalid_argument(
            "BdfIntegrator::initialize(): an empty State; take one from realizeTopology()");
    checkSettings(state.getTime());
    m_state = state;
    m_system.realize(m_state, Stage::Velocity);
    m_step.reset();
    m_equations.reset();
    statistics = IntegratorStatistics();
    m_hasTriggered = false;
    m_order = 1;
    m_stepsAtOrder = lastOrder = 0;
    lastStep = constraintError = visibleWork = 0;
    visibleTime = m_state.getTime();
    buildEquations();
    m_events.initialize(m_state);
}

void BdfIntegrator::Implementation::checkSettings(Real startTime) const {
    const auto refuse = [](const std::string& what) {
        throw std::invalid_argument("BdfIntegrator: " + what);
    };
    if (fixedOrder > maximumOrder) refuse("setMaximumOrder() is below setFixedOrder()");
    if (fixedStep > 0 && fixedStep > maximumStep)
        refuse("setMaximumStepSize() is below setFixedStep()");
    if (minimumStep > maximumStep) refuse("setMaximumStepSize() is below setMinimumStepSize()");
    if (finalTime < startTime)
        refuse("setFinalTime() " + std::to_string(finalTime) + " s is before the State's time " +
               std::to_string(startTime) + " s");
}

void BdfIntegrator::Implementation::buildEquations() {
    m_scratch = m_state;
    if (m_equations) bookPhases();
    m_equations = std::make_unique<MultibodyEquations>(m_system, m_state);
    m_step = std::make_unique<ImplicitStep>(*m_equations, statistics);
    m_step->tolerances = newtonTolerances;
    m_step->blockForm = blockForm;
    m_step->accuracy = accuracy;
    m_step->observer = observer;
    m_step->setNumThreads(numThreads > 0 ? numThreads : chooseNumThreads(*m_equations));

    const int nq = m_equations->numQ(), nu = m_equations->numU(), m = m_equations->numMultipliers();
    for (auto* vector : {&m_q, &m_qHist, &m_qPredicted, &m_errorQ, &m_visibleQ})
        vector->assign(nq, 0);
    for (auto* vector :
         {&m_u, &m_uDot, &m_uHist, &m_uPredicted, &m_errorU, &m_visibleU, &m_visibleUDot})
        vector->assign(nu, 0);
    for (auto* vector : {&m_lambda, &m_visibleLambda}) vector->assign(m, 0);
}

void BdfIntegrator::Implementation::initialize(const State& state) {
    setUp(state);
    const auto start = Clock::now();
    restart(projectInitialState);
    m_isInitialized = true;
    statistics.totalSeconds += secondsSince(start);
}

void BdfIntegrator::Implementation::restart(bool project) {
    m_equations->getFromState(m_state, m_q.data(), m_u.data());
    m_equations->prescribe(visibleTime, 0, nullptr, m_q.data(), m_u.data());
    if (project && m_equations->numMultipliers() > 0)
        m_step->assemble(visibleTime, constraintTolerance, m_q, m_u);
    m_equations->normalizeQ(m_q.data());
    m_step->calcAccelerations(visibleTime, m_q, m_u, m_uDot, m_lambda);

    // A second point backwards along the Taylor series gives the predictor its slope.
    m_nextStep = chooseInitialStep(m_uDot);
    const double h = m_nextStep;
    std::vector<double> delta(m_u.size()), uBack(m_u.size()), qBack = m_q;
    for (size_t i = 0; i < m_u.size(); ++i) {
        delta[i] = -h * m_u[i] + 0.5 * h * h * m_uDot[i];
        uBack[i] = m_u[i] - h * m_uDot[i];
    }
    const double error = m_step->calcPositionError(visibleTime, m_q, m_u);
    m_equations->displaceQ(delta.data(), qBack.data());
    m_history.clear();
    pushPoint(visibleTime - h,
              visibleWork - h * m_equations->calcPower(m_q.data(), m_u.data(), m_uDot.data(),
                                                       m_lambda.data()),
              error, qBack,
              uBack, m_lambda, m_uDot);
    pushPoint(visibleTime, visibleWork, error, m_q, m_u, m_lambda, m_uDot);
    m_realPoints = 1;
    m_order = 1;
    m_stepsAtOrder = 0;
    showPoint(visibleTime);
    m_hasTriggered = false;
    if (m_events.hasTriggers()) m_triggersBefore = m_events.calcTriggers(getState());
}

void BdfIntegrator::Implementation::initialize(const Array_<State>& history) {
    if (history.empty()) throw std::invalid_argument("BdfIntegrator::initialize(): empty history");
    if (!(fixedStep > 0))
        throw std::invalid_argument(
            "BdfIntegrator::initialize(): a starting history needs setFixedStep()");
    if (history.size() > unsigned(BdfHistory::Capacity))
        throw std::invalid_argument(
            "BdfIntegrator::initialize(): a history holds at most 7 states");
    const int wantedOrder = fixedOrder > 0 ? fixedOrder : maximumOrder;
    if (int(history.size()) < wantedOrder)
        throw std::invalid_argument(
            "BdfIntegrator::initialize(): order " + std::to_string(wantedOrder) +
            " needs as many past states, not " + std::to_string(history.size()));
    for (unsigned i = 1; i < history.size(); ++i)
        if (std::abs(history[i].getTime() - history[i - 1].getTime() - fixedStep) >
            1e-9 * fixedStep)
            throw std::invalid_argument(
                "BdfIntegrator::initialize(): states of the history must be " +
                std::to_string(fixedStep) + " s apart, oldest first");
    setUp(history.back());
    m_history.clear();
    m_realPoints = 0;
    double work = 0, lastPower = 0;
    for (const State& state : history) {
        State past = state;
        m_system.realize(past, Stage::Velocity);
        m_equations->getFromState(past, m_q.data(), m_u.data());
        m_equations->normalizeQ(m_q.data());
        if (m_realPoints > 0) {
            // Quaternions of opposite sign are the same rotation; the polynomial needs one branch.
            const BdfPoint& previous = m_history[0];
            for (int b = 0; b < m_equations->numBlocks(); ++b)
                m_equations->getBlock(b).alignQ(previous.q.data() + m_equations->getBlock(b).firstQ,
                                                m_q.data() + m_equations->getBlock(b).firstQ);
        }
        m_step->calcAccelerations(past.getTime(), m_q, m_u, m_uDot, m_lambda);
        const double error = m_step->calcPositionError(past.getTime(), m_q, m_u);
        const double power = m_equations->calcPower(m_q.data(), m_u.data(), m_uDot.data(), m_lambda.data());
        if (m_realPoints > 0) work += 0.5 * fixedStep * (lastPower + power);
        lastPower = power;
        pushPoint(past.getTime(), work, error, m_q, m_u, m_lambda, m_uDot);
        ++m_realPoints;
    }
    m_nextStep = fixedStep;
    m_order = std::min(m_realPoints, wantedOrder);
    visibleTime = m_history[0].t;
    showPoint(visibleTime);
    if (m_events.hasTriggers()) m_triggersBefore = m_events.calcTriggers(getState());
    m_isInitialized = true;
}

Real BdfIntegrator::Implementation::chooseInitialStep(const std::vector<double>& uDot) const {
    if (fixedStep > 0) return fixedStep;
    if (initialStep > 0) return std::min(initialStep, maximumStep);
    // Error of the first, order-1 step: ½h²|u̇|, a tenth of it allowed.
    const double acceleration = m_equations->calcDisplacement(uDot.data());
    const double h = acceleration > 0 ? std::sqrt(0.2 * accuracy / acceleration) : 1e-4;
    return std::min(std::max(std::min(h, Real(1e-3)), 10 * minimumStep), maximumStep);
}

void BdfIntegrator::Implementation::pushPoint(double t, double work, double error,
                                              const std::vector<double>& q,
                                              const std::vector<double>& u,
                                              const std::vector<double>& lambda,
                                              const std::vector<double>& uDot) {
    BdfPoint& point = m_history.push();
    point.t = t;
    point.work = work;
    point.constraintError = error;
    point.q = q;
    point.u = u;
    point.lambda = lambda;
    point.uDot = uDot;
}

//--------------------------------------------------------------------------------------------------------
//single step

bool BdfIntegrator::Implementation::attemptStep(double h, int order, double* error) {
    ++statistics.stepsAttempted;
    m_newTime = m_history[0].t + h;
    const double gamma = m_history.calcGamma(order, m_newTime);
    const double workHist = m_history.calcHistoryPart(order, m_newTime, m_qHist, m_uHist);
    const int points = std::min(order + 1, m_history.size());
    m_history.extrapolateQ(points, m_newTime, m_qPredicted);
    m_history.extrapolateU(points, m_newTime, m_uPredicted);
    m_history.extrapolateLambda(std::min(2, m_realPoints), m_newTime, m_lambda);
    m_q = m_qPredicted;
    m_u = m_uPredicted;

    // Index 3 is never started or restarted at order 1: at a step change its multipliers would be
    // wrong by O(1).
    const Formulation form =
        order == 1 && fixedOrder != 1 ? Formulation::StabilizedIndex2 : formulation;
    m_outcome = m_step->solve(m_newTime, m_qHist, m_uHist, gamma, form, m_q, m_u, m_lambda);
    if (!m_outcome.converged) return false;

    m_equations->calcStepUDot(m_q.data(), m_u.data(), m_uHist.data(), gamma, m_uDot.data());
    if (form == Formulation::StabilizedIndex2) {
        m_newConstraintError = m_step->projectPositions(m_newTime, constraintTolerance, m_q, m_u,
                                                        &m_worstProjectedRow);
        if (!(m_newConstraintError <= constraintTolerance)) return false;
    } else {
        m_newConstraintError = m_step->calcPositionError(m_newTime, m_q, m_u);
    }
    m_newWork = workHist + gamma * m_equations->calcPower(m_q.data(), m_u.data(), m_uDot.data(), m_lambda.data());
    m_equations->normalizeQ(m_q.data());
    *error = fixedStep > 0 ? 0 : calcError(order);
    return true;
}

double BdfIntegrator::Implementation::calcError(int order) const {
    if (m_history.size() < order + 1) return 0;
    const double factor = m_history.calcErrorFactor(order, m_newTime);
    m_history.extrapolateQ(order + 1, m_newTime, m_errorQ);
    m_history.extrapolateU(order + 1, m_newTime, m_errorU);
    for (size_t i = 0; i < m_q.size(); ++i) m_errorQ[i] = factor * (m_q[i] - m_errorQ[i]);
    for (size_t i = 0; i < m_u.size(); ++i) m_errorU[i] = factor * (m_u[i] - m_errorU[i]);
    m_equations->clearPrescribedErrors(m_errorQ.data(), m_errorU.data());
    return m_equations->calcErrorDisplacement(m_errorQ.data(), m_errorU.data(),
                                              m_newTime - m_history[0].t) /
           accuracy;
}

void BdfIntegrator::Implementation::chooseNextStep(double error, double h, int order) {
    if (fixedStep > 0) {
        m_nextStep = fixedStep;
        m_order = std::min(
            {fixedOrder > 0 ? fixedOrder : maximumOrder, m_realPoints + 1, BdfHistory::MaxOrder});
        return;
    }
    // Candidate orders k−1, k, k+1; the one that allows the longest step wins, the present one by
    // preference.
    const auto growth = [](double err, int k, double safety) {
        return std::pow(std::max(safety * err, 1e-10), -1.0 / (k + 1));
    };
    double best = growth(error, order, 2.0);
    int bestOrder = order;
    ++m_stepsAtOrder;
    const int lowest = fixedOrder > 0 ? fixedOrder : 1;
    if (order > lowest && order > 2) {
        const double lower = growth(calcError(order - 1), order - 1, 3.0);
        if (lower > best) best = lower, bestOrder = order - 1;
    }
    const bool mayRaise = order < maximumOrder && (order == 1 || m_stepsAtOrder > order);
    if (mayRaise && m_history.size() >= order + 2 && m_realPoints > order) {
        const double higher = growth(calcError(order + 1), order + 1, order < lowest ? 0.1 : 4.0);
        if (higher > best || order < lowest) best = std::max(higher, best), bestOrder = order + 1;
    }
    if (bestOrder != order) m_stepsAtOrder = 0;
    m_order = bestOrder;
    // A step that could grow a little stays: a new γ costs a factorization. Ratio 2 is within
    // zero-stability for order 2.
    const double ratio =
        best < 1.25 && best > 0.95 ? 1 : std::clamp(best, 0.3, m_order <= 2 ? 2.0 : 1.5);
    m_nextStep = std::min(h * ratio, maximumStep);
}

void BdfIntegrator::Implementation::takeStep(double limit) {
    double h = std::min(m_nextStep, maximumStep);
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
    int order = std::min(m_order, m_history.size());
    int failures = 0, retries = 0;
    for (;;) {
        double error = 0;
        const bool converged = attemptStep(h, order, &error);
        if (converged && error <= 1) {
            // m_history still lacks the new point: the estimates of other orders need it so.
            chooseNextStep(error, h, order);
            if (isCut && failures == 0 && m_nextStep < wanted)
                m_nextStep = std::max(m_nextStep, std::min(wanted, 2 * h));
            pushPoint(m_newTime, m_newWork, m_newConstraintError, m_q, m_u, m_lambda, m_uDot);
            ++m_realPoints;
            ++statistics.stepsTaken;
            lastStep = h;
            lastOrder = order;
            return;
        }
        if (converged) {
            ++statistics.errorTestFailures;
            h *= std::clamp(std::pow(2 * error, -1.0 / (order + 1)), 0.2, 0.9);
            if (++failures > 2) order = 1;
        } else {
            ++statistics.convergenceFailures;
            if (!m_outcome.converged && m_outcome.retryWorthwhile && retries++ < 2) continue;
            retries = 0;
            if (fixedStep > 0)
                failStep(h, "Newton's iteration did not converge with the fixed step");
            h *= 0.25;
            ++failures;
        }
        m_stepsAtOrder = 0;
        if (!(h >= minimumStep))
            failStep(h, converged ? "the error test keeps failing"
                        : m_outcome.converged
                            ? "the positions cannot be brought back onto the joints"
                            : "Newton's iteration does not converge");
    }
}

void BdfIntegrator::Implementation::failStep(double h, const std::string& reason) const {
    std::ostringstream text;
    text << "BdfIntegrator: no step could be taken from t = " << m_history[0].t << " s (h = " << h
         << " s): " << reason << "; ";
    const std::string& body = m_equations->getBlock(m_outcome.worstBlock).name;
    if (!m_outcome.isFinite)
        text << "forces or positions of '" << body << "' are not finite numbers";
    else if (m_outcome.converged && m_worstProjectedRow >= 0)
        text << "joint '" << m_equations->getJointName(m_worstProjectedRow)
             << "' keeps an error of " << m_newConstraintError << " (allowed "
             << constraintTolerance << ")";
    else
        text << "worst body '" << body << "' moves by " << m_outcome.displacementChange
             << " m in the last iteration";
    if (m_outcome.isFinite && !m_outcome.converged && m_outcome.worstRow >= 0)
        text << ", joint '" << m_equations->getJointName(m_outcome.worstRow) << "' has residual "
             << m_outcome.constraintResidual;
    text << ". The last good State is kept; a singular position, a contradictory joint or a load "
            "that changes faster "
            "than the step can follow are usual causes";
    throw std::runtime_error(text.str());
}

//-------------------------------------------------------------------------------------------------------------
//output

void BdfIntegrator::Implementation::writeState(double t, const std::vector<double>& q,
                                               const std::vector<double>& u, State& state) const {
    m_equations->putIntoState(t, q.data(), u.data(), state);
    m_system.realize(state, Stage::Velocity);
}

void BdfIntegrator::Implementation::showPoint(double t) {
    m_stateIsCurrent = false;
    visibleTime = t;
    const BdfPoint& newest = m_history[0];
    if (!isLater(t, newest.t)) {
        m_visibleQ = newest.q;
        m_visibleU = newest.u;
        m_visibleLambda = newest.lambda;
        m_visibleUDot = newest.uDot;
        visibleWork = newest.work;
        constraintError = newest.constraintError;
        return;
    }
    const int points = std::min({lastOrder + 1, m_realPoints, m_history.size()});
    m_history.extrapolateQ(points, t, m_visibleQ);
    m_history.extrapolateU(points, t, m_visibleU);
    m_history.extrapolateLambda(points, t, m_visibleLambda);
    visibleWork = m_history.extrapolateWork(points, t);
    m_equations->normalizeQ(m_visibleQ.data());
    m_equations->prescribe(t, 0, nullptr, m_visibleQ.data(), m_visibleU.data());
    if (m_equations->numMultipliers() > 0 && m_step->canProject()) {
        constraintError = m_step->projectPositions(t, constraintTolerance, m_visibleQ, m_visibleU);
        m_step->projectSpeeds(t, m_visibleQ, m_visibleU);
    } else {
        constraintError = m_step->calcPositionError(t, m_visibleQ, m_visibleU);
    }
    const double fraction = (t - m_history[1].t) / (newest.t - m_history[1].t);
    for (size_t i = 0; i < m_visibleUDot.size(); ++i)
        m_visibleUDot[i] = (1 - fraction) * m_history[1].uDot[i] + fraction * newest.uDot[i];
}

const State& BdfIntegrator::Implementation::getState() const {
    if (!m_stateIsCurrent) {
        auto& self = const_cast<Implementation&>(*this);
        writeState(visibleTime, m_visibleQ, m_visibleU, self.m_state);
        m_stateIsCurrent = true;
    }
    return m_state;
}

Vector BdfIntegrator::Implementation::calcUDot() const {
    return m_equations->calcSimbodyUDot(m_visibleQ.data(), m_visibleUDot.data());
}

Vector BdfIntegrator::Implementation::calcMultipliers(const SimTK::Constraint& constraint) const {
    const std::pair<int, int> rows = m_equations->findRows(constraint.getConstraintIndex());
    return Vector(rows.second, m_visibleLambda.data() + rows.first);
}

Vector BdfIntegrator::Implementation::calcMultipliers(const Joint* joint) const {
    if (!joint) return Vector(int(m_visibleLambda.size()), m_visibleLambda.data());
    return Vector(joint->getNumEquations(),
                  m_visibleLambda.data() + m_equations->getFirstRow(joint->getIndex()));
}

//------------------------------------------------------------------------------------------------------------
//driving

bool BdfIntegrator::Implementation::locateTrigger(const Vector& before, double tBefore) {
    const auto triggersAt = [&](double t) {
        showPoint(t);
        writeState(t, m_visibleQ, m_visibleU, m_scratch);
        return m_events.calcTriggers(m_scratch);
    };
    double high = m_history[0].t, low = tBefore;
    Vector atHigh = triggersAt(high);
    if (!m_events.isTriggered(before, atHigh)) {
        m_triggersBefore = atHigh;
        return false;
    }
    // Bisection to round-off on the step's own polynomial; no step is repeated.
    while (isLater(low, high)) {
        const double middle = 0.5 * (low + high);
        if (middle <= low || middle >= high) break;
        const Vector atMiddle = triggersAt(middle);
        if (m_events.isTriggered(before, atMiddle)) {
            high = middle;
            atHigh = atMiddle;
        } else {
            low = middle;
        }
    }
    m_triggersAfter = atHigh;
    showPoint(high);
    BdfPoint& newest = m_history.newest();
    newest = {high,       visibleWork,     constraintError, m_visibleQ,
              m_visibleU, m_visibleLambda, m_visibleUDot};
    return true;
}

void BdfIntegrator::Implementation::takeOver(const EventDriver::Outcome& outcome) {
    m_isTerminated = outcome.shouldTerminate;
    m_system.realize(m_state, Stage::Velocity);
    if (!outcome.hasChangedState && !m_hasTriggered) return;
    // A State that cannot be started from leaves nothing to go on with.
    m_isInitialized = false;
    if (outcome.hasChangedState)
        buildEquations();  // discrete variables may have changed at any stage
    restart(true);
    m_isInitialized = true;
}

BdfIntegrator::StepStatus BdfIntegrator::Implementation::advance(Real goal) {
    while (!m_isTerminated) {
        const auto eventStart = Clock::now();
        const State& state = getState();
        const Real reportTime = m_events.calcNextReportTime(state);
        const Real eventTime = m_events.calcNextEventTime(state);
        statistics.simbodySeconds += secondsSince(eventStart);
        Real target = std::min({goal, reportTime, eventTime});
        const Real limit = std::min(eventTime, finalTime);
        while (isLater(m_history[0].t, target) && !m_hasTriggered) {
            const double tBefore = m_history[0].t;
            takeStep(limit);
            if (m_events.hasTriggers()) m_hasTriggered = locateTrigger(m_triggersBefore, tBefore);
        }
        if (m_hasTriggered) target = std::min(target, m_history[0].t);
        const bool isAtTrigger = m_hasTriggered && target >= m_history[0].t;
        showPoint(target);

        if (reportTime <= target) {
            const auto reportStart = Clock::now();
            m_events.report(getState());
            statistics.outputSeconds += secondsSince(reportStart);
        }
        if (isAtTrigger || eventTime <= target) {
            const auto handlerStart = Clock::now();
            getState();
            const EventDriver::Outcome outcome =
                isAtTrigger
                    ? m_events.handleTriggered(m_state, m_triggersBefore, m_triggersAfter, accuracy)
                    : m_events.handleScheduled(m_state, accuracy);
            statistics.simbodySeconds += secondsSince(handlerStart);
            takeOver(outcome);
            continue;
        }
        if (target >= goal) break;
    }
    if (m_isTerminated) return StepStatus::Terminated;
    return visibleTime >= finalTime ? StepStatus::ReachedFinalTime : StepStatus::ReachedTime;
}

void BdfIntegrator::Implementation::bookPhases() {
    m_step->addInTiming();
    // Asking Simbody happens within evaluations.
    const double simbody = m_equations->takeSimbodySeconds();
    statistics.simbodySeconds += simbody;
    statistics.evaluationSeconds -= simbody;
}

template <class Work>
BdfIntegrator::StepStatus BdfIntegrator::Implementation::runTimed(Work work) {
    const auto start = Clock::now();
    const auto book = [&] {
        bookPhases();
        statistics.totalSeconds += secondsSince(start);
    };
    try {
        const StepStatus status = work();
        book();
        return status;
    } catch (...) {
        if (m_isInitialized && isLater(visibleTime, m_history[0].t)) showPoint(m_history[0].t);
        book();
        throw;
    }
}

BdfIntegrator::StepStatus BdfIntegrator::Implementation::stepTo(Real time) {
    if (!(time >= visibleTime))
        throw std::invalid_argument("BdfIntegrator::stepTo(): time " + std::to_string(time) +
                                    " s is before " + std::to_string(visibleTime) +
                                    " s, which is reached already");
    return runTimed([&] { return advance(std::min(time, finalTime)); });
}

BdfIntegrator::StepStatus BdfIntegrator::Implementation::stepOnce() {
    return runTimed([&] {
        const Real eventTime = m_events.calcNextEventTime(getState());
        const bool isAtNewest = !isLater(visibleTime, m_history[0].t);
        if (isAtNewest && isLater(visibleTime, finalTime) && isLater(visibleTime, eventTime) &&
            !m_events.hasTriggers())
            takeStep(std::min(eventTime, finalTime));
        const bool hasStep = isLater(visibleTime, m_history[0].t);
        return advance(
            std::min(finalTime, hasStep ? Real(m_history[0].t) : visibleTime + m_nextStep));
    });
}

}  // namespace simflex
