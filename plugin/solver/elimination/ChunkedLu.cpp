#include "simflex/solver/elimination/ChunkedLu.h"

#include <algorithm>
#include <cmath>

namespace simflex {
namespace {

constexpr double LeastShare = 1e-8;

bool isSafePivot(double pivot, double diagonal) {
    return pivot > LeastShare * std::abs(diagonal) && std::isfinite(pivot);
}
bool isSafePivot(const Complex& pivot, const Complex& diagonal) {
    return magnitude(pivot) > LeastShare * magnitude(diagonal) && isFinite(pivot);
}

}  // namespace

template <class Scalar>
bool ChunkedLu<Scalar>::factor(const Scalar* J, int n, const Eigen::MatrixXd& B, Matrix& W) {
    const int m = int(B.cols()), rows = roundUpToChunks(n);
    m_n = n;
    m_LU.resize(n, n + m);
    m_x.resize(n, 1);
    m_above.resize(n, 1);
    m_inverse.resize(size_t(n));
    for (int j = 0; j < n; ++j) m_LU[j].copyFrom(J + j * n, n);
    for (int j = 0; j < m; ++j) m_LU[n + j].copyFrom(B.col(j).data(), n);

    const auto multipliers = m_x[0];
    for (int k = 0; k < n; ++k) {
        const auto pivotColumn = m_LU[k];
        const Scalar pivot = pivotColumn.get(k);
        if (!isSafePivot(pivot, J[k + k * n])) return false;
        const Scalar inverse = m_inverse[size_t(k)] = 1.0 / pivot;
        const int first = (k + 1) / ChunkSize * ChunkSize;
        for (int i = first; i < rows; i += ChunkSize)
            multipliers.store(pivotColumn.load(i) * inverse, i);
        multipliers.clear(first, std::min(k + 1, rows));
        for (int i = k + 1; i < n; ++i) pivotColumn.set(i, multipliers.get(i));
        // Two columns at a time share the multipliers.
        int j = k + 1;
        for (; j + 2 <= n + m; j += 2) {
            const auto a = m_LU[j], b = m_LU[j + 1];
            const Scalar ak = a.get(k), bk = b.get(k);
            for (int i = first; i < rows; i += ChunkSize) {
                const ChunkOf<Scalar> l = multipliers.load(i);
                a.store(a.load(i) - l * ak, i);
                b.store(b.load(i) - l * bk, i);
            }
        }
        for (; j < n + m; ++j) {
            const auto a = m_LU[j];
            const Scalar ak = a.get(k);
            for (int i = first; i < rows; i += ChunkSize)
                a.store(a.load(i) - multipliers.load(i) * ak, i);
        }
    }
    substituteBack(m_LU, n, m);
    for (int j = 0; j < m; ++j) m_LU[n + j].copyTo(W.col(j).data(), n);
    return true;
}

template <class Scalar>
void ChunkedLu<Scalar>::substituteBack(PaddedColumns<Scalar>& X, int first, int count) {
    const auto above = m_above[0];
    for (int k = m_n - 1; k >= 0; --k) {
        const auto column = m_LU[k];
        const int end = roundUpToChunks(k);
        above.copyFrom(column, k);
        above.clear(k, end);
        for (int j = first; j < first + count; ++j) {
            const auto x = X[j];
            const Scalar value = x.get(k) * m_inverse[size_t(k)];
            x.set(k, value);
            for (int i = 0; i < end; i += ChunkSize) x.store(x.load(i) - above.load(i) * value, i);
        }
    }
}

template <class Scalar>
void ChunkedLu<Scalar>::solveInPlace(Scalar* x) {
    const auto y = m_x[0];
    const int rows = m_x.paddedHeight();
    y.copyFrom(x, m_n);
    for (int k = 0; k < m_n; ++k) {
        const auto L = m_LU[k];
        const Scalar value = y.get(k);
        const int next = std::min(roundUpToChunks(k + 1), rows);
        for (int i = k + 1; i < std::min(next, m_n); ++i) y.set(i, y.get(i) - L.get(i) * value);
        for (int i = next; i < rows; i += ChunkSize) y.store(y.load(i) - L.load(i) * value, i);
    }
    substituteBack(m_x, 0, 1);
    y.copyTo(x, m_n);
}

template class ChunkedLu<double>;
template class ChunkedLu<Complex>;

}  // namespace simflex
