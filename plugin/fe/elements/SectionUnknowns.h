#pragma once
/** @file
Unknowns in which slender shells and beams keep their digits. Internal to fe and reduction.

A shell or beam is solid elements between nodes on both sides of it. In their displacements its
bending is a small difference of large forces: of K, which is rounded to ε, (L/t)² ε is left in a
strip of length L and thickness t, and as much again where elements are short. So the displacement
of one node of each section, its base, is an unknown itself, and those of the others are counted
from it,

    u_k = q_k + u_base,

translation of the section and motion across it; those of the internal nodes of C3D8I likewise from
the mean of its corners. Shape functions are combined before anything is rounded: gradients of the
base are the sum of its section's. **/

#include <array>
#include <unordered_map>
#include <vector>

#include "ElementAssembly.h"

namespace simflex {

class SectionUnknowns {
public:
    /** None: u = q. **/
    SectionUnknowns() = default;

    /** Those of the nodes that shells and beams were expanded into.
    @param tieOf  by node: those with one number ≥ 0 follow one rigid interface, so that they are
        counted from a node of the same; those with one below −1 are of another interface, whose
        nodes are counted from each other; −1: of none **/
    SectionUnknowns(const FeElements& elements, const Mesh& mesh, const std::vector<int>& tieOf);

    bool empty() const { return m_baseOf.empty(); }
    int numNodes() const { return int(m_baseOf.size()); }
    /** −1: its displacement is an unknown itself, or it is internal. **/
    int baseOf(int node) const { return m_baseOf[size_t(node)]; }

    /** Calls visit(node, weight) for all that the displacement of a node is counted from. **/
    template <class Visit>
    void forOrigins(int node, const Visit& visit) const {
        if (const int base = m_baseOf[size_t(node)]; base >= 0) visit(base, 1.0);
        const auto corners = m_cornersOf.find(node);
        if (corners == m_cornersOf.end()) return;
        for (const int corner : corners->second) visit(corner, 1.0 / 8);
    }
    bool isInternal(int node) const { return m_cornersOf.count(node) > 0; }

    /** The points of an element in the unknowns of its nodes. **/
    void combine(const int* nodes, int numNodes, ElementPoints& points) const;

private:
    std::vector<int> m_baseOf;
    std::unordered_map<int, std::array<int, 8>> m_cornersOf;  ///< of internal nodes
};

/** K of all elements, and of what is beside them, in these unknowns, 3·node + axis. **/
SymmetricMatrix assembleStiffness(const FeElements& elements, const Mesh& mesh,
                                  const SectionUnknowns& unknowns);

}  // namespace simflex
