#pragma once
/** @file
Triangles ready to be drawn, with normals split at sharp edges. Internal to the renderer. **/

#include <array>
#include <cstdint>
#include <vector>

#include "SimTKcommon.h"

namespace simflex {

/** Data for the GPU. A vertex has seven floats: position, normal, contour value. **/
struct SurfaceGeometry {
    static constexpr int floatsPerVertex = 7;

    std::vector<float> vertices;              ///< floatsPerVertex per vertex
    std::vector<std::uint32_t> triangles;     ///< three vertex indices each, anticlockwise seen
                                              ///< from outside
    std::vector<std::uint32_t> featureEdges;  ///< two vertex indices each
    std::vector<std::uint32_t> elementEdges;  ///< two vertex indices each
    bool isClosed = false;                    ///< only the outside is visible
    bool isFine = false;             ///< per-vertex lighting suffices, see isFinelyDivided()
    SimTK::Vec3 lower{0}, upper{0};  ///< bounding box
    unsigned version = 1;            ///< incremented when `vertices` change

    int numVertices() const { return int(vertices.size()) / floatsPerVertex; }

    void addVertex(const SimTK::Vec3& position, const SimTK::Vec3& normal);
    void addTriangle(std::uint32_t a, std::uint32_t b, std::uint32_t c);
    void addEdge(std::uint32_t a, std::uint32_t b);

    void updateBounds();
};

/** The vertices of a surface with sharp edges: one per node and adjacent smooth patch. **/
struct CreasedSurface {
    std::vector<int> vertexNode;              ///< node of each vertex
    std::vector<std::uint32_t> triangles;     ///< vertex indices
    std::vector<std::uint32_t> featureEdges;  ///< vertex index pairs: creases and open boundaries
    std::vector<std::uint32_t> nodeVertex;    ///< one vertex of each node, for lines along edges
};

/** Splits nodes where neighbouring triangles meet at more than `creaseAngle` [rad].
`positions` holds x, y, z per node; triangles are node indices. O(triangles). **/
CreasedSurface splitAtCreases(const std::vector<float>& positions,
                              const std::vector<std::array<int, 3>>& triangles, double creaseAngle);

/** Triangles around each vertex. **/
struct VertexTriangles {
    std::vector<std::uint32_t> starts;     ///< index of each vertex's first one in `triangles`, and
                                           ///< the end
    std::vector<std::uint32_t> triangles;  ///< ascending for each vertex
};

VertexTriangles findVertexTriangles(const SurfaceGeometry& geometry);

/** Writes area-weighted smooth normals into `geometry.vertices`, in parallel; each vertex sums its
triangles' normals in a fixed order.
@param triangleNormals  workspace, three per triangle **/
void calcNormals(SurfaceGeometry& geometry, const VertexTriangles& around,
                 std::vector<float>& triangleNormals);

/** As above for shapes that do not change. **/
void calcNormals(SurfaceGeometry& geometry);

/** Returns whether triangles are so small, and normals change so little across them, that
per-vertex lighting looks the same. Uses positions, normals and bounds. **/
bool isFinelyDivided(const SurfaceGeometry& geometry);

}  // namespace simflex
