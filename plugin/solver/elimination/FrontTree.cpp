#include "simflex/solver/elimination/FrontTree.h"

#include <metis.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <stdexcept>

#include "simflex/part/OwnRandom.h"

namespace simflex {
namespace {

/** Up to this many unknowns one dense front is faster than any tree. **/
constexpr int LargestDense = 72;

void sortUnique(std::vector<int>& values) {
    std::sort(values.begin(), values.end());
    values.erase(std::unique(values.begin(), values.end()), values.end());
}

/** Nested dissection of a graph; returns its vertices in elimination order. **/
std::vector<int> dissect(const std::vector<std::vector<int>>& neighbours,
                         const std::vector<int>& weights) {
    // METIS wants edges: vertices without any come first.
    std::vector<int> order, connected, number(neighbours.size(), -1);
    for (int v = 0; v < int(neighbours.size()); ++v) {
        if (neighbours[size_t(v)].empty()) {
            order.push_back(v);
        } else {
            number[size_t(v)] = int(connected.size());
            connected.push_back(v);
        }
    }
    if (connected.empty()) return order;

    std::vector<idx_t> starts{0}, ends, vertexWeights;
    for (int v : connected) {
        for (int w : neighbours[size_t(v)]) ends.push_back(number[size_t(w)]);
        starts.push_back(idx_t(ends.size()));
        vertexWeights.push_back(weights[size_t(v)]);
    }
    idx_t count = idx_t(connected.size());
    std::vector<idx_t> permutation(connected.size()), inverse(connected.size());
    idx_t options[METIS_NOPTIONS];
    METIS_SetDefaultOptions(options);
    options[METIS_OPTION_SEED] = 1;
    const OwnRandom random;
    if (METIS_NodeND(&count, starts.data(), ends.data(), vertexWeights.data(), options,
                     permutation.data(), inverse.data()) != METIS_OK)
        throw std::runtime_error("FrontTree: METIS found no elimination order");
    for (idx_t v : permutation) order.push_back(connected[size_t(v)]);
    return order;
}

}  // namespace

FrontTree::FrontTree(const CliquePattern& pattern) {
    makeNodes(pattern);
    orderNodes(pattern);
    makeFronts();
    placeCliques(pattern);
    chooseSubtrees();
}

void FrontTree::makeNodes(const CliquePattern& pattern) {
    // Unknowns of the same cliques form a node.
    std::vector<std::vector<int>> cliquesOf(size_t(pattern.numUnknowns));
    for (int c = 0; c < int(pattern.cliques.size()); ++c)
        for (int unknown : pattern.cliques[size_t(c)]) {
            std::vector<int>& list = cliquesOf[size_t(unknown)];
            if (list.empty() || list.back() != c) list.push_back(c);
        }
    std::vector<bool> isLast(size_t(pattern.numUnknowns), false);
    for (int unknown : pattern.lastUnknowns) isLast[size_t(unknown)] = true;

    const int firstMultiplier =
        pattern.firstMultiplier < 0 ? pattern.numUnknowns : pattern.firstMultiplier;
    std::map<std::pair<int, std::vector<int>>, int> nodeOfKey;
    m_nodeOf.resize(size_t(pattern.numUnknowns));
    for (size_t unknown = 0; unknown < cliquesOf.size(); ++unknown) {
        const auto [found, isNew] =
            nodeOfKey.emplace(std::make_pair(isLast[unknown] ? 2 : int(unknown) >= firstMultiplier,
                                             cliquesOf[unknown]),
                              int(m_nodes.size()));
        if (isNew) {
            m_nodes.emplace_back();
            m_isLast.push_back(isLast[unknown]);
        }
        m_nodeOf[unknown] = found->second;
        m_nodes[size_t(found->second)].push_back(int(unknown));
    }

    m_neighbours.resize(m_nodes.size());
    std::vector<int> members;
    for (const std::vector<int>& clique : pattern.cliques) {
        members.clear();
        for (int unknown : clique) members.push_back(m_nodeOf[size_t(unknown)]);
        sortUnique(members);
        for (int a : members)
            for (int b : members)
                if (a != b) m_neighbours[size_t(a)].push_back(b);
    }
    for (std::vector<int>& list : m_neighbours) sortUnique(list);
}

void FrontTree::orderNodes(const CliquePattern& pattern) {
    m_order.clear();
    if (pattern.numUnknowns <= LargestDense) {
        for (int v = 0; v < int(m_nodes.size()); ++v)
            if (!m_isLast[size_t(v)]) m_order.push_back(v);
        appendLastNodes(pattern);
        return;
    }
    std::vector<int> number(m_nodes.size(), -1), early, weights;
    const auto isMultiplier = [&](int v) {
        return pattern.firstMultiplier >= 0 &&
               m_nodes[size_t(v)].front() >= pattern.firstMultiplier;
    };
    for (int v = 0; v < int(m_nodes.size()); ++v) {
        if (m_isLast[size_t(v)] || isMultiplier(v)) continue;
        number[size_t(v)] = int(early.size());
        early.push_back(v);
        weights.push_back(int(m_nodes[size_t(v)].size()));
    }
    std::vector<std::vector<int>> neighbours(early.size());
    for (size_t k = 0; k < early.size(); ++k)
        for (int w : m_neighbours[size_t(early[k])])
            if (number[size_t(w)] >= 0) neighbours[k].push_back(number[size_t(w)]);
    for (int k : dissect(neighbours, weights)) m_order.push_back(early[size_t(k)]);
    if (pattern.firstMultiplier >= 0) insertMultipliers();
    appendLastNodes(pattern);
}

void FrontTree::insertMultipliers() {
    std::vector<int> place(m_nodes.size(), -1);
    for (size_t k = 0; k < m_order.size(); ++k) place[size_t(m_order[k])] = int(k);
    std::vector<std::vector<int>> after(m_order.size() + 1);  // the node before; 0: none
    for (int v = 0; v < int(m_nodes.size()); ++v) {
        if (m_isLast[size_t(v)] || place[size_t(v)] >= 0) continue;
        int last = -1;
        for (int w : m_neighbours[size_t(v)]) last = std::max(last, place[size_t(w)]);
        after[size_t(last + 1)].push_back(v);
    }
    std::vector<int> order = after[0];
    for (size_t k = 0; k < m_order.size(); ++k) {
        order.push_back(m_order[k]);
        order.insert(order.end(), after[k + 1].begin(), after[k + 1].end());
    }
    m_order = std::move(order);
}

void FrontTree::appendLastNodes(const CliquePattern& pattern) {
    std::vector<bool> isDone(m_nodes.size(), false);
    for (int unknown : pattern.lastUnknowns) {
        const int node = m_nodeOf[size_t(unknown)];
        if (!isDone[size_t(node)]) m_order.push_back(node);
        isDone[size_t(node)] = true;
    }
}

namespace {

/** A front under construction: nodes it eliminates and nodes below them, by elimination order. **/
struct Draft {
    std::vector<int> pivots, border;
    int pivotRows = 0, borderRows = 0;
    int parent = -1;
    bool isMerged = false;
    std::vector<int> children;
};

}  // namespace

void FrontTree::makeFronts() {
    const int count = int(m_order.size());
    std::vector<int> place(m_nodes.size());
    for (int k = 0; k < count; ++k) place[size_t(m_order[size_t(k)])] = k;
    const auto rowsOf = [&](const std::vector<int>& places) {
        int rows = 0;
        for (int k : places) rows += int(m_nodes[size_t(m_order[size_t(k)])].size());
        return rows;
    };
    const bool isDense = int(m_nodeOf.size()) <= LargestDense;

    // One draft per node: its later neighbours and those its children left.
    std::vector<Draft> drafts(static_cast<size_t>(count));
    for (int k = 0; k < count; ++k) {
        Draft& draft = drafts[size_t(k)];
        const int node = m_order[size_t(k)];
        draft.pivots = {k};
        for (int w : m_neighbours[size_t(node)])
            if (place[size_t(w)] > k) draft.border.push_back(place[size_t(w)]);
        for (int child : draft.children)
            for (int b : drafts[size_t(child)].border)
                if (b > k) draft.border.push_back(b);
        // All last nodes go into one front, and so does everything of a dense system.
        if ((isDense || m_isLast[size_t(node)]) && k + 1 < count) draft.border.push_back(k + 1);
        sortUnique(draft.border);
        draft.pivotRows = rowsOf(draft.pivots);
        draft.borderRows = rowsOf(draft.border);
        if (!draft.border.empty()) {
            draft.parent = draft.border.front();
            drafts[size_t(draft.parent)].children.push_back(k);
        }
    }

    // Merge children into parents where that adds few zeros: larger fronts, fewer of them.
    for (int k = 0; k < count; ++k) {
        Draft& parent = drafts[size_t(k)];
        std::vector<int> remaining;
        std::vector<int> candidates = parent.children;
        // Largest border first: this child is most likely to fit.
        std::stable_sort(candidates.begin(), candidates.end(), [&](int a, int b) {
            return drafts[size_t(a)].borderRows > drafts[size_t(b)].borderRows;
        });
        for (int c : candidates) {
            Draft& child = drafts[size_t(c)];
            const int merged = child.pivotRows + parent.pivotRows + parent.borderRows;
            const int zeros =
                child.pivotRows * (parent.pivotRows + parent.borderRows - child.borderRows);
            const bool isLastFront = m_isLast[size_t(m_order[size_t(c)])];
            const bool fits = zeros == 0 || (child.pivotRows + parent.pivotRows <= 16 &&
                                             zeros * 5 < merged * merged);
            if (!(fits || isDense || isLastFront)) {
                remaining.push_back(c);
                continue;
            }
            child.isMerged = true;
            parent.pivots.insert(parent.pivots.end(), child.pivots.begin(), child.pivots.end());
            parent.pivotRows += child.pivotRows;
            for (int grandchild : child.children) {
                drafts[size_t(grandchild)].parent = k;
                remaining.push_back(grandchild);
            }
        }
        parent.children = std::move(remaining);
        std::sort(parent.pivots.begin(), parent.pivots.end());
        std::sort(parent.children.begin(), parent.children.end());
    }

    // Postorder, without recursion: a chain may be as deep as it is long.
    std::vector<int> frontOfDraft(static_cast<size_t>(count), -1);
    std::vector<std::pair<int, size_t>> stack;
    m_position.assign(m_nodeOf.size(), 0);
    std::vector<int> firstRow(static_cast<size_t>(count));  // of each node, by place
    int nextPivot = 0;
    std::vector<int> draftOfFront;
    const auto finish = [&](int k) {
        const Draft& draft = drafts[size_t(k)];
        Front front;
        front.firstPivot = nextPivot;
        front.numPivots = draft.pivotRows;
        front.firstDescendant = int(m_fronts.size());
        for (int child : draft.children) {
            const int index = frontOfDraft[size_t(child)];
            front.children.push_back(index);
            front.firstDescendant =
                std::min(front.firstDescendant, m_fronts[size_t(index)].firstDescendant);
            m_fronts[size_t(index)].parent = int(m_fronts.size());
        }
        for (int p : draft.pivots) {
            firstRow[size_t(p)] = nextPivot;
            for (int unknown : m_nodes[size_t(m_order[size_t(p)])])
                m_position[size_t(unknown)] = nextPivot++;
        }
        frontOfDraft[size_t(k)] = int(m_fronts.size());
        draftOfFront.push_back(k);
        m_fronts.push_back(std::move(front));
    };
    for (int root = 0; root < count; ++root) {
        if (drafts[size_t(root)].isMerged || drafts[size_t(root)].parent >= 0) continue;
        stack.emplace_back(root, 0);
        while (!stack.empty()) {
            auto& [k, next] = stack.back();
            if (next < drafts[size_t(k)].children.size()) {
                const int child = drafts[size_t(k)].children[next++];
                stack.emplace_back(child, 0);
            } else {
                finish(k);
                stack.pop_back();
            }
        }
    }

    // Borders in elimination order, and where they stand in the parents.
    for (size_t f = 0; f < m_fronts.size(); ++f) {
        Front& front = m_fronts[f];
        for (int b : drafts[size_t(draftOfFront[f])].border) {
            const int size = int(m_nodes[size_t(m_order[size_t(b)])].size());
            for (int i = 0; i < size; ++i) front.border.push_back(firstRow[size_t(b)] + i);
        }
        std::sort(front.border.begin(), front.border.end());
        m_work += front.work();
    }
    for (Front& front : m_fronts) {
        if (front.parent < 0) continue;
        const Front& parent = m_fronts[size_t(front.parent)];
        size_t next = 0;
        for (int row : front.border) {
            if (row < parent.firstPivot + parent.numPivots) {
                front.parentRows.push_back(row - parent.firstPivot);
                continue;
            }
            while (parent.border[next] != row) ++next;
            front.parentRows.push_back(parent.numPivots + int(next));
        }
    }
}

void FrontTree::placeCliques(const CliquePattern& pattern) {
    std::vector<int> frontOfPivot(m_position.size());
    for (size_t f = 0; f < m_fronts.size(); ++f)
        std::fill_n(frontOfPivot.begin() + m_fronts[f].firstPivot, m_fronts[f].numPivots, int(f));
    for (int c = 0; c < int(pattern.cliques.size()); ++c) {
        const std::vector<int>& clique = pattern.cliques[size_t(c)];
        if (clique.empty()) continue;
        int earliest = m_position[size_t(clique.front())];
        for (int unknown : clique) earliest = std::min(earliest, m_position[size_t(unknown)]);
        Front& front = m_fronts[size_t(frontOfPivot[size_t(earliest)])];
        Contribution contribution{c, {}};
        for (int unknown : clique) {
            const int row = m_position[size_t(unknown)];
            if (row < front.firstPivot + front.numPivots) {
                contribution.positions.push_back(row - front.firstPivot);
            } else {
                const auto found = std::lower_bound(front.border.begin(), front.border.end(), row);
                contribution.positions.push_back(front.numPivots +
                                                 int(found - front.border.begin()));
            }
        }
        front.contributions.push_back(std::move(contribution));
    }
}

void FrontTree::chooseSubtrees() {
    constexpr int Wanted = 64;
    std::vector<double> work(m_fronts.size());
    for (size_t f = 0; f < m_fronts.size(); ++f) {
        work[f] += m_fronts[f].work();
        if (m_fronts[f].parent >= 0) work[size_t(m_fronts[f].parent)] += work[f];
    }
    // Open the heaviest subtree until there are enough or they are light.
    std::vector<std::pair<double, int>> heap;
    for (size_t f = 0; f < m_fronts.size(); ++f)
        if (m_fronts[f].parent < 0) heap.emplace_back(work[f], int(f));
    std::make_heap(heap.begin(), heap.end());
    while (!heap.empty() && int(heap.size()) < Wanted && heap.front().first > m_work / Wanted) {
        std::pop_heap(heap.begin(), heap.end());
        const int f = heap.back().second;
        heap.pop_back();
        m_top.push_back(f);
        for (int child : m_fronts[size_t(f)].children) {
            heap.emplace_back(work[size_t(child)], child);
            std::push_heap(heap.begin(), heap.end());
        }
    }
    for (const auto& entry : heap) m_subtrees.push_back(entry.second);
    std::sort(m_subtrees.begin(), m_subtrees.end());
    std::sort(m_top.begin(), m_top.end());
}

}  // namespace simflex
