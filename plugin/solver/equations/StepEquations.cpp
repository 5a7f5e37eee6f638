#include "simflex/solver/equations/StepEquations.h"

#include <algorithm>
#include <functional>

#include "simflex/base/Chunk.h"

namespace simflex {

StepEquations::StepEquations(Evaluation& equations)
    : m_equations(equations), m_delta(size_t(equations.getTopology().numU)) {}

void StepEquations::calcQ(const StepFormula& formula, const std::vector<double>& u,
                          std::vector<double>& q) {
    const Blocks& blocks = m_equations.getBlocks();
    if (formula.rule == StepFormula::QRule::Exponential && m_equations.getTopology().needsSimbody) {
        // Simbody's N(q) is that of the last realize(): take it half-way, or order 2 is lost.
        for (size_t i = 0; i < q.size(); ++i) q[i] = 0.5 * (q[i] + formula.qHist[i]);
        blocks.normalizeQ(q.data());
        m_equations.realize(formula.t, q.data(), u.data());
    }
    parallelFor(int(blocks.all.size()), blocks.numThreads,
                [&](int b) { placeBlock(formula, *blocks.all[size_t(b)], u.data(), q.data()); });
}

void StepEquations::placeBlock(const StepFormula& formula, const Block& block, const double* u,
                               double* q) {
    const double stiffness = formula.factors.stiffness;
    const EvaluationContext& context = m_equations.getBlocks().context;
    const double *qHist = formula.qHist.data() + block.firstQ, *own = u + block.firstU;
    q += block.firstQ;
    if (formula.rule == StepFormula::QRule::Linear)
        return block.integrateQ(context, qHist, stiffness, own, q);
    double* delta = m_delta.data() + block.firstU;
    for (int i = 0; i < block.numU; ++i)
        delta[i] = formula.deltaHist[size_t(block.firstU + i)] + stiffness * own[i];
    std::copy_n(qHist, block.numQ, q);
    block.moveQ(context, delta, q);
}

void StepEquations::placeBlock(const StepFormula& formula, const Block& block, const double* u,
                               double* q, double* uDot) {
    placeBlock(formula, block, u, q);
    const double *own = u + block.firstU, *uHist = formula.uHist.data() + block.firstU;
    const double mass = formula.factors.mass;
    for (int i = 0; i < block.numU; i += ChunkSize) {
        const int count = std::min(block.numU - i, ChunkSize);
        storeChunk((loadChunk(own + i, count) - loadChunk(uHist + i, count)) / mass,
                   uDot + block.firstU + i, count);
    }
}

void StepEquations::calcUDot(const StepFormula& formula, const std::vector<double>& q,
                             const std::vector<double>& u, std::vector<double>& uDot) const {
    for (size_t i = 0; i < u.size(); ++i)
        uDot[i] = (u[i] - formula.uHist[i]) / formula.factors.mass;
    if (const PrescribedMotion* prescribed = m_equations.getSimbody().getPrescribed())
        prescribed->applyAccelerations(q.data(), uDot.data());
}

void StepEquations::arrive(const StepFormula& formula, std::vector<double>& u,
                           std::vector<double>& q, std::vector<double>& uDot,
                           NewtonSystem& system) {
    if (m_equations.canEvaluateByBlocks()) {
        const auto place = [&](int b) {
            placeBlock(formula, m_equations.getBlock(b), u.data(), q.data(), uDot.data());
        };
        m_equations.realizePositions(formula.t, std::cref(place), q.data(), u.data(),
                                     system.c.data());
        return;
    }
    calcQ(formula, u, q);
    m_equations.prescribe(formula.t, formula.factors.mass, formula.uHist.data(), q.data(),
                          u.data());
    calcUDot(formula, q, u, uDot);
    m_equations.realize(formula.t, q.data(), u.data());
    m_equations.calcPositionErrors(system.c.data());
}

void StepEquations::evaluate(const StepFormula& formula, MotionLevel level,
                             const std::vector<double>& lambda, const std::vector<double>& z,
                             const Evaluation::BlockVisit& finish, std::vector<double>& u,
                             std::vector<double>& q, std::vector<double>& uDot,
                             NewtonSystem& system) {
    if (m_equations.canEvaluateByBlocks()) {
        m_equations.setZ(z.data());
        const auto place = [&](int b) {
            placeBlock(formula, m_equations.getBlock(b), u.data(), q.data(), uDot.data());
        };
        m_equations.evaluate(formula.t, level, formula.factors, std::cref(place), finish, q.data(),
                             u.data(), uDot.data(), lambda.data(), system.r.data(),
                             system.c.data());
        return;
    }
    realize(formula, z, u, q);
    calcResidual(formula, level, lambda, finish, q, u, uDot, system);
}

void StepEquations::realize(const StepFormula& formula, const std::vector<double>& z,
                            std::vector<double>& u, std::vector<double>& q) {
    calcQ(formula, u, q);
    m_equations.prescribe(formula.t, formula.factors.mass, formula.uHist.data(), q.data(),
                          u.data());
    m_equations.setZ(z.data());
    m_equations.realize(formula.t, q.data(), u.data());
}

void StepEquations::calcResidual(const StepFormula& formula, MotionLevel level,
                                 const std::vector<double>& lambda,
                                 const Evaluation::BlockVisit& finish, const std::vector<double>& q,
                                 const std::vector<double>& u, std::vector<double>& uDot,
                                 NewtonSystem& system) {
    calcUDot(formula, q, u, uDot);
    m_equations.calcResidual(q.data(), u.data(), uDot.data(), lambda.data(), system.r.data());
    m_equations.calcStepErrors(level, formula.factors, uDot.data(), q.data(), system.c.data());
    parallelFor(m_equations.getTopology().numBlocks(), m_equations.getBlocks().numThreads, finish);
}

}  // namespace simflex
