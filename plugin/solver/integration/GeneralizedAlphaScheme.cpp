#include "simflex/solver/integration/GeneralizedAlphaScheme.h"

#include <cmath>

namespace simflex {

void GeneralizedAlphaScheme::setSpectralRadius(double rho) {
    m_alphaM = (2 * rho - 1) / (rho + 1);
    m_alphaF = rho / (rho + 1);
    m_gamma = 0.5 - m_alphaM + m_alphaF;
    m_beta = 0.25 * (m_gamma + 0.5) * (m_gamma + 0.5);
}

void GeneralizedAlphaScheme::calcFormula(const SolutionHistory& history, int, double tNew,
                                         StepFormula& formula) {
    const SolutionPoint& point = history[0];
    const double h = tNew - point.t;
    m_a = point.a;
    if (history.size() > 1) {
        const double lastH = point.t - history[1].t;
        const double factor = (m_alphaM - m_alphaF) * (h - lastH) / lastH;
        for (size_t i = 0; i < m_a.size(); ++i)
            m_a[i] += factor * (point.uDot[i] - history[1].uDot[i]);
    }
    const double mass = m_gamma * h * (1 - m_alphaF) / (1 - m_alphaM);
    formula.t = tNew;
    formula.h = h;
    formula.factors = {mass, m_beta * h / m_gamma};
    formula.rule = StepFormula::QRule::Exponential;
    formula.qHist = point.q;
    const double moved = h * (1 - m_beta / m_gamma), curved = h * h * (0.5 - m_beta / m_gamma);
    const double byA = (1 - m_gamma) * h - mass * m_alphaM / (1 - m_alphaF);
    const double byUDot = mass * m_alphaF / (1 - m_alphaF);
    for (size_t i = 0; i < m_a.size(); ++i) {
        formula.deltaHist[i] = moved * point.u[i] + curved * m_a[i];
        formula.uHist[i] = point.u[i] + byA * m_a[i] + byUDot * point.uDot[i];
    }
    formula.quadrature = 0.5 * h;
    for (size_t i = 0; i < formula.zHist.size(); ++i)
        formula.zHist[i] = point.z[i] + 0.5 * h * point.zDot[i];
    formula.workHist = point.work + 0.5 * h * point.power;
}

void GeneralizedAlphaScheme::completePoint(const SolutionHistory& history,
                                           const StepFormula& formula, SolutionPoint& point) {
    const SolutionPoint& last = history[0];
    const double gammaH = m_gamma * formula.h, rest = (1 - m_gamma) * formula.h;
    for (size_t i = 0; i < m_a.size(); ++i)
        point.a[i] = (point.u[i] - last.u[i] - rest * m_a[i]) / gammaH;
}

OneStageScheme::ErrorFactors GeneralizedAlphaScheme::calcErrorFactors(
    const SolutionHistory& history, int order, double tNew) const {
    // Leading errors C h³ y‴ with D = α_m − α_f: C_q = 1/6 − D/2 − β, C_u = 1/12 − D²/2;
    // y − y_pred = y‴/6 Π(t_{n+1} − t_i).
    const double D = m_alphaM - m_alphaF, h = tNew - history[0].t;
    const double scale = 6 * h * h * h / history.calcNodeProduct(order + 1, tNew);
    return {std::abs(1.0 / 6 - 0.5 * D - m_beta) * scale, std::abs(1.0 / 12 - 0.5 * D * D) * scale};
}

double GeneralizedAlphaScheme::getFirstErrorConstant() const {
    return std::abs(1.0 / 6 - 0.5 * (m_alphaM - m_alphaF) - m_beta);
}

std::vector<std::pair<std::string, double>> GeneralizedAlphaScheme::listSettings() const {
    return {{"setSpectralRadius", m_alphaF / (1 - m_alphaF)}};
}

}  // namespace simflex
