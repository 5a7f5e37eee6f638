#include "simflex/solver/integration/ImplicitStep.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <sstream>

#include "simflex/base/Checkpoint.h"
#include "simflex/base/Chunk.h"
#include "simflex/base/DenseAlgebra.h"
#include "simflex/base/FlushDenormals.h"
#include "simflex/base/SecondsSince.h"
#include "simflex/solver/equations/FlexibleBlock.h"
#include "simflex/solver/integration/FailureDiagnosis.h"

namespace simflex {
namespace {

using Clock = std::chrono::steady_clock;

/** Largest |value·weight|, or a non-finite one. @param weights  null: all 1 **/
double findLargestWeighed(const double* values, const double* weights, int size) {
    Chunk largest{}, nanOrZero{};
    for (int i = 0; i < size; i += ChunkSize) {
        const int count = std::min(size - i, ChunkSize);
        const Chunk magnitude = absolute(loadChunk(values + i, count));
        largest = larger(weights ? magnitude * loadChunk(weights + i, count) : magnitude, largest);
        nanOrZero += magnitude - magnitude;  // infinities count as NaN here, and are sought below
    }
    double result = 0;
    for (int k = 0; k < ChunkSize; ++k) result = std::max(result, largest[k]);
    if (sumChunk(nanOrZero) != 0)
        for (int i = 0; i < size; ++i) {
            if (std::isnan(values[i])) return values[i];
            result = std::max(result, std::isinf(values[i]) ? SimTK::Infinity : 0.0);
        }
    return result;
}

}  // namespace

ImplicitStep::ImplicitStep(Evaluation& equations, IntegratorStatistics& statistics)
    : m_equations(equations),
      m_statistics(statistics),
      m_system(equations.getTopology().makeNewtonSystem()),
      m_solver(m_system),
      m_deltaZ(equations.getTopology().numZ),
      m_stepEquations(equations),
      m_lastUDot(equations.getTopology().numU),
      m_residuals(size_t(equations.getTopology().numBlocks())),
      m_perSpeed(size_t(equations.getTopology().numU), 1),
      m_perMultiplier(size_t(equations.getTopology().numMultipliers), 1) {}

double ImplicitStep::findLargest(const double* values, int size, int* where) {
    const double result = findLargestWeighed(values, nullptr, size);
    if (where)
        for (int i = 0; i < size; ++i) {
            if (std::abs(values[i]) < result) continue;
            *where = i;
            break;
        }
    return result;
}

double ImplicitStep::findLargestResidual() const {
    return m_equations.getBlocks().findLargest([&](int b) { return m_residuals[size_t(b)]; },
                                               nullptr);
}

double ImplicitStep::findLargestForce(const double* r, int firstSpeed, int size) const {
    return findLargestWeighed(r, m_perSpeed.data() + firstSpeed, size);
}

double ImplicitStep::findLargestForce(const double* multipliers) const {
    return findLargestWeighed(multipliers, m_perMultiplier.data(), int(m_perMultiplier.size()));
}

void ImplicitStep::calcForceScales() {
    constexpr double Least = 1e-100;  // [m]: what displaces nothing has no mass, and no force
    std::fill(m_perMultiplier.begin(), m_perMultiplier.end(), 0.0);
    for (int b = 0; b < m_equations.getTopology().numBlocks(); ++b) {
        const Block& block = m_equations.getBlock(b);
        double* const perSpeed = m_perSpeed.data() + block.firstU;
        block.getDisplacements(perSpeed);
        for (int i = 0; i < block.numU; ++i)
            perSpeed[i] = perSpeed[i] > Least ? 1 / perSpeed[i] : 0;
        // For a flexible body its rigid motion is representative.
        const NewtonSystem::Block& matrices = m_system.blocks[size_t(b)];
        const int height = matrices.heightOfGt(), count = matrices.part < 0 ? height : 6;
        for (int k = 0; k < matrices.numColumns(); ++k) {
            const int row = matrices.rows[size_t(k)];
            if (row >= int(m_perMultiplier.size())) continue;  // a force element's
            double& largest = m_perMultiplier[size_t(row)];
            const double* const column = matrices.Gt.data() + size_t(k) * size_t(height);
            for (int i = 0; i < count; ++i)
                largest = std::max(largest, std::abs(column[i]) * perSpeed[i]);
        }
    }
    for (double& scale : m_perMultiplier)
        if (!(scale > 0 && std::isfinite(scale))) scale = 1;
}

void ImplicitStep::setNumThreads(int most) {
    if (most == m_threadChoice.getMost()) return;
    m_threadChoice = ThreadChoice(most);
    useThreads(most);
}

void ImplicitStep::useThreads(int threads) {
    if (threads == m_numThreads) return;
    m_equations.updBlocks().chooseNumThreads(threads);
    m_solver.setNumThreads(threads);
    m_numThreads = threads;
}

bool ImplicitStep::useDense() const {
    return blockForm == BlockForm::Dense ||
           (blockForm == BlockForm::Automatic && m_denseStepsLeft > 0);
}

void ImplicitStep::formAndFactor(const NewtonFactors& factors, const std::vector<double>& q,
                                 const std::vector<double>& u, const std::vector<double>& uDot,
                                 MotionLevel level) {
    const auto start = Clock::now();
    m_equations.formNewtonSystem(factors, useDense(), q.data(), u.data(), uDot.data(), m_system,
                                 level);
    m_statistics.evaluationSeconds += secondsSince(start);
    factor();
    if (useDense()) ++m_statistics.denseFactorizations;
    m_reuse.take(factors);
    m_canProject = true;
}

void ImplicitStep::factor() {
    m_canProject = false;
    calcForceScales();
    runFactorization([this] { m_solver.factor(m_system); });
    m_statistics.redundantConstraints = m_solver.getNumRedundant();
}

void ImplicitStep::runFactorization(const std::function<void()>& factorize) {
    try {
        factorize();
    } catch (const SingularBlock& error) {
        invalidateMatrix();
        throw UnusablePoint(
            FailureDiagnosis(m_equations).explainSingularBlock(error.block, m_system), error.block);
    } catch (const std::runtime_error& error) {
        invalidateMatrix();
        throw UnusablePoint(error.what());
    }
    ++m_statistics.factorizations;
}

std::vector<std::string> ImplicitStep::describeRedundancies() const {
    std::vector<std::string> lines;
    const std::vector<int>& rows = m_solver.getRedundantRows();
    for (int k = 0; k < int(rows.size()); ++k) {
        std::string line = m_equations.getTopology().describeRow(rows[size_t(k)]) + " follows from";
        const char* separator = " ";
        std::vector<std::string> named;
        for (int row : m_solver.findInvolvedRows(k)) {
            if (row >= m_equations.getTopology().numMultipliers) continue;  // a force element's
            const std::string& name = m_equations.getTopology().getJointName(row);
            if (row == rows[size_t(k)] || std::count(named.begin(), named.end(), name)) continue;
            named.push_back(name);
            line += separator + ("'" + name + "'");
            separator = ", ";
        }
        if (named.empty())
            line = m_equations.getTopology().describeRow(rows[size_t(k)]) +
                   " is redundant: the bodies on both sides are held in this way already";
        lines.push_back(line + describeUndetermined(m_solver.findInvolvedRows(k)));
    }
    return lines;
}

std::string ImplicitStep::describeUndetermined(const std::vector<int>& rows) const {
    constexpr double Least = 1e-6;
    const Topology& topology = m_equations.getTopology();
    std::string names;
    for (int k = 0; k < int(topology.frictions.size()); ++k) {
        const Topology::Joint& joint = topology.joints[size_t(topology.frictions[size_t(k)].joint)];
        const auto presses = [&](int row) {
            return row >= joint.firstRow && row < joint.firstRow + joint.numRows() &&
                   std::abs(m_equations.getFrictions().getLoadSlope(k, row - joint.firstRow)) >
                       Least;
        };
        const std::string name = "'" + joint.record->name + "'";
        if (std::any_of(rows.begin(), rows.end(), presses) && names.find(name) == names.npos)
            names += (names.empty() ? "" : ", ") + name;
    }
    if (names.empty()) return "";
    return ": the friction of " + names + " depends on what it leaves undetermined";
}

bool ImplicitStep::mayDifferentiate() const {
    return m_equations.updTrees().canCalc() && blockForm != BlockForm::Arrow;
}

bool ImplicitStep::renewDerivatives(const std::vector<double>& q, const std::vector<double>& u,
                                    const std::vector<double>& uDot) {
    if (!m_renewsDerivatives && !(useDense() && !m_equations.updTrees().areKnown())) return false;
    m_renewsDerivatives = false;
    if (!mayDifferentiate()) return false;
    const auto start = Clock::now();
    m_equations.updTrees().calc(m_equations, q.data(), u.data(), uDot.data());
    m_statistics.evaluationSeconds += secondsSince(start);
    return true;
}

void ImplicitStep::startDense() {
    if (blockForm != BlockForm::Automatic || m_denseStepsLeft > 0) return;
    m_denseStepsLeft = m_densePeriod;
    m_densePeriod = std::min(2 * m_densePeriod, 10000);
}

int ImplicitStep::findNonFiniteBlock() const {
    for (int b = 0; b < m_equations.getTopology().numBlocks(); ++b)
        for (int i = 0; i < m_equations.getBlock(b).numU; ++i)
            if (!std::isfinite(m_system.r[m_equations.getBlock(b).firstU + i])) return b;
    return 0;
}

void ImplicitStep::noteDuration(double seconds) {
    if (m_threadChoice.getMost() <= 1) return;
    m_threadChoice.add(seconds);
    useThreads(m_threadChoice.get());
}

void ImplicitStep::solveLinear() {
    if (observer) observer(m_system);
    m_solver.solve(m_system);
    ++m_statistics.linearSolves;
}

void ImplicitStep::finishBlock(int b, bool hasMatrix) {
    const Block& block = m_equations.getBlock(b);
    m_residuals[size_t(b)] =
        findLargestForce(m_system.r.data() + block.firstU, block.firstU, block.numU);
    if (hasMatrix) m_solver.eliminate(m_system, b);
}

void ImplicitStep::solveForMultipliers(bool isEliminated) {
    if (observer) observer(m_system);
    if (!isEliminated)
        parallelFor(m_equations.getTopology().numBlocks(), m_equations.getBlocks().numThreads,
                    [&](int b) { m_solver.eliminate(m_system, b); });
    m_solver.solveForMultipliers(m_system);
    ++m_statistics.linearSolves;
}

void ImplicitStep::substituteBlock(int b, std::vector<double>& u) {
    m_solver.substitute(m_system, b);
    const Block& block = m_equations.getBlock(b);
    const double* delta = m_solver.getDeltaU().data() + block.firstU;
    double* own = u.data() + block.firstU;
    for (int i = 0; i < block.numU; i += ChunkSize) {
        const int count = std::min(block.numU - i, ChunkSize);
        storeChunk(loadChunk(own + i, count) + loadChunk(delta + i, count), own + i, count);
    }
}

void ImplicitStep::correctStates(const double* A, int numPoints, std::vector<double>& residuals) {
    const Topology& topology = m_equations.getTopology();
    if (!topology.hasCoupledStates) return;
    m_equations.updLoads().calcStateSlopes(m_stateSlopes);
    if (m_stateSlopes.isZero(0)) return;
    const Eigen::Index s = m_stateSlopes.rows();
    const size_t numZ = residuals.size() / size_t(numPoints), first = size_t(topology.firstZ);
    Eigen::MatrixXd matrix = Eigen::MatrixXd::Identity(numPoints * s, numPoints * s);
    Eigen::VectorXd rho(numPoints * s);
    for (int i = 0; i < numPoints; ++i) {
        for (int j = 0; j < numPoints; ++j)
            matrix.block(i * s, j * s, s, s) -= A[i * numPoints + j] * m_stateSlopes;
        for (Eigen::Index k = 0; k < s; ++k)
            rho[i * s + k] = residuals[size_t(i) * numZ + first + size_t(k)];
    }
    rho = SquareSystem(matrix).solve(rho);
    for (int i = 0; i < numPoints; ++i)
        for (Eigen::Index k = 0; k < s; ++k)
            residuals[size_t(i) * numZ + first + size_t(k)] = rho[i * s + k];
}

void ImplicitStep::correctStates(const StepFormula& formula, SolutionPoint& point) {
    const Topology& topology = m_equations.getTopology();
    m_equations.updLoads().calcStateRates(point.zDot.data());
    const size_t end = size_t(topology.firstZ) + topology.states.size();
    for (size_t i = size_t(topology.firstZ); i < end; ++i)
        m_deltaZ[i] = formula.zHist[i] + formula.quadrature * point.zDot[i] - point.z[i];
    correctStates(&formula.quadrature, 1, m_deltaZ);
    for (size_t i = size_t(topology.firstZ); i < end; ++i) point.z[i] += m_deltaZ[i];
    m_equations.setZ(point.z.data());
    m_equations.updLoads().realize();
}

double ImplicitStep::updateZ(const StepFormula& formula, SolutionPoint& point) {
    std::vector<double>& z = point.z;
    m_equations.calcZDot(point.q.data(), point.u.data(), point.uDot.data(), z.data(),
                         point.zDot.data());
    for (size_t i = 0; i < z.size(); ++i) {
        if (m_equations.getTopology().isCoupled(int(i))) continue;
        const double value = formula.zHist[i] + formula.quadrature * point.zDot[i];
        m_deltaZ[i] = value - z[i];
        z[i] = value;
    }
    return m_equations.updErrorNorm().calcZSize(m_deltaZ.data());
}

ImplicitStep::Outcome ImplicitStep::solve(const StepFormula& formula, Formulation formulation,
                                          SolutionPoint& point) {
    return solve(formula, formulation, Purpose::Final, point);
}

ImplicitStep::Outcome ImplicitStep::solveNearSingularity(const StepFormula& formula,
                                                         SolutionPoint& point) {
    return solve(formula, Formulation::Index3, Purpose::Projected, point);
}

bool ImplicitStep::projectStepSpeeds(const StepFormula& formula, SolutionPoint& point) {
    projectSpeeds(formula.t, point.q, point.u, &point.lambda);
    m_stepEquations.calcUDot(formula, point.q, point.u, point.uDot);
    std::copy(point.uDot.begin(), point.uDot.end(), m_lastUDot.begin());
    return findLargestRate(m_system.c) <= LargestSpeedError * calcSpeedScale(point.u);
}

ImplicitStep::Outcome ImplicitStep::solve(const StepFormula& formula, Formulation formulation,
                                          Purpose purpose, SolutionPoint& point) {
    const FlushDenormals flush;
    // Round-off components normal to the constraints are projected out.
    constexpr double LargestNoise = 0.1;
    const double t = formula.t, stiffness = formula.factors.stiffness;
    const MotionLevel level = formulation == Formulation::StabilizedIndex2 ? MotionLevel::Velocity
                                                                           : MotionLevel::Position;
    std::vector<double>&q = point.q, &u = point.u, &lambda = point.lambda, &uDot = point.uDot;
    Outcome outcome;
    bool refresh = m_reuse.beginStep(formula.factors) ||
                   m_equations.updTrees().renewMatrices(useDense()) ||
                   blockForm == BlockForm::Dense || forceFullNewton;
    double previousChange = 0, previousMultiplierChange = 0, forceScale = 0;
    bool hasNewDerivatives = false, isRefreshed = false;
    FrictionTerms& frictions = m_equations.updFrictions();
    frictions.recall();

    // Not where a point was looked at last.
    if (m_equations.getBlocks().askForN()) m_equations.realize(t, q.data(), u.data());
    const auto isFrictionSettled = [&] {
        if (frictions.isEmpty()) return true;
        m_stepEquations.realize(formula, point.z, u, q);
        return frictions.isSettled(lambda.data());
    };
    const auto finish = [&](int b) { finishBlock(b, !refresh); };
    const auto substitute = [&](int b) { substituteBlock(b, u); };
    int allowed = tolerances.maxIterations, numMatrices = 0;
    for (int iteration = 0; iteration < allowed; ++iteration) {
        const auto start = Clock::now();
        const bool hasStates = m_equations.getTopology().hasCoupledStates;
        bool hasOtherFriction = false;
        if (!hasStates && frictions.isEmpty()) {
            m_stepEquations.evaluate(formula, level, lambda, point.z, std::cref(finish), u, q, uDot,
                                     m_system);
        } else {
            m_stepEquations.realize(formula, point.z, u, q);
            if (hasStates) correctStates(formula, point);
            hasOtherFriction = frictions.decide(FrictionTerms::By::Rates, lambda.data());
            if (hasOtherFriction) {
                // The equations differ from those of the previous iteration.
                refresh = true;
                previousChange = previousMultiplierChange = forceScale = 0;
            }
            m_stepEquations.calcResidual(formula, level, lambda, std::cref(finish), q, u, uDot,
                                         m_system);
        }
        const double zChange = point.z.empty() ? 0 : updateZ(formula, point);
        const bool hasZConverged = zChange <= tolerances.displacement * accuracy;
        m_statistics.evaluationSeconds += secondsSince(start);

        const double bodyResidual = findLargestResidual();
        outcome.constraintResidual = findLargest(m_system.c, &outcome.worstRow);
        forceScale = std::max({forceScale, bodyResidual, findLargestForce(lambda.data())});
        if (!std::isfinite(bodyResidual) || !std::isfinite(outcome.constraintResidual)) {
            outcome.isFinite = false;
            outcome.worstBlock = findNonFiniteBlock();
            break;
        }
        if (frictions.findUndecided() >= 0) break;
        if (iteration == 0 && formulation == Formulation::Index3 &&
            m_equations.getTopology().mayLoseCount(m_system.c.data(), stiffness))
            break;
        if (iteration > 0 && !hasOtherFriction &&
            bodyResidual <= tolerances.bodyResidual * forceScale && hasZConverged &&
            areRatesSmall(m_system.c, u)) {
            outcome.converged = true;
            break;
        }

        // A change that a better matrix corrects does not indicate divergence.
        const bool isComparable = !refresh || isRefreshed;
        isRefreshed = refresh;
        if (refresh) {
            hasNewDerivatives |= renewDerivatives(q, u, uDot);
            formAndFactor(formula.factors, q, u, uDot);
            m_reuse.resetRate();
            refresh = false;
            if (numMatrices++ < MostMatrices) allowed = iteration + tolerances.maxIterations;
        }
        solveForMultipliers(!isRefreshed);
        ++m_statistics.newtonIterations;
        const double* deltaLambda = m_solver.getDeltaLambda();
        const double multiplierChange = findLargestForce(deltaLambda);
        for (size_t i = 0; i < lambda.size(); ++i) lambda[i] += deltaLambda[i];
        const double change = m_equations.updErrorNorm().calcChange(
            m_solver.getDeltaU().data(), stiffness, &outcome.worstBlock, std::cref(substitute));
        if (!isRefreshed) noteDuration(secondsSince(start));
        outcome.displacementChange = change;
        if (!(change <= largestChange) || !std::isfinite(multiplierChange)) break;
        if (iteration > 0) {
            m_reuse.noteRate(previousChange > 0 ? change / previousChange : 0);
            const double allowedNoise = tolerances.displacement * accuracy * 1e-3;
            if (iteration > 1 && isComparable &&
                hasStalled(change, previousChange, multiplierChange, previousMultiplierChange) &&
                change > allowedNoise) {
                outcome.converged = purpose == Purpose::Projected && hasZConverged &&
                                    change <= LargestNoise * accuracy &&
                                    (frictions.isEmpty() ||
                                     (areMultipliersGood(multiplierChange, lambda, forceScale) &&
                                      isFrictionSettled()));
                break;
            }
        }
        previousChange = change;
        previousMultiplierChange = multiplierChange;

        const double remaining = m_reuse.calcRemaining();
        const double multiplierScale = std::max(findLargestForce(lambda.data()), m_multiplierFloor);
        if (hasZConverged && remaining * change <= tolerances.displacement * accuracy &&
            (frictions.isEmpty()
                 ? purpose == Purpose::Projected ||
                       remaining * multiplierChange <= tolerances.multiplier * multiplierScale
                 : areMultipliersGood(remaining * multiplierChange, lambda, forceScale)) &&
            isFrictionSettled()) {
            outcome.converged = true;
            break;
        }
        refresh = needsBetterMatrix(iteration, hasNewDerivatives) || forceFullNewton;
    }

    if (outcome.converged) {
        const auto start = Clock::now();
        m_stepEquations.arrive(formula, u, q, uDot, m_system);
        m_statistics.evaluationSeconds += secondsSince(start);
        noteConvergence(point);
    } else {
        noteFailure(hasNewDerivatives, outcome);
    }
    return outcome;
}

double ImplicitStep::findLargestRate(const std::vector<double>& c) const {
    double largest = 0;
    for (size_t k = 0; k < m_perMultiplier.size(); ++k)
        largest = largerOrNaN(largest, std::abs(c[k]) / m_perMultiplier[k]);
    return largest;
}

double ImplicitStep::calcSpeedScale(const std::vector<double>& u) const {
    constexpr double Moment = 1e-6;  // [s]
    return std::max(accuracy / Moment, m_equations.getBlocks().calcDisplacement(u.data()));
}

bool ImplicitStep::areMultipliersGood(double change, const std::vector<double>& lambda,
                                      double forceScale) const {
    constexpr double RoundOff = 1e-9;
    return change <=
           std::max(tolerances.multiplier * findLargestForce(lambda.data()), RoundOff * forceScale);
}

bool ImplicitStep::hasStalled(double change, double previousChange, double multiplierChange,
                              double previousMultiplierChange) {
    // Without joints there are no multipliers to change. When friction changes mode, the iteration
    // restarts and there is no previous change.
    constexpr double Slowest = 0.95;
    return previousChange > 0 && change > Slowest * previousChange &&
           multiplierChange >= Slowest * previousMultiplierChange;
}

bool ImplicitStep::needsBetterMatrix(int iteration, bool hasNewDerivatives) {
    if (!m_reuse.isSlow() || iteration == 0) return false;
    if (m_reuse.isOld()) return true;
    if (hasNewDerivatives || !mayDifferentiate()) return false;
    startDense();
    m_renewsDerivatives = true;
    return true;
}

void ImplicitStep::noteConvergence(const SolutionPoint& end) {
    parallelRanges(
        int(end.uDot.size()), m_equations.getBlocks().numThreads, [&](int begin, int stop) {
            std::copy(&end.uDot[size_t(begin)], end.uDot.data() + stop, &m_lastUDot[size_t(begin)]);
        });
    m_multiplierFloor =
        std::max(0.999 * m_multiplierFloor, 1e-4 * findLargestForce(end.lambda.data()));
    if (m_denseStepsLeft > 0 && --m_denseStepsLeft == 0) {
        m_equations.updTrees().forget();
        invalidateMatrix();
    }
    m_reuse.endStep();
}

void ImplicitStep::noteFailure(bool hasNewDerivatives, Outcome& outcome) {
    const bool wasFresh = m_reuse.isFresh();
    outcome.retryWorthwhile = !wasFresh;
    // Long trees always have all their derivatives.
    const bool canGainByDense = !m_equations.updTrees().renewMatrices(true);
    if (wasFresh && blockForm == BlockForm::Automatic && m_denseStepsLeft == 0 && canGainByDense) {
        startDense();
        outcome.retryWorthwhile = true;
    } else if (wasFresh && !hasNewDerivatives && mayDifferentiate()) {
        m_renewsDerivatives = outcome.retryWorthwhile = true;
    }
    invalidateMatrix();
}

double ImplicitStep::projectPositions(double t, double tolerance, std::vector<double>& q,
                                      const std::vector<double>& u, int* worstRow, Start from) {
    const FlushDenormals flush;
    constexpr int MaxIterations = 10;
    constexpr double SlowRate = 0.1;
    double error = 0, previous = 0;
    bool isFresh = !m_reuse.hasMatrix();
    for (int iteration = 0;; ++iteration) {
        if (iteration > 0 || from == Start::Elsewhere) {
            const auto start = Clock::now();
            m_equations.realize(t, q.data(), u.data());
            m_equations.calcPositionErrors(m_system.c.data());
            m_statistics.evaluationSeconds += secondsSince(start);
        }
        if (iteration == 0)
            m_mayLoseCount = m_equations.getTopology().mayLoseCount(m_system.c.data());
        error = findLargest(m_system.c, worstRow);
        if (error <= tolerance || iteration == MaxIterations || !std::isfinite(error)) return error;
        if (iteration > 0 && !isFresh && error > SlowRate * previous) {
            // G has rotated away since the matrix was factored.
            formAndFactor(m_reuse.getFactors(), q, u, m_lastUDot);
            isFresh = true;
        }
        previous = error;
        m_solver.solveForConstraints(m_system);
        ++m_statistics.linearSolves;
        if (iteration == 0) ++m_statistics.projections;
        m_equations.getBlocks().displaceQ(m_solver.getDeltaU().data(), q.data());
    }
}

double ImplicitStep::projectBetweenSteps(double t, double tolerance, std::vector<double>& q,
                                         const std::vector<double>& u) {
    const FlushDenormals flush;
    // Keep the matrix of the step's end: a poor one only takes more passes.
    constexpr int MaxIterations = 40;
    constexpr double SlowestRate = 0.9;
    double previous = SimTK::Infinity;
    for (int iteration = 0;; ++iteration) {
        const double error = calcPositionError(t, q, u);
        if (error <= tolerance || iteration == MaxIterations || !(error < SlowestRate * previous))
            return error;
        previous = error;
        m_solver.solveForConstraints(m_system);
        ++m_statistics.linearSolves;
        m_equations.getBlocks().displaceQ(m_solver.getDeltaU().data(), q.data());
    }
}

double ImplicitStep::calcPositionError(double t, const std::vector<double>& q,
                                       const std::vector<double>& u) {
    m_equations.realize(t, q.data(), u.data());
    m_equations.calcPositionErrors(m_system.c.data());
    return findLargest(m_system.c);
}

double ImplicitStep::tryPositionError(double t, const std::vector<double>& q,
                                      const std::vector<double>& u) {
    try {
        return calcPositionError(t, q, u);
    } catch (const UnusablePoint&) {
    } catch (const SimTK::Exception::Base&) {
    }
    return SimTK::Infinity;
}

void ImplicitStep::projectSpeeds(double t, const std::vector<double>& q, std::vector<double>& u,
                                 std::vector<double>* lambda) {
    const FlushDenormals flush;
    // The factored G may belong to a nearby q: further passes correct the difference.
    constexpr int MaxIterations = 3;
    for (int iteration = 0;; ++iteration) {
        m_equations.realize(t, q.data(), u.data());
        m_equations.calcVelocityErrors(m_system.c.data());
        if (areRatesSmall(m_system.c, u) || iteration == MaxIterations) return;
        m_solver.solveForConstraints(m_system);
        ++m_statistics.linearSolves;
        const std::vector<double>& delta = m_solver.getDeltaU();
        for (size_t i = 0; i < u.size(); ++i) u[i] += delta[i];
        for (size_t i = 0; lambda && i < lambda->size(); ++i)
            (*lambda)[i] += m_solver.getDeltaLambda()[i];
    }
}

double ImplicitStep::closeJoints(double t, double tolerance, int maxIterations,
                                 std::vector<double>& q, const std::vector<double>& u) {
    // At γ = 1 s the matrix is M + K: any deformation costs far more than any rigid motion.
    std::vector<double> trial(q.size()), uDot(u.size(), 0), lambda(m_system.numMultipliers(), 0);
    for (int iteration = 0;; ++iteration) {
        m_equations.realize(t, q.data(), u.data());
        m_equations.calcPositionErrors(m_system.c.data());
        const double error = findLargest(m_system.c);
        m_equations.calcResidual(q.data(), u.data(), uDot.data(), lambda.data(), m_system.r.data());
        if (error <= tolerance || iteration == maxIterations || !std::isfinite(error)) return error;
        const BlockForm form = blockForm;
        blockForm = BlockForm::Arrow;
        formAndFactor(1, q, u, uDot, MotionLevel::Position);
        blockForm = form;
        m_solver.solveForConstraints(m_system);

        // Shorten the Gauss–Newton step until the errors fall.
        double fraction = 1;
        for (int cut = 0; cut < 12; ++cut, fraction *= 0.5) {
            std::vector<double> delta = m_solver.getDeltaU();
            for (double& value : delta) value *= fraction;
            trial = q;
            if (cut > 0)
                m_equations.realize(t, q.data(),
                                    u.data());  // N(q) of the start, not of the last trial
            m_equations.getBlocks().displaceQ(delta.data(), trial.data());
            if (tryPositionError(t, trial, u) < error) break;
        }
        q = trial;
    }
}

void ImplicitStep::alignJoints(double t, std::vector<double>& q, const std::vector<double>& u) {
    constexpr int MaxIterations = 30;
    constexpr double Misaligned = 1, Aligned = 1e-3;  // [rad]
    m_equations.realize(t, q.data(), u.data());
    const double misalignment = m_equations.getJoints().calcMisalignment();
    if (misalignment < Misaligned) return;
    std::vector<double> aligned = q;
    m_equations.updJoints().setAligning(true);
    closeJoints(t, Aligned, MaxIterations, aligned, u);
    m_equations.updJoints().setAligning(false);
    m_equations.realize(t, aligned.data(), u.data());
    if (m_equations.getJoints().calcMisalignment() < misalignment) q = aligned;
}

void ImplicitStep::relaxShapes(double t, double tolerance, int maxIterations,
                               const std::vector<double>& start, std::vector<double>& q,
                               const std::vector<double>& u) {
    constexpr int MaxPasses = 8, FirstModal = 7;  // behind quaternion and position
    double gap = SimTK::Infinity;
    for (int pass = 0; pass < MaxPasses && gap > tolerance; ++pass) {
        std::vector<double> relaxed = q;
        for (int b = 0; b < m_equations.getTopology().numFlexible; ++b) {
            const Block& block = m_equations.getBlock(b);
            std::copy(start.begin() + block.firstQ + FirstModal,
                      start.begin() + block.firstQ + block.numQ,
                      relaxed.begin() + block.firstQ + FirstModal);
        }
        const double rest = calcPositionError(t, relaxed, u);
        if (!(rest < 0.5 * gap)) return;  // they must deform as much to meet
        gap = rest;
        if (!(closeJoints(t, tolerance, maxIterations, relaxed, u) <= tolerance)) return;
        q = relaxed;
    }
}

bool ImplicitStep::isAssembled(double t, double tolerance, const std::vector<double>& q,
                               const std::vector<double>& u) {
    return calcPositionError(t, q, u) <= tolerance && !m_equations.getJoints().findFlipped();
}

void ImplicitStep::assemble(double t, double tolerance, std::vector<double>& q,
                            std::vector<double>& u) {
    const FlushDenormals flush;
    constexpr int MaxIterations = 60;
    constexpr double Far = 1e-3;  // [m, rad]
    std::vector<double> uDot(u.size(), 0), lambda(m_system.numMultipliers(), 0);
    m_equations.prescribe(t, 0, nullptr, q.data(), u.data());
    const std::vector<double> start = q;
    alignJoints(t, q, u);
    const bool isFar = calcPositionError(t, start, u) > Far;
    double error = closeJoints(t, tolerance, MaxIterations, q, u);
    if (isFar && error <= tolerance) {
        relaxShapes(t, tolerance, MaxIterations, start, q, u);
        error = calcPositionError(t, q, u);
    }
    if (!(error <= tolerance)) {
        throw std::runtime_error(
            FailureDiagnosis(m_equations)
                .explainAssembly(t, m_system.c, tolerance, describeRedundancies()));
    }
    if (const std::string* flipped = m_equations.getJoints().findFlipped())
        throw std::runtime_error("the joints were assembled with the axes of joint '" + *flipped +
                                 "' opposed; start closer to the wanted position");
    m_equations.prescribe(t, 0, nullptr, q.data(), u.data());
    invalidateMatrix();
}

ImplicitStep::Impulse ImplicitStep::applyImpulse(double t, const std::vector<double>& q,
                                                 const std::vector<double>& before,
                                                 std::vector<double>& u, Shapes shapes) {
    const FlushDenormals flush;
    // Exact for constraints that are linear in u; a second pass removes round-off.
    constexpr int MaxPasses = 3;
    std::vector<double> jump(u.size()), multipliers(size_t(m_system.numMultipliers()), 0);
    for (size_t i = 0; i < u.size(); ++i) jump[i] = u[i] - before[i];
    const auto calcErrors = [&](const std::vector<double>& speeds) {
        m_equations.realize(t, q.data(), speeds.data());
        m_equations.calcVelocityErrors(m_system.c.data());
        return findLargest(m_system.c);
    };
    calcErrors(u);
    Impulse impulse;
    if (areRatesSmall(m_system.c, u) && m_equations.getBlocks().calcDisplacement(jump.data()) <=
                                            tolerances.constraintResidual * calcSpeedScale(u))
        return impulse;

    m_equations.calcMomentum(q.data(), u.data(), jump.data(), multipliers.data(),
                             m_system.r.data());
    for (size_t i = 0; i < u.size(); ++i)
        if (m_equations.isSpeedKnown(i)) m_system.r[i] = 0;
    m_equations.formMassSystem(m_system, MotionLevel::Velocity);
    if (shapes == Shapes::Kept) makeModesHeavy();
    factor();
    m_solver.solve(m_system);
    for (int pass = 0;; ++pass) {
        ++m_statistics.linearSolves;
        const std::vector<double>& delta = m_solver.getDeltaU();
        for (size_t i = 0; i < u.size(); ++i) u[i] += delta[i];
        for (size_t k = 0; k < multipliers.size(); ++k)
            multipliers[k] += m_solver.getDeltaLambda()[k];
        calcErrors(u);
        if (areRatesSmall(m_system.c, u) || pass == MaxPasses) break;
        m_solver.solveForConstraints(m_system);
    }
    invalidateMatrix();
    if (!(findLargestRate(m_system.c) <= LargestSpeedError * calcSpeedScale(u)))
        throw std::runtime_error(
            FailureDiagnosis(m_equations).explainSpeeds(t, m_system.c, describeRedundancies()));

    // (u + before)/2 · (p − GᵀΛ), where G u = −∂g/∂t after and that plus an error before.
    const std::vector<double> atRest(u.size(), 0);
    for (size_t k = 0; k < multipliers.size(); ++k)
        impulse.work -= 0.5 * multipliers[k] * m_system.c[k];
    calcErrors(before);
    for (size_t k = 0; k < multipliers.size(); ++k)
        impulse.work -= 0.5 * multipliers[k] * m_system.c[k];
    impulse.isDriven = calcErrors(atRest) > 0;
    for (size_t k = 0; k < multipliers.size(); ++k) impulse.work += multipliers[k] * m_system.c[k];
    for (size_t i = 0; i < u.size(); ++i)
        impulse.isDriven = impulse.isDriven || (m_equations.isSpeedKnown(i) && u[i] != 0);
    impulse.work += checkMomentum(t, q, before, u, multipliers, shapes);
    return impulse;
}

bool ImplicitStep::isModal(const Block& block, size_t u) const {
    const auto& flexible = m_equations.getBlocks().flexible;
    const bool isFlexible = std::any_of(flexible.begin(), flexible.end(),
                                        [&](const Block* other) { return other == &block; });
    return isFlexible && u >= size_t(block.firstU) + 6;
}

void ImplicitStep::makeModesHeavy() {
    constexpr double Heavy = 1e30;  // against modal masses of 1: they take no part
    for (NewtonSystem::Part& part : m_system.parts)
        for (double& mass : part.diagonal) mass *= Heavy;
    for (int b = 0; b < m_equations.getTopology().numBlocks(); ++b) {
        NewtonSystem::Block& block = m_system.blocks[size_t(b)];
        const Block& own = m_equations.getBlock(b);
        if (block.part >= 0) continue;
        for (size_t i = 0; i < size_t(own.numU); ++i)
            if (isModal(own, size_t(own.firstU) + i))
                block.matrix[i + i * size_t(own.numU)] *= Heavy;
    }
}

double ImplicitStep::checkMomentum(double t, const std::vector<double>& q,
                                   const std::vector<double>& before, const std::vector<double>& u,
                                   const std::vector<double>& multipliers, Shapes shapes) {
    constexpr double LargestRest = 1e-6, LargestOfAll = 1e-9;  // of a block's momentum, of any
    constexpr double RoundOff = 1e-14;                         // of what bodies have
    std::vector<double> jump(u.size()), momentum(u.size()), rest(u.size());
    const std::vector<double> none(multipliers.size(), 0);
    for (size_t i = 0; i < u.size(); ++i) jump[i] = u[i] - before[i];
    m_equations.realize(t, q.data(), u.data());
    m_equations.calcMomentum(q.data(), u.data(), jump.data(), none.data(), momentum.data());
    // A jump that is itself round-off of the speeds has momenta that are round-off of theirs.
    m_equations.calcMomentum(q.data(), u.data(), u.data(), none.data(), rest.data());
    double roundOff = RoundOff * findLargest(rest);
    m_equations.calcMomentum(q.data(), u.data(), before.data(), none.data(), rest.data());
    roundOff += RoundOff * findLargest(rest);
    roundOff +=
        m_equations.calcMomentum(q.data(), u.data(), jump.data(), multipliers.data(), rest.data());
    double work = 0;
    for (int b = 0; b < m_equations.getTopology().numBlocks(); ++b) {
        const Block& block = m_equations.getBlock(b);
        const double allowed =
            LargestRest * findLargest(momentum.data() + block.firstU, block.numU) +
            LargestOfAll * findLargest(momentum) + roundOff;
        for (size_t i = size_t(block.firstU); i < size_t(block.firstU + block.numU); ++i) {
            if (m_equations.isSpeedKnown(i) || (shapes == Shapes::Kept && isModal(block, i))) {
                work += 0.5 * (u[i] + before[i]) * rest[i];
            } else if (!(std::abs(rest[i]) <= allowed)) {
                std::ostringstream text;
                text << "speeds that jump at t = " << t << " s do not keep the momentum of '"
                     << block.name << "': it is off by " << std::abs(rest[i])
                     << " kg m/s or kg m^2/s. The results would be wrong; this is a mistake of "
                        "simflex's, or masses differ by too many orders of magnitude";
                throw std::runtime_error(text.str());
            }
        }
    }
    return work;
}

void ImplicitStep::calcAccelerations(double t, const std::vector<double>& q,
                                     const std::vector<double>& u, std::vector<double>& uDot,
                                     std::vector<double>& lambda) {
    const FlushDenormals flush;
    std::fill(lambda.begin(), lambda.end(), 0.0);
    m_equations.realize(t, q.data(), u.data());
    m_equations.calcPrescribedUDot(q.data(), uDot.data());
    m_equations.updFrictions().start();
    // Friction makes the equations nonlinear: it depends on their solution.
    constexpr int MaxIterations = 50;
    int iteration = 0;
    Repetition repetition;
    while (!improveAccelerations(t, q, u, uDot, lambda, repetition)) {
        if (++iteration < MaxIterations) continue;
        const auto& frictions = m_equations.getTopology().frictions;
        const auto worst =
            std::max_element(frictions.begin(), frictions.end(), [&](const auto& a, const auto& b) {
                return std::abs(repetition.correction[size_t(a.firstRow)]) <
                       std::abs(repetition.correction[size_t(b.firstRow)]);
            });
        throw std::runtime_error(
            FailureDiagnosis(m_equations).explainFriction(int(worst - frictions.begin())));
    }
    m_canProject = false;
    invalidateMatrix();
}

bool ImplicitStep::improveAccelerations(double t, const std::vector<double>& q,
                                        const std::vector<double>& u, std::vector<double>& uDot,
                                        std::vector<double>& lambda, Repetition& repetition) {
    constexpr double Accuracy = 1e-12;  // of multipliers
    constexpr double Small = 1e-2, Same = 1e-3;
    FrictionTerms& frictions = m_equations.updFrictions();
    const auto calcErrors = [&] {
        m_equations.calcAccelerationErrors(q.data(), u.data(), uDot.data(), m_system.c.data());
    };
    if (!frictions.isEmpty()) {
        calcErrors();
        if (frictions.decide(FrictionTerms::By::Accelerations, lambda.data())) repetition = {};
        if (const int k = frictions.findUndecided(); k >= 0)
            throw std::runtime_error(FailureDiagnosis(m_equations).explainFriction(k));
    }
    m_equations.calcResidual(q.data(), u.data(), uDot.data(), lambda.data(), m_system.r.data());
    calcErrors();
    if (!std::isfinite(findLargest(m_system.r)))
        throw std::runtime_error(
            FailureDiagnosis(m_equations).explainNonFiniteForces(findNonFiniteBlock(), t, q, u));
    m_equations.formMassSystem(m_system);
    factor();
    m_solver.solve(m_system);
    ++m_statistics.linearSolves;
    const std::vector<double>& delta = m_solver.getDeltaU();
    for (size_t i = 0; i < uDot.size(); ++i) uDot[i] += delta[i];
    const std::vector<double> correction(m_solver.getDeltaLambda(),
                                         m_solver.getDeltaLambda() + lambda.size());
    for (size_t i = 0; i < lambda.size(); ++i) lambda[i] += correction[i];
    const double change = findLargestForce(correction.data()),
                 largest = findLargestForce(lambda.data());
    if (frictions.isEmpty() || change <= Accuracy * largest) return true;
    std::vector<double>& last = repetition.correction;
    ++repetition.numIterations;
    if (last.empty() || change > Small * largest) {
        last = correction;
        return false;
    }
    for (size_t i = 0; i < last.size(); ++i) last[i] -= correction[i];
    const bool isSame = findLargestForce(last.data()) <= Same * change;
    if (isSame)
        for (size_t i = 0; i < last.size(); ++i)
            lambda[i] -= repetition.numIterations * correction[i];
    last = correction;
    return isSame;
}

double ImplicitStep::calcResponse(double stiffness, const std::vector<double>& loads) {
    const FlushDenormals flush;
    const Topology& topology = m_equations.getTopology();
    const size_t nu = size_t(topology.numU), m = size_t(topology.numMultipliers);
    std::copy_n(loads.begin(), nu, m_system.r.begin());
    for (size_t k = 0; k < m; ++k) m_system.c[k] = loads[nu + k] / stiffness;
    m_solver.solve(m_system);
    ++m_statistics.linearSolves;
    return m_equations.updErrorNorm().calcChange(m_solver.getDeltaU().data(), stiffness);
}

ImplicitStep::Imbalance ImplicitStep::calcImbalance(const SolutionPoint& point) {
    const FlushDenormals flush;
    Imbalance imbalance;
    m_equations.setZ(point.z.data());
    m_equations.realize(point.t, point.q.data(), point.u.data());
    m_equations.calcPositionErrors(m_system.c.data());
    imbalance.positionError = findLargest(m_system.c);
    m_equations.calcVelocityErrors(m_system.c.data());
    imbalance.speedError = findLargestRate(m_system.c) / calcSpeedScale(point.u);
    if (!m_reuse.hasMatrix()) return imbalance;
    m_equations.calcResidual(point.q.data(), point.u.data(), point.uDot.data(), point.lambda.data(),
                             m_system.r.data());
    std::fill(m_system.c.begin(), m_system.c.end(), 0.0);
    m_solver.solve(m_system);
    ++m_statistics.linearSolves;
    imbalance.displacement = m_equations.updErrorNorm().calcChange(m_solver.getDeltaU().data(),
                                                                   m_reuse.getFactors().stiffness);
    return imbalance;
}

std::vector<double> ImplicitStep::calcLoads(double t, const std::vector<double>& q,
                                            const std::vector<double>& u) {
    const FlushDenormals flush;
    const size_t nu = u.size(), m = size_t(m_equations.getTopology().numMultipliers);
    std::vector<double> loads(2 * nu + m), lambda(m, 0);
    double *uDot = loads.data(), *r = uDot + nu, *gDotDot = r + nu;
    m_equations.realize(t, q.data(), u.data());
    m_equations.calcPrescribedUDot(q.data(), uDot);
    m_equations.calcResidual(q.data(), u.data(), uDot, lambda.data(), r);
    m_equations.calcAccelerationErrors(q.data(), u.data(), uDot, gDotDot);
    return loads;
}

void ImplicitStep::addInTiming() {
    book(m_solver.getTiming(), m_timed);
}

void ImplicitStep::visit(Checkpoint& checkpoint) {
    m_reuse.visit(checkpoint);
    checkpoint.visit(m_lastUDot, m_multiplierFloor, m_canProject, m_mayLoseCount);
    checkpoint.visit(m_perSpeed, m_perMultiplier);
    checkpoint.visit(m_renewsDerivatives);
    checkpoint.visit(m_denseStepsLeft, m_densePeriod);
    bool isFactored = m_solver.isFactored(), hasLateBlocks = m_solver.hasLateBlocks();
    checkpoint.visit(isFactored, hasLateBlocks);
    if (!isFactored && (m_canProject || m_reuse.hasMatrix()))
        Checkpoint::refuse("it has no matrix to continue with");
    if (isFactored) m_system.visit(checkpoint);
    if (!checkpoint.isReading() || !isFactored) return;
    if (!hasLateBlocks && m_solver.hasLateBlocks()) m_solver.dissolveLateBlocks(m_system);
    m_solver.factor(m_system);
    m_timed = m_solver.getTiming();
}

}  // namespace simflex
