#pragma once
/** @file
The mesh of a part: nodes, solid elements and node sets. Standard types only. **/

#include <array>
#include <map>
#include <string>
#include <vector>

#include "simflex/base/StandardBuild.h"

namespace simflex {

/** Solid elements; node order as in CalculiX and Abaqus (corner nodes first, then mid-edge nodes:
bottom, top, vertical edges for hexahedra and wedges; 1-2, 2-3, 3-1, 1-4, 2-4, 3-4 for tetrahedra).
**/
enum class ElementType { Tet4, Tet10, Hex8, Hex20, Wedge6, Wedge15 };

int numNodesOf(ElementType type);

/** Elements of one type; `nodes` contains numNodesOf(type) mesh indices (0-based) per element. **/
struct ElementBlock {
    ElementType type = ElementType::Hex8;
    std::vector<int> nodes;
    bool isShell = false;  ///< the last corners are on the upper side of the shell, which its
                           ///< normal points to

    int numElements() const { return int(nodes.size()) / numNodesOf(type); }
};

/** Nodes by index 0…numNodes()−1, with their deck numbers. **/
struct Mesh {
    std::vector<int> nodeNumbers;   ///< deck numbers, ascending
    std::vector<double> positions;  ///< 3×numNodes, x y z of each node [m]
    std::vector<ElementBlock> elements;
    std::map<std::string, std::vector<int>>
        nodeSets;  ///< upper-case name → mesh indices, ascending
    /** Solid nodes (mesh indices) that replace each node of a shell or beam, by deck number. **/
    std::map<int, std::vector<int>> expandedNodes;
    int numInternalNodes = 0;  ///< the last nodes are internal degrees of freedom of elements,
                               ///< without a position

    int numNodes() const { return int(nodeNumbers.size()); }

    std::array<double, 3> position(int node) const {
        return {positions[3 * node], positions[3 * node + 1], positions[3 * node + 2]};
    }

    /** Returns the mesh index of the node with this deck number.
    @throws std::out_of_range naming the number. **/
    int indexOf(int nodeNumber) const;
};

}  // namespace simflex
