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
    for (int j = 0; j < n; ++j) m_LU.setColumn(j, J + j * n, n);
    for (int j = 0; j < m; ++j)
        for (int i = 0; i < n; ++i) m_LU.set(n + j, i, B(i, j));

    for (int k = 0; k < n; ++k) {
        const Scalar pivot = m_LU.get(k, k);
        if (!isSafePivot(pivot, J[k + k * n])) return false;
        const Scalar inverse = m_inverse[size_t(k)] = 1.0 / pivot;
        const int first = (k + 1) / ChunkSize * ChunkSize;
        for (int i = first; i < rows; i += ChunkSize) m_x.store(m_LU.load(k, i) * inverse, 0, i);
        for (int i = first; i <= k && i < rows; ++i) m_x.set(0, i, 0);
        for (int i = k + 1; i < n; ++i) m_LU.set(k, i, m_x.get(0, i));
        // Two columns at a time share the multipliers.
        int j = k + 1;
        for (; j + 2 <= n + m; j += 2) {
            const Scalar a = m_LU.get(j, k), b = m_LU.get(j + 1, k);
            for (int i = first; i < rows; i += ChunkSize) {
                const ChunkOf<Scalar> l = m_x.load(0, i);
                m_LU.store(m_LU.load(j, i) - l * a, j, i);
                m_LU.store(m_LU.load(j + 1, i) - l * b, j + 1, i);
            }
        }
        for (; j < n + m; ++j) {
            const Scalar a = m_LU.get(j, k);
            for (int i = first; i < rows; i += ChunkSize)
                m_LU.store(m_LU.load(j, i) - m_x.load(0, i) * a, j, i);
        }
    }
    substituteBack(m_LU, n, m);
    for (int j = 0; j < m; ++j) m_LU.getColumn(n + j, W.col(j).data(), n);
    return true;
}

template <class Scalar>
void ChunkedLu<Scalar>::substituteBack(PaddedColumns<Scalar>& X, int first, int count) {
    for (int k = m_n - 1; k >= 0; --k) {
        const int end = roundUpToChunks(k);
        for (int i = 0; i < k; ++i) m_above.set(0, i, m_LU.get(k, i));
        for (int i = k; i < end; ++i) m_above.set(0, i, 0);
        for (int j = first; j < first + count; ++j) {
            const Scalar value = X.get(j, k) * m_inverse[size_t(k)];
            X.set(j, k, value);
            for (int i = 0; i < end; i += ChunkSize)
                X.store(X.load(j, i) - m_above.load(0, i) * value, j, i);
        }
    }
}

template <class Scalar>
void ChunkedLu<Scalar>::solveInPlace(Scalar* x) {
    const int rows = m_x.paddedHeight();
    m_x.setColumn(0, x, m_n);
    for (int k = 0; k < m_n; ++k) {
        const Scalar value = m_x.get(0, k);
        const int next = std::min(roundUpToChunks(k + 1), rows);
        for (int i = k + 1; i < std::min(next, m_n); ++i)
            m_x.set(0, i, m_x.get(0, i) - m_LU.get(k, i) * value);
        for (int i = next; i < rows; i += ChunkSize)
            m_x.store(m_x.load(0, i) - m_LU.load(k, i) * value, 0, i);
    }
    substituteBack(m_x, 0, 1);
    m_x.getColumn(0, x, m_n);
}

template class ChunkedLu<double>;
template class ChunkedLu<Complex>;

}  // namespace simflex
