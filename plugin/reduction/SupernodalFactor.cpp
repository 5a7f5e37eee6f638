#include "SupernodalFactor.h"

#include <algorithm>

namespace simflex {

using Index = std::int64_t;

std::vector<Index> SupernodalFactor::findSupernodes() const {
    std::vector<Index> supernodes(static_cast<size_t>(size));
    for (Index s = 0; s < numSupernodes; ++s)
        std::fill(supernodes.begin() + super[s], supernodes.begin() + super[s + 1], s);
    return supernodes;
}

TreeShares::TreeShares(const SupernodalFactor& L, std::vector<double> costs, double divisor) {
    const Index n = L.numSupernodes;
    const std::vector<Index> supernodeOf = L.findSupernodes();
    std::vector<Index> first(static_cast<size_t>(n)), open;
    std::vector<std::vector<Index>> children(static_cast<size_t>(n));
    double total = 0;
    for (Index s = 0; s < n; ++s) first[s] = s;
    for (Index s = 0; s < n; ++s) {
        if (L.numRowsOf(s) == L.numColumnsOf(s)) {
            total += costs[s];
            open.push_back(s);
            continue;
        }
        const Index parent = supernodeOf[L.rows[L.rowStarts[s] + L.numColumnsOf(s)]];
        costs[parent] += costs[s];
        first[parent] = std::min(first[parent], first[s]);
        children[parent].push_back(s);
    }

    // Supernodes are numbered in postorder, so a subtree is a contiguous range.
    const auto isRun = [&](Index root) {  // checks that for any numbering
        Index count = 0;
        std::vector<Index> stack{root};
        while (!stack.empty()) {
            const Index s = stack.back();
            stack.pop_back();
            ++count;
            stack.insert(stack.end(), children[s].begin(), children[s].end());
        }
        return count == root - first[root] + 1;
    };
    while (!open.empty()) {
        const Index s = open.back();
        open.pop_back();
        if (costs[s] * divisor <= total && isRun(s)) {
            subtrees.push_back({first[s], s});
        } else {
            top.push_back(s);
            open.insert(open.end(), children[s].begin(), children[s].end());
        }
    }
    std::sort(top.begin(), top.end());
    // Start the largest first to balance the load at the end.
    std::sort(subtrees.begin(), subtrees.end(), [&](const Subtree& a, const Subtree& b) {
        return costs[a.root] != costs[b.root] ? costs[a.root] > costs[b.root] : a.root < b.root;
    });
}

}  // namespace simflex
