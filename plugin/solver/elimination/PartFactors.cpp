#include "simflex/solver/elimination/PartFactors.h"

namespace simflex {

using Eigen::Map;
using Eigen::MatrixXd;
using Eigen::VectorXd;

template <class Scalar>
PartFactors<Scalar>::PartFactors(const Part& part)
    : m_numModes(part.numModes),
      m_numFrames(part.numFrames),
      m_inverseDiagonal(part.numModes, 1),
      m_shapes(Map<const MatrixXd>(part.shapes->data(), part.numModes, 6 * part.numFrames)),
      m_columns(MatrixXd::Zero(roundUpToChunks(part.numModes), 6 * part.numFrames)),
      m_pairIndex(size_t(part.numFrames) * size_t(part.numFrames), -1) {
    if (!IsReal<Scalar>) m_columns.topRows(m_numModes) = m_shapes;
    m_tiles.assignTransposed(m_columns.topRows(m_numModes));
}

template <class Scalar>
void PartFactors<Scalar>::requestPair(int frame, int other) {
    for (const auto& [a, b] : {std::make_pair(frame, other), std::make_pair(other, frame)}) {
        int& index = m_pairIndex[size_t(a * m_numFrames + b)];
        if (index >= 0) continue;
        index = int(m_pairs.size());
        m_pairs.emplace_back(a, b);
    }
    m_compliances.assign(6 * m_pairs.size(), ChunkOf<Scalar>{});
}

template <>
double PartFactors<double>::calcProduct(int row, int column) const {
    return m_shapes.col(row).dot(m_columns.col(column).head(m_numModes));
}

template <>
Complex PartFactors<Complex>::calcProduct(int row, int column) const {
    const double *a = m_columns.col(row).data(), *b = m_columns.col(column).data();
    ComplexChunk sum{};
    for (int i = 0; i < getStride(); i += ChunkSize)
        sum += m_inverseDiagonal.load(0, i) * (loadChunk(a + i) * loadChunk(b + i));
    return sumChunk(sum);
}

template <class Scalar>
bool PartFactors<Scalar>::factor(const Part& part) {
    bool isFiniteAll = true;
    for (int i = 0; i < m_numModes; ++i) {
        const Scalar inverse = 1.0 / part.diagonal[size_t(i)];
        m_inverseDiagonal.set(0, i, inverse);
        isFiniteAll = isFiniteAll && isFinite(inverse);
    }
    if constexpr (IsReal<Scalar>) {
        const Map<const VectorXd> inverseDiagonal(m_inverseDiagonal.plane(0), m_numModes);
        for (int k = 0; k < 6 * m_numFrames; ++k)
            m_columns.col(k).head(m_numModes) = inverseDiagonal.cwiseProduct(m_shapes.col(k));
        m_tiles.assignTransposed(m_columns.topRows(m_numModes));
    }
    for (size_t k = 0; k < m_pairs.size(); ++k) {
        const auto [frame, other] = m_pairs[k];
        if (frame > other) continue;
        ChunkOf<Scalar>* compliance = m_compliances.data() + 6 * k;
        ChunkOf<Scalar>* mirrored =
            m_compliances.data() + 6 * m_pairIndex[size_t(other * m_numFrames + frame)];
        for (int j = 0; j < 6; ++j)
            for (int i = 0; i < 6; ++i) {
                const Scalar product = calcProduct(6 * frame + i, 6 * other + j);
                setEntry(compliance[j], i, product);
                if (frame != other) setEntry(mirrored[i], j, product);
            }
    }
    return isFiniteAll;
}

template class PartFactors<double>;
template class PartFactors<Complex>;

}  // namespace simflex
