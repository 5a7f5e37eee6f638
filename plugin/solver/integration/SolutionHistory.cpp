#include "simflex/solver/integration/SolutionHistory.h"

#include <algorithm>

#include "simflex/base/Checkpoint.h"
#include "simflex/base/Chunk.h"
#include "simflex/base/ParallelFor.h"

namespace simflex {

void SolutionPoint::resize(int numQ, int numU, int numMultipliers, int numZ) {
    for (auto* vector : {&q, &qDot}) vector->assign(size_t(numQ), 0);
    for (auto* vector : {&u, &uDot, &a}) vector->assign(size_t(numU), 0);
    for (auto* vector : {&z, &zDot}) vector->assign(size_t(numZ), 0);
    lambda.assign(size_t(numMultipliers), 0);
}

void SolutionPoint::visit(Checkpoint& checkpoint) {
    checkpoint.visit(t, work, power, constraintError);
    checkpoint.visit(q, u, lambda, z, qDot, uDot, zDot, a);
}

void SolutionHistory::resize(int numQ, int numU, int numMultipliers, int numZ) {
    for (SolutionPoint& point : m_points) point.resize(numQ, numU, numMultipliers, numZ);
    clear();
    m_startsDouble = false;
}

SolutionPoint& SolutionHistory::push() {
    m_newest = (m_newest + 1) % Capacity;
    m_size = std::min(m_size + 1, Capacity);
    m_pushed = std::min(m_pushed + 1, Capacity);
    return m_points[m_newest];
}

void SolutionHistory::replaceNewest(const std::vector<SolutionPoint>& points) {
    const int count = int(points.size());
    for (int i = 0; i < count; ++i)
        m_points[(m_newest + Capacity + 1 - count + i) % Capacity] = points[size_t(i)];
}

void SolutionHistory::startAtNewest() {
    m_size = 1;
    m_pushed = 0;
    m_startsDouble = true;
}

int SolutionHistory::collectNodes(int nodes, double* times, bool& isDouble) const {
    isDouble = nodes > m_size;
    const int points = isDouble ? nodes - 1 : nodes;
    for (int j = 0; j < points; ++j) times[j] = (*this)[j].t;
    return points;
}

SolutionHistory::Weights SolutionHistory::calcInterpolation(int nodes, double t) const {
    double times[Capacity];
    bool isDouble = false;
    Weights weights;
    weights.numPoints = collectNodes(nodes, times, isDouble);
    const int points = weights.numPoints, oldest = points - 1;
    for (int j = 0; j < points; ++j) {
        double& weight = weights.value[j];
        weight = 1;
        for (int i = 0; i < points; ++i)
            if (i != j) weight *= (t - times[i]) / (times[j] - times[i]);
        if (isDouble && j != oldest) weight *= (t - times[oldest]) / (times[j] - times[oldest]);
    }
    if (isDouble) {
        // Hermite: value P(t)(1 − (t − t₀)P'(t₀)), derivative (t − t₀)P(t).
        double slope = 0;
        for (int i = 0; i < oldest; ++i) slope += 1 / (times[oldest] - times[i]);
        const double past = t - times[oldest];
        weights.derivative = past * weights.value[oldest];
        weights.value[oldest] *= 1 - past * slope;
    }
    return weights;
}

double SolutionHistory::calcNodeProduct(int nodes, double t) const {
    double times[Capacity];
    bool isDouble = false;
    const int points = collectNodes(nodes, times, isDouble);
    double product = isDouble ? t - times[points - 1] : 1;
    for (int i = 0; i < points; ++i) product *= t - times[i];
    return product;
}

void SolutionHistory::combine(const Weights& weights, Member value, Member derivative,
                              std::vector<double>& sum) const {
    const double* terms[MaxNodes];
    double factors[MaxNodes];
    int count = 0;
    for (; count < weights.numPoints; ++count) {
        terms[count] = ((*this)[count].*value).data();
        factors[count] = weights.value[count];
    }
    if (weights.derivative != 0) {
        terms[count] = ((*this)[count - 1].*derivative).data();
        factors[count++] = weights.derivative;
    }
    double* sums = sum.data();
    parallelRanges(int(sum.size()), m_numThreads, [&](int begin, int end) {
        for (int i = begin; i < end; i += ChunkSize) {
            const int size = std::min(end - i, ChunkSize);
            Chunk chunk = factors[0] * loadChunk(terms[0] + i, size);
            for (int j = 1; j < count; ++j) chunk += factors[j] * loadChunk(terms[j] + i, size);
            storeChunk(chunk, sums + i, size);
        }
    });
}

void SolutionHistory::combineQ(const Weights& weights, std::vector<double>& q) const {
    combine(weights, &SolutionPoint::q, &SolutionPoint::qDot, q);
}
void SolutionHistory::combineU(const Weights& weights, std::vector<double>& u) const {
    combine(weights, &SolutionPoint::u, &SolutionPoint::uDot, u);
}
void SolutionHistory::combineZ(const Weights& weights, std::vector<double>& z) const {
    // The weights of values add up to 1, so that differences from the newest point can be combined.
    // Equal values then cause no round-off.
    const SolutionPoint &newest = (*this)[0], &oldest = (*this)[weights.numPoints - 1];
    for (size_t i = 0; i < z.size(); ++i) {
        double difference = weights.derivative * oldest.zDot[i];
        for (int j = 1; j < weights.numPoints; ++j)
            difference += weights.value[j] * ((*this)[j].z[i] - newest.z[i]);
        z[i] = newest.z[i] + difference;
    }
}

double SolutionHistory::combineWork(const Weights& weights) const {
    double work = weights.derivative * (*this)[weights.numPoints - 1].power;
    for (int j = 0; j < weights.numPoints; ++j) work += weights.value[j] * (*this)[j].work;
    return work;
}

void SolutionHistory::extrapolateLambda(int points, double t, std::vector<double>& lambda) const {
    Weights weights = calcInterpolation(std::min(points, m_size), t);
    combine(weights, &SolutionPoint::lambda, &SolutionPoint::lambda, lambda);
}

void SolutionHistory::interpolateUDot(int points, double t, std::vector<double>& uDot) const {
    Weights weights = calcInterpolation(std::min(points, m_size), t);
    combine(weights, &SolutionPoint::uDot, &SolutionPoint::uDot, uDot);
}

void SolutionHistory::visit(Checkpoint& checkpoint) {
    checkpoint.visitWithin(m_size, 0, Capacity, "the number of past points");
    checkpoint.visitWithin(m_pushed, 0, Capacity, "the number of points since the start");
    checkpoint.visit(m_startsDouble);
    if (checkpoint.isReading()) m_newest = m_size > 0 ? m_size - 1 : 0;
    for (int age = 0; age < m_size; ++age)
        m_points[(m_newest + Capacity - age) % Capacity].visit(checkpoint);
}

}  // namespace simflex
