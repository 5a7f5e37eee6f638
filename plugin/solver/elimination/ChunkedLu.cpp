#include "simflex/solver/elimination/ChunkedLu.h"

#include <algorithm>
#include <cmath>

#include "simflex/base/Chunk.h"

namespace simflex {
namespace {

/** y −= a x, rows from `first` to `end`, both rounded down and up to whole chunks: x is zero in the
 * rows of the first chunk that are not meant. **/
inline void subtract(double* y, const double* x, double a, int first, int end) {
    for (int i = first / ChunkSize * ChunkSize; i < end; i += ChunkSize)
        storeChunk(loadChunk(y + i) - loadChunk(x + i) * a, y + i);
}

}  // namespace

bool ChunkedLu::factor(const double* J, int n, const Eigen::MatrixXd& B, Eigen::MatrixXd& W) {
    const int m = int(B.cols()), rows = roundUpToChunks(n);
    m_n = n;
    if (m_LU.rows() != rows || m_LU.cols() != n + m) m_LU.setZero(rows, n + m);
    if (m_x.size() != rows) {
        m_x.setZero(rows);
        m_above.setZero(rows);
    }
    m_inverse.resize(n);
    for (int j = 0; j < n; ++j) std::copy_n(J + j * n, n, column(j));
    for (int j = 0; j < m; ++j) std::copy_n(B.col(j).data(), n, column(n + j));

    constexpr double LeastShare = 1e-8;
    double* multipliers = m_x.data();
    for (int k = 0; k < n; ++k) {
        double* pivotColumn = column(k);
        const double pivot = pivotColumn[k];
        if (!(pivot > LeastShare * std::abs(J[k + k * n])) || !std::isfinite(pivot)) return false;
        m_inverse[k] = 1 / pivot;
        const int first = (k + 1) / ChunkSize * ChunkSize;
        for (int i = first; i < rows; i += ChunkSize)
            storeChunk(loadChunk(pivotColumn + i) * m_inverse[k], multipliers + i);
        for (int i = first; i <= k && i < rows; ++i) multipliers[i] = 0;
        for (int i = k + 1; i < n; ++i) pivotColumn[i] = multipliers[i];
        // Two columns at a time share the multipliers.
        int j = k + 1;
        for (; j + 2 <= n + m; j += 2) {
            double *a = column(j), *b = column(j + 1);
            const double ak = a[k], bk = b[k];
            for (int i = first; i < rows; i += ChunkSize) {
                const Chunk l = loadChunk(multipliers + i);
                storeChunk(loadChunk(a + i) - l * ak, a + i);
                storeChunk(loadChunk(b + i) - l * bk, b + i);
            }
        }
        for (; j < n + m; ++j) subtract(column(j), multipliers, column(j)[k], first, rows);
    }
    substituteBack(column(n), m);
    for (int j = 0; j < m; ++j) std::copy_n(column(n + j), n, W.col(j).data());
    return true;
}

void ChunkedLu::substituteBack(double* X, int count) {
    double* above = m_above.data();
    for (int k = m_n - 1; k >= 0; --k) {
        std::copy_n(column(k), k, above);
        const int end = roundUpToChunks(k);
        std::fill(above + k, above + end, 0.0);
        for (int j = 0; j < count; ++j) {
            double* x = X + j * m_LU.rows();
            const double value = x[k] *= m_inverse[k];
            for (int i = 0; i < end; i += ChunkSize)
                storeChunk(loadChunk(x + i) - loadChunk(above + i) * value, x + i);
        }
    }
}

void ChunkedLu::solveInPlace(double* x) {
    double* y = m_x.data();
    std::copy_n(x, m_n, y);
    for (int k = 0; k < m_n; ++k) {
        const double* L = column(k);
        const double value = y[k];
        const int next = std::min(roundUpToChunks(k + 1), int(m_x.size()));
        for (int i = k + 1; i < std::min(next, m_n); ++i) y[i] -= L[i] * value;
        for (int i = next; i < int(m_x.size()); i += ChunkSize)
            storeChunk(loadChunk(y + i) - loadChunk(L + i) * value, y + i);
    }
    substituteBack(y, 1);
    std::copy_n(y, m_n, x);
}

}  // namespace simflex
