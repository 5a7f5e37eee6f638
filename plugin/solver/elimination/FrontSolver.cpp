#include "simflex/solver/elimination/FrontSolver.h"

#include <algorithm>
#include <cmath>

#include "simflex/base/Dot.h"
#include "simflex/base/ParallelFor.h"

namespace simflex {

using Eigen::Map;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using StridedMatrix = Map<MatrixXd, 0, Eigen::OuterStride<>>;

namespace {

constexpr int PanelWidth = 32;
/** A diagonal that has kept this much of its first value is taken as pivot without a search. **/
constexpr double GoodPivot = 0.1;

}  // namespace

FrontSolver::FrontSolver(const CliquePattern& pattern) : m_tree(pattern) {
    size_t matrices = 0, vectors = 0;
    for (const FrontTree::Front& front : m_tree.fronts()) {
        const size_t rows = size_t(front.numRows());
        m_offsets.push_back(matrices);
        m_vectorOffsets.push_back(vectors);
        matrices += (rows * rows + 7) / 8 * 8;
        vectors += rows;
    }
    const size_t unknowns = size_t(m_tree.numUnknowns());
    m_storage.setZero(Eigen::Index(matrices));
    m_vectors.assign(vectors, 0);
    m_originals.assign(vectors, 0);
    m_pivotOrder.assign(unknowns, 0);
    m_inversePivots.assign(unknowns, 0);
    m_isRedundant.assign(unknowns, 0);
    m_x.assign(unknowns, 0);
    m_unknownAt.resize(unknowns);
    for (size_t i = 0; i < unknowns; ++i) m_unknownAt[size_t(m_tree.positions()[i])] = int(i);
}

template <class Visit>
void FrontSolver::visitUpwards(int threads, Visit visit) {
    const std::vector<int>& subtrees = m_tree.subtrees();
    parallelFor(int(subtrees.size()), threads, Schedule::WhoeverIsFree, [&](int s) {
        const int root = subtrees[size_t(s)];
        for (int f = m_tree.fronts()[size_t(root)].firstDescendant; f <= root; ++f) visit(f);
    });
    for (int f : m_tree.frontsAboveSubtrees()) visit(f);
}

template <class Visit>
void FrontSolver::visitDownwards(int threads, Visit visit) {
    const std::vector<int>&top = m_tree.frontsAboveSubtrees(), &subtrees = m_tree.subtrees();
    for (auto f = top.rbegin(); f != top.rend(); ++f) visit(*f);
    parallelFor(int(subtrees.size()), threads, Schedule::WhoeverIsFree, [&](int s) {
        const int root = subtrees[size_t(s)];
        for (int f = root; f >= m_tree.fronts()[size_t(root)].firstDescendant; --f) visit(f);
    });
}

//--------------------------------------------------------------------------------------------------
// factorization

void FrontSolver::factor(const std::vector<const double*>& values, int threads) {
    visitUpwards(threads, [&](int f) { factorFront(f, values); });
    findNullVectors();
}

void FrontSolver::assembleFront(int f, const std::vector<const double*>& values) {
    const FrontTree::Front& front = m_tree.fronts()[size_t(f)];
    const int rows = front.numRows();
    double *F = matrixOf(f), *original = originalOf(f);
    std::fill_n(F, size_t(rows) * size_t(rows), 0.0);
    std::fill_n(original, rows, 0.0);

    for (const FrontTree::Contribution& contribution : front.contributions) {
        const double* column = values[size_t(contribution.clique)];
        if (!column) continue;
        const std::vector<int>& at = contribution.positions;
        const size_t size = at.size();
        for (size_t j = 0; j < size; ++j, column += size) {
            double* target = F + size_t(at[j]) * size_t(rows);
            for (size_t i = 0; i < size; ++i)
                if (!m_isSymmetric || at[i] >= at[j]) target[at[i]] += column[i];
            original[at[j]] += std::abs(column[j]);
        }
    }
    for (int c : front.children) {
        const FrontTree::Front& child = m_tree.fronts()[size_t(c)];
        const int childRows = child.numRows(), k = child.numPivots;
        const int border = childRows - k;
        const double *C = matrixOf(c), *childOriginal = originalOf(c) + k;
        const int* at = child.parentRows.data();
        for (int j = 0; j < border; ++j) {
            const double* column = C + size_t(k + j) * size_t(childRows) + k;
            double* target = F + size_t(at[j]) * size_t(rows);
            // Both borders ascend: the lower triangle stays the lower one.
            for (int i = m_isSymmetric ? j : 0; i < border; ++i) target[at[i]] += column[i];
            original[at[j]] += childOriginal[j];
        }
    }
}

void FrontSolver::factorFront(int f, const std::vector<const double*>& values) {
    assembleFront(f, values);
    const FrontTree::Front& front = m_tree.fronts()[size_t(f)];
    for (int i = 0; i < front.numPivots; ++i) m_pivotOrder[size_t(front.firstPivot + i)] = i;
    if (front.numRows() <= 2 * PanelWidth) {
        eliminate(f, 0, front.numPivots);
        return;
    }
    for (int from = 0; from < front.numPivots; from += PanelWidth) {
        const int to = std::min(from + PanelWidth, front.numPivots);
        eliminate(f, from, to);
        updateTrailing(f, from, to);
    }
}

void FrontSolver::swapPivots(int f, int p, int q) {
    const FrontTree::Front& front = m_tree.fronts()[size_t(f)];
    const int rows = front.numRows();
    double *F = matrixOf(f), *original = originalOf(f);
    const auto at = [&](int i, int j) -> double& { return F[i + size_t(j) * size_t(rows)]; };
    std::swap(m_pivotOrder[size_t(front.firstPivot + p)],
              m_pivotOrder[size_t(front.firstPivot + q)]);
    std::swap(original[p], original[q]);
    if (!m_isSymmetric) {
        for (int j = 0; j < rows; ++j) std::swap(at(p, j), at(q, j));
        std::swap_ranges(F + size_t(p) * size_t(rows), F + size_t(p + 1) * size_t(rows),
                         F + size_t(q) * size_t(rows));
        return;
    }
    for (int j = 0; j < p; ++j) std::swap(at(p, j), at(q, j));
    for (int i = p + 1; i < q; ++i) std::swap(at(i, p), at(q, i));
    for (int i = q + 1; i < rows; ++i) std::swap(at(i, p), at(i, q));
    std::swap(at(p, p), at(q, q));
}

void FrontSolver::eliminate(int f, int from, int to) {
    const FrontTree::Front& front = m_tree.fronts()[size_t(f)];
    const int rows = front.numRows();
    // A small front is updated as a whole, a large one within the panel.
    const int lastColumn = rows <= 2 * PanelWidth ? rows : to;
    double *F = matrixOf(f), *original = originalOf(f);
    for (int p = from; p < to; ++p) {
        int best = p;
        const auto diagonal = [&](int i) { return std::abs(F[size_t(i) * size_t(rows + 1)]); };
        if (!(original[p] > 0 && diagonal(p) > GoodPivot * original[p])) {
            // Rows that began without a diagonal wait for the others, which fill it.
            if (!(*std::max_element(original + p, original + to) > 0))
                for (int i = p; i < to; ++i) original[i] = diagonal(i);
            double largest = -1;
            for (int i = p; i < to; ++i) {
                const double relative = original[i] > 0 ? diagonal(i) / original[i] : 0;
                if (relative > largest) largest = relative, best = i;
            }
        }
        if (best != p) swapPivots(f, p, best);
        double* column = F + size_t(p) * size_t(rows);
        const double pivot = column[p];
        const size_t place = size_t(front.firstPivot + p);
        m_isRedundant[place] = !(std::abs(pivot) > RankThreshold * original[p]);
        if (m_isRedundant[place]) {
            m_inversePivots[place] = 0;
            std::fill(column + p, column + rows, 0.0);
            continue;
        }
        const double inverse = 1 / pivot;
        m_inversePivots[place] = inverse;
        if (m_isSymmetric) {
            for (int j = p + 1; j < lastColumn; ++j) {
                const double factor = column[j] * inverse;
                double* target = F + size_t(j) * size_t(rows);
#pragma GCC ivdep
                for (int i = j; i < rows; ++i) target[i] -= column[i] * factor;
            }
            for (int i = p + 1; i < rows; ++i) column[i] *= inverse;
        } else {
            for (int i = p + 1; i < rows; ++i) column[i] *= inverse;
            for (int j = p + 1; j < lastColumn; ++j) {
                double* target = F + size_t(j) * size_t(rows);
                const double factor = target[p];
#pragma GCC ivdep
                for (int i = p + 1; i < rows; ++i) target[i] -= column[i] * factor;
            }
        }
    }
}

void FrontSolver::updateTrailing(int f, int from, int to) {
    const FrontTree::Front& front = m_tree.fronts()[size_t(f)];
    const int rows = front.numRows(), width = to - from, rest = rows - to;
    if (rest == 0) return;
    StridedMatrix F(matrixOf(f), rows, rows, Eigen::OuterStride<>(rows));
    const auto L = F.block(to, from, rest, width);
    if (!m_isSymmetric) {
        // Rows of U to the right of the panel are still to be solved for.
        auto U = F.block(from, to, width, rest);
        F.block(from, from, width, width).triangularView<Eigen::UnitLower>().solveInPlace(U);
        F.block(to, to, rest, rest).noalias() -= L * U;
        return;
    }
    thread_local Eigen::Matrix<double, Eigen::Dynamic, PanelWidth> storage;  // L·D, kept for reuse
    if (storage.rows() < rest) storage.resize(rest, PanelWidth);
    auto scaled = storage.topLeftCorner(rest, width);
    for (int k = 0; k < width; ++k) {
        const double inverse = m_inversePivots[size_t(front.firstPivot + from + k)];
        if (inverse == 0)
            scaled.col(k).setZero();
        else
            scaled.col(k) = L.col(k) / inverse;
    }
    F.block(to, to, rest, rest).triangularView<Eigen::Lower>() -= L * scaled.transpose();
}

//--------------------------------------------------------------------------------------------------
// solution

void FrontSolver::forwardFront(int f) {
    const FrontTree::Front& front = m_tree.fronts()[size_t(f)];
    const int rows = front.numRows(), k = front.numPivots;
    const double* F = matrixOf(f);
    double* v = vectorOf(f);
    const int* order = m_pivotOrder.data() + front.firstPivot;
    // Children's parts first, in the front's own order; then the pivots' permutation.
    double* whole = m_x.data() + front.firstPivot;
    std::fill(v + k, v + rows, 0.0);
    for (int c : front.children) {
        const FrontTree::Front& child = m_tree.fronts()[size_t(c)];
        const double* from = vectorOf(c) + child.numPivots;
        for (size_t i = 0; i < child.parentRows.size(); ++i) {
            const int at = child.parentRows[i];
            (at < k ? whole[at] : v[at]) += from[i];
        }
    }
    for (int p = 0; p < k; ++p) v[p] = whole[order[p]];
    for (int p = 0; p < k; ++p) {
        const double* column = F + size_t(p) * size_t(rows);
        const double value = v[p];
#pragma GCC ivdep
        for (int i = p + 1; i < rows; ++i) v[i] -= column[i] * value;
    }
}

void FrontSolver::backwardFront(int f, double* x) {
    // In: v[0…k) holds L⁻¹b, or D times a null vector's start; x of the border is known.
    const FrontTree::Front& front = m_tree.fronts()[size_t(f)];
    const int rows = front.numRows(), k = front.numPivots;
    const double* F = matrixOf(f);
    double* v = vectorOf(f);
    for (size_t i = 0; i < front.border.size(); ++i) v[size_t(k) + i] = x[front.border[i]];
    const double* inverse = m_inversePivots.data() + front.firstPivot;
    for (int p = k - 1; p >= 0; --p) {
        if (m_isSymmetric) {
            const double* column = F + size_t(p) * size_t(rows);
            v[p] = v[p] * inverse[p] - dot(column + p + 1, v + p + 1, rows - p - 1);
        } else {
            double sum = 0;
            for (int j = p + 1; j < rows; ++j) sum += F[p + size_t(j) * size_t(rows)] * v[j];
            v[p] = (v[p] - sum) * inverse[p];
        }
    }
    const int* order = m_pivotOrder.data() + front.firstPivot;
    for (int p = 0; p < k; ++p) x[front.firstPivot + order[p]] = v[p];
}

void FrontSolver::solve(double* x, int threads) {
    for (size_t i = 0; i < m_x.size(); ++i) m_x[i] = x[m_unknownAt[i]];
    if (!m_redundant.empty()) projectOffNullSpace(m_x.data());
    visitUpwards(threads, [&](int f) { forwardFront(f); });
    visitDownwards(threads, [&](int f) { backwardFront(f, m_x.data()); });
    if (!m_redundant.empty()) projectOffNullSpace(m_x.data());
    for (size_t i = 0; i < m_x.size(); ++i) x[m_unknownAt[i]] = m_x[i];
}

//--------------------------------------------------------------------------------------------------
// redundancy

void FrontSolver::findNullVectors() {
    m_redundant.clear();
    if (std::find(m_isRedundant.begin(), m_isRedundant.end(), 1) == m_isRedundant.end()) return;
    m_nullVectors.clear();
    std::vector<double> x(m_x.size(), 0.0);
    for (int f = 0; f < int(m_tree.fronts().size()); ++f) {
        const FrontTree::Front& front = m_tree.fronts()[size_t(f)];
        for (int p = 0; p < front.numPivots; ++p) {
            if (!m_isRedundant[size_t(front.firstPivot + p)]) continue;
            const int row = front.firstPivot + m_pivotOrder[size_t(front.firstPivot + p)];
            m_redundant.push_back(m_unknownAt[size_t(row)]);

            // Back substitution from 1 at the pivot set aside; only its subtree is touched.
            NullVector null;
            null.first = m_tree.fronts()[size_t(front.firstDescendant)].firstPivot;
            double* inverse = m_inversePivots.data() + front.firstPivot;
            for (int g = f; g >= front.firstDescendant; --g) {
                double* v = vectorOf(g);
                std::fill_n(v, m_tree.fronts()[size_t(g)].numPivots, 0.0);
                if (g != f) {
                    backwardFront(g, x.data());
                    continue;
                }
                v[p] = 1;
                inverse[p] = 1;
                // Border and later pivots are zero: with them zero, 1 stays 1.
                backwardFront(g, x.data());
                inverse[p] = 0;
            }
            null.entries.assign(x.begin() + null.first,
                                x.begin() + front.firstPivot + front.numPivots);
            std::fill(x.begin() + null.first, x.begin() + front.firstPivot + front.numPivots, 0.0);
            m_nullVectors.push_back(std::move(null));
        }
    }
    std::vector<Eigen::Triplet<double>> entries;
    for (size_t k = 0; k < m_nullVectors.size(); ++k) {
        double largest = 0;
        for (double value : m_nullVectors[k].entries) largest = std::max(largest, std::abs(value));
        for (size_t i = 0; i < m_nullVectors[k].entries.size(); ++i) {
            const double value = m_nullVectors[k].entries[i] / largest;
            if (std::abs(value) > 1e-14)
                entries.emplace_back(m_nullVectors[k].first + int(i), int(k), value);
        }
    }
    m_nullSpace.resize(int(m_x.size()), int(m_nullVectors.size()));
    m_nullSpace.setFromTriplets(entries.begin(), entries.end());
    m_gram.compute(Eigen::SparseMatrix<double>(m_nullSpace.transpose() * m_nullSpace));
}

void FrontSolver::projectOffNullSpace(double* x) const {
    Map<VectorXd> vector(x, Eigen::Index(m_x.size()));
    const VectorXd weights = m_gram.solve(m_nullSpace.transpose() * vector);
    vector -= m_nullSpace * weights;
}

std::vector<int> FrontSolver::findInvolvedUnknowns(int k) const {
    std::vector<int> involved;
    for (Eigen::SparseMatrix<double>::InnerIterator entry(m_nullSpace, k); entry; ++entry)
        if (std::abs(entry.value()) > 1e-6) involved.push_back(m_unknownAt[size_t(entry.row())]);
    std::sort(involved.begin(), involved.end());
    return involved;
}

}  // namespace simflex
