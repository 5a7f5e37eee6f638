#include "simflex/solver/integration/BdfScheme.h"

#include <algorithm>

namespace simflex {

bool BdfScheme::suit(Suitability suitability) {
    m_suitedOrder = suitability == Suitability::HighOrder ? MaxOrder : 2;
    return getMaximumOrder() > 2 && fixedOrder == 0;
}

int BdfScheme::getLowestOrder() const {
    return fixedOrder > 0 ? fixedOrder : std::min(2, getMaximumOrder());
}

int BdfScheme::getHighestOrder(const SolutionHistory& history) const {
    return std::min(fixedOrder > 0 ? fixedOrder : getMaximumOrder(), history.numNodes());
}

void BdfScheme::calcFormula(const SolutionHistory& history, int order, double tNew,
                            StepFormula& formula) {
    SolutionHistory::Weights weights;
    const double gamma = history.calcBdf(order, tNew, weights);
    formula.t = tNew;
    formula.h = tNew - history[0].t;
    formula.factors = gamma;
    formula.rule = StepFormula::QRule::Linear;
    formula.quadrature = gamma;
    history.combineQ(weights, formula.qHist);
    history.combineU(weights, formula.uHist);
    history.combineZ(weights, formula.zHist);
    formula.workHist = history.combineWork(weights);
}

IntegrationScheme::ErrorFactors BdfScheme::calcErrorFactors(const SolutionHistory& history,
                                                            int order, double tNew) const {
    SolutionHistory::Weights unused;
    const double gamma = history.calcBdf(order, tNew, unused);
    const double oldest = history[std::min(order, history.size() - 1)].t;
    const double factor = gamma / (tNew - oldest);
    return {factor, factor};
}

double BdfScheme::getFirstErrorConstant() const {
    return 1.0 / 12;
}

std::vector<std::pair<std::string, double>> BdfScheme::listSettings() const {
    return {{"setMaximumOrder", maximumOrder}, {"setFixedOrder", fixedOrder}};
}

}  // namespace simflex
