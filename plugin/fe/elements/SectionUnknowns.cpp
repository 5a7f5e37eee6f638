#include "SectionUnknowns.h"

#include <algorithm>
#include <numeric>

#include "simflex/fe/MatrixEntries.h"

namespace simflex {
namespace {

/** Returns for each node the number of the node it was expanded from, −1: none. **/
std::vector<int> listOrigins(const Mesh& mesh) {
    std::vector<int> origins(size_t(mesh.numNodes()), -1);
    for (const auto& [number, nodes] : mesh.expandedNodes)
        for (const int node : nodes)
            if (mesh.nodeNumbers[size_t(node)] != number) origins[size_t(node)] = number;
    return origins;
}

int findRoot(std::vector<int>& parents, int node) {
    while (parents[size_t(node)] != node) {
        parents[size_t(node)] = parents[size_t(parents[size_t(node)])];
        node = parents[size_t(node)];
    }
    return node;
}

}  // namespace

SectionUnknowns::SectionUnknowns(const FeElements& elements, const Mesh& mesh,
                                 const std::vector<int>& tieOf) {
    if (mesh.expandedNodes.empty()) return;
    const std::vector<int> origins = listOrigins(mesh);
    // Sections: nodes with the same origin in an element, merged.
    std::vector<int> parents(size_t(mesh.numNodes()));
    std::iota(parents.begin(), parents.end(), 0);
    for (int e = 0; e < elements.size(); ++e) {
        const int n = elements.numNodesOf(e), *nodes = elements.nodesOf(e);
        for (int i = 0; i < n; ++i)
            for (int j = 0; j < i; ++j)
                if (origins[size_t(nodes[i])] >= 0 &&
                    origins[size_t(nodes[i])] == origins[size_t(nodes[j])])
                    parents[size_t(findRoot(parents, nodes[i]))] = findRoot(parents, nodes[j]);
    }
    std::vector<int> bases(size_t(mesh.numNodes()), -1);  // by root
    const auto isTied = [&](int node) { return tieOf[size_t(node)] >= 0; };
    for (int node = 0; node < mesh.numNodes(); ++node) {
        int& base = bases[size_t(findRoot(parents, node))];
        if (base < 0 || (isTied(node) && !isTied(base))) base = node;
    }
    m_baseOf.assign(size_t(mesh.numNodes()), -1);
    for (int node = 0; node < mesh.numNodes(); ++node) {
        const int base = bases[size_t(findRoot(parents, node))], tie = tieOf[size_t(node)];
        if (base != node && (tie == -1 || tie == tieOf[size_t(base)]))
            m_baseOf[size_t(node)] = base;
    }
    const int firstInternal = mesh.numNodes() - mesh.numInternalNodes;
    for (int e = 0; e < elements.size(); ++e) {
        const int n = elements.numNodesOf(e), *nodes = elements.nodesOf(e);
        for (int k = 0; k < n; ++k)
            if (nodes[k] >= firstInternal) std::copy_n(nodes, 8, m_cornersOf[nodes[k]].begin());
            // If nodes at one position are divided among elements, some elements lack the base.
            else if (std::find(nodes, nodes + n, m_baseOf[size_t(nodes[k])]) == nodes + n)
                m_baseOf[size_t(nodes[k])] = -1;
    }
}

void SectionUnknowns::combine(const int* nodes, int numNodes, ElementPoints& points) const {
    for (int k = numNodes - 1; k >= 0; --k)  // internal nodes are last, and must be processed first
        forOrigins(nodes[k], [&](int node, double weight) {
            const auto to = Eigen::Index(std::find(nodes, nodes + numNodes, node) - nodes);
            for (ElementPoint& point : points.points) {
                if (point.G.cols() > 0) point.G.col(to) += weight * point.G.col(k);
                if (point.B.cols() > 0)
                    point.B.middleCols<3>(3 * to) += weight * point.B.middleCols<3>(3 * k);
            }
            if (points.hourglass.size() == 0) return;
            points.hourglass.row(to) += weight * points.hourglass.row(k);
            points.hourglass.col(to) += weight * points.hourglass.col(k);
        });
}

SymmetricMatrix assembleStiffness(const FeElements& elements, const Mesh& mesh,
                                  const SectionUnknowns& unknowns) {
    SymmetricMatrix K;
    ElementAssembly(elements, mesh.numNodes())
        .assemble(
            [&](int e, ElementWork& work) {
                elements.calcPoints(e, mesh, work.points);
                unknowns.combine(elements.nodesOf(e), elements.numNodesOf(e), work.points);
                integrateStiffness(work);
            },
            &K, nullptr);
    const SymmetricMatrix& beside = elements.beside.K;
    if (beside.values.empty()) return K;
    MatrixEntries entries;
    const auto add = [&](int row, int column, double value) {
        if (row >= column) entries.add(row, column, value);
    };
    for (int column = 0; column < beside.size; ++column)
        for (auto k = beside.columnStarts[size_t(column)];
             k < beside.columnStarts[size_t(column) + 1]; ++k) {
            const int row = beside.rows[size_t(k)];
            const double value = beside.values[size_t(k)];
            // Both nodes and their bases.
            const auto ofBase = [&](int dof) {
                const int base = unknowns.baseOf(dof / 3);
                return base < 0 ? -1 : 3 * base + dof % 3;
            };
            for (const int i : {row, ofBase(row)})
                for (const int j : {column, ofBase(column)}) {
                    if (i < 0 || j < 0) continue;
                    add(i, j, value);
                    if (row != column) add(j, i, value);
                }
        }
    return addEntries(K, std::move(entries), K.size);
}

}  // namespace simflex
