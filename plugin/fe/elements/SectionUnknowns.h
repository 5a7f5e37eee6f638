#pragma once
/** @file
Unknowns that preserve the digits of slender shells and beams. Internal to fe and reduction.

A shell or beam consists of solid elements between nodes on both sides of it. In their
displacements, bending is a small difference of large forces: rounding K by ε causes a relative
error of (L/t)² ε in a strip of length L and thickness t, and as much again if elements are short.
Therefore the displacement of one node of each section, its base, is an unknown itself, and the
others are relative to it,

    u_k = q_k + u_base,

translation of the section and motion across it; likewise those of the internal nodes of C3D8I are
relative to the mean of its corners. Shape functions are combined before rounding: gradients of the
base are the sum over its section. **/

#include <array>
#include <unordered_map>
#include <vector>

#include "ElementAssembly.h"

namespace simflex {

class SectionUnknowns {
public:
    /** No sections: u = q. **/
    SectionUnknowns() = default;

    /** Unknowns for the nodes to which shells and beams were expanded.
    @param tieOf  by node: nodes with the same number ≥ 0 follow one rigid interface and are
    relative to a node of the same; a number below −1 identifies another interface, whose nodes are
    relative to each other; −1: none **/
    SectionUnknowns(const FeElements& elements, const Mesh& mesh, const std::vector<int>& tieOf);

    bool empty() const { return m_baseOf.empty(); }
    int numNodes() const { return int(m_baseOf.size()); }
    /** Returns the base of a node; −1: its displacement is an unknown itself, or it is
    internal. **/
    int baseOf(int node) const { return m_baseOf[size_t(node)]; }

    /** Calls visit(node, weight) for all nodes that the displacement of a node is relative to. **/
    template <class Visit>
    void forOrigins(int node, const Visit& visit) const {
        if (const int base = m_baseOf[size_t(node)]; base >= 0) visit(base, 1.0);
        const auto corners = m_cornersOf.find(node);
        if (corners == m_cornersOf.end()) return;
        for (const int corner : corners->second) visit(corner, 1.0 / 8);
    }
    bool isInternal(int node) const { return m_cornersOf.count(node) > 0; }

    /** Transforms the points of an element to the unknowns of its nodes. **/
    void combine(const int* nodes, int numNodes, ElementPoints& points) const;

private:
    std::vector<int> m_baseOf;
    std::unordered_map<int, std::array<int, 8>> m_cornersOf;  ///< of internal nodes
};

/** Returns K of all elements, springs and hinged elements in these unknowns, 3·node + axis. **/
SymmetricMatrix assembleStiffness(const FeElements& elements, const Mesh& mesh,
                                  const SectionUnknowns& unknowns);

}  // namespace simflex
