#include "SupernodalSolve.h"

#include <omp.h>

#include <algorithm>

namespace simflex {
namespace {

using Index = std::int64_t;

constexpr int Panel = 8;                       // columns whose right-hand sides stay in registers
constexpr int SharedColumns = 64;              // columns of a large supernode between two barriers
constexpr Index WorthSharing = 65536;          // entries worth waking threads for
constexpr Index FactorWorthThreads = 1000000;  // entries of the whole factor worth using threads
                                               // for
constexpr Index RowsPerShare = 256;
constexpr double Subtrees = 24;  // the largest subtree has at most 1/Subtrees of all entries

using Row = Chunk;
using Buffer = std::vector<Row>;

/** y_r ← y_r − Σ_c L_rc x_c for the rows of a panel of `Columns` columns. **/
template <int Columns>
inline void subtractProduct(const double* L, Index stride, Index numRows, const Row* x, Row* y) {
    Row held[Columns];
#pragma GCC unroll 8
    for (int c = 0; c < Columns; ++c) held[c] = x[c];
    for (Index r = 0; r < numRows; ++r) {
        Row sum = y[r];
#pragma GCC unroll 8
        for (int c = 0; c < Columns; ++c) sum -= L[r + c * stride] * held[c];
        y[r] = sum;
    }
}

inline void subtractProduct(const double* L, Index stride, Index numRows, int numColumns,
                            const Row* x, Row* y) {
    int c = 0;
    for (; c + Panel <= numColumns; c += Panel)
        subtractProduct<Panel>(L + c * stride, stride, numRows, x + c, y);
    for (; c + 3 <= numColumns; c += 3)
        subtractProduct<3>(L + c * stride, stride, numRows, x + c, y);
    for (; c < numColumns; ++c) subtractProduct<1>(L + c * stride, stride, numRows, x + c, y);
}

/** x_c ← x_c − Σ_r L_rc y_r. **/
template <int Columns>
inline void subtractTransposed(const double* L, Index stride, Index numRows, const Row* y, Row* x) {
    Row sum[Columns];
#pragma GCC unroll 8
    for (int c = 0; c < Columns; ++c) sum[c] = x[c];
    for (Index r = 0; r < numRows; ++r) {
        const Row value = y[r];
#pragma GCC unroll 8
        for (int c = 0; c < Columns; ++c) sum[c] -= L[r + c * stride] * value;
    }
#pragma GCC unroll 8
    for (int c = 0; c < Columns; ++c) x[c] = sum[c];
}

inline void subtractTransposed(const double* L, Index stride, Index numRows, int numColumns,
                               const Row* y, Row* x) {
    int c = 0;
    for (; c + Panel <= numColumns; c += Panel)
        subtractTransposed<Panel>(L + c * stride, stride, numRows, y, x + c);
    for (; c + 3 <= numColumns; c += 3)
        subtractTransposed<3>(L + c * stride, stride, numRows, y, x + c);
    for (; c < numColumns; ++c) subtractTransposed<1>(L + c * stride, stride, numRows, y, x + c);
}

/** x ← L⁻¹ x with the triangle of `size` columns. **/
inline void solveTriangle(const double* L, Index stride, int size, Row* x) {
    for (int first = 0; first < size; first += Panel) {
        const int end = std::min(first + Panel, size);
        for (int c = first; c < end; ++c) {
            const double* column = L + c * stride;
            x[c] = x[c] / column[c];
            for (int r = c + 1; r < end; ++r) x[r] -= column[r] * x[c];
        }
        subtractProduct(L + first * stride + end, stride, size - end, end - first, x + first,
                        x + end);
    }
}

/** x ← L⁻ᵀ x with the triangle of `size` columns. **/
inline void solveTransposedTriangle(const double* L, Index stride, int size, Row* x) {
    for (int first = (size - 1) / Panel * Panel; first >= 0; first -= Panel) {
        const int end = std::min(first + Panel, size);
        subtractTransposed(L + first * stride + end, stride, size - end, end - first, x + end,
                           x + first);
        for (int c = end - 1; c >= first; --c) {
            const double* column = L + c * stride;
            for (int r = c + 1; r < end; ++r) x[c] -= column[r] * x[r];
            x[c] = x[c] / column[c];
        }
    }
}

}  // namespace

struct SupernodalSolve::Subtree {
    Index first = 0, root = 0;  // range of its supernodes
    Buffer above;               // sums for the rows above it
};

struct SupernodalSolve::Workspace {
    Buffer shared;  // rows below a top-level supernode
};

SupernodalSolve::SupernodalSolve(const SupernodalFactor& L)
    : m_L(L), m_work(std::make_unique<Workspace>()) {
    findSubtrees();
    for (Index s = 0; s < L.numSupernodes; ++s)
        m_mostRows = std::max<Index>(m_mostRows, numRowsOf(s));
    m_work->shared.resize(size_t(m_mostRows));
    m_shared = L.valueStarts[L.numSupernodes] >= FactorWorthThreads;
}

SupernodalSolve::~SupernodalSolve() = default;

void SupernodalSolve::findSubtrees() {
    const Index n = m_L.numSupernodes;
    std::vector<double> entries(static_cast<size_t>(n));
    for (Index s = 0; s < n; ++s) entries[s] = double(numRowsOf(s)) * numColumnsOf(s);
    TreeShares shares(m_L, std::move(entries), Subtrees);
    m_top = std::move(shares.top);
    for (const TreeShares::Subtree& share : shares.subtrees)
        m_subtrees.push_back({share.first, share.root,
                              Buffer(size_t(numRowsOf(share.root) - numColumnsOf(share.root)))});

    m_rows.assign(m_L.rows, m_L.rows + m_L.rowStarts[n]);
    for (const Subtree& subtree : m_subtrees) {
        // The rows above the subtree are the rows below its root.
        const Index* above = m_L.rows + m_L.rowStarts[subtree.root] + numColumnsOf(subtree.root);
        const Index* end = m_L.rows + m_L.rowStarts[subtree.root + 1];
        const Index limit = m_L.super[subtree.root + 1];
        for (Index s = subtree.first; s <= subtree.root; ++s) {
            const Index* at = above;
            for (Index k = m_L.rowStarts[s] + numColumnsOf(s); k < m_L.rowStarts[s + 1]; ++k) {
                if (m_L.rows[k] < limit) continue;
                at = std::lower_bound(at, end, m_L.rows[k]);
                m_rows[k] = std::int32_t(-1 - (at - above));
            }
        }
    }
}

void SupernodalSolve::solveLower(Row* x) {
    std::vector<Buffer> buffers(size_t(m_shared ? omp_get_max_threads() : 1),
                                Buffer(size_t(m_mostRows)));
#pragma omp parallel for schedule(dynamic, 1) if (m_shared)
    for (size_t t = 0; t < m_subtrees.size(); ++t) {
        Buffer& below = buffers[size_t(omp_get_thread_num())];
        Subtree& subtree = m_subtrees[t];
        std::fill(subtree.above.begin(), subtree.above.end(), Row{});
        for (Index s = subtree.first; s <= subtree.root; ++s) {
            const int numColumns = numColumnsOf(s), numBelow = numRowsOf(s) - numColumns;
            const Index stride = numRowsOf(s);
            const double* L = m_L.values + m_L.valueStarts[s];
            Row* own = x + m_L.super[s];
            solveTriangle(L, stride, numColumns, own);
            std::fill_n(below.begin(), numBelow, Row{});
            subtractProduct(L + numColumns, stride, numBelow, numColumns, own, below.data());
            const std::int32_t* rows = m_rows.data() + m_L.rowStarts[s] + numColumns;
            for (int r = 0; r < numBelow; ++r)
                if (rows[r] >= 0)
                    x[rows[r]] += below[size_t(r)];
                else
                    subtree.above[size_t(-1 - rows[r])] += below[size_t(r)];
        }
    }
    for (const Subtree& subtree : m_subtrees) {
        const Index* rows = m_L.rows + m_L.rowStarts[subtree.root] + numColumnsOf(subtree.root);
        for (size_t r = 0; r < subtree.above.size(); ++r) x[rows[r]] += subtree.above[r];
    }
    Row* below = m_work->shared.data();
    for (const Index s : m_top) {
        const int numColumns = numColumnsOf(s);
        const Index stride = numRowsOf(s), numBelow = stride - numColumns;
        const double* L = m_L.values + m_L.valueStarts[s];
        Row* own = x + m_L.super[s];
        std::fill_n(below, numBelow, Row{});
        for (int first = 0; first < numColumns; first += SharedColumns) {
            const int width = std::min(SharedColumns, numColumns - first), end = first + width;
            const double* panel = L + first * stride;
            solveTriangle(panel + first, stride, width, own + first);
            const Index numInside = numColumns - end;  // rows that are columns of this supernode
            const Index numShares = (stride - end + RowsPerShare - 1) / RowsPerShare;
#pragma omp parallel for schedule(static) if (m_shared && stride * width >= WorthSharing)
            for (Index share = 0; share < numShares; ++share) {
                const Index begin = share * RowsPerShare,
                            stop = std::min(begin + RowsPerShare, stride - end);
                const Index middle = std::clamp(numInside, begin, stop);
                subtractProduct(panel + end + begin, stride, middle - begin, width, own + first,
                                own + end + begin);
                subtractProduct(panel + end + middle, stride, stop - middle, width, own + first,
                                below + (middle - numInside));
            }
        }
        const Index* rows = m_L.rows + m_L.rowStarts[s] + numColumns;
        for (Index r = 0; r < numBelow; ++r) x[rows[r]] += below[r];
    }
}

void SupernodalSolve::solveUpper(Row* x) {
    Row* below = m_work->shared.data();
    for (auto at = m_top.rbegin(); at != m_top.rend(); ++at) {
        const Index s = *at;
        const int numColumns = numColumnsOf(s);
        const Index stride = numRowsOf(s), numBelow = stride - numColumns;
        const double* L = m_L.values + m_L.valueStarts[s];
        Row* own = x + m_L.super[s];
        const Index* rows = m_L.rows + m_L.rowStarts[s] + numColumns;
        for (Index r = 0; r < numBelow; ++r) below[r] = x[rows[r]];
        for (int first = (numColumns - 1) / SharedColumns * SharedColumns; first >= 0;
             first -= SharedColumns) {
            const int width = std::min(SharedColumns, numColumns - first), end = first + width;
            const double* panel = L + first * stride;
            const int numPanels = (width + Panel - 1) / Panel;
#pragma omp parallel for schedule(static) if (m_shared && stride * width >= WorthSharing)
            for (int k = 0; k < numPanels; ++k) {
                const int column = k * Panel, columns = std::min(Panel, width - column);
                const double* part = panel + column * stride;
                subtractTransposed(part + end, stride, numColumns - end, columns, own + end,
                                   own + first + column);
                subtractTransposed(part + numColumns, stride, numBelow, columns, below,
                                   own + first + column);
            }
            solveTransposedTriangle(panel + first, stride, width, own + first);
        }
    }
    std::vector<Buffer> buffers(size_t(m_shared ? omp_get_max_threads() : 1),
                                Buffer(size_t(m_mostRows)));
#pragma omp parallel for schedule(dynamic, 1) if (m_shared)
    for (size_t t = 0; t < m_subtrees.size(); ++t) {
        Buffer& gathered = buffers[size_t(omp_get_thread_num())];
        const Subtree& subtree = m_subtrees[t];
        for (Index s = subtree.root; s >= subtree.first; --s) {
            const int numColumns = numColumnsOf(s), numBelow = numRowsOf(s) - numColumns;
            const Index stride = numRowsOf(s);
            const double* L = m_L.values + m_L.valueStarts[s];
            Row* own = x + m_L.super[s];
            const Index* rows = m_L.rows + m_L.rowStarts[s] + numColumns;
            for (int r = 0; r < numBelow; ++r) gathered[size_t(r)] = x[rows[r]];
            subtractTransposed(L + numColumns, stride, numBelow, numColumns, gathered.data(), own);
            solveTransposedTriangle(L, stride, numColumns, own);
        }
    }
}

}  // namespace simflex
