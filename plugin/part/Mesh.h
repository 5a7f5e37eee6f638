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

/** Number of nodes of one element. **/
int numNodesOf(ElementType type);

/** Elements of one kind; `nodes` holds numNodesOf(type) mesh indices (0-based) for each. **/
struct ElementBlock {
    ElementType type = ElementType::Hex8;
    std::vector<int> nodes;
    bool isShell = false;  ///< their last corners are on the upper side of a shell, to which n points

    int numElements() const { return int(nodes.size()) / numNodesOf(type); }
};

/** Nodes by index 0…numNodes()−1, with the numbers they carry in the deck. **/
struct Mesh {
    std::vector<int> nodeNumbers;   ///< number in the deck, ascending
    std::vector<double> positions;  ///< 3×numNodes, x y z of each node [m]
    std::vector<ElementBlock> elements;
    std::map<std::string, std::vector<int>>
        nodeSets;  ///< upper-case name → mesh indices, ascending
    /** Of nodes of shells and beams, by their numbers: the mesh indices of the nodes of their
     * solids. **/
    std::map<int, std::vector<int>> expandedNodes;
    int numInternalNodes = 0;  ///< the last ones are no places: elements bend by them within

    int numNodes() const { return int(nodeNumbers.size()); }

    std::array<double, 3> position(int node) const {
        return {positions[3 * node], positions[3 * node + 1], positions[3 * node + 2]};
    }

    /** Mesh index of the node with this deck number.
    @throws std::out_of_range naming the number. **/
    int indexOf(int nodeNumber) const;
};

}  // namespace simflex
