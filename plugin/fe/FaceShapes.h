#pragma once
/** @file
Shape functions of element faces and shells of 3, 4, 6 or 8 nodes (corners, then mid-edge nodes;
mid-edge node k lies between corners k and k+1). Internal to fe.

Natural coordinates as in CalculiX: triangles 0…1 with ξ+η ≤ 1, quadrilaterals −1…1. **/

#include <array>
#include <vector>

#include "Vec3d.h"
#include "simflex/part/Mesh.h"

namespace simflex {

/** Values and derivatives with respect to ξ and η at a point of a face. **/
struct FaceShapes {
    std::array<double, 8> N{}, dXi{}, dEta{};
};

/** @pre numNodes is 3, 4, 6 or 8. **/
FaceShapes calcFaceShapes(int numNodes, double xi, double eta);

/** Returns the natural coordinates of a node of a face. **/
std::array<double, 2> getFaceNodeCoordinates(int numNodes, int node);

/** Returns whether the point is in the face or on its boundary. **/
bool isOnFace(int numNodes, double xi, double eta);

/** A point of a face with given node positions. **/
struct FacePoint {
    FaceShapes shapes;
    Vec3d position{}, tangentXi{}, tangentEta{};
};
FacePoint calcFacePoint(const std::vector<Vec3d>& nodes, double xi, double eta);

/** Returns the nodes of face 1…6 of a solid in CalculiX's numbering (S1, S2, …): indices into the
element, corners first. Empty if the element has no such face. **/
std::vector<int> getFaceNodes(ElementType type, int face);

}  // namespace simflex
