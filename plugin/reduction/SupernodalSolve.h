#pragma once
/** @file
Triangular solves with a supernodal Cholesky factor for eight right-hand sides at a time. Internal
to reduction.

The factor is read once for eight vectors that lie side by side. Disjoint subtrees of the
elimination tree go to threads, each with sums of its own for the rows above it; the few large
supernodes at the top are shared out by rows or columns. Who computes what does not depend on the
number of threads, nor do the bits. **/

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace simflex {

/** A supernodal lower triangle as CHOLMOD stores it. Supernode s has the columns
super[s]…super[s+1]−1, the rows rows[rowStarts[s]…rowStarts[s+1]−1], its columns first, and its
entries by columns from values[valueStarts[s]]. **/
struct SupernodalFactor {
    std::int64_t size = 0, numSupernodes = 0;
    const std::int64_t* super = nullptr;
    const std::int64_t* rowStarts = nullptr;
    const std::int64_t* valueStarts = nullptr;
    const std::int64_t* rows = nullptr;
    const double* values = nullptr;
};

class SupernodalSolve {
public:
    static constexpr int Width = 8;

    /** @param L  must live as long as this. **/
    explicit SupernodalSolve(const SupernodalFactor& L);
    ~SupernodalSolve();

    /** x ← L⁻¹ x, x size×8, the eight numbers of a row side by side, aligned to 64 bytes. **/
    void solveLower(double* x);

    /** x ← L⁻ᵀ x. **/
    void solveUpper(double* x);

private:
    struct Subtree;
    struct Workspace;

    int numColumnsOf(std::int64_t s) const { return int(m_L.super[s + 1] - m_L.super[s]); }
    int numRowsOf(std::int64_t s) const { return int(m_L.rowStarts[s + 1] - m_L.rowStarts[s]); }
    void findSubtrees();

    SupernodalFactor m_L;
    std::vector<Subtree> m_subtrees;
    std::vector<std::int64_t> m_top;  ///< supernodes of no subtree, ascending
    std::vector<std::int32_t>
        m_rows;  ///< as L.rows; where a row lies above its subtree, −1 − place
    std::int64_t m_mostRows = 0;
    bool m_shared = false;  ///< among threads: worth it
    std::unique_ptr<Workspace> m_work;
};

}  // namespace simflex
