#include "simflex/part/MeshFaces.h"

#include <algorithm>
#include <set>
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

MeshFace makeFace(const FaceTemplate& shape, ElementType type, const int* nodes) {
    MeshFace face;
    for (std::size_t k = 0; k < 4; ++k) {
        face.corners[k] = shape.corners[k] < 0 ? -1 : nodes[shape.corners[k]];
        const bool hasMiddle = isQuadratic(type) && shape.middles[k] >= 0;
        face.middles[k] = hasMiddle ? nodes[shape.middles[k]] : -1;
    }
    return face;
}

void checkNodes(const Mesh& mesh) {
    for (const ElementBlock& block : mesh.elements)
        for (const int node : block.nodes)
            if (node < 0 || node >= mesh.numNodes())
                throw std::invalid_argument("extractBoundaryFaces: an element uses node index " +
                                            std::to_string(node) + ", the mesh has nodes 0 to " +
                                            std::to_string(mesh.numNodes() - 1));
}

/** Calls visit(face) for all faces of all elements, in the order of the mesh. **/
template <class Visit>
void forEachFace(const Mesh& mesh, const Visit& visit) {
    for (const ElementBlock& block : mesh.elements) {
        const std::vector<FaceTemplate> templates = getFaces(block.type);
        const std::size_t perElement = std::size_t(numNodesOf(block.type));
        for (int e = 0; e < block.numElements(); ++e)
            for (const FaceTemplate& shape : templates)
                visit(makeFace(shape, block.type, &block.nodes[std::size_t(e) * perElement]));
    }
}

using Key = std::array<int, 4>;  // sorted corners; −1 of a triangle last

Key calcKey(const MeshFace& face) {
    Key key = face.corners;
    std::sort(key.begin(), key.begin() + face.numCorners());
    return key;
}

struct Entry {
    std::array<int, 3> others;  // the key's other corners
    std::size_t face;           // index of the face in the mesh
};

}  // namespace

std::vector<MeshFace> extractBoundaryFaces(const Mesh& mesh) {
    checkNodes(mesh);

    // Group faces by their lowest corner: few share one, so duplicates are found in linear time.
    std::vector<std::size_t> starts(std::size_t(mesh.numNodes()) + 1, 0);
    std::size_t numFaces = 0;
    forEachFace(mesh, [&](const MeshFace& face) {
        ++starts[std::size_t(calcKey(face)[0]) + 1];
        ++numFaces;
    });
    for (std::size_t node = 1; node < starts.size(); ++node) starts[node] += starts[node - 1];
    std::vector<Entry> entries(numFaces);
    std::vector<std::size_t> ends(starts.begin(), starts.end() - 1);
    std::size_t number = 0;
    forEachFace(mesh, [&](const MeshFace& face) {
        const Key key = calcKey(face);
        entries[ends[std::size_t(key[0])]++] = {{key[1], key[2], key[3]}, number++};
    });

    std::vector<bool> isBoundary(numFaces, false);
    std::size_t numBoundary = 0;
    for (std::size_t node = 0; node + 1 < starts.size(); ++node) {
        const auto first = entries.begin() + std::ptrdiff_t(starts[node]);
        const auto last = entries.begin() + std::ptrdiff_t(starts[node + 1]);
        std::sort(first, last, [](const Entry& a, const Entry& b) { return a.others < b.others; });
        for (auto i = first; i != last;) {
            auto j = i + 1;
            while (j != last && j->others == i->others) ++j;
            if (j == i + 1) {
                isBoundary[i->face] = true;
                ++numBoundary;
            }
            i = j;
        }
    }

    std::vector<MeshFace> skin;
    skin.reserve(numBoundary);
    number = 0;
    forEachFace(mesh, [&](const MeshFace& face) {
        if (isBoundary[number++]) skin.push_back(face);
    });
    return skin;
}

std::vector<MeshFace> listSkinOf(const Mesh& mesh, const std::vector<char>& isChosen) {
    std::vector<MeshFace> faces = extractBoundaryFaces(mesh);
    const auto isLeftOut = [&](int node) { return node >= 0 && !isChosen[std::size_t(node)]; };
    faces.erase(std::remove_if(
                    faces.begin(), faces.end(),
                    [&](const MeshFace& face) {
                        return std::any_of(face.corners.begin(), face.corners.end(), isLeftOut) ||
                               std::any_of(face.middles.begin(), face.middles.end(), isLeftOut);
                    }),
                faces.end());
    return faces;
}

std::vector<MeshFace> listLoadedFaces(const Mesh& mesh, const std::vector<char>& isChosen) {
    std::set<Key> hidden;  // lower sides and edges of fully chosen shells
    for (const ElementBlock& block : mesh.elements) {
        if (!block.isShell) continue;
        const std::size_t size = std::size_t(numNodesOf(block.type));
        const int firstOnTop =
            block.type == ElementType::Wedge6 || block.type == ElementType::Wedge15 ? 3 : 4;
        for (std::size_t first = 0; first + size <= block.nodes.size(); first += size) {
            const int* nodes = &block.nodes[first];
            if (!std::all_of(nodes, nodes + size,
                             [&](int node) { return isChosen[std::size_t(node)] != 0; }))
                continue;
            for (const FaceTemplate& shape : getFaces(block.type))
                if (std::any_of(shape.corners.begin(), shape.corners.end(),
                                [&](int corner) { return corner >= 0 && corner < firstOnTop; }))
                    hidden.insert(calcKey(makeFace(shape, block.type, nodes)));
        }
    }
    std::vector<MeshFace> faces = listSkinOf(mesh, isChosen);
    faces.erase(
        std::remove_if(faces.begin(), faces.end(),
                       [&](const MeshFace& face) { return hidden.count(calcKey(face)) > 0; }),
        faces.end());
    return faces;
}

std::vector<MeshFace> listFacesOf(const Mesh& mesh, const std::vector<char>& isChosen) {
    checkNodes(mesh);
    std::vector<MeshFace> faces;
    std::set<Key> known;
    const auto isLeftOut = [&](int node) { return node >= 0 && !isChosen[std::size_t(node)]; };
    forEachFace(mesh, [&](const MeshFace& face) {
        if (std::any_of(face.corners.begin(), face.corners.end(), isLeftOut) ||
            std::any_of(face.middles.begin(), face.middles.end(), isLeftOut))
            return;
        if (known.insert(calcKey(face)).second) faces.push_back(face);
    });
    return faces;
}

std::vector<int> listNodesOnSide(const Mesh& mesh, int nodeNumber, ShellSide side) {
    const auto expanded = mesh.expandedNodes.find(nodeNumber);
    if (expanded == mesh.expandedNodes.end()) return {};
    std::vector<int> nodes;
    for (const ElementBlock& block : mesh.elements) {
        if (!block.isShell) continue;
        const int count = numNodesOf(block.type);
        const bool isWedge =
            block.type == ElementType::Wedge6 || block.type == ElementType::Wedge15;
        for (size_t k = 0; k < block.nodes.size(); ++k) {
            // Corners below and above, middles below and above, then those between.
            const int layer = int(k) % count / (isWedge ? 3 : 4);
            if (layer > 3 || layer % 2 != (side == ShellSide::Top)) continue;
            if (std::binary_search(expanded->second.begin(), expanded->second.end(),
                                   block.nodes[k]))
                nodes.push_back(block.nodes[k]);
        }
    }
    std::sort(nodes.begin(), nodes.end());
    nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
    return nodes;
}

}  // namespace simflex
