#pragma once
/** @file
Variable-step BDF of order 1 to 5 (private header). The derivative at t_{n+1} of the polynomial
through the new point and k nodes gives γ and the history part; with the double node of a start,
order 2 is the trapezoidal rule on the first step.

Local error of order k: γ/(t_{n+1} − t of the (k+1)-th node) (y − y_pred). **/

#include "simflex/solver/integration/IntegrationScheme.h"

namespace simflex {

class BdfScheme : public OneStageScheme {
public:
    static constexpr int MaxOrder = 5;

    int maximumOrder = 0;  ///< 0: depends on the system
    int fixedOrder = 0;    ///< 0: none

    /** y_hist of ẏ = (y − y_hist)/γ at tNew, from the newest `order` nodes, as weights of the
    points.
    @returns γ **/
    static double calcCoefficients(const SolutionHistory& history, int order, double tNew,
                                   SolutionHistory::Weights& past);

    bool suit(Suitability suitability) override;

    const char* getName() const override { return "Bdf"; }
    int getLowestOrder() const override;
    int getHighestOrder(const SolutionHistory& history) const override;
    int getMaximumOrder() const override {
        return fixedOrder > 0 ? fixedOrder : maximumOrder > 0 ? maximumOrder : m_suitedOrder;
    }
    void calcFormula(const SolutionHistory& history, int order, double tNew,
                     StepFormula& formula) override;
    void completePoint(const SolutionHistory&, const StepFormula&, SolutionPoint&) override {}
    ErrorFactors calcErrorFactors(const SolutionHistory& history, int order,
                                  double tNew) const override;
    double getFirstErrorConstant() const override;
    std::vector<std::pair<std::string, double>> listSettings() const override;

private:
    int m_suitedOrder = 2;
};

}  // namespace simflex
