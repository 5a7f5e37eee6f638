#include "SupernodalFactorization.h"

#include <sys/mman.h>

#include <algorithm>
#include <memory>
#include <stdexcept>

#include "OneBlasThread.h"
#include "simflex/base/ParallelFor.h"

extern "C" {
void dsyrk_(const char* uplo, const char* trans, const int* n, const int* k, const double* alpha,
            const double* A, const int* lda, const double* beta, double* C, const int* ldc);
void dgemm_(const char* transA, const char* transB, const int* m, const int* n, const int* k,
            const double* alpha, const double* A, const int* lda, const double* B, const int* ldb,
            const double* beta, double* C, const int* ldc);
void dtrsm_(const char* side, const char* uplo, const char* trans, const char* diag, const int* m,
            const int* n, const double* alpha, const double* A, const int* lda, double* B,
            const int* ldb);
void dpotrf_(const char* uplo, const int* n, double* A, const int* lda, int* info);
}

namespace simflex {
namespace {

using Index = std::int64_t;

constexpr int BlockColumns = 256, TileRows = 256;
constexpr double FactorSubtrees = 48;      // a subtree has at most 1/FactorSubtrees of all flops
constexpr double FlopsWorthThreads = 2e7;  // of the whole factor
constexpr double TileFlopsWorthThreads = 1e6;  // of a block of columns

/** OpenBLAS hangs if it cannot allocate this buffer for each calling thread.
@returns a number of threads for which the memory suffices
@throws std::runtime_error if it does not suffice for one **/
int fitMemory(int threads) {
    constexpr size_t Buffer = size_t(128) << 20;
    for (; threads > 0; --threads) {
        const size_t size = Buffer * size_t(threads);
        void* const room = mmap(nullptr, size, PROT_READ | PROT_WRITE,
                                MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
        if (room == MAP_FAILED) continue;
        munmap(room, size);
        return threads;
    }
    throw std::runtime_error("out of memory: factoring the stiffness matrix needs 128 MB for BLAS");
}

/** C ← beta C + alpha A Bᵀ, m×n; only the lower triangle of C if A is B. **/
void addProduct(double alpha, int m, int n, int k, const double* A, const double* B, int stride,
                double beta, double* C, int strideC) {
    if (A == B)
        dsyrk_("L", "N", &n, &k, &alpha, A, &stride, &beta, C, &strideC);
    else
        dgemm_("N", "T", &m, &n, &k, &alpha, A, &stride, B, &stride, &beta, C, &strideC);
}

/** Lower triangle of A in the order of L, by columns. **/
struct OrderedEntries {
    OrderedEntries(const SymmetricMatrix& A, const Index* order) {
        std::vector<std::int32_t> place(size_t(A.size));
        for (int k = 0; k < A.size; ++k) place[size_t(order[k])] = k;
        starts.assign(size_t(A.size) + 1, 0);
        const auto forEach = [&](const auto& visit) {
            for (int column = 0; column < A.size; ++column)
                for (Index k = A.columnStarts[size_t(column)];
                     k < A.columnStarts[size_t(column) + 1]; ++k) {
                    const auto [low, high] =
                        std::minmax(place[size_t(A.rows[size_t(k)])], place[size_t(column)]);
                    visit(low, high, A.values[size_t(k)]);
                }
        };
        forEach([&](int column, int, double) { ++starts[size_t(column) + 1]; });
        for (int k = 0; k < A.size; ++k) starts[size_t(k) + 1] += starts[size_t(k)];
        rows.resize(size_t(A.numEntries()));
        values.resize(size_t(A.numEntries()));
        std::vector<Index> next(starts.begin(), starts.end() - 1);
        forEach([&](int column, int row, double value) {
            const Index at = next[size_t(column)]++;
            rows[size_t(at)] = row;
            values[size_t(at)] = value;
        });
    }
    std::vector<Index> starts;
    std::vector<std::int32_t> rows;
    std::vector<double> values;
};

/** Rows begin…end−1 of an earlier supernode are columns of a later one. **/
struct Descendant {
    std::int32_t supernode, begin, end;
};

struct TileWorkspace {
    explicit TileWorkspace(Index size)
        : places(new std::int32_t[size_t(size)]),
          product(new double[size_t(BlockColumns) * std::max(BlockColumns, TileRows)]) {}
    std::unique_ptr<std::int32_t[]> places;  ///< position of each row of L in a supernode
    std::unique_ptr<double[]> product;
};

class SupernodalFactorization {
public:
    SupernodalFactorization(const SymmetricMatrix& A, const Index* order, const SupernodalFactor& L,
                            double* values)
        : m_L(L), m_values(values), m_entries(A, order) {
        findDescendants();
    }

    Index run(int threads) {
        std::vector<double> flops(size_t(m_L.numSupernodes));
        double total = 0;
        for (Index s = 0; s < m_L.numSupernodes; ++s) {
            const double n = m_L.numColumnsOf(s), below = m_L.numRowsOf(s) - n;
            flops[size_t(s)] = n * n * n / 3 + n * below * (n + below);
            total += flops[size_t(s)];
        }
        threads = chooseNumThreads(threads, total, FlopsWorthThreads);
        const TreeShares shares(m_L, std::move(flops), FactorSubtrees);
        std::vector<Index> failures(shares.subtrees.size(), -1);
        parallelFor(shares.subtrees.size(), threads, Schedule::WhoeverIsFree, [&](size_t t) {
            TileWorkspace work(m_L.size);
            for (Index s = shares.subtrees[t].first; s <= shares.subtrees[t].root; ++s) {
                failures[t] = factorSupernode(s, work, 1);
                if (failures[t] >= 0) return;
            }
        });
        Index failed = -1;
        for (const Index row : failures)
            if (row >= 0 && (failed < 0 || row < failed)) failed = row;
        TileWorkspace work(m_L.size);
        for (size_t k = 0; failed < 0 && k < shares.top.size(); ++k)
            failed = factorSupernode(shares.top[k], work, threads);
        return failed;
    }

private:
    struct Part {  ///< rows first…end−1 of a descendant are columns of a block
        const Descendant* of;
        int first, end;
    };

    void findDescendants() {
        const std::vector<Index> supernodeOf = m_L.findSupernodes();
        const auto forEach = [&](const auto& visit) {
            for (Index d = 0; d < m_L.numSupernodes; ++d) {
                const Index* rows = m_L.rows + m_L.rowStarts[d];
                const int numRows = m_L.numRowsOf(d);
                for (int begin = m_L.numColumnsOf(d), end; begin < numRows; begin = end) {
                    const Index s = supernodeOf[size_t(rows[begin])];
                    for (end = begin + 1; end < numRows && rows[end] < m_L.super[s + 1];) ++end;
                    visit(s, Descendant{std::int32_t(d), begin, end});
                }
            }
        };
        m_starts.assign(size_t(m_L.numSupernodes) + 1, 0);
        forEach([&](Index s, const Descendant&) { ++m_starts[size_t(s) + 1]; });
        for (size_t s = 0; s + 1 < m_starts.size(); ++s) m_starts[s + 1] += m_starts[s];
        m_descendants.resize(size_t(m_starts.back()));
        std::vector<Index> next(m_starts.begin(), m_starts.end() - 1);
        forEach(
            [&](Index s, const Descendant& d) { m_descendants[size_t(next[size_t(s)]++)] = d; });
    }

    /** @returns the row at which a pivot is not positive; −1: none **/
    Index factorSupernode(Index s, TileWorkspace& work, int threads) {
        const int numColumns = m_L.numColumnsOf(s), stride = m_L.numRowsOf(s);
        takeEntries(s, work.places.get());
        std::vector<Part> parts;
        for (int first = 0; first < numColumns; first += BlockColumns) {
            const int end = std::min(first + BlockColumns, numColumns), width = end - first;
            double* block = m_values + m_L.valueStarts[s] + Index(first) * stride;
            double flops = 2.0 * width * first * (stride - first);
            parts.clear();
            for (Index k = m_starts[size_t(s)]; k < m_starts[size_t(s) + 1]; ++k) {
                const Descendant& d = m_descendants[size_t(k)];
                const Index* rows = m_L.rows + m_L.rowStarts[d.supernode];
                const auto find = [&](int column) {
                    return int(
                        std::lower_bound(rows + d.begin, rows + d.end, m_L.super[s] + column) -
                        rows);
                };
                const Part part{&d, find(first), find(end)};
                if (part.first == part.end) continue;
                parts.push_back(part);
                flops += 2.0 * (part.end - part.first) * m_L.numColumnsOf(d.supernode) *
                         (m_L.numRowsOf(d.supernode) - part.first);
            }
            const int numTiles = 1 + (stride - end + TileRows - 1) / TileRows;
            const int team = chooseNumThreads(threads, flops, TileFlopsWorthThreads);
            const auto forEachTile = [&](int from, const auto& visit) {
                parallelFor(numTiles - from, team, Schedule::WhoeverIsFree, [&](int k) {
                    const int tile = k + from;
                    const int begin = tile ? end + (tile - 1) * TileRows : first;
                    visit(begin, tile ? std::min(begin + TileRows, stride) : end);
                });
            };
            forEachTile(0, [&](int begin, int stop) {
                std::unique_ptr<double[]> own;
                if (team > 1) own.reset(new double[size_t(BlockColumns) * TileRows]);
                double* product = own ? own.get() : work.product.get();
                for (const Part& part : parts)
                    subtractDescendant(s, part, first, begin, stop, work.places.get(), product);
                if (first > 0) {
                    const double* before = m_values + m_L.valueStarts[s];
                    addProduct(-1, stop - begin, width, first, before + begin, before + first,
                               stride, 1, block + begin, stride);
                }
            });
            int info = 0;
            dpotrf_("L", &width, block + first, &stride, &info);
            if (info) return m_L.super[s] + first + std::max(info, 1) - 1;
            forEachTile(1, [&](int begin, int stop) {
                const int height = stop - begin;
                const double one = 1;
                dtrsm_("R", "L", "T", "N", &height, &width, &one, block + first, &stride,
                       block + begin, &stride);
            });
        }
        return -1;
    }

    /** Copies A's entries into a supernode and sets the `places` of its rows. **/
    void takeEntries(Index s, std::int32_t* places) {
        const Index* rows = m_L.rows + m_L.rowStarts[s];
        const int stride = m_L.numRowsOf(s);
        for (int r = 0; r < stride; ++r) places[rows[r]] = r;
        std::fill(m_values + m_L.valueStarts[s],
                  m_values + m_L.valueStarts[s] + Index(stride) * m_L.numColumnsOf(s), 0.0);
        for (Index column = m_L.super[s]; column < m_L.super[s + 1]; ++column) {
            double* into = m_values + m_L.valueStarts[s] + (column - m_L.super[s]) * stride;
            for (Index k = m_entries.starts[size_t(column)];
                 k < m_entries.starts[size_t(column) + 1]; ++k)
                into[places[m_entries.rows[size_t(k)]]] += m_entries.values[size_t(k)];
        }
    }

    /** Subtracts a descendant's contribution to rows begin…end−1 of a block of columns. **/
    void subtractDescendant(Index s, const Part& part, int firstColumn, int begin, int end,
                            const std::int32_t* places, double* product) {
        const Index d = part.of->supernode;
        const Index* rows = m_L.rows + m_L.rowStarts[d];
        const int strideD = m_L.numRowsOf(d);
        const auto isBefore = [&](int place) {
            return [places, place](Index row) { return places[row] < place; };
        };
        const bool isDiagonal = begin == firstColumn;
        const int from =
            isDiagonal
                ? part.first
                : int(std::partition_point(rows + part.end, rows + strideD, isBefore(begin)) -
                      rows);
        const int to =
            isDiagonal
                ? part.end
                : int(std::partition_point(rows + from, rows + strideD, isBefore(end)) - rows);
        const int height = to - from, width = part.end - part.first;
        if (height == 0) return;
        const double* values = m_values + m_L.valueStarts[d];
        addProduct(1, height, width, m_L.numColumnsOf(d), values + from, values + part.first,
                   strideD, 0, product, height);
        double* into = m_values + m_L.valueStarts[s];
        const int stride = m_L.numRowsOf(s);
        for (int c = 0; c < width; ++c) {
            double* column = into + Index(places[rows[part.first + c]]) * stride;
            const double* of = product + Index(c) * height;
            for (int r = isDiagonal ? c : 0; r < height; ++r)
                column[places[rows[from + r]]] -= of[r];
        }
    }

    const SupernodalFactor m_L;
    double* const m_values;
    const OrderedEntries m_entries;
    std::vector<Index> m_starts;  ///< of each supernode's descendants, in ascending order
    std::vector<Descendant> m_descendants;
};

}  // namespace

Index factorSupernodes(const SymmetricMatrix& A, const Index* order, const SupernodalFactor& L,
                       double* values, int threads) {
    const OneBlasThread oneThread;
    return SupernodalFactorization(A, order, L, values).run(fitMemory(threads));
}

}  // namespace simflex
