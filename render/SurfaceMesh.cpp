#include "simflex/render/SurfaceMesh.h"

#include <algorithm>

#include "simflex/part/MeshFaces.h"

namespace simflex {

namespace {

void divide(const MeshFace& face, std::vector<std::array<int, 3>>& triangles) {
    const auto& c = face.corners;
    const auto& m = face.middles;
    const int n = face.numCorners();
    if (!face.isQuadratic()) {
        triangles.push_back({c[0], c[1], c[2]});
        if (n == 4) triangles.push_back({c[0], c[2], c[3]});
        return;
    }
    for (int k = 0; k < n; ++k) triangles.push_back({c[k], m[k], m[(k + n - 1) % n]});
    triangles.push_back({m[0], m[1], m[2]});
    if (n == 4) triangles.push_back({m[0], m[2], m[3]});
}

void collectEdges(const MeshFace& face, std::vector<std::array<int, 2>>& edges) {
    const int n = face.numCorners();
    for (int k = 0; k < n; ++k) {
        const int a = face.corners[k], b = face.corners[(k + 1) % n], m = face.middles[k];
        if (m < 0) {
            edges.push_back({std::min(a, b), std::max(a, b)});
        } else {
            edges.push_back({std::min(a, m), std::max(a, m)});
            edges.push_back({std::min(b, m), std::max(b, m)});
        }
    }
}

}  // namespace

SurfaceMesh extractSurface(const Mesh& mesh) {
    SurfaceMesh surface;
    for (const MeshFace& face : extractBoundaryFaces(mesh)) {
        divide(face, surface.triangles);
        collectEdges(face, surface.elementEdges);
    }
    std::sort(surface.elementEdges.begin(), surface.elementEdges.end());
    surface.elementEdges.erase(
        std::unique(surface.elementEdges.begin(), surface.elementEdges.end()),
        surface.elementEdges.end());

    // Renumber: only nodes of the skin, in mesh order.
    std::vector<int> newIndex(mesh.numNodes(), -1);
    for (const auto& triangle : surface.triangles)
        for (const int node : triangle) newIndex[node] = 0;
    for (int node = 0; node < mesh.numNodes(); ++node)
        if (newIndex[node] == 0) {
            newIndex[node] = int(surface.nodes.size());
            surface.nodes.push_back(node);
        }
    for (auto& triangle : surface.triangles)
        for (int& node : triangle) node = newIndex[node];
    for (auto& edge : surface.elementEdges)
        for (int& node : edge) node = newIndex[node];
    return surface;
}

}  // namespace simflex
