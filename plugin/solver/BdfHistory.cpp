#include "simflex/solver/BdfHistory.h"

#include <algorithm>

namespace simflex {
namespace {

/** sum ← Σ_j weights[j]·member of point j. **/
void combine(const BdfHistory& history, std::vector<double> BdfPoint::*member, int count,
             const double* weights, std::vector<double>& sum) {
    const size_t size = (history[0].*member).size();
    sum.resize(size);
    for (size_t i = 0; i < size; ++i) sum[i] = weights[0] * (history[0].*member)[i];
    for (int j = 1; j < count; ++j) {
        const std::vector<double>& values = history[j].*member;
        for (size_t i = 0; i < size; ++i) sum[i] += weights[j] * values[i];
    }
}

}  // namespace

BdfPoint& BdfHistory::push() {
    m_newest = (m_newest + 1) % Capacity;
    m_size = std::min(m_size + 1, Capacity);
    return m_points[m_newest];
}

double BdfHistory::calcGamma(int order, double tNew) const {
    double alpha0 = 0;
    for (int i = 0; i < order; ++i) alpha0 += 1 / (tNew - (*this)[i].t);
    return 1 / alpha0;
}

double BdfHistory::calcHistoryPart(int order, double tNew, std::vector<double>& qHist,
                                   std::vector<double>& uHist) const {
    const double gamma = calcGamma(order, tNew);
    double weights[Capacity];
    double work = 0;
    for (int j = 0; j < order; ++j) {
        // α_j: derivative at tNew of the Lagrange polynomial of point j over {tNew, all points}.
        const double tj = (*this)[j].t;
        double alpha = 1 / (tj - tNew);
        for (int i = 0; i < order; ++i)
            if (i != j) alpha *= (tNew - (*this)[i].t) / (tj - (*this)[i].t);
        weights[j] = -gamma * alpha;
        work += weights[j] * (*this)[j].work;
    }
    combine(*this, &BdfPoint::q, order, weights, qHist);
    combine(*this, &BdfPoint::u, order, weights, uHist);
    return work;
}

void BdfHistory::calcWeights(int points, double t, double* weights) const {
    for (int j = 0; j < points; ++j) {
        weights[j] = 1;
        for (int i = 0; i < points; ++i)
            if (i != j) weights[j] *= (t - (*this)[i].t) / ((*this)[j].t - (*this)[i].t);
    }
}

void BdfHistory::extrapolateQ(int points, double t, std::vector<double>& q) const {
    double weights[Capacity];
    calcWeights(points, t, weights);
    combine(*this, &BdfPoint::q, points, weights, q);
}

void BdfHistory::extrapolateU(int points, double t, std::vector<double>& u) const {
    double weights[Capacity];
    calcWeights(points, t, weights);
    combine(*this, &BdfPoint::u, points, weights, u);
}

void BdfHistory::extrapolateLambda(int points, double t, std::vector<double>& lambda) const {
    double weights[Capacity];
    calcWeights(points, t, weights);
    combine(*this, &BdfPoint::lambda, points, weights, lambda);
}

double BdfHistory::extrapolateWork(int points, double t) const {
    double weights[Capacity], work = 0;
    calcWeights(points, t, weights);
    for (int j = 0; j < points; ++j) work += weights[j] * (*this)[j].work;
    return work;
}

double BdfHistory::calcErrorFactor(int order, double tNew) const {
    return calcGamma(order, tNew) / (tNew - (*this)[order].t);
}

}  // namespace simflex
