#include "SkinModes.h"

#include <numeric>
#include <stdexcept>

#include "SkinProduct.h"

namespace simflex {

std::shared_ptr<const SkinModes> extractSkinModes(std::shared_ptr<const ReducedBody> part,
                                                  double creaseAngle) {
    const std::size_t rows = 3 * std::size_t(part->mesh.numNodes());
    if (part->Phi.size() != rows * part->numModes || part->mesh.positions.size() != rows)
        throw std::invalid_argument("cannot draw part '" + part->name +
                                    "': " + std::to_string(part->mesh.numNodes()) + " nodes and " +
                                    std::to_string(part->numModes) + " modes need " +
                                    std::to_string(rows * part->numModes) +
                                    " values of Phi, it has " + std::to_string(part->Phi.size()));

    CurvedSurface surface = extractCurvedSurface(part->mesh, calcChordTolerance(part->mesh));
    if (part->mesh.elements.empty()) {  // nodes only: drawn as dots
        surface.mesh.nodes.resize(std::size_t(part->mesh.numNodes()));
        std::iota(surface.mesh.nodes.begin(), surface.mesh.nodes.end(), 0);
    }
    auto skin = std::make_shared<SkinModes>();
    skin->nodes = std::move(surface.mesh.nodes);
    skin->between = std::move(surface.between);
    const std::size_t numNodes = skin->nodes.size();
    skin->restPositions.resize(3 * numNodes);
    for (std::size_t i = 0; i < 3 * numNodes; ++i)
        skin->restPositions[i] =
            float(part->mesh.positions[3 * std::size_t(skin->nodes[i / 3]) + i % 3]);
    const std::size_t numModes = std::size_t(part->numModes);
    skin->Phi.resize(3 * numNodes * numModes);
    forSkinChunks(numNodes, 3 * numNodes * numModes, [&](std::size_t first, std::size_t end) {
        for (std::size_t mode = 0; mode < numModes; ++mode) {
            const double* from = &part->Phi[mode * rows];
            float* to = &skin->Phi[mode * 3 * numNodes];
            for (std::size_t i = first; i < end; ++i)
                for (std::size_t k = 0; k < 3; ++k)
                    to[3 * i + k] = float(from[3 * std::size_t(skin->nodes[i]) + k]);
        }
    });

    std::vector<float> positions = skin->restPositions;
    positions.resize(3 * std::size_t(skin->numPoints()));
    skin->between.interpolate3(skin->restPositions.data(), &positions[3 * numNodes]);
    CreasedSurface creased = splitAtCreases(positions, surface.mesh.triangles, creaseAngle);
    skin->vertexPoint = std::move(creased.vertexNode);
    if (surface.mesh.triangles.empty()) {
        skin->vertexPoint.resize(numNodes);
        std::iota(skin->vertexPoint.begin(), skin->vertexPoint.end(), 0);
    }
    auto undeformed = std::make_shared<SurfaceGeometry>();
    undeformed->triangles = std::move(creased.triangles);
    undeformed->featureEdges = std::move(creased.featureEdges);
    undeformed->elementEdges.reserve(2 * surface.mesh.elementEdges.size());
    for (const auto& edge : surface.mesh.elementEdges)
        for (const int point : edge)
            undeformed->elementEdges.push_back(creased.nodeVertex[std::size_t(point)]);
    undeformed->vertices.reserve(SurfaceGeometry::floatsPerVertex * skin->vertexPoint.size());
    for (const int point : skin->vertexPoint) {
        const float* s = &positions[3 * std::size_t(point)];
        undeformed->addVertex(SimTK::Vec3(s[0], s[1], s[2]), SimTK::Vec3(0));
    }
    skin->around = findVertexTriangles(*undeformed);
    std::vector<float> triangleNormals;
    calcNormals(*undeformed, skin->around, triangleNormals);
    undeformed->isClosed = true;
    undeformed->updateBounds();
    undeformed->isFine = isFinelyDivided(*undeformed);
    skin->undeformed = std::move(undeformed);
    skin->part = std::move(part);
    return skin;
}

}  // namespace simflex
