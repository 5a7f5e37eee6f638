#include "simflex/render/SurfaceMesh.h"

#include <algorithm>
#include <stdexcept>
#include <string>

namespace simflex {

namespace {

// Corners of one face, anticlockwise from outside, then mid-edge nodes in the same order; -1: none.
struct FaceTemplate {
    std::array<int, 4> corners;
    std::array<int, 4> middles;
};

std::vector<FaceTemplate> getFaces(ElementType type) {
    switch (type) {
        case ElementType::Tet4:
        case ElementType::Tet10:
            return {{{0, 2, 1, -1}, {6, 5, 4, -1}},
                    {{0, 1, 3, -1}, {4, 8, 7, -1}},
                    {{1, 2, 3, -1}, {5, 9, 8, -1}},
                    {{2, 0, 3, -1}, {6, 7, 9, -1}}};
        case ElementType::Hex8:
        case ElementType::Hex20:
            return {{{0, 3, 2, 1}, {11, 10, 9, 8}},   {{4, 5, 6, 7}, {12, 13, 14, 15}},
                    {{0, 1, 5, 4}, {8, 17, 12, 16}},  {{1, 2, 6, 5}, {9, 18, 13, 17}},
                    {{2, 3, 7, 6}, {10, 19, 14, 18}}, {{3, 0, 4, 7}, {11, 16, 15, 19}}};
        case ElementType::Wedge6:
        case ElementType::Wedge15:
            return {{{0, 2, 1, -1}, {8, 7, 6, -1}},
                    {{3, 4, 5, -1}, {9, 10, 11, -1}},
                    {{0, 1, 4, 3}, {6, 13, 9, 12}},
                    {{1, 2, 5, 4}, {7, 14, 10, 13}},
                    {{2, 0, 3, 5}, {8, 12, 11, 14}}};
    }
    throw std::invalid_argument("extractSurface: unknown element type");
}

bool isQuadratic(ElementType type) {
    return type == ElementType::Tet10 || type == ElementType::Hex20 || type == ElementType::Wedge15;
}

struct Face {
    std::array<int, 4> key;      // corner nodes sorted
    std::array<int, 4> corners;  // mesh indices, -1: none
    std::array<int, 4> middles;
    std::size_t order;  // place in the mesh, so that the result does not depend on sorting
};

std::vector<Face> collectFaces(const Mesh& mesh) {
    std::vector<Face> faces;
    for (const ElementBlock& block : mesh.elements) {
        const std::vector<FaceTemplate> templates = getFaces(block.type);
        const int perElement = numNodesOf(block.type);
        for (int e = 0; e < block.numElements(); ++e) {
            const int* nodes = &block.nodes[std::size_t(e) * perElement];
            for (int i = 0; i < perElement; ++i)
                if (nodes[i] < 0 || nodes[i] >= mesh.numNodes())
                    throw std::invalid_argument(
                        "extractSurface: an element uses node index " + std::to_string(nodes[i]) +
                        ", the mesh has nodes 0 to " + std::to_string(mesh.numNodes() - 1));
            for (const FaceTemplate& shape : templates) {
                Face face;
                for (int k = 0; k < 4; ++k) {
                    face.corners[k] = shape.corners[k] < 0 ? -1 : nodes[shape.corners[k]];
                    const bool hasMiddle = isQuadratic(block.type) && shape.middles[k] >= 0;
                    face.middles[k] = hasMiddle ? nodes[shape.middles[k]] : -1;
                }
                face.key = face.corners;
                std::sort(face.key.begin(), face.key.end());
                face.order = faces.size();
                faces.push_back(face);
            }
        }
    }
    return faces;
}

std::vector<Face> keepBoundary(std::vector<Face> faces) {
    std::sort(faces.begin(), faces.end(), [](const Face& a, const Face& b) {
        return a.key != b.key ? a.key < b.key : a.order < b.order;
    });
    std::vector<Face> boundary;
    for (std::size_t i = 0; i < faces.size();) {
        std::size_t j = i + 1;
        while (j < faces.size() && faces[j].key == faces[i].key) ++j;
        if (j == i + 1) boundary.push_back(faces[i]);
        i = j;
    }
    std::sort(boundary.begin(), boundary.end(),
              [](const Face& a, const Face& b) { return a.order < b.order; });
    return boundary;
}

void divide(const Face& face, std::vector<std::array<int, 3>>& triangles) {
    const auto& c = face.corners;
    const auto& m = face.middles;
    const int n = c[3] < 0 ? 3 : 4;
    if (m[0] < 0) {
        triangles.push_back({c[0], c[1], c[2]});
        if (n == 4) triangles.push_back({c[0], c[2], c[3]});
        return;
    }
    for (int k = 0; k < n; ++k) triangles.push_back({c[k], m[k], m[(k + n - 1) % n]});
    triangles.push_back({m[0], m[1], m[2]});
    if (n == 4) triangles.push_back({m[0], m[2], m[3]});
}

void collectEdges(const Face& face, std::vector<std::array<int, 2>>& edges) {
    const int n = face.corners[3] < 0 ? 3 : 4;
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
    const std::vector<Face> boundary = keepBoundary(collectFaces(mesh));
    SurfaceMesh surface;
    for (const Face& face : boundary) {
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
