#include "SkinModes.h"

#include <stdexcept>

#include "simflex/render/SurfaceMesh.h"

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

    const SurfaceMesh surface = extractSurface(part->mesh);
    auto skin = std::make_shared<SkinModes>();
    skin->nodes = surface.nodes;
    const std::size_t skinRows = 3 * surface.nodes.size();
    skin->restPositions.resize(skinRows);
    skin->Phi.resize(skinRows * part->numModes);
    for (std::size_t i = 0; i < skinRows; ++i) {
        const std::size_t row = 3 * std::size_t(surface.nodes[i / 3]) + i % 3;
        skin->restPositions[i] = float(part->mesh.positions[row]);
        for (int mode = 0; mode < part->numModes; ++mode)
            skin->Phi[mode * skinRows + i] = float(part->Phi[mode * rows + row]);
    }

    const CreasedSurface creased =
        splitAtCreases(skin->restPositions, surface.triangles, creaseAngle);
    skin->vertexNode = creased.vertexNode;
    auto undeformed = std::make_shared<SurfaceGeometry>();
    undeformed->triangles = creased.triangles;
    undeformed->featureEdges = creased.featureEdges;
    for (const auto& edge : surface.elementEdges)
        for (const int node : edge) undeformed->elementEdges.push_back(creased.nodeVertex[node]);
    for (const int node : skin->vertexNode) {
        const float* s = &skin->restPositions[3 * std::size_t(node)];
        undeformed->addVertex(SimTK::Vec3(s[0], s[1], s[2]), SimTK::Vec3(0));
    }
    calcNormals(*undeformed);
    undeformed->isClosed = true;
    undeformed->updateBounds();
    undeformed->isFine = isFinelyDivided(*undeformed);
    skin->undeformed = std::move(undeformed);
    skin->part = std::move(part);
    return skin;
}

}  // namespace simflex
