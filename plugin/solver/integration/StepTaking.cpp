// One step: attempts, their error, order and length of the next one.
#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "simflex/base/Chunk.h"
#include "simflex/solver/integration/FailureDiagnosis.h"
#include "simflex/solver/integration/Stepper.h"

namespace simflex {

using SimTK::State;

bool Stepper::tryStep(double h, int order, double* error) {
    m_fault.clear();
    try {
        if (!attemptStep(h, order, error)) return false;
        const auto areGood = [](const std::vector<double>& values) {
            return areUsable(values.data(), int(values.size()));
        };
        if (std::isnan(*error) || !areGood(m_new.uDot) || !areGood(m_new.lambda) ||
            !areGood(m_new.z) || !areGood(m_new.zDot) || !std::isfinite(m_new.work))
            throw UnusablePoint(
                "the step ends where accelerations, forces of joints or its error "
                "are not finite numbers",
                std::max(m_taken.worstBlock, 0));
        return true;
    } catch (const UnusablePoint& fault) {
        m_outcome = ImplicitStep::Outcome();
        m_outcome.worstBlock = std::max(fault.block, 0);
        m_fault = fault.what();
    } catch (const SimTK::Exception::Base& fault) {
        m_outcome = ImplicitStep::Outcome();
        m_fault = fault.getMessage();
    }
    m_outcome.isFinite = false;
    m_step->invalidateMatrix();
    return false;
}

bool Stepper::attemptStep(double h, int order, double* error) {
    if (solvesStages()) return attemptStages(h, error);
    ++m_statistics.stepsAttempted;
    const long iterationsBefore = m_statistics.newtonIterations;
    const double t = m_history[0].t + h;
    m_equations->updErrorNorm().setReference(m_history[0].q.data(), m_history[0].u.data(),
                                             m_history[0].z.data());
    m_history.setNumThreads(m_equations->getBlocks().numThreads);
    updFormulas().calcFormula(m_history, order, t, m_formula);
    m_new.t = t;
    const SolutionHistory::Weights prediction =
        m_history.calcInterpolation(std::min(order + 1, m_history.numNodes()), t);
    // q follows from u; only evaluations by Simbody need its prediction.
    if (!m_equations->canEvaluateByBlocks()) m_history.combineQ(prediction, m_new.q);
    m_history.combineU(prediction, m_new.u);
    m_history.combineZ(prediction, m_new.z);
    const int pointsOfLambda =
        m_equations->updErrorNorm().isInMetres() ? 2 : std::clamp(order, 2, 4);
    predictLambda(pointsOfLambda, m_new);

    m_outcome = m_solvesPositions ? m_step->solveNearSingularity(m_formula, m_new)
                                  : m_step->solve(m_formula, m_settings.formulation, m_new);
    if (!m_outcome.converged) {
        m_failure = Failure::Convergence;
        m_statistics.divergentIterations += m_statistics.newtonIterations - iterationsBefore;
        return false;
    }

    if (m_settings.formulation == Formulation::StabilizedIndex2) {
        if (isEndAskedFor() && !projectNew(ImplicitStep::Start::AtStepsEnd)) return false;
        if (m_solvesPositions && !m_step->projectStepSpeeds(m_formula, m_new)) {
            m_failure = Failure::Speeds;
            return false;
        }
    } else {
        m_new.constraintError = m_step->calcPositionError(t, m_new.q, m_new.u);
    }
    m_equations->updLoads().countTurns(m_new.z.data());
    m_new.power = m_equations->canHavePower()
                      ? m_equations->calcPower(m_new.q.data(), m_new.u.data(), m_new.uDot.data(),
                                               m_new.lambda.data())
                      : 0;
    m_new.work = calcWork(order);
    m_equations->getBlocks().normalizeQ(m_new.q.data());
    updFormulas().completePoint(m_history, m_formula, m_new);
    if (m_settings.fixedStep > 0)
        *error = 0;
    else
        *error = m_history.numNodes() > order ? calcError(order) : calcFirstError();
    if (m_settings.fixedStep == 0 && *error <= 1)
        *error = largerOrNaN(*error, calcUnseenError(order));
    return true;
}

double Stepper::calcWork(int order) const {
    // Where the points resolve the power, it is integrated as the polynomial through them, since no
    // error test covers the method's own formula at prescribed motions. Where power decays within a
    // step, as with stiff dampers, the method's formula is consistent with its solution.
    constexpr double Shown = 0.1;  // largest error of trapezoids, relative to h·max|P|
    const double usual = m_formula.workHist + m_formula.quadrature * m_new.power;
    if (m_history.size() < 2) return usual;
    const int count = std::min(std::max(order, 3), m_history.size()) + 1;
    const auto at = [&](int k) -> const SolutionPoint& {
        return k == 0 ? m_new : m_history[k - 1];
    };
    const double h = m_new.t - at(1).t, middle = m_new.t - 0.5 * h;
    double work = 0;
    // Gauss: exact to degree 5.
    constexpr double Abscissa = 0.7745966692414834, Weights[] = {5. / 18, 8. / 18, 5. / 18};
    for (int i = 0; i < 3; ++i) {
        const double t = middle + (i - 1) * 0.5 * h * Abscissa;
        for (int k = 0; k < count; ++k) {
            double weight = h * Weights[i];
            for (int j = 0; j < count; ++j)
                if (j != k) weight *= (t - at(j).t) / (at(k).t - at(j).t);
            work += weight * at(k).power;
        }
    }
    const double trapezoid = 0.5 * h * (m_new.power + at(1).power);
    const double largest = h * std::max(std::abs(m_new.power), std::abs(at(1).power));
    return std::abs(work - trapezoid) <= Shown * largest ? at(1).work + work : usual;
}

void Stepper::predictLambda(int points, SolutionPoint& point) {
    // Multipliers left undetermined by redundant constraints are not corrected by the iteration:
    // extrapolated from step to step, they would grow without bound.
    if (m_statistics.redundantConstraints > 0)
        std::fill(point.lambda.begin(), point.lambda.end(), 0.0);
    else
        m_history.extrapolateLambda(points, point.t, point.lambda);
}

bool Stepper::isEndAskedFor() const {
    const TimedLoads& loads = m_equations->getTimedLoads();
    return m_equations->getTopology().numMultipliers > 0 || m_equations->canHavePower() ||
           m_equations->updErrorNorm().isInMetres() || loads.hasLoads() || loads.hasMotions();
}

bool Stepper::projectNew(ImplicitStep::Start from) {
    m_new.constraintError = m_step->projectPositions(m_new.t, m_settings.constraintTolerance,
                                                     m_new.q, m_new.u, &m_worstProjectedRow, from);
    m_failure = m_step->mayLoseCount() ? Failure::Count : Failure::Positions;
    return m_new.constraintError <= m_settings.constraintTolerance && !m_step->mayLoseCount();
}

bool Stepper::attemptStages(double h, double* error) {
    ++m_statistics.stepsAttempted;
    const long iterationsBefore = m_statistics.newtonIterations;
    const SolutionPoint& start = m_history[0];
    RadauStep& step = updStages();
    m_equations->updErrorNorm().setReference(start.q.data(), start.u.data(), start.z.data());
    const IntegrationScheme::DenseNodes nodes = m_scheme.getDenseNodes(m_order);
    for (int i = 0; i < radau::NumStages; ++i) {
        SolutionPoint& stage = step.updStage(i);
        stage.t = start.t + radau::C[i] * h;
        const SolutionHistory::Weights prediction =
            m_history.calcInterpolation(std::min(nodes.values, m_history.numNodes()), stage.t);
        m_history.combineQ(prediction, stage.q);
        m_history.combineU(prediction, stage.u);
        m_history.combineZ(prediction, stage.z);
        predictLambda(nodes.lambda, stage);
    }
    m_outcome = step.solveStages(start, h);
    if (!m_outcome.converged) {
        m_new.t = start.t + h;
        m_failure = Failure::Convergence;
        m_statistics.divergentIterations += m_statistics.newtonIterations - iterationsBefore;
        return false;
    }
    if (!step.completeStages(start, h)) {
        m_failure = Failure::Count;
        return false;
    }
    m_new = step.updStage(radau::NumStages - 1);
    m_formula.factors = RadauStep::calcFactors(h);
    // Lengths of quaternions do not count as errors.
    m_equations->getBlocks().normalizeQ(m_new.q.data());
    m_error.q = m_new.q;
    // Without joints nothing is projected, and the error test evaluates this point anyway.
    const bool isEvaluated =
        m_equations->getTopology().numMultipliers > 0 || m_settings.fixedStep > 0;
    if (isEvaluated && !projectNew(ImplicitStep::Start::Elsewhere)) return false;
    if (m_equations->getTopology().countsTurns) {
        if (!isEvaluated) m_equations->realize(m_new.t, m_new.q.data(), m_new.u.data());
        m_equations->updLoads().countTurns(m_new.z.data());
    }
    for (size_t i = 0; i < m_error.q.size(); ++i) m_error.q[i] = m_new.q[i] - m_error.q[i];
    std::fill(m_error.u.begin(), m_error.u.end(), 0.0);
    std::fill(m_error.z.begin(), m_error.z.end(), 0.0);
    const double projected = calcErrorSize(h);
    *error = 0;
    if (m_settings.fixedStep > 0) return true;
    if (projected > 1) {
        *error = projected;
        return true;
    }
    step.calcError(start, m_new, h, m_error);
    step.reduceError(h, m_error);
    *error = largerOrNaN(projected, calcErrorSize(std::max(h, m_speedTime)));
    if (m_equations->getTimedLoads().hasLoads())
        m_equations->realize(m_new.t, m_new.q.data(), m_new.u.data());
    if (*error <= 1) *error = largerOrNaN(*error, calcUnseenError(m_taken.lastOrder));
    return true;
}

double Stepper::calcErrorSize(double h) {
    m_equations->getSimbody().clearPrescribedErrors(m_error.q.data(), m_error.u.data());
    return largerOrNaN(m_equations->updErrorNorm().calcSize(m_error.q.data(), m_error.u.data(), h,
                                                            &m_taken.worstBlock),
                       m_equations->updErrorNorm().calcZSize(m_error.z.data())) /
           m_settings.accuracy;
}

double Stepper::calcError(int order) {
    const OneStageScheme::ErrorFactors factors =
        updFormulas().calcErrorFactors(m_history, order, m_new.t);
    const SolutionHistory::Weights prediction = m_history.calcInterpolation(order + 1, m_new.t);
    m_history.combineQ(prediction, m_error.q);
    m_history.combineU(prediction, m_error.u);
    m_history.combineZ(prediction, m_error.z);
    const int threads = m_equations->getBlocks().numThreads;
    const auto calcDifference = [threads](double factor, const std::vector<double>& values,
                                          std::vector<double>& predicted) {
        parallelRanges(int(values.size()), threads, [&](int begin, int end) {
            for (int i = begin; i < end; i += ChunkSize) {
                const int size = std::min(end - i, ChunkSize);
                double* difference = predicted.data() + i;
                storeChunk(
                    factor * (loadChunk(values.data() + i, size) - loadChunk(difference, size)),
                    difference, size);
            }
        });
    };
    calcDifference(factors.q, m_new.q, m_error.q);
    calcDifference(factors.u, m_new.u, m_error.u);
    calcDifference(factors.u, m_new.z, m_error.z);
    return calcErrorSize(m_new.t - m_history[0].t);
}

double Stepper::calcFirstError() {
    const SolutionPoint& last = m_history[0];
    const double h = m_new.t - last.t, factor = updFormulas().getFirstErrorConstant() * h;
    std::fill(m_error.q.begin(), m_error.q.end(), 0.0);
    for (size_t i = 0; i < m_error.u.size(); ++i)
        m_error.u[i] = factor * (m_new.uDot[i] - last.uDot[i]);
    for (size_t i = 0; i < m_error.z.size(); ++i)
        m_error.z[i] = factor * (m_new.zDot[i] - last.zDot[i]);
    return calcErrorSize(h);
}

void Stepper::chooseNextStep(double error, double h, int order) {
    const int lowest = m_scheme.getLowestOrder();
    const int highest = m_scheme.getHighestOrder(m_history);
    if (m_settings.fixedStep > 0) {
        m_nextLength = m_settings.fixedStep;
        m_order = std::min(std::max(order + 1, lowest), highest);
        return;
    }
    if (!m_formulas) {
        // Small changes do not justify a new matrix.
        constexpr double LargestRatio = 4, LeastGrowth = 1.2;
        double ratio = m_controller.calcRatio(error, order, LargestRatio);
        const double largest = updStages().calcLargestRatio();
        if (ratio > largest) {
            ratio = largest;
            m_controller.restart();
        }
        m_nextLength =
            std::min(ratio > 1 && ratio < LeastGrowth ? h : h * ratio, calcLongestLength());
        return;
    }
    // Candidate orders k−1, k, k+1: the one with the longest step wins, or the one of least error
    // among several at the longest allowed step. A higher order must be clearly better: where error
    // terms do not decrease with the order, the method is near instability.
    constexpr double Preference = 1.2;
    const auto growth = [](double err, int k) {
        return std::pow(StepController::Target / std::max(err, 1e-10), 1.0 / (k + 1));
    };
    ++m_stepsAtOrder;
    double best = growth(error, order), leastError = error;
    int bestOrder = order;
    const auto isBetter = [&](double err, int k, double preference) {
        const double other = growth(err, k);
        const bool isEitherLongest = h * std::min(best, other) >= calcLongestLength();
        return isEitherLongest ? preference * err < leastError : other > preference * best;
    };
    const auto consider = [&](double err, int k, double preference) {
        if (!isBetter(err, k, preference)) return;
        best = growth(err, k);
        leastError = err;
        bestOrder = k;
    };
    if (order > lowest && m_stepsAtOrder > 1) consider(calcError(order - 1), order - 1, 1);
    if (order < highest && (order < lowest || m_stepsAtOrder > order) &&
        m_history.numNodes() > order + 1) {
        const double err = calcError(order + 1);
        if (order < lowest) best = 0, leastError = SimTK::Infinity;
        consider(err, order + 1, Preference);
    }
    // Ratios for which the formulas are zero-stable with some margin.
    const double largest = bestOrder <= 2 ? 2.0 : 1.5;
    if (bestOrder == order) {
        m_nextLength = h * m_controller.calcRatio(error, order, largest);
    } else {
        m_controller.restart();
        m_stepsAtOrder = 0;
        m_nextLength = h * std::clamp(best, 0.5, largest);
    }
    m_order = bestOrder;
    m_nextLength = std::min(m_nextLength, calcLongestLength());
}

void Stepper::passBreak() {
    // Whatever does not depend on time is bit-identical on both sides.
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
        // There may be a kink, which no polynomial of high order represents.
        m_stepsAtOrder = 0;
        m_order = std::min(m_order, m_scheme.getLowestOrder());
        return;
    }
    restart();
    m_nextLength = chooseFirstLength(point, m_nextLength);
}

void Stepper::acceptStep(double h, int order) {
    if (m_taken.lastLength > 0 && m_statistics.stepsTaken > 0) {
        m_statistics.sumOfSquaredLogRatios += std::pow(std::log(h / m_taken.lastLength), 2);
        ++m_statistics.stepRatios;
    }
    if (solvesStages()) {
        // Copies of whole points allocate nothing: every array already has its size.
        for (int i = 0; i + 1 < radau::NumStages; ++i) m_history.push() = updStages().updStage(i);
        updStages().keepError();
    } else if (!m_formulas) {
        updStages().forgetError();
    }
    std::swap(m_history.push(), m_new);  // the next step overwrites all of it
    m_equations->updBlocks().followPose();
    m_equations->updFrictions().keep(h);
    ++m_statistics.stepsTaken;
    ++m_statistics.stepsAtOrder[size_t(order)];
    m_statistics.timeCovered += h;
    m_statistics.largestStep = std::max(m_statistics.largestStep, h);
    m_statistics.smallestStep =
        m_statistics.stepsTaken == 1 ? h : std::min(m_statistics.smallestStep, h);
    if (SimTK::isNaN(m_taken.firstLength)) m_taken.firstLength = h;
    m_taken.lastLength = h;
    m_speedTime = std::max(h, m_speedTime - 0.5 * h);
    m_taken.lastOrder = order;
}

void Stepper::takeStep(double limit) {
    if (m_breaks.isAtEnd(m_history[0].t)) passBreak();
    if (m_equations->getFrictions().isAtSwitch()) passSwitch();
    stepWithin(std::min(limit, m_breaks.getEnd()));
}

void Stepper::stepWithin(double limit) {
    double h = std::min(m_nextLength, calcLongestLength());
    bool isCut = false;
    const double remaining = limit - m_history[0].t;
    if (h >= remaining * (1 - 1e-10)) {
        isCut = h > remaining * (1 + 1e-10);
        h = remaining;
    } else if (m_settings.fixedStep == 0 && h > 0.5 * remaining) {
        h = 0.5 * remaining;  // two equal steps rather than a long and a tiny one
        isCut = true;
    }
    const double wanted = m_nextLength;
    int order = std::min(m_order, m_history.numNodes());
    int failures = 0, retries = 0;
    bool isShortened = false, mayHold = true;
    m_solvesPositions = false;
    FrictionTerms::Hold hold(m_equations->updFrictions());
    if (!m_formulas && m_history.size() > 1 && m_taken.lastOrder < m_scheme.getLowestOrder()) {
        // The slope left by a fallback would count as an error.
        m_trial = m_history[0];
        complete(m_trial);
        m_history.newest().uDot = m_trial.uDot;
    }
    for (;;) {
        if (!m_formulas)
            order = solvesStages() ? m_order
                                   : std::min(m_fallback.getMaximumOrder(), m_history.numNodes());
        double error = 0;
        const bool isSolved = tryStep(h, order, &error);
        if (isSolved && error <= 1 && mayHold && !hold.isOn() && calcSwitchError(h) > 1) {
            hold.set(true);
            continue;
        }
        if (isSolved && error <= 1) {
            // Estimates of other orders need m_history without the new point.
            chooseNextStep(error, h, order);
            if (isCut && failures == 0 && m_nextLength < wanted)
                m_nextLength = std::max(m_nextLength, std::min(wanted, 2 * h));
            acceptStep(h, order);
            if (hold.isOn()) endAtSwitch();
            return;
        }
        if (isSolved) {
            ++m_statistics.errorTestFailures;
            h *= m_controller.calcRatioAfterRejection(error, order);
            ++failures;
        } else {
            ++(m_outcome.converged  ? m_statistics.projectionFailures
               : m_outcome.isFinite ? m_statistics.convergenceFailures
                                    : m_statistics.nonFiniteFailures);
            if (!m_outcome.converged && m_outcome.retryWorthwhile && retries++ < 2) continue;
            retries = 0;
            if (hold.isOn()) {
                // Held contacts may exert a wrong force.
                hold.set(mayHold = false);
                continue;
            }
            // Near a singular position the velocity constraints change too fast for the iteration.
            // Elsewhere the step may just be too long.
            if (!m_formulas && m_settings.fixedStep == 0 && !std::exchange(isShortened, true)) {
                m_controller.restart();
                h *= 0.5;
                ++failures;
                continue;
            }
            if (!m_solvesPositions && !m_outcome.converged && m_outcome.isFinite &&
                m_settings.formulation == Formulation::StabilizedIndex2 &&
                m_equations->getTopology().numMultipliers > 0) {
                m_solvesPositions = true;
                continue;
            }
            m_solvesPositions = false;
            if (m_settings.fixedStep > 0) failStep(h, m_failure, 0);
            m_controller.restart();
            h *= 0.25;
            ++failures;
        }
        m_stepsAtOrder = 0;
        if (!(h >= m_settings.minimumStep))
            failStep(h, isSolved ? Failure::ErrorTest : m_failure, error);
        if (failures == 3) {
            // Something jumped here, so that the history misleads.
            restart();
            order = m_order;
        }
    }
}

void Stepper::failStep(double h, Failure failure, double error) {
    const std::vector<std::string> redundancies = m_step->describeRedundancies();
    const FailureDiagnosis diagnosis(*m_equations);
    const FailureDiagnosis::FailedStep step{m_history[0],
                                            m_new,
                                            h,
                                            m_outcome,
                                            m_fault,
                                            redundancies,
                                            m_numRedundantAtStart,
                                            !m_settings.differentiated.empty(),
                                            m_settings.accuracy};
    std::ostringstream text;
    text << m_name << ": no step could be taken from t = " << m_history[0].t << " s (h = " << h
         << " s): ";
    if (!m_outcome.isFinite)
        text << diagnosis.explainNonFinite(step);
    else if (failure == Failure::ErrorTest)
        text << "the error test keeps failing: "
             << diagnosis.explainLargeError(step, error, m_error.q.data(), m_error.u.data(),
                                            m_error.z);
    else if (failure == Failure::Convergence)
        text << "Newton's iteration does not converge: " << diagnosis.explainNoConvergence(step);
    else if (failure == Failure::Count)
        text << "it is too long to count the teeth and turns of gears and couplers; allow shorter "
                "steps";
    else if (failure == Failure::Speeds)
        text << "the speeds cannot be brought onto the joints: "
             << diagnosis.explainNoSpeeds(step, m_step->getConstraintErrors());
    else
        text << "the positions cannot be brought back onto the joints: "
             << diagnosis.explainNoProjection(step, m_worstProjectedRow,
                                              m_settings.constraintTolerance);
    text << ". The last good State is kept";
    throw std::runtime_error(text.str());
}

}  // namespace simflex
