// The symbolic analysis against elimination of a dense Boolean pattern.

#include "simflex/solver/elimination/FrontTree.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>

namespace simflex {
namespace {

using Pattern = std::vector<std::vector<bool>>;

/** L's pattern in elimination order: entry (i, j), i ≥ j. **/
Pattern eliminate(const CliquePattern& pattern, const std::vector<int>& position) {
    const int n = pattern.numUnknowns;
    Pattern isFilled(static_cast<size_t>(n), std::vector<bool>(static_cast<size_t>(n)));
    for (const std::vector<int>& clique : pattern.cliques)
        for (const int a : clique)
            for (const int b : clique)
                isFilled[size_t(position[size_t(a)])][size_t(position[size_t(b)])] = true;
    for (size_t k = 0; k < size_t(n); ++k)
        for (size_t i = k + 1; i < size_t(n); ++i)
            for (size_t j = k + 1; isFilled[i][k] && j < size_t(n); ++j)
                if (isFilled[j][k]) isFilled[i][j] = true;
    return isFilled;
}

/** Returns the elimination positions of a front's rows. **/
std::vector<int> getRows(const FrontTree::Front& front) {
    std::vector<int> rows(static_cast<size_t>(front.numPivots));
    std::iota(rows.begin(), rows.end(), front.firstPivot);
    rows.insert(rows.end(), front.border.begin(), front.border.end());
    return rows;
}

void check(const CliquePattern& pattern) {
    const FrontTree tree(pattern);
    const std::vector<int>& position = tree.positions();
    ASSERT_EQ(tree.numUnknowns(), pattern.numUnknowns);
    std::vector<int> sorted = position;
    std::sort(sorted.begin(), sorted.end());
    for (int i = 0; i < pattern.numUnknowns; ++i) ASSERT_EQ(sorted[size_t(i)], i);

    // Fronts eliminate all unknowns in sequence, children before parents.
    int next = 0;
    const auto& fronts = tree.fronts();
    for (size_t f = 0; f < fronts.size(); ++f) {
        EXPECT_EQ(fronts[f].firstPivot, next);
        next += fronts[f].numPivots;
        EXPECT_TRUE(std::is_sorted(fronts[f].border.begin(), fronts[f].border.end()));
        if (fronts[f].border.empty()) continue;
        ASSERT_GT(fronts[f].parent, int(f));
        const std::vector<int> above = getRows(fronts[size_t(fronts[f].parent)]);
        for (size_t i = 0; i < fronts[f].border.size(); ++i)
            EXPECT_EQ(above.at(size_t(fronts[f].parentRows[i])), fronts[f].border[i]);
    }
    EXPECT_EQ(next, pattern.numUnknowns);

    // A front contains all fill of its pivots.
    const Pattern isFilled = eliminate(pattern, position);
    for (const FrontTree::Front& front : fronts) {
        const std::vector<int> rows = getRows(front);
        for (int pivot = front.firstPivot; pivot < front.firstPivot + front.numPivots; ++pivot)
            for (int i = pivot + 1; i < pattern.numUnknowns; ++i)
                EXPECT_TRUE(!isFilled[size_t(i)][size_t(pivot)] ||
                            std::binary_search(rows.begin(), rows.end(), i))
                    << "row " << i << " of pivot " << pivot;
    }

    // Each clique is assembled once, at its unknowns' rows.
    std::vector<int> numAdded(pattern.cliques.size());
    for (const FrontTree::Front& front : fronts) {
        const std::vector<int> rows = getRows(front);
        for (const FrontTree::Contribution& added : front.contributions) {
            const std::vector<int>& clique = pattern.cliques[size_t(added.clique)];
            ++numAdded[size_t(added.clique)];
            ASSERT_EQ(added.positions.size(), clique.size());
            for (size_t i = 0; i < clique.size(); ++i)
                EXPECT_EQ(rows.at(size_t(added.positions[i])), position[size_t(clique[i])]);
        }
    }
    for (size_t c = 0; c < numAdded.size(); ++c)
        EXPECT_EQ(numAdded[c], pattern.cliques[c].empty() ? numAdded[c] : 1) << "clique " << c;

    // Unknowns marked as last come last, in the requested order.
    const size_t numLast = pattern.lastUnknowns.size();
    for (size_t i = 0; i < numLast; ++i)
        EXPECT_EQ(position[size_t(pattern.lastUnknowns[i])],
                  pattern.numUnknowns - int(numLast) + int(i));
}

CliquePattern makeChain(int count) {
    CliquePattern pattern;
    pattern.numUnknowns = count;
    for (int k = 0; k + 1 < count; ++k) pattern.cliques.push_back({k, k + 1});
    return pattern;
}

TEST(FrontTree, HoldsTheFillOfChainsRingsAndGrids) {
    check(makeChain(2));
    check(makeChain(150));
    CliquePattern ring = makeChain(120);
    ring.cliques.push_back({119, 0});
    check(ring);
    CliquePattern grid;
    constexpr int side = 12;
    grid.numUnknowns = side * side;
    for (int i = 0; i + 1 < side; ++i)
        for (int j = 0; j + 1 < side; ++j)
            grid.cliques.push_back(
                {i * side + j, i * side + j + 1, (i + 1) * side + j, (i + 1) * side + j + 1});
    check(grid);
}

TEST(FrontTree, HoldsTheFillOfRandomPatterns) {
    std::mt19937 random(11);
    for (int trial = 0; trial < 20; ++trial) {
        CliquePattern pattern;
        pattern.numUnknowns = 60 + int(random() % 100);
        for (int i = 0; i < pattern.numUnknowns; ++i) pattern.cliques.push_back({i});
        for (int c = int(random() % 120); c > 0; --c) {
            std::vector<int> clique;
            for (int size = 1 + int(random() % 5); size > 0; --size)
                clique.push_back(int(random() % unsigned(pattern.numUnknowns)));
            std::sort(clique.begin(), clique.end());
            clique.erase(std::unique(clique.begin(), clique.end()), clique.end());
            pattern.cliques.push_back(clique);
        }
        if (trial % 2 == 1) pattern.lastUnknowns = {3, 0};
        check(pattern);
    }
}

TEST(FrontTree, AChainCostsInProportionToItsLength) {
    const FrontTree tree(makeChain(1000)), longer(makeChain(2000));
    EXPECT_NEAR(longer.work() / tree.work(), 2, 0.1);
    for (const FrontTree::Front& front : tree.fronts()) EXPECT_LE(front.border.size(), 2u);
}

TEST(FrontTree, SubtreesAndTheFrontsAboveThemAreAllFronts) {
    const FrontTree tree(makeChain(4000));
    std::vector<int> numSeen(tree.fronts().size());
    for (const int root : tree.subtrees())
        for (int f = tree.fronts()[size_t(root)].firstDescendant; f <= root; ++f)
            ++numSeen[size_t(f)];
    for (const int f : tree.frontsAboveSubtrees()) ++numSeen[size_t(f)];
    for (const int count : numSeen) EXPECT_EQ(count, 1);
}

}  // namespace
}  // namespace simflex
