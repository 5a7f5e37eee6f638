#include "simflex/solver/elimination/PartFactors.h"

#include <algorithm>

namespace simflex {

using Eigen::Map;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

/** C ← AᵀB, six columns of either; flat, since the sums are short. **/
__attribute__((flatten)) void multiplyColumns(const MatrixXd& A, int firstOfA, const MatrixXd& B,
                                              int firstOfB, Chunk* C) {
    for (int j = 0; j < 6; ++j)
        for (int i = 0; i < 6; ++i)
            setEntry(C[j], i, A.col(firstOfA + i).dot(B.col(firstOfB + j).head(A.rows())));
}

}  // namespace

template <class Scalar>
PartFactors<Scalar>::PartFactors(const Part& part)
    : m_numModes(part.numModes),
      m_numFrames(part.numFrames),
      m_inverseDiagonal(part.numModes, 1),
      m_shapes(Map<const MatrixXd>(part.shapes->data(), part.numModes, 6 * part.numFrames)),
      m_columns(MatrixXd::Zero(roundUpToChunks(part.numModes), 6 * part.numFrames)),
      m_pairIndex(size_t(part.numFrames) * size_t(part.numFrames), -1) {
    if (!IsReal<Scalar>) {
        m_columns.topRows(m_numModes) = m_shapes;
        for (int frame = 0; frame < m_numFrames; ++frame)
            for (int k = 0; k < m_numModes; ++k) {
                Chunk row{};
                for (int a = 0; a < 6; ++a) setEntry(row, a, m_shapes(k, 6 * frame + a));
                m_rows.push_back(row);
            }
    }
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

template <class Scalar>
inline void PartFactors<Scalar>::formCompliance(int frame, int other,
                                                ChunkOf<Scalar>* compliance) const {
    if constexpr (IsReal<Scalar>) {
        multiplyColumns(m_shapes, 6 * frame, m_columns, 6 * other, compliance);
    } else {
        const Chunk* rows = m_rows.data() + frame * m_numModes;
        const Chunk* otherRows = m_rows.data() + other * m_numModes;
        ComplexChunk sums[6] = {};  // mode by mode: nothing is summed across a chunk
        for (int k = 0; k < m_numModes; ++k) {
            const ComplexChunk scaled = rows[k] * m_inverseDiagonal[0].get(k);
#pragma GCC unroll 6
            for (int j = 0; j < 6; ++j) sums[j] += scaled * otherRows[k][j];
        }
        std::copy_n(sums, 6, compliance);
    }
}

template <class Scalar>
bool PartFactors<Scalar>::factor(const Part& part) {
    const auto inverses = m_inverseDiagonal[0];
    for (int i = 0; i < m_numModes; i += ChunkSize) {
        const int count = std::min(m_numModes - i, ChunkSize);
        ChunkOf<Scalar> inverse = invertChunk(loadChunk(part.diagonal.data() + i, count));
        for (int k = count; k < ChunkSize; ++k) setEntry(inverse, k, 0);
        inverses.store(inverse, i);
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
        formCompliance(frame, other, compliance);
        if (frame == other) continue;
        for (int j = 0; j < 6; ++j)
            for (int i = 0; i < 6; ++i) setEntry(mirrored[i], j, getEntry(compliance[j], i));
    }
    return Map<const VectorXd>(m_inverseDiagonal.plane(0),
                               m_inverseDiagonal.paddedHeight() * PaddedColumns<Scalar>::numPlanes)
        .allFinite();
}

template class PartFactors<double>;
template class PartFactors<Complex>;

}  // namespace simflex
