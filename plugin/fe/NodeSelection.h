#pragma once
/** @file
Chooses nodes of a mesh: by node set, number or geometry. Deck coordinates, metres.

    selectNodes(mesh, "SHAFT")                           the nodes of a set (or surface) of the deck
    selectNodes(mesh, "node:17")                         one node by its number in the deck; of a
                                                         shell or beam its expanded nodes too
    selectNodes(mesh, "sphere:0,0,0,0.01")               x,y,z,r: nodes no farther than r from x,y,z
    selectNodes(mesh, "cylinder:0,0,0,0,0,1,0.005")      x,y,z,ax,ay,az,r: nodes no farther than r
                                                         from the axis through x,y,z along a
    selectNodes(mesh, "cylinder:0,0,0,0,0,1,0.005,0.02") the same, at most 0.02 up the axis
    selectNodes(mesh, "plane:0.2,0,0,1,0,0")             x,y,z,nx,ny,nz: nodes on the plane

Every shape takes round-off with it: one millionth of the mesh's size. **/

#include <array>
#include <string>
#include <vector>

#include "simflex/part/Mesh.h"

namespace simflex {

/** Mesh indices, ascending; upper and lower case of a set's name are the same.
@throws std::invalid_argument for a set or node that does not exist (lists those that do), a shape
    with the wrong number of numbers or an impossible one, or one that holds no node (says how far
    away the nearest is). **/
std::vector<int> selectNodes(const Mesh& mesh, const std::string& selection);

/** A node's share of a volume or area: ∫ N and ∫ N x. **/
struct NodeShare {
    double weight = 0;  ///< may be zero or negative
    std::array<double, 3> moment{};
};

/** Shares of nodes in a mean over them: of the volume of the elements that they make up, else of
the area of the faces of the skin, else of faces between elements; where they make up none of these,
all alike. Deck coordinates. **/
std::vector<NodeShare> calcNodeShares(const Mesh& mesh, const std::vector<int>& nodes);

/** Where the middle of the selected nodes is taken to be, whatever the mesh: the centroid of the
elements that they make up, else of the faces of the skin, else their mean. Where the selection is a
cylinder, or all nodes lie on one and go round more than half of it, that centroid's foot on the
axis. Deck coordinates [m].
@throws std::invalid_argument as selectNodes(). **/
std::array<double, 3> findMiddle(const Mesh& mesh, const std::string& selection);

}  // namespace simflex
