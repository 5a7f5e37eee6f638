#include "simflex/part/MeshFaces.h"

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
    throw std::invalid_argument("extractBoundaryFaces: unknown element type");
}

bool isQuadratic(ElementType type) {
    return type == ElementType::Tet10 || type == ElementType::Hex20 || type == ElementType::Wedge15;
}

struct Face {
    MeshFace nodes;
    std::array<int, 4> key;  // corner nodes sorted
    std::size_t order;       // place in the mesh, so that the result does not depend on sorting
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
                        "extractBoundaryFaces: an element uses node index " +
                        std::to_string(nodes[i]) + ", the mesh has nodes 0 to " +
                        std::to_string(mesh.numNodes() - 1));
            for (const FaceTemplate& shape : templates) {
                Face face;
                for (int k = 0; k < 4; ++k) {
                    face.nodes.corners[k] = shape.corners[k] < 0 ? -1 : nodes[shape.corners[k]];
                    const bool hasMiddle = isQuadratic(block.type) && shape.middles[k] >= 0;
                    face.nodes.middles[k] = hasMiddle ? nodes[shape.middles[k]] : -1;
                }
                face.key = face.nodes.corners;
                std::sort(face.key.begin(), face.key.end());
                face.order = faces.size();
                faces.push_back(face);
            }
        }
    }
    return faces;
}

}  // namespace

std::vector<MeshFace> extractBoundaryFaces(const Mesh& mesh) {
    std::vector<Face> faces = collectFaces(mesh);
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
    std::vector<MeshFace> skin;
    for (const Face& face : boundary) skin.push_back(face.nodes);
    return skin;
}

}  // namespace simflex
