#pragma once
/** @file
Faces of a solid mesh. Standard types only. **/

#include <array>
#include <vector>

#include "simflex/part/Mesh.h"

namespace simflex {

/** A face of an element: mesh indices of its corners, anticlockwise seen from outside, and of its
mid-edge nodes (middles[k] is between corners k and k+1); −1: none. **/
struct MeshFace {
    std::array<int, 4> corners;
    std::array<int, 4> middles;

    int numCorners() const { return corners[3] < 0 ? 3 : 4; }
    bool isQuadratic() const { return middles[0] >= 0; }
};

/** Returns the faces that belong to one element only, in the order of the mesh's elements. Time and
memory O(faces) unless a node belongs to a large share of them.
@throws std::invalid_argument naming a node index outside the mesh. **/
std::vector<MeshFace> extractBoundaryFaces(const Mesh& mesh);

/** Returns the boundary faces whose nodes are all chosen.
@param isChosen  by mesh index **/
std::vector<MeshFace> listSkinOf(const Mesh& mesh, const std::vector<char>& isChosen);

/** As listSkinOf(), but if all nodes of a shell are chosen, only its upper side, so that a load per
area acts once. **/
std::vector<MeshFace> listLoadedFaces(const Mesh& mesh, const std::vector<char>& isChosen);

/** Returns all faces, boundary or internal, whose nodes are all chosen, without duplicates.
O(faces).
@param isChosen  by mesh index **/
std::vector<MeshFace> listFacesOf(const Mesh& mesh, const std::vector<char>& isChosen);

enum class ShellSide { Bottom, Top };

/** The nodes on one side of the shells at a node of the deck, ascending mesh indices: one where
they have one normal there, none for a node of no shell. Part files written before this could be
told have none. O(elements). **/
std::vector<int> listNodesOnSide(const Mesh& mesh, int nodeNumber, ShellSide side);

}  // namespace simflex
