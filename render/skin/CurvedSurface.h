#pragma once
/** @file
The skin of a solid mesh, with curved faces of quadratic elements. Internal.

A face is x(ξ,η) = Σ N_k(ξ,η) x_k over its 6 or 8 nodes, N the serendipity shape functions. It is
divided at its mid-edge nodes, and further where a chord deviates by more than a tolerance. Added
vertices are linear combinations of nodes with constant weights, which also interpolate
displacements and nodal values. An edge is divided in the same way by both of its faces, from its
own three nodes, so that no gap opens. **/

#include <vector>

#include "simflex/render/SurfaceMesh.h"

namespace simflex {

/** Points Σ_k weights[k]·(value at nodes[k]), k = starts[i] … starts[i+1]−1 for point i. **/
struct PointsBetween {
    std::vector<int> starts{0};
    std::vector<int> nodes;  ///< indices into the skin's nodes
    std::vector<float> weights;

    int size() const { return int(starts.size()) - 1; }

    /** Computes out[0…size()−1] from one value per skin node. **/
    void interpolate(const float* values, float* out) const;
    /** As interpolate(), with three values each. **/
    void interpolate3(const float* values, float* out) const;
};

struct CurvedSurface {
    /** Triangles and edges refer to points instead of nodes: first the skin's nodes, then those
    between. **/
    SurfaceMesh mesh;
    PointsBetween between;

    int numPoints() const { return int(mesh.nodes.size()) + between.size(); }
};

/** Returns half a pixel if the part fills the picture: 3e-4 of the diagonal of its bounding box
[m]. **/
double calcChordTolerance(const Mesh& mesh);

/** Extracts the skin; no chord deviates by more than `tolerance` [m] from its face, up to 32 chords
per edge. O(faces + points).
@throws std::invalid_argument naming a node index outside the mesh. **/
CurvedSurface extractCurvedSurface(const Mesh& mesh, double tolerance);

}  // namespace simflex
