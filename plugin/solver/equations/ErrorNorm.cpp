#include "simflex/solver/equations/ErrorNorm.h"

#include <algorithm>
#include <cmath>

#include "simflex/solver/equations/RigidTree.h"

namespace simflex {

using namespace SimTK;

ErrorNorm::ErrorNorm(const Blocks& blocks, const State& state)
    : m_blocks(blocks), m_numQ(blocks.numQ()), m_numU(blocks.numU()), m_numZ(state.getNZ()) {
    m_uWeights.assign(size_t(m_numU), 1);
    for (const RigidTree* tree : blocks.rigid)
        tree->takeSpeeds(state.getUWeights(), m_uWeights.data() + tree->firstU);
    m_uScales = m_uWeights;
    m_zWeights.resize(size_t(m_numZ));
    for (int i = 0; i < m_numZ; ++i) m_zWeights[size_t(i)] = state.getZWeights()[i];
    m_zScales = m_zWeights;
    m_referenceQ.assign(size_t(m_numQ), 0);
    m_weighed.assign(size_t(m_numQ), 0);
}

void ErrorNorm::setReference(const double* q, const double* u, const double* z) {
    // A value counts as such where it is larger than its unit, 1/weight.
    const auto calcScale = [](double value, double weight) {
        return std::abs(value) * weight > 1 ? 1 / std::abs(value) : weight;
    };
    for (int i = 0; i < m_numZ; ++i) m_zScales[size_t(i)] = calcScale(z[i], m_zWeights[size_t(i)]);
    if (m_kind == Kind::Displacement) {
        m_zScales = m_zWeights;
        return;
    }
    std::copy_n(q, m_numQ, m_referenceQ.begin());
    for (int i = 0; i < m_numU; ++i) m_uScales[size_t(i)] = calcScale(u[i], m_uWeights[size_t(i)]);
}

double ErrorNorm::calcNorm(int size, const double* values, const double* scales, int* worst) const {
    double largest = 0, sum = 0;
    for (int i = 0; i < size; ++i) {
        const double value = std::abs(scales ? scales[i] * values[i] : values[i]);
        if (!(value <= largest)) {
            largest = value;
            if (worst) *worst = i;
        }
        sum += value * value;
        if (std::isnan(value)) return value;
    }
    return m_kind == Kind::Infinity || size == 0 ? largest : std::sqrt(sum / size);
}

double ErrorNorm::calcSize(const double* deltaQ, const double* deltaU, double h, int* worst) {
    if (m_kind != Kind::Displacement) {
        for (const RigidTree* tree : m_blocks.rigid)
            tree->weighQ(m_referenceQ.data() + tree->firstQ, m_uWeights.data() + tree->firstU,
                         deltaQ + tree->firstQ, m_weighed.data() + tree->firstQ);
        int worstQ = 0, worstU = 0;
        const double ofQ = calcNorm(m_numQ, m_weighed.data(), nullptr, &worstQ);
        const double ofU = calcNorm(m_numU, deltaU, m_uScales.data(), &worstU);
        for (int b = 0; worst && b < int(m_blocks.all.size()); ++b)
            if (ofQ > ofU ? m_blocks.all[size_t(b)]->firstQ <= worstQ
                          : m_blocks.all[size_t(b)]->firstU <= worstU)
                *worst = b;
        return std::isnan(ofQ) ? ofQ : ofU > ofQ || std::isnan(ofU) ? ofU : ofQ;
    }
    return m_blocks.findLargest(
        [&](int b) {
            const Block& block = *m_blocks.all[size_t(b)];
            return std::max(block.calcQDisplacement(deltaQ + block.firstQ),
                            block.calcUDisplacement(deltaU + block.firstU, h));
        },
        worst);
}

double ErrorNorm::calcChange(const double* deltaU, double stiffness, int* worst,
                             const std::function<void(int b)>& prepare) const {
    const double displacement = stiffness * m_blocks.calcDisplacement(deltaU, worst, prepare);
    if (m_kind == Kind::Displacement || !std::isfinite(displacement)) return displacement;
    // N W N⁺ δq = γ N W δu, about as large as γ W δu.
    return std::max(stiffness * calcNorm(m_numU, deltaU, m_uWeights.data(), nullptr),
                    calcNorm(m_numU, deltaU, m_uScales.data(), nullptr));
}

double ErrorNorm::calcZSize(const double* deltaZ) const {
    double largest = 0;
    if (m_kind == Kind::RootMeanSquare) return calcNorm(m_numZ, deltaZ, m_zScales.data(), nullptr);
    for (int i = 0; i < m_numZ; ++i)
        largest = std::max(largest, std::abs(m_zScales[size_t(i)] * deltaZ[i]));
    return largest;
}

}  // namespace simflex
