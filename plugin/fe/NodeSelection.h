#pragma once
/** @file
Selects nodes of a mesh by node set, number or geometry. Deck coordinates, metres.

    selectNodes(mesh, "SHAFT")                           the nodes of a set (or surface) of the deck
    selectNodes(mesh, "node:17")                         one node by its number in the deck; of a
                                                         shell or beam its expanded nodes too
    selectNodes(mesh, "sphere:0,0,0,0.01")               x,y,z,r: nodes no farther than r from x,y,z
    selectNodes(mesh, "cylinder:0,0,0,0,0,1,0.005")      x,y,z,ax,ay,az,r: nodes no farther than r
                                                         from the axis through x,y,z along a
    selectNodes(mesh, "cylinder:0,0,0,0,0,1,0.005,0.02") the same, at most 0.02 up the axis
    selectNodes(mesh, "plane:0.2,0,0,1,0,0")             x,y,z,nx,ny,nz: nodes on the plane

Shapes have a tolerance of one millionth of the mesh's size. **/

#include <array>
#include <string>
#include <vector>

#include "simflex/part/Mesh.h"

namespace simflex {

/** Returns mesh indices, ascending. Set names are case-insensitive.
@throws std::invalid_argument for a set or node that does not exist (listing the existing ones), a
shape with the wrong count of numbers or invalid ones, or one that contains no node (with the
distance of the nearest). **/
std::vector<int> selectNodes(const Mesh& mesh, const std::string& selection);

/** Share of a node in a volume or area: ∫ N and ∫ N x. **/
struct NodeShare {
    double weight = 0;  ///< may be zero or negative
    std::array<double, 3> moment{};
};

/** Returns the nodes' shares in an average: of the volume of the elements they form, else of the
area of the boundary faces, else of faces between elements; if they form none of these, equal
shares. Deck coordinates. **/
std::vector<NodeShare> calcNodeShares(const Mesh& mesh, const std::vector<int>& nodes);

/** Returns the middle of the selected nodes, independent of the mesh density: the centroid of the
elements they form, else of the boundary faces, else their mean. If the selection is a cylinder, or
all nodes lie on one and cover more than half of its circumference, the centroid is projected onto
the axis. Deck coordinates [m].
@throws std::invalid_argument as selectNodes(). **/
std::array<double, 3> findMiddle(const Mesh& mesh, const std::string& selection);

}  // namespace simflex
