#include "DeformedSurface.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace simflex {

namespace {

constexpr int stride = SurfaceGeometry::floatsPerVertex;
constexpr int rowsPerChunk = 6144;  // fixed, so that results do not depend on the number of threads

}  // namespace

DeformedSurface::DeformedSurface(std::shared_ptr<const SkinModes> skinModes)
    : skin(std::move(skinModes)),
      displacements(skin->restPositions.size()),
      deformed(std::make_shared<SurfaceGeometry>(*skin->undeformed)) {}

const std::vector<float>& DeformedSurface::calcDisplacements(const SimTK::Vector& xi) {
    if (xi.size() != getPart().numModes)
        throw std::invalid_argument(
            "part '" + getPart().name + "' has " + std::to_string(getPart().numModes) +
            " modes, but modal coordinates have size " + std::to_string(xi.size()));
    std::vector<float> wanted(getPart().numModes);
    for (int i = 0; i < getPart().numModes; ++i) wanted[i] = float(xi[i]);
    if (hasDisplacements && wanted == modal) return displacements;
    modal = wanted;
    hasDisplacements = true;

    const Eigen::Index rows = Eigen::Index(displacements.size());
    const Eigen::Map<const Eigen::MatrixXf> Phi(skin->Phi.data(), rows, getPart().numModes);
    const Eigen::Map<const Eigen::VectorXf> xiFloat(modal.data(), getPart().numModes);
    Eigen::Map<Eigen::VectorXf> u(displacements.data(), rows);
    const int numChunks = int((rows + rowsPerChunk - 1) / rowsPerChunk);
    // Small products are bound by memory: waking other threads would only slow the rasterizer down.
    [[maybe_unused]] const bool isLarge = rows * getPart().numModes > 20000000;
#pragma omp parallel for schedule(static) if (isLarge)
    for (int chunk = 0; chunk < numChunks; ++chunk) {
        const Eigen::Index first = Eigen::Index(chunk) * rowsPerChunk;
        const Eigen::Index count = std::min<Eigen::Index>(rowsPerChunk, rows - first);
        u.segment(first, count).noalias() = Phi.middleRows(first, count) * xiFloat;
    }
    return displacements;
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

void DeformedSurface::update(const SimTK::Vector& xi, double factor,
                             const std::vector<float>& nodeValues) {
    calcDisplacements(xi);
    const float f = float(factor);
    for (std::size_t v = 0; v < skin->vertexNode.size(); ++v) {
        const float* s = &skin->restPositions[3 * std::size_t(skin->vertexNode[v])];
        const float* u = &displacements[3 * std::size_t(skin->vertexNode[v])];
        float* vertex = &deformed->vertices[v * stride];
        for (int k = 0; k < 3; ++k) vertex[k] = s[k] + f * u[k];
        if (!nodeValues.empty()) vertex[6] = nodeValues[std::size_t(skin->vertexNode[v])];
    }
    calcNormals(*deformed);
    deformed->updateBounds();
    ++deformed->version;
}

SimTK::Vec3 DeformedSurface::calcNodePosition(int node, const SimTK::Vector& xi,
                                              double factor) const {
    const auto s = getPart().mesh.position(node);
    SimTK::Vec3 position(s[0], s[1], s[2]);
    const std::size_t rows = 3 * std::size_t(getPart().mesh.numNodes());
    for (int mode = 0; mode < getPart().numModes; ++mode)
        for (int k = 0; k < 3; ++k)
            position[k] +=
                factor * xi[mode] * getPart().Phi[mode * rows + 3 * std::size_t(node) + k];
    return position;
}

}  // namespace simflex
