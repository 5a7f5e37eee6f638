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

#include "SupernodalFactor.h"

namespace simflex {

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

    int numColumnsOf(std::int64_t s) const { return m_L.numColumnsOf(s); }
    int numRowsOf(std::int64_t s) const { return m_L.numRowsOf(s); }
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
