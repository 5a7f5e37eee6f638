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
    m_otherWeighed = m_weighed;
    const int numFlexible = int(blocks.flexible.size());
    for (int b = 0; b < int(blocks.all.size()); ++b) {
        const Block& block = *blocks.all[size_t(b)];
        if (b < numFlexible) {
            m_parts.push_back({b, -1, block.firstQ, block.numQ, block.firstU, block.numU});
            continue;
        }
        int k = 0;
        for (const RigidTree::Root& root : blocks.rigid[size_t(b - numFlexible)]->getRoots())
            m_parts.push_back({b, k++, block.firstQ + root.firstQ, root.numQ,
                               block.firstU + root.firstU, root.numU});
    }
    m_sizes.assign(m_parts.size(), 0);
}

void ErrorNorm::setReference(const double* q, const double* u, const double* z) {
    // Errors are relative to values larger than the unit 1/weight, and to the unit otherwise.
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

double ErrorNorm::calcNorm(int size, const double* values, const double* scales) const {
    double largest = 0, sum = 0;
    for (int i = 0; i < size; ++i) {
        const double value = std::abs(scales ? scales[i] * values[i] : values[i]);
        largest = largerOrNaN(largest, value);
        sum += value * value;
    }
    return m_kind == Kind::Infinity || size == 0 || std::isnan(largest) ? largest
                                                                        : std::sqrt(sum / size);
}

void ErrorNorm::weigh(const double* deltaQ, std::vector<double>& weighed) const {
    if (m_kind == Kind::Displacement) return;
    for (const RigidTree* tree : m_blocks.rigid)
        tree->weighQ(m_referenceQ.data() + tree->firstQ, m_uWeights.data() + tree->firstU,
                     deltaQ + tree->firstQ, weighed.data() + tree->firstQ);
}

double ErrorNorm::calcPartSize(const Part& part, const double* deltaQ, const double* deltaU,
                               const std::vector<double>& weighed, double h) const {
    if (m_kind != Kind::Displacement)
        return largerOrNaN(
            calcNorm(part.numQ, weighed.data() + part.firstQ, nullptr),
            calcNorm(part.numU, deltaU + part.firstU, m_uScales.data() + part.firstU));
    const Block& block = *m_blocks.all[size_t(part.block)];
    const double *dq = deltaQ + block.firstQ, *du = deltaU + block.firstU;
    if (part.root < 0)
        return largerOrNaN(block.calcQDisplacement(dq), block.calcUDisplacement(du, h));
    const RigidTree& tree = *m_blocks.rigid[size_t(part.block) - m_blocks.flexible.size()];
    const RigidTree::Root& root = tree.getRoots()[size_t(part.root)];
    return largerOrNaN(tree.calcQDisplacement(root, dq), h * tree.calcDisplacement(root, du));
}

double ErrorNorm::calcSize(const double* deltaQ, const double* deltaU, double h, int* worst) {
    weigh(deltaQ, m_weighed);
    const bool isMean = m_kind == Kind::RootMeanSquare;
    double largest = 0;
    if (worst || !isMean) {
        parallelFor(int(m_parts.size()), m_blocks.numThreads, [&](int k) {
            m_sizes[size_t(k)] = calcPartSize(m_parts[size_t(k)], deltaQ, deltaU, m_weighed, h);
        });
        for (size_t k = 0; k < m_parts.size(); ++k) {
            if (m_sizes[k] <= largest || std::isnan(largest)) continue;
            largest = m_sizes[k];
            if (worst) *worst = m_parts[k].block;
        }
    }
    if (!isMean) return largest;
    return largerOrNaN(calcNorm(m_numQ, m_weighed.data(), nullptr),
                       calcNorm(m_numU, deltaU, m_uScales.data()));
}

double ErrorNorm::calcChange(const double* deltaU, double stiffness, int* worst,
                             const std::function<void(int b)>& prepare) const {
    const double displacement = stiffness * m_blocks.calcDisplacement(deltaU, worst, prepare);
    if (m_kind == Kind::Displacement || !std::isfinite(displacement)) return displacement;
    // N W N⁺ δq = γ N W δu, about as large as γ W δu.
    return largerOrNaN(stiffness * calcNorm(m_numU, deltaU, m_uWeights.data()),
                       calcNorm(m_numU, deltaU, m_uScales.data()));
}

double ErrorNorm::calcZSize(const double* deltaZ) const {
    if (m_kind == Kind::RootMeanSquare) return calcNorm(m_numZ, deltaZ, m_zScales.data());
    double largest = 0;
    for (int i = 0; i < m_numZ; ++i)
        largest = largerOrNaN(largest, std::abs(m_zScales[size_t(i)] * deltaZ[i]));
    return largest;
}

}  // namespace simflex
