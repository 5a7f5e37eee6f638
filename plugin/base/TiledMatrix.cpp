#include "simflex/base/TiledMatrix.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "simflex/base/Chunk.h"

namespace simflex {
namespace {

static_assert(TiledMatrix::TileHeight == ChunkSize);

/** Chunks of sums computed at a time: as many as fit into registers beside the factors, and enough
independent ones to hide the latency of an addition. **/
#ifdef __AVX512F__
constexpr int NumSums = 16;
#else
constexpr int NumSums = 4;
#endif
constexpr int MostColumns = NumSums < 8 ? NumSums : 8;

/** y[rows[k]] = chunk[k]. **/
inline void scatter(const Chunk& chunk, const int* rows, double* y) {
#ifdef __AVX512F__
    _mm512_i32scatter_pd(y, _mm256_loadu_si256(reinterpret_cast<const __m256i*>(rows)), chunk, 8);
#else
    for (int k = 0; k < ChunkSize; ++k) y[rows[k]] = chunk[k];
#endif
}

}  // namespace

TiledMatrix::TiledMatrix(const Eigen::Ref<const Eigen::MatrixXd>& matrix, double negligible) {
    assignTransposed(matrix.transpose());
    if (negligible > 0 && matrix.size() > 0) skipZeros(matrix, negligible);
}

void TiledMatrix::skipZeros(const Eigen::Ref<const Eigen::MatrixXd>& matrix, double negligible) {
    const double largestZero = negligible * matrix.cwiseAbs().maxCoeff();
    const auto isKept = [&](int row, int column) {
        return row < int(matrix.rows()) && std::abs(matrix(row, column)) > largestZero;
    };
    std::vector<std::pair<std::vector<bool>, int>> rows;
    for (int i = 0; i < paddedRows(); ++i) {
        std::vector<bool> pattern;
        for (int j = 0; j < m_cols; ++j) pattern.push_back(isKept(i, j));
        rows.emplace_back(std::move(pattern), i);
    }
    std::sort(rows.begin(), rows.end());
    std::vector<int> kept, firstKept;
    for (int tile = 0; tile < m_numTiles; ++tile) {
        firstKept.push_back(int(kept.size()));
        const auto first = rows.begin() + tile * TileHeight;
        for (int j = 0; j < m_cols; ++j)
            if (std::any_of(first, first + TileHeight,
                            [j](const auto& row) { return row.first[size_t(j)]; }))
                kept.push_back(j);
    }
    if (2 * kept.size() > size_t(m_numTiles) * size_t(m_cols)) return;
    firstKept.push_back(int(kept.size()));
    m_values.setZero(Eigen::Index(kept.size()) * TileHeight);
    for (int tile = 0; tile < m_numTiles; ++tile)
        for (int k = 0; k < TileHeight; ++k) {
            const int row = rows[size_t(tile * TileHeight + k)].second;
            m_rows.push_back(row);
            for (int c = firstKept[size_t(tile)]; c < firstKept[size_t(tile) + 1]; ++c)
                if (row < int(matrix.rows()))
                    m_values[c * TileHeight + k] = matrix(row, kept[size_t(c)]);
        }
    m_kept = std::move(kept);
    m_firstKept = std::move(firstKept);
}

template <int Columns>
void TiledMatrix::multiplyKept(int count, const double* const* x, double* const* y) const {
    int first = 0;
    for (; first + Columns <= count; first += Columns)
        for (int tile = 0; tile < m_numTiles; ++tile) {
            Chunk sums[Columns];
            for (int c = 0; c < Columns; ++c) sums[c] = Chunk{};
            for (int k = m_firstKept[size_t(tile)]; k < m_firstKept[size_t(tile) + 1]; ++k) {
                const Chunk a = loadChunk(m_values.data() + size_t(k) * TileHeight);
                const size_t column = size_t(m_kept[size_t(k)]);
                for (int c = 0; c < Columns; ++c) sums[c] += a * x[first + c][column];
            }
            for (int c = 0; c < Columns; ++c)
                scatter(sums[c], m_rows.data() + tile * TileHeight, y[first + c]);
        }
    if constexpr (Columns > 1)
        if (first < count) multiplyKept<Columns / 2>(count - first, x + first, y + first);
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
    if (!m_rows.empty()) return multiplyKept<MostColumns>(count, x, y);
    constexpr int Tiles = NumSums == 16 ? 4 : 2;
    int tile = 0;
    for (; tile + Tiles <= m_numTiles; tile += Tiles)
        multiplyStrip<Tiles, NumSums / Tiles>(tile, count, x, y);
    switch (m_numTiles - tile) {
        case 3:
            return multiplyStrip<3, NumSums / 4>(tile, count, x, y);
        case 2:
            return multiplyStrip<2, NumSums / 2>(tile, count, x, y);
        case 1:
            return multiplyStrip<1, MostColumns>(tile, count, x, y);
        default:
            return;
    }
}

}  // namespace simflex
