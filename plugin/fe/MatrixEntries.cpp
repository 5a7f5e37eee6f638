#include "MatrixEntries.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

namespace simflex {
namespace {

/** Tolerance for equal entries, relative to the largest one. **/
constexpr double Same = 1e-10;

double findLargest(const std::vector<double>& values) {
    double largest = 0;
    for (const double value : values) largest = std::max(largest, std::abs(value));
    return largest;
}

std::string nameDof(int dof, const Mesh& mesh) {
    return "direction " + std::to_string(dof % 3 + 1) + " of node " +
           std::to_string(mesh.nodeNumbers[size_t(dof / 3)]);
}

/** Visits the entries of both matrices: visit(row, column, a, b, inA, inB). **/
template <class Visit>
void mergeEntries(const SymmetricMatrix& A, const SymmetricMatrix& B, Visit visit) {
    for (int column = 0; column < A.size; ++column) {
        auto a = A.columnStarts[size_t(column)], b = B.columnStarts[size_t(column)];
        const auto endA = A.columnStarts[size_t(column) + 1],
                   endB = B.columnStarts[size_t(column) + 1];
        while (a < endA || b < endB) {
            const int rowA = a < endA ? A.rows[size_t(a)] : A.size;
            const int rowB = b < endB ? B.rows[size_t(b)] : B.size;
            const int row = std::min(rowA, rowB);
            visit(row, column, rowA == row ? A.values[size_t(a)] : 0.0,
                  rowB == row ? B.values[size_t(b)] : 0.0, rowA == row, rowB == row);
            a += rowA == row;
            b += rowB == row;
        }
    }
}

}  // namespace

SymmetricMatrix makeSymmetric(const MatrixEntries& entries, MatrixForm form, const Mesh& mesh,
                              const std::string& what) {
    MatrixEntries lower, upper;
    for (size_t k = 0; k < entries.values.size(); ++k) {
        const bool isUpper = entries.rows[k] < entries.columns[k];
        (isUpper ? upper : lower).add(entries.rows[k], entries.columns[k], entries.values[k]);
    }
    const int size = 3 * mesh.numNodes();
    const SymmetricMatrix L =
        SymmetricMatrix::fromEntries(size, lower.rows, lower.columns, lower.values);
    if (upper.values.empty()) return L;
    const SymmetricMatrix U =
        SymmetricMatrix::fromEntries(size, upper.rows, upper.columns, upper.values);
    bool onlyUpper = true;
    for (size_t k = 0; k < lower.values.size(); ++k)
        onlyUpper = onlyUpper && lower.rows[k] == lower.columns[k];
    const bool isGeneral = form == MatrixForm::General && !onlyUpper;
    const double tolerance = Same * findLargest(entries.values);

    SymmetricMatrix A;
    A.size = size;
    mergeEntries(L, U, [&](int row, int column, double low, double up, bool inL, bool inU) {
        while (int(A.columnStarts.size()) <= column) A.columnStarts.push_back(A.numEntries());
        const bool both = row != column && (isGeneral || (inL && inU));
        if (both && std::abs(low - up) > tolerance) {
            std::ostringstream text;
            text << what << " is not symmetric: it has " << low << " in the row of "
                 << nameDof(row, mesh) << " and the column of " << nameDof(column, mesh) << ", and "
                 << up << " in the row and column the other way round";
            throw std::invalid_argument(text.str());
        }
        A.rows.push_back(row);
        A.values.push_back(inL ? low : up);
    });
    while (int(A.columnStarts.size()) <= size) A.columnStarts.push_back(A.numEntries());
    return A;
}

SymmetricMatrix takeNodalMass(const SymmetricMatrix& M, const Mesh& mesh) {
    const double tolerance = Same * findLargest(M.values);
    SymmetricMatrix axes[3];
    for (SymmetricMatrix& m : axes) m.size = mesh.numNodes();
    for (int column = 0; column < M.size; ++column) {
        SymmetricMatrix& m = axes[column % 3];
        m.columnStarts.push_back(m.numEntries());
        for (auto k = M.columnStarts[size_t(column)]; k < M.columnStarts[size_t(column) + 1]; ++k) {
            const int row = M.rows[size_t(k)];
            if (row % 3 == column % 3) {
                m.rows.push_back(row / 3);
                m.values.push_back(M.values[size_t(k)]);
            } else if (std::abs(M.values[size_t(k)]) > tolerance) {
                throw std::invalid_argument("the mass matrix couples " + nameDof(row, mesh) +
                                            " to " + nameDof(column, mesh) +
                                            "; simflex needs plain solids, M = m ⊗ 1₃");
            }
        }
    }
    for (SymmetricMatrix& m : axes) m.columnStarts.push_back(m.numEntries());
    for (int axis = 1; axis < 3; ++axis)
        mergeEntries(axes[0], axes[axis], [&](int row, int column, double a, double b, bool, bool) {
            if (std::abs(a - b) <= tolerance) return;
            std::ostringstream text;
            text << "the mass matrix differs between the directions 1 and " << axis + 1
                 << " (nodes " << mesh.nodeNumbers[size_t(row)] << " and "
                 << mesh.nodeNumbers[size_t(column)] << ": " << a << " and " << b
                 << "); simflex needs plain solids, M = m ⊗ 1₃";
            throw std::invalid_argument(text.str());
        });
    return std::move(axes[0]);
}

SymmetricMatrix addEntries(const SymmetricMatrix& A, MatrixEntries more, int size) {
    for (int column = 0; column < A.size; ++column)
        for (auto k = A.columnStarts[size_t(column)]; k < A.columnStarts[size_t(column) + 1]; ++k)
            more.add(A.rows[size_t(k)], column, A.values[size_t(k)]);
    return SymmetricMatrix::fromEntries(size, more.rows, more.columns, more.values);
}

}  // namespace simflex
