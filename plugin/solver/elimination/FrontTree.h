#pragma once
/** @file
Symbolic analysis of a sparse symmetric pattern for multifrontal elimination (private header).

The pattern is a sum of *cliques*: sets of unknowns that one body couples with each other. Unknowns
that belong to the same cliques form a node; nodes get a nested-dissection order (METIS), and nodes
with the same rows below are merged into *fronts*. A front eliminates its `numPivots` unknowns from
a small dense matrix and hands the rest, its border, to its parent. Fronts are in postorder:
children before parents, each subtree contiguous.

Source: I. Duff, J. Reid, The multifrontal solution of indefinite sparse symmetric linear systems,
ACM TOMS 9 (1983). **/

#include <cstddef>
#include <vector>

namespace simflex {

/** Input of the analysis: sizes and couplings, no numbers. **/
struct CliquePattern {
    int numUnknowns = 0;
    std::vector<std::vector<int>> cliques;  ///< unknowns of each; an unknown may appear twice
    std::vector<int> lastUnknowns;          ///< eliminated after all others, in this order
    /** First unknown without a diagonal of its own: these are eliminated right after the last other
    unknown that shares a clique with them; −1: none. **/
    int firstMultiplier = -1;
};

class FrontTree {
public:
    /** Contribution of a clique to a front, at these rows. **/
    struct Contribution {
        int clique;
        std::vector<int> positions;  ///< row of the front for each unknown of the clique
    };

    struct Front {
        int firstPivot = 0;       ///< in elimination order
        int numPivots = 0;        ///< k
        std::vector<int> border;  ///< later unknowns coupled to it, in elimination order
        int parent = -1;
        int firstDescendant = 0;  ///< first front of the subtree
        std::vector<int> children;
        std::vector<int> parentRows;  ///< row in the parent's front of each border unknown
        std::vector<Contribution> contributions;

        int numRows() const { return numPivots + int(border.size()); }
        /** Approximate number of multiplications of its elimination. **/
        double work() const { return double(numPivots) * numRows() * numRows(); }
    };

    explicit FrontTree(const CliquePattern& pattern);

    const std::vector<Front>& fronts() const { return m_fronts; }
    int numUnknowns() const { return int(m_position.size()); }

    /** Position of each unknown in the elimination order. **/
    const std::vector<int>& positions() const { return m_position; }

    /** Roots of disjoint subtrees of similar work that may be eliminated in parallel; the fronts
    above them follow in order. **/
    const std::vector<int>& subtrees() const { return m_subtrees; }
    const std::vector<int>& frontsAboveSubtrees() const { return m_top; }

    double work() const { return m_work; }

private:
    void makeNodes(const CliquePattern& pattern);
    void orderNodes(const CliquePattern& pattern);
    void insertMultipliers();
    void appendLastNodes(const CliquePattern& pattern);
    void makeFronts();
    void placeCliques(const CliquePattern& pattern);
    void chooseSubtrees();

    std::vector<int> m_nodeOf;                   ///< by unknown
    std::vector<std::vector<int>> m_nodes;       ///< unknowns of each node
    std::vector<bool> m_isLast;                  ///< by node
    std::vector<std::vector<int>> m_neighbours;  ///< of each node, ascending
    std::vector<int> m_order;                    ///< nodes as eliminated
    std::vector<Front> m_fronts;
    std::vector<int> m_position;
    std::vector<int> m_subtrees, m_top;
    double m_work = 0;
};

}  // namespace simflex
