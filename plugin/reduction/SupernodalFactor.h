#pragma once
/** @file
A supernodal Cholesky factor and the partition of its elimination tree for threads. Internal to
reduction. **/

#include <cstdint>
#include <vector>

namespace simflex {

/** A supernodal lower triangle as stored by CHOLMOD. Supernode s has columns super[s]…super[s+1]−1
and rows rows[rowStarts[s]…rowStarts[s+1]−1], its own columns first. Its entries start at
values[valueStarts[s]], column-major. **/
struct SupernodalFactor {
    std::int64_t size = 0, numSupernodes = 0;
    const std::int64_t* super = nullptr;
    const std::int64_t* rowStarts = nullptr;
    const std::int64_t* valueStarts = nullptr;
    const std::int64_t* rows = nullptr;
    const double* values = nullptr;

    int numColumnsOf(std::int64_t s) const { return int(super[s + 1] - super[s]); }
    int numRowsOf(std::int64_t s) const { return int(rowStarts[s + 1] - rowStarts[s]); }
    std::vector<std::int64_t> findSupernodes() const;  ///< supernode of each column
};

/** Disjoint subtrees that can be processed concurrently, and the supernodes above them. **/
struct TreeShares {
    struct Subtree {
        std::int64_t first, root;  ///< its supernodes are first…root
    };
    std::vector<Subtree> subtrees;  ///< most costly first
    std::vector<std::int64_t> top;  ///< supernodes in no subtree, ascending

    /** @param costs    by supernode
    @param divisor  a subtree costs at most 1/divisor of the total **/
    TreeShares(const SupernodalFactor& L, std::vector<double> costs, double divisor);
};

}  // namespace simflex
