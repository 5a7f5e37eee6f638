#include "simflex/solver/elimination/PartFactors.h"

namespace simflex {

using Eigen::Map;
using Eigen::MatrixXd;
using Eigen::VectorXd;

PartFactors::PartFactors(const NewtonSystem::Part& part)
    : m_numModes(part.numModes),
      m_numFrames(part.numFrames),
      m_inverseDiagonal(VectorXd::Zero(roundUpToChunks(part.numModes))),
      m_shapes(Map<const MatrixXd>(part.shapes->data(), part.numModes, 6 * part.numFrames)),
      m_flexibility(MatrixXd::Zero(roundUpToChunks(part.numModes), 6 * part.numFrames)),
      m_pairIndex(size_t(part.numFrames) * size_t(part.numFrames), -1) {
    m_flexibilityTiles.assignTransposed(m_flexibility.topRows(m_numModes));  // for its size
}

void PartFactors::requestPair(int frame, int other) {
    for (const auto& [a, b] : {std::make_pair(frame, other), std::make_pair(other, frame)}) {
        int& index = m_pairIndex[size_t(a * m_numFrames + b)];
        if (index >= 0) continue;
        index = int(m_pairs.size());
        m_pairs.emplace_back(a, b);
    }
    m_compliances.assign(6 * m_pairs.size(), Chunk{});
}

bool PartFactors::factor(const NewtonSystem::Part& part) {
    auto inverseDiagonal = m_inverseDiagonal.head(m_numModes);
    inverseDiagonal = Map<const VectorXd>(part.diagonal.data(), m_numModes).cwiseInverse();
    for (int k = 0; k < 6 * m_numFrames; ++k)
        m_flexibility.col(k).head(m_numModes) = inverseDiagonal.cwiseProduct(m_shapes.col(k));
    m_flexibilityTiles.assignTransposed(m_flexibility.topRows(m_numModes));
    for (size_t k = 0; k < m_pairs.size(); ++k) {
        const auto [frame, other] = m_pairs[k];
        if (frame > other) continue;
        Chunk* compliance = m_compliances.data() + 6 * k;
        Chunk* mirrored =
            m_compliances.data() + 6 * m_pairIndex[size_t(other * m_numFrames + frame)];
        for (int j = 0; j < 6; ++j)
            for (int i = 0; i < 6; ++i) {
                compliance[j][i] = m_shapes.col(6 * frame + i)
                                       .dot(m_flexibility.col(6 * other + j).head(m_numModes));
                if (frame != other) mirrored[i][j] = compliance[j][i];
            }
    }
    return inverseDiagonal.allFinite();
}

}  // namespace simflex
