#include "SymmetricProduct.h"

#include <algorithm>
#include <numeric>

#include "simflex/base/ParallelFor.h"

namespace simflex {
namespace {

constexpr size_t kProductsWorthThreads = 2000000;  // multiplications

}  // namespace

FullRows::FullRows(const SymmetricMatrix& lower) : _starts(lower.size + 1, 0) {
    for (int column = 0; column < lower.size; ++column)
        for (auto k = lower.columnStarts[column]; k < lower.columnStarts[column + 1]; ++k) {
            ++_starts[lower.rows[k] + 1];
            if (lower.rows[k] != column) ++_starts[column + 1];
        }
    std::partial_sum(_starts.begin(), _starts.end(), _starts.begin());
    std::vector<std::int64_t> next(_starts.begin(), _starts.end() - 1);
    _columns.resize(_starts.back());
    _values.resize(_starts.back());
    // The upper part of row r comes from column r; its lower part was filled by columns before r.
    for (int column = 0; column < lower.size; ++column)
        for (auto k = lower.columnStarts[column]; k < lower.columnStarts[column + 1]; ++k) {
            const int row = lower.rows[k];
            _columns[next[column]] = row;
            _values[next[column]++] = lower.values[k];
            if (row == column) continue;
            _columns[next[row]] = column;
            _values[next[row]++] = lower.values[k];
        }
}

Shapes FullRows::multiplyBlocks(const Shapes& X, int rowsPerEntry) const {
    const Eigen::Index width = rowsPerEntry * X.cols();
    Shapes Y(X.rows(), X.cols());
#pragma omp parallel for schedule(static) if (_values.size() * size_t(width) >= kProductsWorthThreads)
    for (int row = 0; row < size(); ++row) {
        double* y = Y.data() + row * width;
        for (Eigen::Index j = 0; j < width; ++j) y[j] = 0;
        for (auto k = _starts[row]; k < _starts[row + 1]; ++k) {
            const double value = _values[k];
            const double* x = X.data() + _columns[k] * width;
            for (Eigen::Index j = 0; j < width; ++j) y[j] += value * x[j];
        }
    }
    return Y;
}

Shapes LowerTriangle::multiply(const Shapes& X) const {
    constexpr Eigen::Index kWidth = 8;  // vectors a pass over the matrix
    using Row = Eigen::Array<double, kWidth, 1>;
    const int size = _lower.size;
    Shapes Y(X.rows(), X.cols());
    const Eigen::Index numPasses = (X.cols() + kWidth - 1) / kWidth;
    const int threads = _lower.values.size() * 8 >= kProductsWorthThreads ? omp_get_max_threads() : 1;
    parallelFor(numPasses, threads, Schedule::WhoeverIsFree, [&](Eigen::Index pass) {
        const Eigen::Index first = pass * kWidth, width = std::min(kWidth, X.cols() - first);
        std::vector<Row> x(static_cast<size_t>(size)), y(static_cast<size_t>(size), Row::Zero());
        for (int row = 0; row < size; ++row) {
            x[size_t(row)].setZero();
            for (Eigen::Index j = 0; j < width; ++j) x[size_t(row)][j] = X(row, first + j);
        }
        for (int column = 0; column < size; ++column) {
            const Row own = x[size_t(column)];
            Row sum = Row::Zero();
            for (auto k = _lower.columnStarts[column]; k < _lower.columnStarts[column + 1]; ++k) {
                const int row = _lower.rows[k];
                const double value = _lower.values[k];
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
            for (Eigen::Index j = 0; j < width; ++j) Y(row, first + j) = y[size_t(row)][j];
    });
    return Y;
}

}  // namespace simflex
