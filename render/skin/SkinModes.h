#pragma once
/** @file
The skin of a reduced part and the rows of Φ that move it: constant, shared by threads, in single
precision. Internal. The points of the skin are its nodes, then points between nodes on curved
faces. **/

#include <memory>
#include <vector>

#include "CurvedSurface.h"
#include "simflex/part/ReducedBody.h"
#include "simflex/render/scene/SurfaceGeometry.h"

namespace simflex {

struct SkinModes {
    std::shared_ptr<const ReducedBody> part;
    std::vector<int> nodes;            ///< mesh index of each skin node, ascending
    std::vector<float> restPositions;  ///< s, 3 per skin node [m]
    std::vector<float> Phi;            ///< (3·skin nodes)×n_f, column-major
    PointsBetween between;             ///< points on curved faces
    std::vector<int> vertexPoint;      ///< point of each vertex of `undeformed`
    VertexTriangles around;            ///< for each vertex of `undeformed`
    std::shared_ptr<const SurfaceGeometry> undeformed;

    int numNodes() const { return int(nodes.size()); }
    int numPoints() const { return numNodes() + between.size(); }
};

/** Extracts the skin. Edges sharper than `creaseAngle` [rad] are drawn sharp. O(elements + points +
skin nodes·n_f).
@throws std::invalid_argument naming the part if Φ does not match the mesh. **/
std::shared_ptr<const SkinModes> extractSkinModes(std::shared_ptr<const ReducedBody> part,
                                                  double creaseAngle);

}  // namespace simflex
