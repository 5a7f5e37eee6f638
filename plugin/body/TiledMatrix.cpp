#include "simflex/body/TiledMatrix.h"

#include <cstring>

namespace simflex {
namespace {

/** Eight doubles; the compiler maps them onto what the machine has. **/
using Tile = double __attribute__((vector_size(8 * TiledMatrix::TileHeight)));

}  // namespace

TiledMatrix::TiledMatrix(const Eigen::Ref<const Eigen::MatrixXd>& matrix) {
    assignTransposed(matrix.transpose());
}

void TiledMatrix::assignTransposed(const Eigen::MatrixXd& A) {
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
    Tile sums[Tiles][Columns] = {};
    for (int j = 0; j < m_cols; ++j) {
        for (int t = 0; t < Tiles; ++t) {
            Tile a;
            std::memcpy(&a, A[t] + size_t(j) * TileHeight, sizeof a);
            for (int c = 0; c < Columns; ++c) sums[t][c] += a * x[c][j];
        }
    }
    for (int t = 0; t < Tiles; ++t)
        for (int c = 0; c < Columns; ++c)
            std::memcpy(y[c] + size_t(tile + t) * TileHeight, &sums[t][c], sizeof(Tile));
}

template <int Tiles>
void TiledMatrix::multiplyStrip(int tile, int count, const double* const* x,
                                double* const* y) const {
    int c = 0;
    for (; c + 4 <= count; c += 4) multiplyTiles<Tiles, 4>(tile, x + c, y + c);
    switch (count - c) {
        case 3:
            return multiplyTiles<Tiles, 3>(tile, x + c, y + c);
        case 2:
            return multiplyTiles<Tiles, 2>(tile, x + c, y + c);
        case 1:
            return multiplyTiles<Tiles, 1>(tile, x + c, y + c);
        default:
            return;
    }
}

void TiledMatrix::multiply(int count, const double* const* x, double* const* y) const {
    // Four tiles at a time: enough independent sums to hide the latency of an addition.
    int tile = 0;
    for (; tile + 4 <= m_numTiles; tile += 4) multiplyStrip<4>(tile, count, x, y);
    for (; tile < m_numTiles; ++tile) multiplyStrip<1>(tile, count, x, y);
}

}  // namespace simflex
