#pragma once
/** @file
The skin of a solid mesh with faces of quadratic elements as curved as they are. Internal.

A face is x(ξ,η) = Σ N_k(ξ,η) x_k over its 6 or 8 nodes, N the serendipity shape functions. It is
divided at its mid-edge nodes, and further where a chord leaves it by more than a tolerance. The
vertices so added are linear combinations of nodes, with constant weights: displacements and nodal
values at them follow like positions. An edge is divided alike by both its faces, by what its own
three nodes say, so that no gap opens. **/

#include <vector>

#include "simflex/render/SurfaceMesh.h"

namespace simflex {

/** Points Σ_k weights[k]·(value at nodes[k]), k = starts[i] … starts[i+1]−1 for point i. **/
struct PointsBetween {
    std::vector<int> starts{0};
    std::vector<int> nodes;  ///< by place among the skin's nodes
    std::vector<float> weights;

    int size() const { return int(starts.size()) - 1; }

    /** out[0…size()−1] from one value per skin node. **/
    void interpolate(const float* values, float* out) const;
    /** The same of three values each. **/
    void interpolate3(const float* values, float* out) const;
};

struct CurvedSurface {
    /** Triangles and edges have points for nodes: first nodes of the skin, then those between. **/
    SurfaceMesh mesh;
    PointsBetween between;

    int numPoints() const { return int(mesh.nodes.size()) + between.size(); }
};

/** Half a pixel where the part fills the picture: 3e-4 of the diagonal of its bounding box [m]. **/
double calcChordTolerance(const Mesh& mesh);

/** Extracts the skin; no chord is farther than `tolerance` [m] from its face, up to 32 chords an
edge. O(faces + points).
@throws std::invalid_argument that names a node index outside the mesh. **/
CurvedSurface extractCurvedSurface(const Mesh& mesh, double tolerance);

}  // namespace simflex
