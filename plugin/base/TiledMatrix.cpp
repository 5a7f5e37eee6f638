#include "simflex/base/TiledMatrix.h"

#include "simflex/base/Chunk.h"

namespace simflex {
namespace {

static_assert(TiledMatrix::TileHeight == ChunkSize);

}  // namespace

TiledMatrix::TiledMatrix(const Eigen::Ref<const Eigen::MatrixXd>& matrix) {
    assignTransposed(matrix.transpose());
}

void TiledMatrix::assignTransposed(const Eigen::Ref<const Eigen::MatrixXd>& A) {
    m_cols = int(A.rows());
    m_numTiles = int(A.cols() + TileHeight - 1) / TileHeight;
    m_values.setZero(Eigen::Index(m_numTiles) * TileHeight * m_cols);
    for (int i = 0; i < int(A.cols()); ++i) {
        double* entry = m_values.data() + i / TileHeight * m_cols * TileHeight + i % TileHeight;
        for (int j = 0; j < m_cols; ++j, entry += TileHeight) *entry = A(j, i);
    }
}

template <int Tiles, int Columns>
void TiledMatrix::multiplyTiles(int tile, const double* const* x, double* const* y) const {
    const double* A[Tiles];
    for (int t = 0; t < Tiles; ++t)
        A[t] = m_values.data() + size_t(tile + t) * size_t(m_cols) * TileHeight;
    Chunk sums[Tiles][Columns];
    for (int t = 0; t < Tiles; ++t)
        for (int c = 0; c < Columns; ++c) sums[t][c] = Chunk{};
    for (int j = 0; j < m_cols; ++j) {
        for (int t = 0; t < Tiles; ++t) {
            const Chunk a = loadChunk(A[t] + size_t(j) * TileHeight);
            for (int c = 0; c < Columns; ++c) sums[t][c] += a * x[c][j];
        }
    }
    for (int t = 0; t < Tiles; ++t)
        for (int c = 0; c < Columns; ++c)
            storeChunk(sums[t][c], y[c] + size_t(tile + t) * TileHeight);
}

template <int Tiles, int Columns>
void TiledMatrix::multiplyStrip(int tile, int count, const double* const* x,
                                double* const* y) const {
    int c = 0;
    for (; c + Columns <= count; c += Columns) multiplyTiles<Tiles, Columns>(tile, x + c, y + c);
    if constexpr (Columns > 1)
        if (c < count) multiplyStrip<Tiles, Columns / 2>(tile, count - c, x + c, y + c);
}

void TiledMatrix::multiply(int count, const double* const* x, double* const* y) const {
    // Up to 16 sums at a time: enough independent ones to hide the latency of an addition.
    int tile = 0;
    for (; tile + 4 <= m_numTiles; tile += 4) multiplyStrip<4, 4>(tile, count, x, y);
    switch (m_numTiles - tile) {
        case 3:
            return multiplyStrip<3, 4>(tile, count, x, y);
        case 2:
            return multiplyStrip<2, 8>(tile, count, x, y);
        case 1:
            return multiplyStrip<1, 8>(tile, count, x, y);
        default:
            return;
    }
}

}  // namespace simflex
