#include "SymmetricProduct.h"

#include <algorithm>
#include <numeric>

#include "simflex/base/Chunk.h"
#include "simflex/base/ParallelFor.h"

namespace simflex {
namespace {

constexpr size_t ProductsWorthThreads = 2000000;  // multiplications worth starting threads for
constexpr Eigen::Index SumsInRegisters = 3;       // chunks

/** y ← Σ_k values_k x(columns_k) of contiguous numbers, `Chunks` chunks at a time. **/
template <int Chunks>
inline void addUpRow(const double* values, const std::int32_t* columns, std::int64_t count,
                     const double* x, Eigen::Index width, double* y) {
    Chunk sum[Chunks] = {};
    for (std::int64_t k = 0; k < count; ++k) {
        const double* of = x + columns[k] * width;
#pragma GCC unroll 3
        for (int c = 0; c < Chunks; ++c) sum[c] += values[k] * loadChunk(of + c * ChunkSize);
    }
#pragma GCC unroll 3
    for (int c = 0; c < Chunks; ++c) storeChunk(sum[c], y + c * ChunkSize);
}

}  // namespace

FullRows::FullRows(const SymmetricMatrix& lower) : m_starts(lower.size + 1, 0) {
    for (int column = 0; column < lower.size; ++column)
        for (auto k = lower.columnStarts[column]; k < lower.columnStarts[column + 1]; ++k) {
            ++m_starts[lower.rows[k] + 1];
            if (lower.rows[k] != column) ++m_starts[column + 1];
        }
    std::partial_sum(m_starts.begin(), m_starts.end(), m_starts.begin());
    std::vector<std::int64_t> next(m_starts.begin(), m_starts.end() - 1);
    m_columns.resize(m_starts.back());
    m_values.resize(m_starts.back());
    // The upper part of row r comes from column r; its lower part was filled by earlier columns.
    for (int column = 0; column < lower.size; ++column)
        for (auto k = lower.columnStarts[column]; k < lower.columnStarts[column + 1]; ++k) {
            const int row = lower.rows[k];
            m_columns[next[column]] = row;
            m_values[next[column]++] = lower.values[k];
            if (row == column) continue;
            m_columns[next[row]] = column;
            m_values[next[row]++] = lower.values[k];
        }
}

Shapes FullRows::multiplyBlocks(const Shapes& X, int rowsPerEntry) const {
    const Eigen::Index width = rowsPerEntry * X.cols();
    Shapes Y(X.rows(), X.cols());
#pragma omp parallel for schedule(static) if (m_values.size() * size_t(width) >= \
                                              ProductsWorthThreads)
    for (int row = 0; row < size(); ++row) {
        const std::int64_t first = m_starts[row], count = m_starts[row + 1] - first;
        const double *values = m_values.data() + first, *x = X.data();
        const std::int32_t* columns = m_columns.data() + first;
        double* y = Y.data() + row * width;
        Eigen::Index j = 0;
        for (; j + SumsInRegisters * ChunkSize <= width; j += SumsInRegisters * ChunkSize)
            addUpRow<SumsInRegisters>(values, columns, count, x + j, width, y + j);
        for (; j + ChunkSize <= width; j += ChunkSize)
            addUpRow<1>(values, columns, count, x + j, width, y + j);
        for (; j < width; ++j) {
            double sum = 0;
            for (std::int64_t k = 0; k < count; ++k) sum += values[k] * x[columns[k] * width + j];
            y[j] = sum;
        }
    }
    return Y;
}

Shapes LowerTriangle::multiply(const Shapes& X) const {
    const int size = m_lower.size;
    Shapes Y(X.rows(), X.cols());
    const Eigen::Index numPasses = (X.cols() + ChunkSize - 1) / ChunkSize;
    const int threads =
        m_lower.values.size() * ChunkSize >= ProductsWorthThreads ? omp_get_max_threads() : 1;
    parallelFor(numPasses, threads, Schedule::WhoeverIsFree, [&](Eigen::Index pass) {
        const Eigen::Index first = pass * ChunkSize;
        const int width = int(std::min<Eigen::Index>(ChunkSize, X.cols() - first));
        std::vector<Chunk> x(static_cast<size_t>(size)), y(static_cast<size_t>(size), Chunk{});
        for (int row = 0; row < size; ++row)
            x[size_t(row)] = loadChunk(&X.coeffRef(row, first), width);
        for (int column = 0; column < size; ++column) {
            const Chunk own = x[size_t(column)];
            Chunk sum{};
            for (auto k = m_lower.columnStarts[column]; k < m_lower.columnStarts[column + 1]; ++k) {
                const int row = m_lower.rows[k];
                const double value = m_lower.values[k];
                if (row == column) {
                    sum += value * own;
                    continue;
                }
                sum += value * x[size_t(row)];
                y[size_t(row)] += value * own;
            }
            y[size_t(column)] += sum;
        }
        for (int row = 0; row < size; ++row)
            storeChunk(y[size_t(row)], &Y.coeffRef(row, first), width);
    });
    return Y;
}

Eigen::VectorXd LowerTriangle::sumSizes(const Shapes& X) const {
    Eigen::VectorXd sums = Eigen::VectorXd::Zero(X.cols());
    for (int column = 0; column < m_lower.size; ++column)
        for (auto k = m_lower.columnStarts[column]; k < m_lower.columnStarts[column + 1]; ++k) {
            const int row = m_lower.rows[k];
            const double size = (row == column ? 1 : 2) * std::abs(m_lower.values[k]);
            sums += size * X.row(row).cwiseAbs().cwiseProduct(X.row(column).cwiseAbs());
        }
    return sums;
}

Stiffness::Stiffness(const FeModel& model, const std::vector<int>& tieOf) : m_model(model) {
    if (!model.elements) return;
    m_unknowns = SectionUnknowns(*model.elements, model.mesh, tieOf);
    if (!m_unknowns.empty()) m_own = assembleStiffness(*model.elements, model.mesh, m_unknowns);
}

Shapes Stiffness::toUnknowns(const Shapes& u) const {
    Shapes q = u;
    for (int node = 0; node < m_unknowns.numNodes(); ++node)
        m_unknowns.forOrigins(node, [&](int from, double weight) {
            q.middleRows<3>(3 * node) -= weight * u.middleRows<3>(3 * from);
        });
    return q;
}

Shapes Stiffness::multiply(const Shapes& u) const {
    if (m_unknowns.empty()) return LowerTriangle(m_model.K).multiply(u);
    const Shapes ofUnknowns = LowerTriangle(m_own).multiply(toUnknowns(u));
    Shapes f = ofUnknowns;
    for (int node = 0; node < m_unknowns.numNodes(); ++node)
        m_unknowns.forOrigins(node, [&](int from, double weight) {
            f.middleRows<3>(3 * from) -= weight * ofUnknowns.middleRows<3>(3 * node);
        });
    return f;
}

Eigen::VectorXd Stiffness::sumSizes(const Shapes& u) const {
    return LowerTriangle(matrix()).sumSizes(m_unknowns.empty() ? u : toUnknowns(u));
}

}  // namespace simflex
