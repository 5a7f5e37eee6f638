#pragma once
/** @file
Triangles ready to be drawn, with normals split at sharp edges. Internal to the renderer. **/

#include <array>
#include <cstdint>
#include <vector>

#include "SimTKcommon.h"

namespace simflex {

/** What the GPU gets. A vertex has seven floats: position, normal, value of the contour. **/
struct SurfaceGeometry {
    static constexpr int floatsPerVertex = 7;

    std::vector<float> vertices;              ///< floatsPerVertex per vertex
    std::vector<std::uint32_t> triangles;     ///< three vertex indices each, anticlockwise outside
    std::vector<std::uint32_t> featureEdges;  ///< two vertex indices each
    std::vector<std::uint32_t> elementEdges;  ///< two vertex indices each
    bool isClosed = false;                    ///< seen from outside only, back faces are hidden
    bool isFine = false;             ///< light may be found at vertices, see isFinelyDivided()
    SimTK::Vec3 lower{0}, upper{0};  ///< bounding box
    unsigned version = 1;            ///< grows whenever `vertices` change

    int numVertices() const { return int(vertices.size()) / floatsPerVertex; }

    void addVertex(const SimTK::Vec3& position, const SimTK::Vec3& normal);
    void addTriangle(std::uint32_t a, std::uint32_t b, std::uint32_t c);
    void addEdge(std::uint32_t a, std::uint32_t b);

    /** Sets the bounding box from the vertices. **/
    void updateBounds();
};

/** The vertices that a surface with sharp edges needs: one per node and smooth patch around it. **/
struct CreasedSurface {
    std::vector<int> vertexNode;              ///< node of each vertex
    std::vector<std::uint32_t> triangles;     ///< vertex indices
    std::vector<std::uint32_t> featureEdges;  ///< vertex index pairs: creases and open borders
    std::vector<std::uint32_t> nodeVertex;    ///< one vertex of each node, for lines along edges
};

/** Splits nodes where neighbouring triangles meet at more than `creaseAngle` [rad].
`positions` holds x, y, z per node; triangles are node indices. O(triangles). **/
CreasedSurface splitAtCreases(const std::vector<float>& positions,
                              const std::vector<std::array<int, 3>>& triangles, double creaseAngle);

/** Triangles around each vertex. **/
struct VertexTriangles {
    std::vector<std::uint32_t> starts;     ///< of each vertex in `triangles`, and one behind
    std::vector<std::uint32_t> triangles;  ///< ascending for each vertex
};

VertexTriangles findVertexTriangles(const SurfaceGeometry& geometry);

/** Writes area-weighted smooth normals into `geometry.vertices` from its positions, in parallel:
each vertex gathers its triangles' in the same order.
@param triangleNormals  workspace, three per triangle **/
void calcNormals(SurfaceGeometry& geometry, const VertexTriangles& around,
                 std::vector<float>& triangleNormals);

/** The same for shapes that do not change. **/
void calcNormals(SurfaceGeometry& geometry);

/** Whether triangles are so small, and normals turn so little across them, that light found at
their corners and interpolated looks the same. From positions, normals and bounds. **/
bool isFinelyDivided(const SurfaceGeometry& geometry);

}  // namespace simflex
