#include "simflex/solver/integration/RadauStep.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <complex>

#include "simflex/base/Checkpoint.h"
#include "simflex/base/FlushDenormals.h"
#include "simflex/base/SecondsSince.h"

namespace simflex {

using namespace radau;

namespace {

using RadauClock = std::chrono::steady_clock;

/** Order of evaluation of the stages: the matrix is that of the middle one. **/
constexpr int EvaluationOrder[NumStages] = {0, 2, 1};
constexpr int Middle = 1, End = NumStages - 1;

/** y_i ← y_n + h Σ_j a_ij ẏ_j for all stages. **/
void integrate(const std::vector<double>& start, double h,
               std::array<SolutionPoint, NumStages>& stages,
               std::vector<double> SolutionPoint::*value,
               std::vector<double> SolutionPoint::*derivative) {
    for (int i = 0; i < NumStages; ++i) {
        std::vector<double>& y = stages[size_t(i)].*value;
        const double *d0 = (stages[0].*derivative).data(), *d1 = (stages[1].*derivative).data(),
                     *d2 = (stages[2].*derivative).data();
        const double a0 = h * A[i][0], a1 = h * A[i][1], a2 = h * A[i][2];
        for (size_t k = 0; k < y.size(); ++k)
            y[k] = start[k] + (a0 * d0[k] + a1 * d1[k] + a2 * d2[k]);
    }
}

}  // namespace

RadauStep::RadauStep(Evaluation& equations, IntegratorStatistics& statistics)
    : ImplicitStep(equations, statistics),
      m_complex(makeCombined(m_system, equations.getTopology().numMultipliers)),
      m_complexSolver(m_complex) {
    const Topology& topology = equations.getTopology();
    for (int i = 0; i < NumStages; ++i) {
        m_stages[size_t(i)].resize(topology.numQ, topology.numU, topology.numMultipliers,
                                   topology.numZ);
        m_r[size_t(i)] = m_deltaU[size_t(i)] = m_system.r;
        m_c[size_t(i)].assign(size_t(topology.numMultipliers), 0);
        m_deltaLambda[size_t(i)] = m_c[size_t(i)];
    }
    m_trial = m_stages[End];
    m_change = {m_trial.q, m_trial.u, m_trial.z};
    static_cast<ErrorNorm::Error&>(m_last) = m_change;
    m_tried = m_last;
    m_real.fill(m_system);
    m_history.assign(size_t(topology.numU), 0);
    m_matrixQ = m_trial.q;
    m_zChange.assign(NumStages * size_t(topology.numZ), 0);
    for (int row = 0; row < topology.numMultipliers; ++row)
        if (topology.getRowLevel(row) == MotionLevel::Acceleration)
            m_accelerationRows.push_back(row);
}

void RadauStep::useThreads(int threads) {
    ImplicitStep::useThreads(threads);
    m_complexSolver.setNumThreads(threads);
}

void RadauStep::placeStages(const SolutionPoint& start, double h) {
    const Blocks& blocks = m_equations.getBlocks();
    // q̇ depends on q through N alone: this iteration is much faster than Newton's.
    const bool askForN = blocks.askForN();
    for (int pass = 0; pass < (askForN ? 1 : 2); ++pass) {
        for (SolutionPoint& stage : m_stages) {
            if (askForN) m_equations.realize(stage.t, stage.q.data(), stage.u.data());
            blocks.calcQDot(stage.q.data(), stage.u.data(), stage.qDot.data());
        }
        integrate(start.q, h, m_stages, &SolutionPoint::q, &SolutionPoint::qDot);
    }
    const PrescribedMotion* prescribed = m_equations.getSimbody().getPrescribed();
    for (int i = 0; prescribed && i < NumStages; ++i) {
        SolutionPoint& stage = m_stages[size_t(i)];
        for (size_t k = 0; k < m_history.size(); ++k) {
            m_history[k] = start.u[k];
            for (int j = 0; j < NumStages; ++j)
                if (j != i) m_history[k] += h * A[i][j] * m_stages[size_t(j)].uDot[k];
        }
        m_equations.prescribe(stage.t, h * A[i][i], m_history.data(), stage.q.data(),
                              stage.u.data());
    }
    const double *u0 = m_stages[0].u.data(), *u1 = m_stages[1].u.data(), *u2 = m_stages[2].u.data();
    for (int i = 0; i < NumStages; ++i) {
        SolutionPoint& stage = m_stages[size_t(i)];
        const double w0 = W[i][0] / h, w1 = W[i][1] / h, w2 = W[i][2] / h;
        for (size_t k = 0; k < stage.uDot.size(); ++k) {
            const double u = start.u[k];
            stage.uDot[k] = w0 * (u0[k] - u) + w1 * (u1[k] - u) + w2 * (u2[k] - u);
        }
        if (!prescribed) continue;
        m_equations.prescribe(stage.t, 0, nullptr, stage.q.data(), stage.u.data());
        prescribed->applyAccelerations(stage.q.data(), stage.uDot.data());
    }
}

bool RadauStep::keepsMatrices() const {
    constexpr int LargestTree = 30;  // speeds: factoring costs their cube, evaluating their number
    const Topology& topology = m_equations.getTopology();
    if (m_equations.updTrees().renewMatrices(useDense())) return false;
    if (!topology.differenced.empty()) return true;
    return std::any_of(topology.blockSizes.begin() + topology.numFlexible,
                       topology.blockSizes.end(), [](int size) { return size > LargestTree; });
}

template <class Choice>
void RadauStep::correctZ(const SolutionPoint& start, double h, const Choice& isChosen,
                         bool byNewton) {
    const size_t numZ = start.z.size();
    double hA[NumStages * NumStages];
    for (int i = 0; i < NumStages; ++i)
        for (int j = 0; j < NumStages; ++j) hA[i * NumStages + j] = h * A[i][j];
    for (size_t i = 0; i < NumStages; ++i)
        for (size_t k = 0; k < numZ; ++k) {
            double change = start.z[k] - m_stages[i].z[k];
            for (size_t j = 0; j < NumStages; ++j)
                change += hA[i * NumStages + j] * m_stages[j].zDot[k];
            m_zChange[i * numZ + k] = isChosen(k) ? change : 0;
        }
    if (byNewton) correctStates(hA, NumStages, m_zChange);
    for (size_t k = 0; k < numZ; ++k) {
        if (!isChosen(k)) continue;
        for (size_t i = 0; i < NumStages; ++i) m_stages[i].z[k] += m_zChange[i * numZ + k];
        m_deltaZ[k] = m_zChange[End * numZ + k];
    }
}

double RadauStep::evaluateStages(const SolutionPoint& start, double h, bool forMatrix,
                                 bool& hasOtherFriction) {
    hasOtherFriction = false;
    const Topology& topology = m_equations.getTopology();
    if (topology.hasCoupledStates) {
        for (const int i : EvaluationOrder) {
            SolutionPoint& stage = m_stages[size_t(i)];
            m_equations.setZ(stage.z.data());
            m_equations.realize(stage.t, stage.q.data(), stage.u.data());
            m_equations.updLoads().calcStateRates(stage.zDot.data());
        }
        correctZ(
            start, h, [&](size_t k) { return topology.isCoupled(int(k)); }, true);
    }
    FrictionTerms& frictions = m_equations.updFrictions();
    if (!frictions.isEmpty()) {
        SolutionPoint& end = m_stages[End];
        m_equations.setZ(end.z.data());
        m_equations.realize(end.t, end.q.data(), end.u.data());
        hasOtherFriction = frictions.decide(FrictionTerms::By::Rates, end.lambda.data());
    }
    for (const int i : EvaluationOrder) {
        SolutionPoint& stage = m_stages[size_t(i)];
        m_equations.setZ(stage.z.data());
        m_equations.realize(stage.t, stage.q.data(), stage.u.data());
        if (m_carriesForces && forMatrix) m_inertias.take(i, m_equations.getBlocks());
        frictions.follow(stage.lambda.data());
        m_equations.calcResidual(stage.q.data(), stage.u.data(), stage.uDot.data(),
                                 stage.lambda.data(), m_r[size_t(i)].data());
        m_equations.calcStepErrors(MotionLevel::Velocity, 1, stage.uDot.data(), stage.q.data(),
                                   m_c[size_t(i)].data());
        if (!stage.z.empty())
            m_equations.calcZDot(stage.q.data(), stage.u.data(), stage.uDot.data(), stage.z.data(),
                                 stage.zDot.data());
    }
    // Errors of accelerations in terms of ΔU.
    for (const int row : m_accelerationRows) {
        double errors[NumStages];
        for (int i = 0; i < NumStages; ++i) errors[i] = m_c[size_t(i)][size_t(row)];
        for (int i = 0; i < NumStages; ++i)
            m_c[size_t(i)][size_t(row)] =
                h * (A[i][0] * errors[0] + A[i][1] * errors[1] + A[i][2] * errors[2]);
    }
    if (start.z.empty()) return 0;
    if (topology.hasForeignZ() || !topology.hasCoupledStates)
        correctZ(
            start, h, [&](size_t k) { return !topology.isCoupled(int(k)); }, false);
    return m_equations.updErrorNorm().calcZSize(m_deltaZ.data());
}

bool RadauStep::isFrictionSettled(const SolutionPoint& start, double h) {
    FrictionTerms& frictions = m_equations.updFrictions();
    if (frictions.isEmpty()) return true;
    placeStages(start, h);
    const SolutionPoint& end = m_stages[End];
    m_equations.setZ(end.z.data());
    m_equations.realize(end.t, end.q.data(), end.u.data());
    return frictions.isSettled(end.lambda.data());
}

void RadauStep::formAndFactorBoth(const NewtonFactors& factors) {
    const SolutionPoint& stage = m_stages[Middle];
    formAndFactor(factors, stage.q, stage.u, stage.uDot);
    const auto start = RadauClock::now();
    m_matrixQ = stage.q;
    m_real[0] = m_system;
    const NewtonFactors others[] = {{factors.mass, 2 * factors.stiffness},
                                    {2 * factors.mass, factors.stiffness}};
    for (int k = 0; k < 2; ++k)
        m_equations.formNewtonSystem(others[k], useDense(), stage.q.data(), stage.u.data(),
                                     stage.uDot.data(), m_real[size_t(k + 1)]);
    m_statistics.evaluationSeconds += secondsSince(start);
    factorComplex();
}

void RadauStep::factorComplex() {
    using Complex = std::complex<double>;
    // mass = stiffness = h/γ̂. With w₀ + w₁ + w₂ = 1:  M/mass (1 − w₂/2) = M μ,
    // K stiffness (1 + w₁) = K/μ.
    const Complex ratio(Alpha / RealEigenvalue, Beta / RealEigenvalue);
    const Complex byStiffness = 1.0 / ratio - 1.0, byMass = 2.0 * (1.0 - ratio);
    const Complex weights[] = {1.0 - byStiffness - byMass, byStiffness, byMass};
    combine(m_real[0], m_real[1], m_real[2], weights, m_complex);
    runFactorization([this] { m_complexSolver.factor(m_complex); });
}

void RadauStep::solveBoth() {
    using Complex = std::complex<double>;
    const auto *t = InverseT[0], *re = InverseT[1], *im = InverseT[2];
    const auto transform = [&](const Vectors& stages, std::vector<double>& real,
                               std::vector<Complex>& complex) {
        const double *x0 = stages[0].data(), *x1 = stages[1].data(), *x2 = stages[2].data();
        for (size_t k = 0; k < stages[0].size(); ++k) {
            real[k] = t[0] * x0[k] + t[1] * x1[k] + t[2] * x2[k];
            complex[k] = Complex(re[0] * x0[k] + re[1] * x1[k] + re[2] * x2[k],
                                 im[0] * x0[k] + im[1] * x1[k] + im[2] * x2[k]);
        }
    };
    const Blocks& blocks = m_equations.getBlocks();
    for (int i = 0; i < NumStages; ++i) {
        double* r = m_r[size_t(i)].data();
        if (m_carriesForces)
            m_inertias.carry(i, Middle, blocks, r);
        else  // inertia is constant in axes that turn with a body, and with it J
            blocks.turnAlong(m_stages[size_t(i)].q.data(), m_matrixQ.data(), r);
    }
    transform(m_r, m_system.r, m_complex.r);
    transform(m_c, m_system.c, m_complex.c);
    solveLinear();
    m_complexSolver.solve(m_complex);
    ++m_statistics.linearSolves;
    const auto transformBack = [&](const double* real, const Complex* complex, Vectors& stages) {
        for (int i = 0; i < NumStages; ++i)
            for (size_t k = 0; k < stages[size_t(i)].size(); ++k)
                stages[size_t(i)][k] =
                    T[i][0] * real[k] + T[i][1] * complex[k].real() + T[i][2] * complex[k].imag();
    };
    transformBack(m_solver.getDeltaU().data(), m_complexSolver.getDeltaU().data(), m_deltaU);
    for (int i = 0; !m_carriesForces && i < NumStages; ++i)
        blocks.turnAlong(m_matrixQ.data(), m_stages[size_t(i)].q.data(),
                         m_deltaU[size_t(i)].data());
    transformBack(m_solver.getDeltaLambda(), m_complexSolver.getDeltaLambda(), m_deltaLambda);
}

ImplicitStep::Outcome RadauStep::solveStages(const SolutionPoint& start, double h) {
    const FlushDenormals flush;
    constexpr double LargestNoise = 0.1;  // of the accuracy: round-off that no iteration removes
    const NewtonFactors factors = calcFactors(h);
    Outcome outcome;
    // An iteration evaluates three stages: a new matrix costs less than one of them, and the error
    // it leaves does not accumulate over the steps.
    constexpr double SlowestRate = 0.15;
    // In long trees each step forms its matrix at predictions; at corrected stages it is better.
    constexpr double SlowestFromPrediction = 0.3;
    bool refresh = m_reuse.beginStep(factors, SlowestRate) || !keepsMatrices() ||
                   blockForm == BlockForm::Dense || forceFullNewton;
    // Convergence starts anew: the error left by the first change accumulates over many short
    // steps.
    m_reuse.resetRate();
    m_slowestRate = 0;
    m_carriesForces = m_equations.updTrees().renewMatrices(useDense());
    bool hasNewDerivatives = false, isRefreshed = false;
    double previousChange = 0, previousMultiplierChange = 0, forceScale = 0;
    for (int i = 0; i < NumStages; ++i) {
        m_stages[size_t(i)].t = start.t + C[i] * h;
        m_stages[size_t(i)].uDot = start.uDot;
    }

    m_equations.updFrictions().recall();
    int allowed = tolerances.maxIterations, numMatrices = 0, renewals = 0;
    for (int iteration = 0; iteration < allowed; ++iteration) {
        const auto begin = RadauClock::now();
        placeStages(start, h);
        bool hasOtherFriction;
        const double zChange = evaluateStages(start, h, refresh, hasOtherFriction);
        if (hasOtherFriction) {
            refresh = true;
            previousChange = previousMultiplierChange = forceScale = 0;
        }
        const bool hasZConverged = zChange <= tolerances.displacement * accuracy;
        m_statistics.evaluationSeconds += secondsSince(begin);

        double bodyResidual = 0;
        outcome.constraintResidual = 0;
        for (int i = 0; i < NumStages; ++i) {
            int row = -1;
            const std::vector<double>& residual = m_r[size_t(i)];
            const double r = findLargestForce(residual.data(), 0, int(residual.size())),
                         c = findLargest(m_c[size_t(i)], &row);
            if (!std::isfinite(r)) {
                outcome.isFinite = false;
                m_system.r = m_r[size_t(i)];
                outcome.worstBlock = findNonFiniteBlock();
            }
            outcome.isFinite = outcome.isFinite && std::isfinite(c);
            bodyResidual = largerOrNaN(bodyResidual, r);
            if (c > outcome.constraintResidual) {
                outcome.constraintResidual = c;
                outcome.worstRow = row;
            }
            forceScale =
                std::max({forceScale, r, findLargestForce(m_stages[size_t(i)].lambda.data())});
        }
        if (!outcome.isFinite || m_equations.getFrictions().findUndecided() >= 0) break;
        if (iteration > 0 && !hasOtherFriction &&
            bodyResidual <= tolerances.bodyResidual * forceScale && hasZConverged &&
            areRatesSmall(m_c[0], m_stages[0].u) && areRatesSmall(m_c[1], m_stages[1].u) &&
            areRatesSmall(m_c[End], m_stages[End].u)) {
            outcome.converged = true;
            break;
        }

        const bool isComparable = !refresh || isRefreshed;
        isRefreshed = refresh;
        if (refresh) {
            const SolutionPoint& middle = m_stages[Middle];
            hasNewDerivatives |= renewDerivatives(middle.q, middle.u, middle.uDot);
            formAndFactorBoth(factors);
            m_reuse.resetRate();
            refresh = false;
            if (numMatrices++ < MostMatrices) allowed = iteration + tolerances.maxIterations;
        }
        solveBoth();
        if (!isRefreshed) noteDuration(secondsSince(begin));
        ++m_statistics.newtonIterations;
        double change = 0, multiplierChange = 0;
        for (int i = 0; i < NumStages; ++i) {
            std::vector<double>&u = m_stages[size_t(i)].u, &lambda = m_stages[size_t(i)].lambda;
            const std::vector<double>&deltaU = m_deltaU[size_t(i)],
                  &deltaLambda = m_deltaLambda[size_t(i)];
            for (size_t k = 0; k < u.size(); ++k) u[k] += deltaU[k];
            for (size_t k = 0; k < lambda.size(); ++k) lambda[k] += deltaLambda[k];
            int block = 0;
            const double own =
                m_equations.updErrorNorm().calcChange(deltaU.data(), factors.stiffness, &block);
            if (!(own <= change) && !std::isnan(change)) {
                change = own;
                outcome.worstBlock = block;
            }
            multiplierChange = largerOrNaN(multiplierChange, findLargestForce(deltaLambda.data()));
        }
        outcome.displacementChange = change;
        if (!(change <= largestChange) || !std::isfinite(multiplierChange)) break;
        if (iteration > 0) {
            const double rate = previousChange > 0 ? change / previousChange : 0;
            m_reuse.noteRate(rate);
            m_slowestRate = std::max(m_slowestRate, rate);
            if (iteration > 1 && isComparable &&
                hasStalled(change, previousChange, multiplierChange, previousMultiplierChange)) {
                // Friction depends on multipliers: inaccurate ones would be wrong forces.
                outcome.converged =
                    hasZConverged && change <= LargestNoise * accuracy &&
                    (m_equations.getFrictions().isEmpty() ||
                     (areMultipliersGood(multiplierChange, m_stages[End].lambda, forceScale) &&
                      isFrictionSettled(start, h)));
                break;
            }
        }
        previousChange = change;
        previousMultiplierChange = multiplierChange;

        const double remaining = m_reuse.calcRemaining();
        const double multiplierScale =
            std::max(findLargestForce(m_stages[End].lambda.data()), m_multiplierFloor);
        if (hasZConverged && remaining * change <= tolerances.displacement * accuracy &&
            remaining * multiplierChange <= tolerances.multiplier * multiplierScale &&
            isFrictionSettled(start, h)) {
            outcome.converged = true;
            break;
        }
        const bool mayRenew = m_carriesForces ? renewals < 1 : !m_reuse.isFresh();
        const bool isSlow =
            iteration > 0 && mayRenew &&
            m_reuse.getRate() > (m_carriesForces ? SlowestFromPrediction : SlowestRate);
        if (isSlow) ++renewals;
        refresh = needsBetterMatrix(iteration, hasNewDerivatives) || isSlow || forceFullNewton;
    }

    if (outcome.converged) {
        const auto begin = RadauClock::now();
        placeStages(start, h);
        m_statistics.evaluationSeconds += secondsSince(begin);
        noteConvergence(m_stages[End]);
    } else {
        noteFailure(hasNewDerivatives, outcome);
    }
    return outcome;
}

bool RadauStep::completeStages(const SolutionPoint& start, double h) {
    const Topology& topology = m_equations.getTopology();
    const bool hasPower = m_equations.canHavePower();
    for (SolutionPoint& stage : m_stages) {
        stage.power = 0;
        if (!hasPower && topology.periods.empty()) continue;
        m_equations.setZ(stage.z.data());
        m_equations.realize(stage.t, stage.q.data(), stage.u.data());
        if (!topology.periods.empty()) {
            m_equations.calcPositionErrors(m_system.c.data());
            m_mayLoseCount = topology.mayLoseCount(m_system.c.data());
            if (m_mayLoseCount) return false;
        }
        if (hasPower)
            stage.power = m_equations.calcPower(stage.q.data(), stage.u.data(), stage.uDot.data(),
                                                stage.lambda.data());
    }
    for (int i = 0; i < NumStages; ++i)
        m_stages[size_t(i)].work =
            start.work + h * (A[i][0] * m_stages[0].power + A[i][1] * m_stages[1].power +
                              A[i][2] * m_stages[2].power);
    return true;
}

void RadauStep::calcError(const SolutionPoint& start, const SolutionPoint& end, double h,
                          ErrorNorm::Error& error) {
    const FlushDenormals flush;
    std::vector<double>&errorQ = error.q, &errorU = error.u, &errorZ = error.z;
    const double gamma = calcFactors(h).mass;
    const auto embed = [&](std::vector<double> SolutionPoint::*value,
                           std::vector<double> SolutionPoint::*derivative,
                           std::vector<double>& difference) {
        const std::vector<double>&y = start.*value, &yDot = start.*derivative;
        const double *y0 = (m_stages[0].*value).data(), *y1 = (m_stages[1].*value).data(),
                     *y2 = (m_stages[2].*value).data();
        for (size_t k = 0; k < difference.size(); ++k)
            difference[k] =
                gamma *
                (yDot[k] +
                 (E[0] * (y0[k] - y[k]) + E[1] * (y1[k] - y[k]) + E[2] * (y2[k] - y[k])) / h);
    };
    embed(&SolutionPoint::q, &SolutionPoint::qDot, errorQ);
    embed(&SolutionPoint::u, &SolutionPoint::uDot, errorU);
    embed(&SolutionPoint::z, &SolutionPoint::zDot, errorZ);
    correctStates(&gamma, 1, errorZ);

    // One iteration of the embedded method's implicit formula, from the step's end.
    SolutionPoint& trial = m_trial;
    for (size_t k = 0; k < trial.q.size(); ++k) trial.q[k] = end.q[k] + errorQ[k];
    for (size_t k = 0; k < trial.uDot.size(); ++k) trial.uDot[k] = end.uDot[k] - errorU[k] / gamma;
    m_equations.getSimbody().clearPrescribedErrors(errorQ.data(), errorU.data());
    m_equations.setZ(end.z.data());
    m_equations.realize(end.t, trial.q.data(), end.u.data());
    m_equations.calcResidual(trial.q.data(), end.u.data(), trial.uDot.data(), end.lambda.data(),
                             m_system.r.data());
    // No component normal to the constraints; near a singular position it would be spurious.
    std::fill(m_system.c.begin(), m_system.c.end(), 0.0);
    if (m_carriesForces) {
        m_inertias.take(End, m_equations.getBlocks());
        m_inertias.carry(End, Middle, m_equations.getBlocks(), m_system.r.data());
    }
    m_solver.solve(m_system);
    ++m_statistics.linearSolves;
    errorU = m_solver.getDeltaU();
    m_equations.getBlocks().calcQDot(end.q.data(), errorU.data(), trial.qDot.data());
    // Lengths of quaternions are no errors.
    for (size_t k = 0; k < errorQ.size(); ++k)
        trial.q[k] = end.q[k] + (errorQ[k] + gamma * trial.qDot[k]);
    m_equations.getBlocks().normalizeQ(trial.q.data());
    for (size_t k = 0; k < errorQ.size(); ++k) errorQ[k] = trial.q[k] - end.q[k];
}

void RadauStep::reduceError(double h, ErrorNorm::Error& error) {
    m_tried.h = h;
    static_cast<ErrorNorm::Error&>(m_tried) = error;
    if (m_last.h == 0) return;
    // Of a vibration exp(iωt) the first is 0.03 (ωh)² of the second, and ωh is |Δe|/|e|; ten times
    // as much is taken, as errors of many steps add up. Inside the step the solution is of lower
    // order: its error is 0.13 of the second.
    constexpr double Ratio = 0.3, Least = 1.0 / 30;
    const double scale = std::pow(h / m_last.h, 4);
    const auto subtract = [scale](const std::vector<double>& now, const std::vector<double>& last,
                                  std::vector<double>& change) {
        for (size_t k = 0; k < now.size(); ++k) change[k] = now[k] - scale * last[k];
    };
    subtract(error.q, m_last.q, m_change.q);
    subtract(error.u, m_last.u, m_change.u);
    subtract(error.z, m_last.z, m_change.z);
    m_equations.updErrorNorm().scaleByPart(error, m_change, h, [&](double size, double change) {
        if (!(size > 0)) return 1.0;
        const double ratio = change / size;
        return std::clamp(Ratio * ratio * ratio, Least, 1.0);
    });
}

double RadauStep::calcLargestRatio() const {
    // Of steps ∝ h and iterations ∝ 1/ln(1/rate) with a rate ∝ h², as J changes by h from stage to
    // stage, the cheapest have the rate e⁻².
    constexpr double BestRate = 0.135, Least = 0.5;
    // An older matrix may be slow whatever the step.
    if (!m_carriesForces || m_slowestRate <= 0) return SimTK::Infinity;
    return std::max(Least, std::sqrt(BestRate / m_slowestRate));
}

void RadauStep::addInTiming() {
    ImplicitStep::addInTiming();
    book(m_complexSolver.getTiming(), m_complexTimed);
}

void RadauStep::visit(Checkpoint& checkpoint) {
    ImplicitStep::visit(checkpoint);
    checkpoint.visit(m_last.h, m_last.q, m_last.u, m_last.z);
    bool isFactored = m_complexSolver.isFactored(), hasLateBlocks = m_complexSolver.hasLateBlocks();
    checkpoint.visit(isFactored, hasLateBlocks);
    if (!isFactored) {
        if (m_reuse.hasMatrix()) Checkpoint::refuse("it has no matrix to continue with");
        return;
    }
    checkpoint.visit(m_matrixQ);
    for (NewtonSystem& system : m_real) system.visit(checkpoint);
    if (!checkpoint.isReading() || !m_reuse.hasMatrix()) return;
    if (!hasLateBlocks && m_complexSolver.hasLateBlocks())
        m_complexSolver.dissolveLateBlocks(m_complex);
    factorComplex();
    m_complexTimed = m_complexSolver.getTiming();
}

}  // namespace simflex
