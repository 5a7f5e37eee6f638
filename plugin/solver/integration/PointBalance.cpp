#include "simflex/solver/integration/PointBalance.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "simflex/base/FlushDenormals.h"
#include "simflex/solver/integration/FailureDiagnosis.h"

namespace simflex {

void PointBalance::calc(const NewtonFactors& factors, const Options& options,
                        SolutionPoint& point) {
    const FlushDenormals flush;
    // Sliding friction depends on the multipliers; without friction one iteration is exact.
    constexpr int MostIterations = 10;
    constexpr double Accuracy = 1e-10;
    if (!m_matrices)
        m_matrices = std::make_unique<Matrices>(m_equations.getTopology().makeNewtonSystem());
    NewtonSystem& system = m_matrices->system;
    FrictionTerms& frictions = m_equations.updFrictions();
    const FrictionTerms::Look look(frictions);
    frictions.recall();
    std::vector<double>&q = point.q, &u = point.u, &uDot = point.uDot, &lambda = point.lambda;
    m_equations.prescribe(point.t, 0, nullptr, q.data(), u.data());
    m_equations.setZ(point.z.data());
    m_equations.realize(point.t, q.data(), u.data());
    if (const PrescribedMotion* prescribed = m_equations.getSimbody().getPrescribed())
        prescribed->applyAccelerations(q.data(), uDot.data());
    if (options.isRedundant && frictions.isEmpty()) std::fill(lambda.begin(), lambda.end(), 0.0);

    std::fill(system.c.begin(), system.c.end(), 0.0);
    for (int iteration = 0; iteration < MostIterations; ++iteration) {
        frictions.follow(lambda.data());
        m_equations.calcResidual(q.data(), u.data(), uDot.data(), lambda.data(), system.r.data());
        m_equations.calcAccelerationErrors(q.data(), u.data(), uDot.data(), system.c.data());
        for (double& error : system.c) error *= factors.mass;
        if (iteration == 0) {
            m_equations.formNewtonSystem(factors, options.isDense, q.data(), u.data(), uDot.data(),
                                         system);
            factor(options);
        }
        m_matrices->solver.solve(system);
        const std::vector<double>& deltaU = m_matrices->solver.getDeltaU();
        for (size_t i = 0; i < uDot.size(); ++i) uDot[i] += deltaU[i] / factors.mass;
        double change = 0, largest = 0;
        for (size_t k = 0; k < lambda.size(); ++k) {
            const double delta = m_matrices->solver.getDeltaLambda()[k];
            lambda[k] += delta;
            change = std::max(change, std::abs(delta));
            largest = std::max(largest, std::abs(lambda[k]));
        }
        if (frictions.isEmpty() || change <= Accuracy * largest) return;
    }
}

void PointBalance::factor(const Options& options) {
    BlockEliminationSolver& solver = m_matrices->solver;
    solver.setNumThreads(options.numThreads);
    if (!options.hasLateBlocks && solver.hasLateBlocks())
        solver.dissolveLateBlocks(m_matrices->system);
    try {
        solver.factor(m_matrices->system);
    } catch (const SingularBlock& error) {
        throw std::runtime_error(
            FailureDiagnosis(m_equations).explainSingularBlock(error.block, m_matrices->system));
    }
}

}  // namespace simflex
