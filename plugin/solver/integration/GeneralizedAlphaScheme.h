#pragma once
/** @file
Generalized-α on a Lie group (private header): with spectral radius ρ at infinite frequency,

    α_m = (2ρ − 1)/(ρ + 1),  α_f = ρ/(ρ + 1),  γ = ½ − α_m + α_f,  β = ¼(γ + ½)²
    (1 − α_m) a_{n+1} + α_m a_n = (1 − α_f) u̇_{n+1} + α_f u̇_n
    u_{n+1} = u_n + h((1 − γ) a_n + γ a_{n+1})
    q_{n+1} = q_n exp(h u_n + h²((½ − β) a_n + β a_{n+1}))

M u̇ = f holds at the new point itself. a_n approximates u̇ at t_n + (α_m − α_f) h, so it is shifted
when h changes. z and work follow the trapezoidal rule.
Source: O. Brüls, A. Cardona, M. Arnold, Mech. Mach. Theory 48 (2012) 121–137. **/

#include "simflex/solver/integration/IntegrationScheme.h"

namespace simflex {

class GeneralizedAlphaScheme : public OneStageScheme {
public:
    explicit GeneralizedAlphaScheme(double spectralRadius) { setSpectralRadius(spectralRadius); }

    /** @pre 0 ≤ ρ ≤ 1. **/
    void setSpectralRadius(double rho);

    const char* getName() const override { return "GeneralizedAlpha"; }
    int getLowestOrder() const override { return 2; }
    int getHighestOrder(const SolutionHistory&) const override { return 2; }
    int getMaximumOrder() const override { return 2; }
    void calcFormula(const SolutionHistory& history, int order, double tNew,
                     StepFormula& formula) override;
    void completePoint(const SolutionHistory& history, const StepFormula& formula,
                       SolutionPoint& point) override;
    ErrorFactors calcErrorFactors(const SolutionHistory& history, int order,
                                  double tNew) const override;
    double getFirstErrorConstant() const override;
    std::vector<std::pair<std::string, double>> listSettings() const override;

private:
    double m_alphaM = 0, m_alphaF = 0, m_gamma = 0, m_beta = 0;
    std::vector<double> m_a;  ///< a_n of the current step
};

}  // namespace simflex
