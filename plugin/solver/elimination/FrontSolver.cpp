#include "simflex/solver/elimination/FrontSolver.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "simflex/base/Dot.h"
#include "simflex/base/ParallelFor.h"
#include "simflex/solver/elimination/ScalarChunk.h"

namespace simflex {

using Eigen::Map;
using Eigen::VectorXd;

namespace {

constexpr int PanelWidth = 32;
/** A diagonal that kept this part of its initial value is used as pivot without a search. **/
constexpr double GoodPivot = 0.1;

/** Imaginary before real parts of four complex numbers. **/
inline Chunk swapPairs(const Chunk& chunk) {
    return makeChunk(chunk[1], chunk[0], chunk[3], chunk[2], chunk[5], chunk[4], chunk[7],
                     chunk[6]);
}

/** y −= a x. **/
inline void subtract(const double* x, double a, int size, double* y) {
#pragma GCC ivdep
    for (int i = 0; i < size; ++i) y[i] -= x[i] * a;
}
inline void subtract(const Complex* x, const Complex& a, int size, Complex* y) {
    const Chunk re = Chunk{} + a.real(), im = a.imag() * makeChunk(-1, 1, -1, 1, -1, 1, -1, 1);
    const double* from = reinterpret_cast<const double*>(x);
    double* to = reinterpret_cast<double*>(y);
    int i = 0;
    for (; i + 4 <= size; i += 4) {
        const Chunk four = loadChunk(from + 2 * i);
        storeChunk(loadChunk(to + 2 * i) - (four * re + swapPairs(four) * im), to + 2 * i);
    }
    for (; i < size; ++i) {
        to[2 * i] -= from[2 * i] * a.real() - from[2 * i + 1] * a.imag();
        to[2 * i + 1] -= from[2 * i + 1] * a.real() + from[2 * i] * a.imag();
    }
}

/** y = x/a; zero if a is. Not Eigen's, whose last bits depend on addresses for complex numbers. **/
inline void divide(const double* x, double a, int size, double* y) {
    for (int i = 0; i < size; ++i) y[i] = a == 0 ? 0 : x[i] / a;
}
inline void divide(const Complex* x, const Complex& a, int size, Complex* y) {
    const Complex inverse = a == 0.0 ? 0.0 : 1.0 / a;
    for (int i = 0; i < size; ++i) y[i] = x[i] * inverse;
}

/** aᵀb. **/
inline Complex dot(const Complex* a, const Complex* b, int size) {
    Chunk straight{}, crossed{};  // re·re and im·im; re·im and im·re
    const double* from = reinterpret_cast<const double*>(a);
    const double* other = reinterpret_cast<const double*>(b);
    for (int i = 0; i < 2 * size; i += ChunkSize) {
        const int count = std::min(2 * size - i, ChunkSize);
        const Chunk four = loadChunk(from + i, count), otherFour = loadChunk(other + i, count);
        straight += four * otherFour;
        crossed += four * swapPairs(otherFour);
    }
    return {sumChunk(straight * makeChunk(1, -1, 1, -1, 1, -1, 1, -1)), sumChunk(crossed)};
}

}  // namespace

template <class Scalar>
FrontSolver<Scalar>::FrontSolver(const CliquePattern& pattern) : m_tree(pattern) {
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

template <class Scalar>
template <class Visit>
void FrontSolver<Scalar>::visitUpwards(int threads, Visit visit) {
    const std::vector<int>& subtrees = m_tree.subtrees();
    parallelFor(int(subtrees.size()), threads, Schedule::WhoeverIsFree, [&](int s) {
        const int root = subtrees[size_t(s)];
        for (int f = m_tree.fronts()[size_t(root)].firstDescendant; f <= root; ++f) visit(f);
    });
    for (int f : m_tree.frontsAboveSubtrees()) visit(f);
}

template <class Scalar>
template <class Visit>
void FrontSolver<Scalar>::visitDownwards(int threads, Visit visit) {
    const std::vector<int>&top = m_tree.frontsAboveSubtrees(), &subtrees = m_tree.subtrees();
    for (auto f = top.rbegin(); f != top.rend(); ++f) visit(*f);
    parallelFor(int(subtrees.size()), threads, Schedule::WhoeverIsFree, [&](int s) {
        const int root = subtrees[size_t(s)];
        for (int f = root; f >= m_tree.fronts()[size_t(root)].firstDescendant; --f) visit(f);
    });
}

//--------------------------------------------------------------------------------------------------
// factorization

template <class Scalar>
void FrontSolver<Scalar>::factor(const std::vector<const Scalar*>& values, int threads) {
    visitUpwards(threads, [&](int f) { factorFront(f, values); });
    findNullVectors();
}

template <class Scalar>
void FrontSolver<Scalar>::assembleFront(int f, const std::vector<const Scalar*>& values) {
    const FrontTree::Front& front = m_tree.fronts()[size_t(f)];
    const int rows = front.numRows();
    Scalar* F = matrixOf(f);
    double* original = originalOf(f);
    std::fill_n(F, size_t(rows) * size_t(rows), Scalar(0));
    std::fill_n(original, rows, 0.0);

    for (const FrontTree::Contribution& contribution : front.contributions) {
        const Scalar* column = values[size_t(contribution.clique)];
        if (!column) continue;
        const std::vector<int>& at = contribution.positions;
        const size_t size = at.size();
        for (size_t j = 0; j < size; ++j, column += size) {
            Scalar* target = F + size_t(at[j]) * size_t(rows);
            for (size_t i = 0; i < size; ++i)
                if (!m_isSymmetric || at[i] >= at[j]) target[at[i]] += column[i];
            original[at[j]] += magnitude(column[j]);
        }
    }
    for (int c : front.children) {
        const FrontTree::Front& child = m_tree.fronts()[size_t(c)];
        const int childRows = child.numRows(), k = child.numPivots;
        const int border = childRows - k;
        const Scalar* C = matrixOf(c);
        const double* childOriginal = originalOf(c) + k;
        const int* at = child.parentRows.data();
        for (int j = 0; j < border; ++j) {
            const Scalar* column = C + size_t(k + j) * size_t(childRows) + k;
            Scalar* target = F + size_t(at[j]) * size_t(rows);
            // Both borders ascend: the lower triangle stays the lower one.
            for (int i = m_isSymmetric ? j : 0; i < border; ++i) target[at[i]] += column[i];
            original[at[j]] += childOriginal[j];
        }
    }
}

template <class Scalar>
void FrontSolver<Scalar>::factorFront(int f, const std::vector<const Scalar*>& values) {
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

template <class Scalar>
void FrontSolver<Scalar>::swapPivots(int f, int p, int q) {
    const FrontTree::Front& front = m_tree.fronts()[size_t(f)];
    const int rows = front.numRows();
    Scalar* F = matrixOf(f);
    double* original = originalOf(f);
    const auto at = [&](int i, int j) -> Scalar& { return F[i + size_t(j) * size_t(rows)]; };
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

template <class Scalar>
void FrontSolver<Scalar>::eliminate(int f, int from, int to) {
    const FrontTree::Front& front = m_tree.fronts()[size_t(f)];
    const int rows = front.numRows();
    // A small front is updated as a whole, a large one within the panel.
    const int lastColumn = rows <= 2 * PanelWidth ? rows : to;
    Scalar* F = matrixOf(f);
    double* original = originalOf(f);
    for (int p = from; p < to; ++p) {
        int best = p;
        const auto diagonal = [&](int i) { return magnitude(F[size_t(i) * size_t(rows + 1)]); };
        if (!(original[p] > 0 && diagonal(p) > GoodPivot * original[p])) {
            // Rows that began without a diagonal wait until the others fill it.
            if (!(*std::max_element(original + p, original + to) > 0))
                for (int i = p; i < to; ++i) original[i] = diagonal(i);
            double largest = -1;
            for (int i = p; i < to; ++i) {
                const double relative = original[i] > 0 ? diagonal(i) / original[i] : 0;
                if (relative > largest) largest = relative, best = i;
            }
        }
        if (best != p) swapPivots(f, p, best);
        Scalar* column = F + size_t(p) * size_t(rows);
        const Scalar pivot = column[p];
        const size_t place = size_t(front.firstPivot + p);
        m_isRedundant[place] = !(magnitude(pivot) > RankThreshold * original[p]);
        if (m_isRedundant[place]) {
            m_inversePivots[place] = 0;
            std::fill(column + p, column + rows, Scalar(0));
            continue;
        }
        const Scalar inverse = 1.0 / pivot;
        m_inversePivots[place] = inverse;
        if (m_isSymmetric) {
            for (int j = p + 1; j < lastColumn; ++j) {
                const Scalar factor = column[j] * inverse;
                Scalar* target = F + size_t(j) * size_t(rows);
                subtract(column + j, factor, rows - j, target + j);
            }
            for (int i = p + 1; i < rows; ++i) column[i] *= inverse;
        } else {
            for (int i = p + 1; i < rows; ++i) column[i] *= inverse;
            for (int j = p + 1; j < lastColumn; ++j) {
                Scalar* target = F + size_t(j) * size_t(rows);
                const Scalar factor = target[p];
                subtract(column + p + 1, factor, rows - p - 1, target + p + 1);
            }
        }
    }
}

template <class Scalar>
void FrontSolver<Scalar>::updateTrailing(int f, int from, int to) {
    const FrontTree::Front& front = m_tree.fronts()[size_t(f)];
    const int rows = front.numRows(), width = to - from, rest = rows - to;
    if (rest == 0) return;
    Map<Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>, 0, Eigen::OuterStride<>> F(
        matrixOf(f), rows, rows, Eigen::OuterStride<>(rows));
    const auto L = F.block(to, from, rest, width);
    if (!m_isSymmetric) {
        // Rows of U to the right of the panel are still to be solved for.
        auto U = F.block(from, to, width, rest);
        F.block(from, from, width, width)
            .template triangularView<Eigen::UnitLower>()
            .solveInPlace(U);
        F.block(to, to, rest, rest).noalias() -= L * U;
        return;
    }
    thread_local Eigen::Matrix<Scalar, Eigen::Dynamic, PanelWidth> storage;  // L·D, kept for reuse
    if (storage.rows() < rest) storage.resize(rest, PanelWidth);
    auto scaled = storage.topLeftCorner(rest, width);
    for (int k = 0; k < width; ++k) {
        const Scalar inverse = m_inversePivots[size_t(front.firstPivot + from + k)];
        divide(L.col(k).data(), inverse, rest, scaled.col(k).data());
    }
    F.block(to, to, rest, rest).template triangularView<Eigen::Lower>() -= L * scaled.transpose();
}

//--------------------------------------------------------------------------------------------------
// solution

template <class Scalar>
void FrontSolver<Scalar>::forwardFront(int f) {
    const FrontTree::Front& front = m_tree.fronts()[size_t(f)];
    const int rows = front.numRows(), k = front.numPivots;
    const Scalar* F = matrixOf(f);
    Scalar* v = vectorOf(f);
    const int* order = m_pivotOrder.data() + front.firstPivot;
    // Children's parts first, in the front's own order; then the pivots' permutation.
    Scalar* whole = m_x.data() + front.firstPivot;
    std::fill(v + k, v + rows, Scalar(0));
    for (int c : front.children) {
        const FrontTree::Front& child = m_tree.fronts()[size_t(c)];
        const Scalar* from = vectorOf(c) + child.numPivots;
        for (size_t i = 0; i < child.parentRows.size(); ++i) {
            const int at = child.parentRows[i];
            (at < k ? whole[at] : v[at]) += from[i];
        }
    }
    for (int p = 0; p < k; ++p) v[p] = whole[order[p]];
    for (int p = 0; p < k; ++p) {
        const Scalar* column = F + size_t(p) * size_t(rows);
        subtract(column + p + 1, Scalar(v[p]), rows - p - 1, v + p + 1);
    }
}

template <class Scalar>
void FrontSolver<Scalar>::backwardFront(int f, Scalar* x) {
    // In: v[0…k) holds L⁻¹b, or D times a null vector's start; x of the border is known.
    const FrontTree::Front& front = m_tree.fronts()[size_t(f)];
    const int rows = front.numRows(), k = front.numPivots;
    const Scalar* F = matrixOf(f);
    Scalar* v = vectorOf(f);
    for (size_t i = 0; i < front.border.size(); ++i) v[size_t(k) + i] = x[front.border[i]];
    const Scalar* inverse = m_inversePivots.data() + front.firstPivot;
    for (int p = k - 1; p >= 0; --p) {
        if (m_isSymmetric) {
            const Scalar* column = F + size_t(p) * size_t(rows);
            v[p] = v[p] * inverse[p] - dot(column + p + 1, v + p + 1, rows - p - 1);
        } else {
            Scalar sum = 0;
            for (int j = p + 1; j < rows; ++j) sum += F[p + size_t(j) * size_t(rows)] * v[j];
            v[p] = (v[p] - sum) * inverse[p];
        }
    }
    const int* order = m_pivotOrder.data() + front.firstPivot;
    for (int p = 0; p < k; ++p) x[front.firstPivot + order[p]] = v[p];
}

template <class Scalar>
void FrontSolver<Scalar>::solve(Scalar* x, int threads) {
    for (size_t i = 0; i < m_x.size(); ++i) m_x[i] = x[m_unknownAt[i]];
    if (!m_redundant.empty()) projectOffNullSpace(m_x.data());
    visitUpwards(threads, [&](int f) { forwardFront(f); });
    visitDownwards(threads, [&](int f) { backwardFront(f, m_x.data()); });
    if (!m_redundant.empty()) projectOffNullSpace(m_x.data());
    for (size_t i = 0; i < m_x.size(); ++i) x[m_unknownAt[i]] = m_x[i];
}

template <class Scalar>
void FrontSolver<Scalar>::forwardWide(int f) {
    const FrontTree::Front& front = m_tree.fronts()[size_t(f)];
    const int rows = front.numRows(), k = front.numPivots;
    const Scalar* F = matrixOf(f);
    Wide* v = m_wideVectors.data() + m_vectorOffsets[size_t(f)];
    Wide* whole = m_wideX.data() + front.firstPivot;
    std::fill(v + k, v + rows, Wide());
    for (int c : front.children) {
        const FrontTree::Front& child = m_tree.fronts()[size_t(c)];
        const Wide* from = m_wideVectors.data() + m_vectorOffsets[size_t(c)] + child.numPivots;
        for (size_t i = 0; i < child.parentRows.size(); ++i) {
            const int at = child.parentRows[i];
            (at < k ? whole[at] : v[at]).values += from[i].values;
        }
    }
    const int* order = m_pivotOrder.data() + front.firstPivot;
    for (int p = 0; p < k; ++p) v[p] = whole[order[p]];
    for (int p = 0; p < k; ++p) {
        const Scalar* column = F + size_t(p) * size_t(rows);
        const ChunkOf<Scalar> own = v[p].values;
        for (int i = p + 1; i < rows; ++i) v[i].values -= own * column[i];
    }
}

template <class Scalar>
void FrontSolver<Scalar>::backwardWide(int f) {
    const FrontTree::Front& front = m_tree.fronts()[size_t(f)];
    const int rows = front.numRows(), k = front.numPivots;
    const Scalar* F = matrixOf(f);
    Wide *v = m_wideVectors.data() + m_vectorOffsets[size_t(f)], *x = m_wideX.data();
    for (size_t i = 0; i < front.border.size(); ++i) v[size_t(k) + i] = x[front.border[i]];
    const Scalar* inverse = m_inversePivots.data() + front.firstPivot;
    for (int p = k - 1; p >= 0; --p) {
        ChunkOf<Scalar> sum{};
        if (m_isSymmetric) {
            const Scalar* column = F + size_t(p) * size_t(rows);
            for (int i = p + 1; i < rows; ++i) sum += v[i].values * column[i];
            v[p].values = v[p].values * inverse[p] - sum;
        } else {
            for (int j = p + 1; j < rows; ++j) sum += v[j].values * F[p + size_t(j) * size_t(rows)];
            v[p].values = (v[p].values - sum) * inverse[p];
        }
    }
    const int* order = m_pivotOrder.data() + front.firstPivot;
    for (int p = 0; p < k; ++p) x[front.firstPivot + order[p]] = v[p];
}

template <class Scalar>
void FrontSolver<Scalar>::solve(Scalar* x, int count, int threads) {
    const size_t n = m_x.size();
    if (count == 1 || !m_redundant.empty()) {
        for (int k = 0; k < count; ++k) solve(x + size_t(k) * n, threads);
        return;
    }
    m_wideX.resize(n);
    m_wideVectors.resize(m_vectors.size());
    for (int first = 0; first < count; first += ChunkSize) {
        const int width = std::min(count - first, ChunkSize);
        Scalar* columns = x + size_t(first) * n;
        parallelRanges(int(n), threads, [&](int begin, int end) {
            Scalar row[ChunkSize] = {};
            for (int i = begin; i < end; ++i) {
                const Scalar* from = columns + m_unknownAt[size_t(i)];
                for (int k = 0; k < width; ++k) row[k] = from[size_t(k) * n];
                m_wideX[size_t(i)].values = loadChunk(row, ChunkSize);
            }
        });
        visitUpwards(threads, [&](int f) { forwardWide(f); });
        visitDownwards(threads, [&](int f) { backwardWide(f); });
        parallelRanges(int(n), threads, [&](int begin, int end) {
            Scalar row[ChunkSize];
            for (int i = begin; i < end; ++i) {
                storeChunk(m_wideX[size_t(i)].values, row, ChunkSize);
                Scalar* to = columns + m_unknownAt[size_t(i)];
                for (int k = 0; k < width; ++k) to[size_t(k) * n] = row[k];
            }
        });
    }
}

template <>
int FrontSolver<double>::countNegativePivots() const {
    return int(std::count_if(m_inversePivots.begin(), m_inversePivots.end(),
                             [](double inverse) { return inverse < 0; }));
}

//--------------------------------------------------------------------------------------------------
// redundancy

template <class Scalar>
void FrontSolver<Scalar>::findNullVectors() {
    m_redundant.clear();
    if (std::find(m_isRedundant.begin(), m_isRedundant.end(), 1) == m_isRedundant.end()) return;
    m_nullVectors.clear();
    std::vector<Scalar> x(m_x.size(), 0.0);
    for (int f = 0; f < int(m_tree.fronts().size()); ++f) {
        const FrontTree::Front& front = m_tree.fronts()[size_t(f)];
        for (int p = 0; p < front.numPivots; ++p) {
            if (!m_isRedundant[size_t(front.firstPivot + p)]) continue;
            const int row = front.firstPivot + m_pivotOrder[size_t(front.firstPivot + p)];
            m_redundant.push_back(m_unknownAt[size_t(row)]);

            // Back substitution from 1 at the pivot set aside; only its subtree is touched.
            NullVector null;
            null.first = m_tree.fronts()[size_t(front.firstDescendant)].firstPivot;
            Scalar* inverse = m_inversePivots.data() + front.firstPivot;
            for (int g = f; g >= front.firstDescendant; --g) {
                Scalar* v = vectorOf(g);
                std::fill_n(v, m_tree.fronts()[size_t(g)].numPivots, Scalar(0));
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
            const auto begin = x.begin() + null.first;
            const auto end = x.begin() + front.firstPivot + front.numPivots;
            std::transform(begin, end, std::back_inserter(null.entries),
                           [](const Scalar& entry) { return std::real(entry); });
            std::fill(begin, end, Scalar(0));
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

template <class Scalar>
void FrontSolver<Scalar>::projectOffNullSpace(Scalar* x) const {
    constexpr int parts = sizeof(Scalar) / sizeof(double);
    for (int part = 0; part < parts; ++part) {
        Map<VectorXd, 0, Eigen::InnerStride<parts>> vector(reinterpret_cast<double*>(x) + part,
                                                           Eigen::Index(m_x.size()));
        const VectorXd weights = m_gram.solve(m_nullSpace.transpose() * vector);
        vector -= m_nullSpace * weights;
    }
}

template <class Scalar>
std::vector<int> FrontSolver<Scalar>::findInvolvedUnknowns(int k) const {
    std::vector<int> involved;
    for (Eigen::SparseMatrix<double>::InnerIterator entry(m_nullSpace, k); entry; ++entry)
        if (std::abs(entry.value()) > 1e-6) involved.push_back(m_unknownAt[size_t(entry.row())]);
    std::sort(involved.begin(), involved.end());
    return involved;
}

template class FrontSolver<double>;
template class FrontSolver<Complex>;

}  // namespace simflex
