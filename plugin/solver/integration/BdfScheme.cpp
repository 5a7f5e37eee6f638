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

double BdfScheme::calcCoefficients(const SolutionHistory& history, int order, double tNew,
                                   SolutionHistory::Weights& past) {
    double times[SolutionHistory::Capacity];
    bool isDouble = false;
    past = SolutionHistory::Weights();
    past.numPoints = history.collectNodes(order, times, isDouble);
    const int points = past.numPoints, oldest = points - 1;
    double alpha0 = 0;
    for (int i = 0; i < points; ++i) alpha0 += 1 / (tNew - times[i]);
    if (isDouble) alpha0 += 1 / (tNew - times[oldest]);
    const double gamma = 1 / alpha0;

    // Derivatives at tNew of the Lagrange polynomials through tNew and all nodes.
    for (int j = 0; j < points; ++j) {
        double alpha = 1 / (times[j] - tNew);
        for (int i = 0; i < points; ++i)
            if (i != j) alpha *= (tNew - times[i]) / (times[j] - times[i]);
        if (isDouble && j != oldest) alpha *= (tNew - times[oldest]) / (times[j] - times[oldest]);
        past.value[j] = -gamma * alpha;
    }
    if (isDouble) {
        // Hermite, with R(t) = (t − t_new)Π_{i≠0}(t − t_i) scaled to R(t₀) = 1: value
        // R(t)(1 − (t − t₀)R'(t₀)), derivative (t − t₀)R(t).
        double slope = 1 / (times[oldest] - tNew);
        for (int i = 0; i < oldest; ++i) slope += 1 / (times[oldest] - times[i]);
        const double span = tNew - times[oldest], weight = past.value[oldest];
        past.derivative = weight * span;
        past.value[oldest] = weight * (1 - span * slope);
    }
    return gamma;
}

void BdfScheme::calcFormula(const SolutionHistory& history, int order, double tNew,
                            StepFormula& formula) {
    SolutionHistory::Weights weights;
    const double gamma = calcCoefficients(history, order, tNew, weights);
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

OneStageScheme::ErrorFactors BdfScheme::calcErrorFactors(const SolutionHistory& history, int order,
                                                         double tNew) const {
    SolutionHistory::Weights unused;
    const double gamma = calcCoefficients(history, order, tNew, unused);
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
