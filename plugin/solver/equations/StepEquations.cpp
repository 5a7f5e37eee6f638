#include "simflex/solver/equations/StepEquations.h"

#include <algorithm>

namespace simflex {

StepEquations::StepEquations(Evaluation& equations)
    : m_equations(equations), m_delta(size_t(equations.getTopology().numU)) {}

void StepEquations::calcQ(const StepFormula& formula, const std::vector<double>& u,
                          std::vector<double>& q) {
    const Blocks& blocks = m_equations.getBlocks();
    const double stiffness = formula.factors.stiffness;
    if (formula.rule == StepFormula::QRule::Linear) {
        blocks.integrateQ(formula.qHist.data(), stiffness, u.data(), q.data());
        return;
    }
    if (m_equations.getTopology().needsSimbody) {
        // Simbody's N(q) is that of the last realize(): take it half-way, or order 2 is lost.
        for (size_t i = 0; i < q.size(); ++i) q[i] = 0.5 * (q[i] + formula.qHist[i]);
        blocks.normalizeQ(q.data());
        m_equations.realize(formula.t, q.data(), u.data());
    }
    for (size_t i = 0; i < u.size(); ++i) m_delta[i] = formula.deltaHist[i] + stiffness * u[i];
    std::copy(formula.qHist.begin(), formula.qHist.end(), q.begin());
    blocks.moveQ(m_delta.data(), q.data());
}

void StepEquations::calcUDot(const StepFormula& formula, const std::vector<double>& q,
                             const std::vector<double>& u, std::vector<double>& uDot) const {
    for (size_t i = 0; i < u.size(); ++i)
        uDot[i] = (u[i] - formula.uHist[i]) / formula.factors.mass;
    if (const PrescribedMotion* prescribed = m_equations.getSimbody().getPrescribed())
        prescribed->applyAccelerations(q.data(), uDot.data());
}

void StepEquations::complete(const StepFormula& formula, std::vector<double>& u,
                             std::vector<double>& q, std::vector<double>& uDot) {
    calcQ(formula, u, q);
    m_equations.prescribe(formula.t, formula.factors.mass, formula.uHist.data(), q.data(),
                          u.data());
    calcUDot(formula, q, u, uDot);
}

void StepEquations::evaluate(const StepFormula& formula, MotionLevel level,
                             const std::vector<double>& lambda, const std::vector<double>& z,
                             std::vector<double>& u, std::vector<double>& q,
                             std::vector<double>& uDot, NewtonSystem& system) {
    calcQ(formula, u, q);
    m_equations.prescribe(formula.t, formula.factors.mass, formula.uHist.data(), q.data(),
                          u.data());
    m_equations.updSimbody().setZ(z.data());
    m_equations.realize(formula.t, q.data(), u.data());
    calcUDot(formula, q, u, uDot);
    m_equations.calcResidual(q.data(), u.data(), uDot.data(), lambda.data(), system.r.data());
    m_equations.calcStepErrors(level, formula.factors, uDot.data(), q.data(), system.c.data());
}

}  // namespace simflex
