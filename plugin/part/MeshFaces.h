#pragma once
/** @file
Faces of a solid mesh. Standard types only. **/

#include <array>
#include <vector>

#include "simflex/part/Mesh.h"

namespace simflex {

/** One face of an element: mesh indices of its corners, anticlockwise from outside, and of its
mid-edge nodes (that between corners k and k+1 is middles[k]); −1 where there is none. **/
struct MeshFace {
    std::array<int, 4> corners;
    std::array<int, 4> middles;

    int numCorners() const { return corners[3] < 0 ? 3 : 4; }
    bool isQuadratic() const { return middles[0] >= 0; }
};

/** The faces that belong to one element only: the skin, in the order of the mesh's elements. Time
and memory O(faces) when no node has a large share of them.
@throws std::invalid_argument that names a node index outside the mesh. **/
std::vector<MeshFace> extractBoundaryFaces(const Mesh& mesh);

/** The faces of the skin that have these nodes alone.
@param isChosen  by mesh index **/
std::vector<MeshFace> listSkinOf(const Mesh& mesh, const std::vector<char>& isChosen);

/** The same, but of shells all of whose nodes are among them the upper side alone, so that a load
per area acts once. **/
std::vector<MeshFace> listLoadedFaces(const Mesh& mesh, const std::vector<char>& isChosen);

/** All faces that have these nodes alone, each once, wherever they lie in the mesh. O(faces).
@param isChosen  by mesh index **/
std::vector<MeshFace> listFacesOf(const Mesh& mesh, const std::vector<char>& isChosen);

enum class ShellSide { Bottom, Top };

/** The nodes on one side of the shells at a node of the deck, ascending mesh indices: one where
they have one normal there, none for a node of no shell. Part files written before this could be
told have none. O(elements). **/
std::vector<int> listNodesOnSide(const Mesh& mesh, int nodeNumber, ShellSide side);

}  // namespace simflex
