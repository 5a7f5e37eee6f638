#include "DeformedSurface.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "SkinProduct.h"

namespace simflex {

DeformedSurface::DeformedSurface(std::shared_ptr<const SkinModes> skinModes)
    : skin(std::move(skinModes)),
      displacements(skin->restPositions.size()),
      modal(std::size_t(skin->part->numModes)),
      wanted(modal.size()),
      deformed(std::make_shared<SurfaceGeometry>(*skin->undeformed)) {}

const std::vector<float>& DeformedSurface::calcDisplacements(const SimTK::Vector& xi) {
    if (xi.size() != getPart().numModes)
        throw std::invalid_argument(
            "part '" + getPart().name + "' has " + std::to_string(getPart().numModes) +
            " modes, but modal coordinates have size " + std::to_string(xi.size()));
    wanted.resize(std::size_t(xi.size()));
    for (int i = 0; i < xi.size(); ++i) wanted[std::size_t(i)] = float(xi[i]);
    if (hasDisplacements && wanted == modal) return displacements;
    std::swap(modal, wanted);
    hasDisplacements = true;
    multiplySkin(skin->Phi.data(), displacements.size(), displacements.size(), xi.size(),
                 modal.data(), displacements.data());
    return displacements;
}

const std::vector<float>& DeformedSurface::calcDisplacements(const SimTK::Vector& xi,
                                                             const ReferenceMotion& reference) {
    calcDisplacements(xi);
    if (reference.shift.norm() == 0 && reference.turn.norm() == 0) return displacements;
    relative.resize(displacements.size());
    const std::size_t numNodes = std::size_t(skin->numNodes());
    forSkinChunks(numNodes, 12 * numNodes, [&](std::size_t first, std::size_t end) {
        for (std::size_t i = 3 * first; i < 3 * end; i += 3) {
            const float* s = &skin->restPositions[i];
            const SimTK::Vec3 held = reference.calcDisplacement(SimTK::Vec3(s[0], s[1], s[2]));
            for (std::size_t k = 0; k < 3; ++k)
                relative[i + k] = float(double(displacements[i + k]) - held[int(k)]);
        }
    });
    return relative;
}

double DeformedSurface::calcLargestDisplacement(const SimTK::Vector& xi,
                                                const ReferenceMotion& reference) {
    const std::vector<float>& shown = calcDisplacements(xi, reference);
    float largest = 0;
    for (std::size_t i = 0; i + 2 < shown.size(); i += 3) {
        const float* u = &shown[i];
        largest = std::max(largest, u[0] * u[0] + u[1] * u[1] + u[2] * u[2]);
    }
    return std::sqrt(double(largest));
}

void DeformedSurface::update(const SimTK::Vector& xi, double factor,
                             const std::vector<float>& nodeValues,
                             const ReferenceMotion& reference) {
    const std::vector<float>& shown = calcDisplacements(xi, reference);
    const bool isMeanAxes = &shown == &displacements;
    const std::size_t numNodes = std::size_t(skin->numNodes());
    const std::size_t numPoints = std::size_t(skin->numPoints());
    positions.resize(3 * numPoints);
    const float f = float(factor), more = float(factor - 1);
    forSkinChunks(numNodes, 9 * numNodes, [&](std::size_t first, std::size_t end) {
        if (isMeanAxes)
            for (std::size_t i = 3 * first; i < 3 * end; ++i)
                positions[i] = skin->restPositions[i] + f * displacements[i];
        else
            for (std::size_t i = 3 * first; i < 3 * end; ++i)
                positions[i] = skin->restPositions[i] + displacements[i] + more * shown[i];
    });
    skin->between.interpolate3(positions.data(), positions.data() + 3 * numNodes);
    const bool hasValues = !nodeValues.empty();
    if (hasValues) {
        values.resize(numPoints);
        std::copy(nodeValues.begin(), nodeValues.end(), values.begin());
        skin->between.interpolate(values.data(), values.data() + numNodes);
    }

    const std::size_t numVertices = skin->vertexPoint.size();
    constexpr std::size_t stride = SurfaceGeometry::floatsPerVertex;
    forSkinChunks(numVertices, 12 * numVertices, [&](std::size_t first, std::size_t end) {
        for (std::size_t v = first; v < end; ++v) {
            const std::size_t point = std::size_t(skin->vertexPoint[v]);
            float* vertex = &deformed->vertices[v * stride];
            for (std::size_t k = 0; k < 3; ++k) vertex[k] = positions[3 * point + k];
            if (hasValues) vertex[6] = values[point];
        }
    });
    calcNormals(*deformed, skin->around, triangleNormals);
    deformed->updateBounds();
    ++deformed->version;
}

void DeformedSurface::update(const SimTK::Vector& xi, double factor) {
    calcDisplacements(xi);
    std::vector<float> lengths(std::size_t(skin->numNodes()));
    for (std::size_t i = 0; i < lengths.size(); ++i) {
        const float* u = &displacements[3 * i];
        lengths[i] = std::sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2]);
    }
    update(xi, factor, lengths);
}

SimTK::Vec3 DeformedSurface::calcNodePosition(int node, const SimTK::Vector& xi, double factor,
                                              const ReferenceMotion& reference) const {
    const auto s = getPart().mesh.position(node);
    SimTK::Vec3 position(s[0], s[1], s[2]);
    position -= (factor - 1) * reference.calcDisplacement(position);
    const std::size_t rows = 3 * std::size_t(getPart().mesh.numNodes());
    for (int mode = 0; mode < getPart().numModes; ++mode)
        for (int k = 0; k < 3; ++k)
            position[k] +=
                factor * xi[mode] * getPart().Phi[mode * rows + 3 * std::size_t(node) + k];
    return position;
}

}  // namespace simflex
