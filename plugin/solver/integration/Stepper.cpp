// Start, dense output and statistics.
#include "simflex/solver/integration/Stepper.h"

#include <omp.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "simflex/base/Checkpoint.h"
#include "simflex/body/FlexibleBodySubsystem.h"
#include "simflex/solver/equations/StateImage.h"

namespace simflex {

using SimTK::Real;

Stepper::Stepper(std::string name, const SimTK::MultibodySystem& system, const SimTK::State& state,
                 IntegrationScheme& scheme, StepSettings& settings, StepsTaken& taken,
                 IntegratorStatistics& statistics)
    : m_name(std::move(name)),
      m_system(system),
      m_scheme(scheme),
      m_formulas(dynamic_cast<OneStageScheme*>(&scheme)),
      m_settings(settings),
      m_taken(taken),
      m_statistics(statistics),
      m_equations(std::make_unique<Evaluation>(system, state, Topology::Setting::Implicit,
                                               settings.differentiated)),
      m_balance(*m_equations),
      m_breaks(settings.breaks) {
    if (m_formulas)
        m_step = std::make_unique<ImplicitStep>(*m_equations, m_statistics);
    else
        m_step = std::make_unique<RadauStep>(*m_equations, m_statistics);
    // Variables that change only at ends of steps need short steps. Trackers of contacts and cables
    // are exempt, because they only repeat a search.
    for (const SimTK::DiscreteVarKey& key : listAutoUpdates(state)) {
        const SimTK::Subsystem& subsystem = m_system.getSubsystem(key.first);
        m_hasMemory = m_hasMemory || !(SimTK::ContactTrackerSubsystem::isInstanceOf(subsystem) ||
                                       SimTK::CableTrackerSubsystem::isInstanceOf(subsystem));
    }
    m_keepsMatrices = !m_formulas && updStages().keepsMatrices();
    m_step->blockForm = m_settings.blockForm;
    m_step->accuracy = m_settings.accuracy;
    takeAdjustments();

    const Topology& topology = m_equations->getTopology();
    m_history.resize(topology.numQ, topology.numU, topology.numMultipliers, topology.numZ);
    resize(m_new);
    resize(m_trial);
    m_formula.resize(topology.numQ, topology.numU, topology.numZ);
    m_error.q.assign(size_t(topology.numQ), 0);
    m_error.u.assign(size_t(topology.numU), 0);
    m_error.z.assign(size_t(topology.numZ), 0);
    m_samples.resize(topology.numQ, topology.numU, topology.numMultipliers);
}

void Stepper::resize(SolutionPoint& point) const {
    const Topology& topology = m_equations->getTopology();
    point.resize(topology.numQ, topology.numU, topology.numMultipliers, topology.numZ);
}

void Stepper::takeAdjustments() {
    chooseSettings();
    // The step's error is a fraction of the iteration's correction. If that exceeds the accuracy by
    // this factor, the step would be rejected anyway.
    constexpr Real BeyondSense = 1e12;
    m_step->largestChange =
        m_settings.fixedStep > 0 ? SimTK::Infinity : BeyondSense * m_settings.accuracy;
    m_step->forceFullNewton = m_settings.forceFullNewton;
    m_step->observer = m_settings.observer;
    m_step->setNumThreads(m_settings.numThreads > 0 ? m_settings.numThreads
                                                    : omp_get_max_threads());
    if (m_settings.fixedStep > 0) m_nextLength = m_settings.fixedStep;
}

void Stepper::chooseSettings() {
    const bool isFree =
        !m_equations->getTopology().hasModes() && m_settings.fixedStep == 0 && !m_hasMemory;
    const bool hasHighOrder = m_scheme.suit(isFree ? IntegrationScheme::Suitability::HighOrder
                                                   : IntegrationScheme::Suitability::AStable);
    using Norm = ErrorNorm::Kind;
    const bool isSimbodysOwn = !FlexibleBodySubsystem::find(m_system) &&
                               m_settings.formulation == Formulation::StabilizedIndex2 &&
                               m_settings.fixedStep == 0;
    const bool isRelative = m_settings.accuracyNorm == AccuracyNorm::StateWeights ||
                            (m_settings.accuracyNorm == AccuracyNorm::Automatic && isSimbodysOwn);
    if (isRelative && m_equations->getTopology().numFlexible > 0)
        throw std::invalid_argument(m_name +
                                    "::setAccuracyNorm(): StateWeights is for systems without "
                                    "flexible bodies, whose modes' "
                                    "weights follow from what they displace");
    m_equations->updErrorNorm().setKind(!isRelative                  ? Norm::Displacement
                                        : m_settings.useInfinityNorm ? Norm::Infinity
                                                                     : Norm::RootMeanSquare);

    constexpr Real TightTolerance = 1e-10, PartOfAccuracy = 0.1;  // as in SimTK::Integrator
    // Projection is noise to the error test.
    constexpr Real LargestNoise = 0.01;
    m_settings.constraintTolerance = m_settings.ownConstraintTolerance.value_or(
        isRelative ? PartOfAccuracy * m_settings.accuracy
                   : std::min(TightTolerance, LargestNoise * m_settings.accuracy));
    m_step->tolerances =
        m_settings.ownNewtonTolerances.value_or(ImplicitIntegrator::NewtonTolerances());
    if (m_settings.ownNewtonTolerances) return;
    if (!m_formulas) {
        // Errors of steps may be far below the accuracy, and those of the iteration should not
        // dominate. An old matrix leaves the same error in every step.
        m_step->tolerances.displacement = m_keepsMatrices ? 1e-4 : 1e-3;
        m_step->tolerances.multiplier = 1e-4;
        return;
    }
    // In relative norms errors of speeds count directly, not by their effect in a step.
    if (!isRelative || !hasHighOrder) return;
    m_step->tolerances.displacement = 0.1;
    m_step->tolerances.multiplier = 1e-4;
}

double Stepper::calcLongestLength() const {
    return m_settings.maximumStep > 0
               ? m_settings.maximumStep
               : std::max({m_system.getDefaultTimeScale(), m_settings.initialStep,
                           m_settings.minimumStep, m_settings.fixedStep});
}

void Stepper::complete(SolutionPoint& point) {
    m_equations->updFunctions().forget();
    m_equations->setZ(point.z.data());
    m_step->calcAccelerations(point.t, point.q, point.u, point.uDot, point.lambda);
    m_equations->updFrictions().keep(0);
    point.constraintError = m_step->calcPositionError(point.t, point.q, point.u);
    m_equations->updBlocks().followPose();
    m_equations->getBlocks().calcQDot(point.q.data(), point.u.data(), point.qDot.data());
    m_equations->calcZDot(point.q.data(), point.u.data(), point.uDot.data(), point.z.data(),
                          point.zDot.data());
    point.power = m_equations->calcPower(point.q.data(), point.u.data(), point.uDot.data(),
                                         point.lambda.data());
    point.a = point.uDot;
}

void Stepper::start(SolutionPoint& point) {
    m_equations->updFrictions().forgetSwitch();
    complete(point);
    m_history.clear();
    m_history.push() = point;
    m_numRedundantAtStart = m_statistics.redundantConstraints;
    forgetPast();
    constexpr Real LongestFraction = 1e-2;  // of the system's time scale
    m_nextLength = chooseFirstLength(point, LongestFraction * m_system.getDefaultTimeScale());
    m_speedTime = 0;
}

void Stepper::startFrom(std::vector<SolutionPoint>& points, int order) {
    enterSmoothSpan(points.back().t);
    m_history.clear();
    const SolutionPoint* before = nullptr;
    for (SolutionPoint& point : points) {
        m_equations->getBlocks().normalizeQ(point.q.data());
        // Quaternions of opposite sign are the same rotation; the polynomial needs one branch.
        for (int b = 0; before && b < m_equations->getTopology().numBlocks(); ++b) {
            const Block& block = m_equations->getBlock(b);
            block.alignQ(before->q.data() + block.firstQ, point.q.data() + block.firstQ);
        }
        complete(point);
        point.work =
            before ? before->work + 0.5 * m_settings.fixedStep * (before->power + point.power) : 0;
        m_history.push() = point;
        before = &point;
    }
    m_numRedundantAtStart = m_statistics.redundantConstraints;
    ++m_statistics.starts;
    m_nextLength = m_settings.fixedStep;
    m_order = order;
}

void Stepper::restart() {
    complete(m_history.newest());
    forgetPast();
}

void Stepper::forgetPast() {
    m_history.startAtNewest();
    if (!m_formulas) updStages().forgetError();
    ++m_statistics.starts;
    m_controller.restart();
    m_order = std::min(m_scheme.getLowestOrder(), m_scheme.getHighestOrder(m_history));
    m_stepsAtOrder = 0;
}

void Stepper::enterSmoothSpan(double time) {
    m_breaks.moveTo(time);
    m_equations->updFunctions().setSmoothSpan(m_breaks.getFirst(), m_breaks.getLast());
}

double Stepper::chooseFirstLength(const SolutionPoint& point, double longest) {
    if (m_settings.fixedStep > 0) return m_settings.fixedStep;
    if (m_settings.initialStep > 0) return std::min(m_settings.initialStep, calcLongestLength());
    // Rate of change of u̇, from accelerations a short way along the Taylor series.
    const double acceleration = m_equations->getBlocks().calcDisplacement(point.uDot.data());
    double delta = 1e-2 * longest;
    if (acceleration > 0)
        delta = std::min(delta, 0.1 * std::sqrt(m_settings.accuracy / acceleration));
    double h = longest;
    try {
        m_new = point;
        m_new.t = point.t + delta;
        for (size_t i = 0; i < point.u.size(); ++i) {
            m_error.u[i] = delta * point.u[i] + 0.5 * delta * delta * point.uDot[i];
            m_new.u[i] = point.u[i] + delta * point.uDot[i];
        }
        m_step->calcPositionError(point.t, point.q, point.u);
        m_equations->getBlocks().displaceQ(m_error.u.data(), m_new.q.data());
        m_step->calcAccelerations(m_new.t, m_new.q, m_new.u, m_new.uDot, m_new.lambda);
        for (size_t i = 0; i < point.u.size(); ++i)
            m_error.u[i] = (m_new.uDot[i] - point.uDot[i]) / delta;
        const double jerk = m_equations->getBlocks().calcDisplacement(m_error.u.data());
        const double allowed = StepController::Target * m_settings.accuracy /
                               std::max(m_formulas ? m_formulas->getFirstErrorConstant() : 0, 1e-2);
        if (jerk > 0) h = std::cbrt(allowed / jerk);
        const double jerkSize = m_equations->updErrorNorm().calcChange(m_error.u.data(), 0);
        if (jerkSize > 0) h = std::min(h, std::sqrt(allowed / jerkSize));
    } catch (const std::runtime_error&) {
        h = delta;  // the first step will say what is wrong
    } catch (const SimTK::Exception::Base&) {
        h = delta;
    }
    return std::min(std::max(std::min(h, longest), 10 * m_settings.minimumStep),
                    calcLongestLength());
}

void Stepper::calcPoint(double t, SolutionPoint& point) {
    const SolutionPoint& newest = m_history[0];
    if (!isLater(t, newest.t)) {
        point = newest;
        // An event at t must not stay ahead of the State by round-off, or it would recur forever.
        point.t = std::max(t, newest.t);
        return;
    }
    point.t = t;
    const IntegrationScheme::DenseNodes nodes = m_scheme.getDenseNodes(m_taken.lastOrder);
    const int valueNodes = std::min(nodes.values, m_history.numNodes());
    const SolutionHistory::Weights weights = m_history.calcInterpolation(valueNodes, t);
    m_history.combineQ(weights, point.q);
    m_history.combineU(weights, point.u);
    m_history.combineZ(weights, point.z);
    m_history.extrapolateLambda(std::min(nodes.lambda, valueNodes), t, point.lambda);
    point.work = m_history.combineWork(weights);
    m_equations->getBlocks().normalizeQ(point.q.data());
    m_equations->prescribe(t, 0, nullptr, point.q.data(), point.u.data());
    if (m_settings.projectInterpolatedStates && m_equations->getTopology().numMultipliers > 0 &&
        m_step->canProject()) {
        point.constraintError =
            m_step->projectBetweenSteps(t, m_settings.constraintTolerance, point.q, point.u);
        m_step->projectSpeeds(t, point.q, point.u);
    } else {
        const bool hasError =
            m_equations->getTopology().numMultipliers > 0 || m_equations->getBlocks().askForN();
        point.constraintError = hasError ? m_step->calcPositionError(t, point.q, point.u) : 0;
    }
    m_history.interpolateUDot(nodes.uDot, t, point.uDot);
}

void Stepper::balance(SolutionPoint& point) {
    // The starting point is exact.
    if (m_history.size() < 2 || m_taken.lastLength == 0) return;
    constexpr double PartOfStep = 0.25;  // about that of Radau's matrix
    PointBalance::Options options;
    options.isDense = m_step->useDense();
    options.isRedundant = m_statistics.redundantConstraints > 0;
    options.hasLateBlocks = m_step->hasLateBlocks();
    options.numThreads = m_equations->getBlocks().numThreads;
    m_balance.calc(PartOfStep * m_taken.lastLength, options, point);
}

void Stepper::endLastStep(double end) {
    if (end < m_history[0].t) m_equations->updFrictions().forgetSwitch();
    cutLastStep(end);
}

void Stepper::cutLastStep(double end) {
    // The same polynomial, through the stages of the shorter step.
    std::vector<SolutionPoint> points;
    if (solvesStages()) {
        const double start = m_history[radau::NumStages].t;
        for (int i = 0; i + 1 < radau::NumStages; ++i) {
            calcPoint(start + radau::C[i] * (end - start), m_trial);
            points.push_back(m_trial);
        }
    }
    calcPoint(end, m_trial);
    points.push_back(m_trial);
    m_history.replaceNewest(points);
}

void Stepper::bookPhases() {
    m_step->addInTiming();
    // Simbody's time is included in that of evaluations.
    const double simbody = m_equations->updSimbody().takeSeconds();
    m_statistics.simbodySeconds += simbody;
    m_statistics.evaluationSeconds -= simbody;
}

void Stepper::visit(Checkpoint& c) {
    m_history.visit(c);
    if (m_history.size() == 0) Checkpoint::refuse("it has no solution to continue from");
    for (int age = 0; age < m_history.size(); ++age)
        if (!std::isfinite(m_history[age].t) ||
            (age > 0 && !(m_history[age].t < m_history[age - 1].t)))
            Checkpoint::refuse("its points do not follow each other in time");
    m_new.visit(c);
    m_controller.visit(c);
    c.visit(m_nextLength, m_speedTime);
    c.visitWithin(m_order, 1, 5, "the order");
    c.visit(m_stepsAtOrder, m_numRedundantAtStart);
    m_breaks.visit(c);
    m_equations->updFunctions().setSmoothSpan(m_breaks.getFirst(), m_breaks.getLast());
    m_equations->visit(c);
    m_step->visit(c);
}

}  // namespace simflex
