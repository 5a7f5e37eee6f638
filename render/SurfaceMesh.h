#pragma once
/** @file
The skin of a solid mesh: the faces that belong to one element only, as triangles.

Faces of quadratic elements are divided at their mid-edge nodes (a 6-node triangle into 4, an 8-node
quadrilateral into 6 triangles), so that curved faces look curved. **/

#include <array>
#include <vector>

#include "simflex/part/Mesh.h"

namespace simflex {

struct SurfaceMesh {
    std::vector<int> nodes;  ///< mesh indices of the nodes used, ascending
    std::vector<std::array<int, 3>>
        triangles;  ///< indices into `nodes`, anticlockwise from outside
    std::vector<std::array<int, 2>> elementEdges;  ///< edges of element faces, without duplicates
};

/** Extracts the skin. Time and memory O(faces).
@throws std::invalid_argument naming a node index outside the mesh. **/
SurfaceMesh extractSurface(const Mesh& mesh);

}  // namespace simflex
