#pragma once
/** @file
A supernodal Cholesky factor, and its elimination tree in shares for threads. Internal to
reduction. **/

#include <cstdint>
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

    int numColumnsOf(std::int64_t s) const { return int(super[s + 1] - super[s]); }
    int numRowsOf(std::int64_t s) const { return int(rowStarts[s + 1] - rowStarts[s]); }
    std::vector<std::int64_t> findSupernodes() const;  ///< of each column
};

/** Disjoint subtrees, which can be worked on at the same time, and what is above them. **/
struct TreeShares {
    struct Subtree {
        std::int64_t first, root;  ///< its supernodes are first…root
    };
    std::vector<Subtree> subtrees;  ///< the most costly first
    std::vector<std::int64_t> top;  ///< supernodes of no subtree, ascending

    /** @param costs    of each supernode
    @param divisor  a subtree costs at most one part in so many of all **/
    TreeShares(const SupernodalFactor& L, std::vector<double> costs, double divisor);
};

}  // namespace simflex
