#pragma once
/** @file
Triangular solves with a supernodal Cholesky factor for eight right-hand sides at a time. Internal
to reduction.

The factor is read once for eight interleaved vectors. Threads process disjoint subtrees of the
elimination tree, each with its own sums for the rows above it; the few large supernodes at the top
are divided by rows or columns. The partition does not depend on the number of threads, so results
are bit-identical. **/

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "SupernodalFactor.h"
#include "simflex/base/Chunk.h"

namespace simflex {

class SupernodalSolve {
public:
    /** @param L  must outlive this object. **/
    explicit SupernodalSolve(const SupernodalFactor& L);
    ~SupernodalSolve();

    /** x ← L⁻¹ x, where x is size×8, row-major. **/
    void solveLower(Chunk* x);

    /** x ← L⁻ᵀ x. **/
    void solveUpper(Chunk* x);

private:
    struct Subtree;
    struct Workspace;

    int numColumnsOf(std::int64_t s) const { return m_L.numColumnsOf(s); }
    int numRowsOf(std::int64_t s) const { return m_L.numRowsOf(s); }
    void findSubtrees();

    SupernodalFactor m_L;
    std::vector<Subtree> m_subtrees;
    std::vector<std::int64_t> m_top;   ///< supernodes in no subtree, ascending
    std::vector<std::int32_t> m_rows;  ///< as L.rows; −1 − index for rows above their subtree
    std::int64_t m_mostRows = 0;
    bool m_shared = false;  ///< large enough for threads
    std::unique_ptr<Workspace> m_work;
};

}  // namespace simflex
