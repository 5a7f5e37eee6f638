#include "SymmetricProduct.h"

#include <numeric>

namespace simflex {

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
#pragma omp parallel for schedule(static)
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

}  // namespace simflex
