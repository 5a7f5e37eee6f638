#include "DeformedSurface.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "simflex/render/SurfaceMesh.h"

namespace simflex {

namespace {

constexpr int stride = SurfaceGeometry::floatsPerVertex;
constexpr int rowsPerChunk = 6144;  // fixed, so that results do not depend on the number of threads

}  // namespace

DeformedSurface::DeformedSurface(std::shared_ptr<const ReducedBody> reducedBody, double creaseAngle)
    : part(std::move(reducedBody)) {
    const std::size_t rows = 3 * std::size_t(part->mesh.numNodes());
    if (part->Phi.size() != rows * part->numModes || part->mesh.positions.size() != rows)
        throw std::invalid_argument("cannot draw part '" + part->name +
                                    "': " + std::to_string(part->mesh.numNodes()) + " nodes and " +
                                    std::to_string(part->numModes) + " modes need " +
                                    std::to_string(rows * part->numModes) +
                                    " values of Phi, it has " + std::to_string(part->Phi.size()));

    const SurfaceMesh skin = extractSurface(part->mesh);
    const std::size_t skinRows = 3 * skin.nodes.size();
    restPositions.resize(skinRows);
    skinPhi.resize(skinRows * part->numModes);
    for (std::size_t i = 0; i < skinRows; ++i) {
        const std::size_t row = 3 * std::size_t(skin.nodes[i / 3]) + i % 3;
        restPositions[i] = float(part->mesh.positions[row]);
        for (int mode = 0; mode < part->numModes; ++mode)
            skinPhi[mode * skinRows + i] = float(part->Phi[mode * rows + row]);
    }
    displacements.resize(skinRows);

    const CreasedSurface creased = splitAtCreases(restPositions, skin.triangles, creaseAngle);
    vertexNode = creased.vertexNode;
    undeformed = std::make_shared<SurfaceGeometry>();
    undeformed->triangles = creased.triangles;
    undeformed->featureEdges = creased.featureEdges;
    for (const auto& edge : skin.elementEdges)
        for (const int node : edge) undeformed->elementEdges.push_back(creased.nodeVertex[node]);
    for (const int node : vertexNode) {
        const float* s = &restPositions[3 * std::size_t(node)];
        undeformed->addVertex(SimTK::Vec3(s[0], s[1], s[2]), SimTK::Vec3(0));
    }
    calcNormals(*undeformed);
    undeformed->isClosed = true;
    undeformed->updateBounds();
    deformed = std::make_shared<SurfaceGeometry>(*undeformed);
}

void DeformedSurface::calcDisplacements(const SimTK::Vector& xi) {
    if (xi.size() != part->numModes)
        throw std::invalid_argument(
            "part '" + part->name + "' has " + std::to_string(part->numModes) +
            " modes, but modal coordinates have size " + std::to_string(xi.size()));
    std::vector<float> wanted(part->numModes);
    for (int i = 0; i < part->numModes; ++i) wanted[i] = float(xi[i]);
    if (hasDisplacements && wanted == modal) return;
    modal = wanted;
    hasDisplacements = true;

    const Eigen::Index rows = Eigen::Index(displacements.size());
    const Eigen::Map<const Eigen::MatrixXf> Phi(skinPhi.data(), rows, part->numModes);
    const Eigen::Map<const Eigen::VectorXf> xiFloat(modal.data(), part->numModes);
    Eigen::Map<Eigen::VectorXf> u(displacements.data(), rows);
    const int numChunks = int((rows + rowsPerChunk - 1) / rowsPerChunk);
    // Small products are bound by memory: waking other threads would only slow the rasterizer down.
    [[maybe_unused]] const bool isLarge = rows * part->numModes > 20000000;
#pragma omp parallel for schedule(static) if (isLarge)
    for (int chunk = 0; chunk < numChunks; ++chunk) {
        const Eigen::Index first = Eigen::Index(chunk) * rowsPerChunk;
        const Eigen::Index count = std::min<Eigen::Index>(rowsPerChunk, rows - first);
        u.segment(first, count).noalias() = Phi.middleRows(first, count) * xiFloat;
    }
}

double DeformedSurface::calcLargestDisplacement(const SimTK::Vector& xi) {
    calcDisplacements(xi);
    float largest = 0;
    for (std::size_t i = 0; i + 2 < displacements.size(); i += 3) {
        const float* u = &displacements[i];
        largest = std::max(largest, u[0] * u[0] + u[1] * u[1] + u[2] * u[2]);
    }
    return std::sqrt(double(largest));
}

void DeformedSurface::update(const SimTK::Vector& xi, double factor) {
    calcDisplacements(xi);
    const float f = float(factor);
    for (std::size_t v = 0; v < vertexNode.size(); ++v) {
        const float* s = &restPositions[3 * std::size_t(vertexNode[v])];
        const float* u = &displacements[3 * std::size_t(vertexNode[v])];
        float* vertex = &deformed->vertices[v * stride];
        for (int k = 0; k < 3; ++k) vertex[k] = s[k] + f * u[k];
        vertex[6] = std::sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2]);
    }
    calcNormals(*deformed);
    deformed->updateBounds();
    ++deformed->version;
}

SimTK::Vec3 DeformedSurface::calcNodePosition(int node, const SimTK::Vector& xi,
                                              double factor) const {
    const auto s = part->mesh.position(node);
    SimTK::Vec3 position(s[0], s[1], s[2]);
    const std::size_t rows = 3 * std::size_t(part->mesh.numNodes());
    for (int mode = 0; mode < part->numModes; ++mode)
        for (int k = 0; k < 3; ++k)
            position[k] += factor * xi[mode] * part->Phi[mode * rows + 3 * std::size_t(node) + k];
    return position;
}

}  // namespace simflex
