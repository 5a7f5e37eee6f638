#include "Primitives.h"

#include <cmath>
#include <map>
#include <stdexcept>
#include <string>

namespace simflex {

using SimTK::Pi;
using SimTK::Vec3;

namespace {

const double polygonCreaseAngle = 40 * Pi / 180;

std::shared_ptr<SurfaceGeometry> finish(SurfaceGeometry&& geometry, bool isClosed) {
    geometry.isClosed = isClosed;
    geometry.updateBounds();
    return std::make_shared<SurfaceGeometry>(std::move(geometry));
}

// Adds a disc about the y axis at height y, facing `direction` (+1 or -1) along y.
void addCap(SurfaceGeometry& geometry, double y, double direction, int slices) {
    const std::uint32_t center = std::uint32_t(geometry.numVertices());
    geometry.addVertex(Vec3(0, y, 0), Vec3(0, direction, 0));
    for (int i = 0; i < slices; ++i) {
        const double angle = 2 * Pi * i / slices;
        geometry.addVertex(Vec3(std::cos(angle), y, -std::sin(angle)), Vec3(0, direction, 0));
    }
    for (int i = 0; i < slices; ++i) {
        const std::uint32_t a = center + 1 + std::uint32_t(i);
        const std::uint32_t b = center + 1 + std::uint32_t((i + 1) % slices);
        if (direction > 0)
            geometry.addTriangle(center, a, b);
        else
            geometry.addTriangle(center, b, a);
        geometry.addEdge(a, b);
    }
}

}  // namespace

SurfaceGeometryPtr createBrick() {
    SurfaceGeometry geometry;
    for (int axis = 0; axis < 3; ++axis)
        for (const double side : {-1.0, 1.0}) {
            Vec3 n(0), u(0), v(0);
            n[axis] = side;
            u[(axis + 1) % 3] = 1;
            v[(axis + 2) % 3] = side;
            const std::uint32_t first = std::uint32_t(geometry.numVertices());
            for (const Vec3& p : {n - u - v, n + u - v, n + u + v, n - u + v})
                geometry.addVertex(p, n);
            geometry.addTriangle(first, first + 1, first + 2);
            geometry.addTriangle(first, first + 2, first + 3);
            if (axis != 2)
                for (std::uint32_t k = 0; k < 4; ++k)
                    if (axis == 0 || k % 2 == 1) geometry.addEdge(first + k, first + (k + 1) % 4);
        }
    return finish(std::move(geometry), true);
}

SurfaceGeometryPtr createSphere(int slices) {
    SurfaceGeometry geometry;
    const int stacks = slices / 2;
    for (int j = 0; j <= stacks; ++j) {
        const double polar = Pi * j / stacks;
        for (int i = 0; i <= slices; ++i) {
            const double angle = 2 * Pi * i / slices;
            const Vec3 p(std::sin(polar) * std::cos(angle), std::cos(polar),
                         -std::sin(polar) * std::sin(angle));
            geometry.addVertex(p, p);
        }
    }
    const std::uint32_t row = std::uint32_t(slices) + 1;
    for (std::uint32_t j = 0; j < std::uint32_t(stacks); ++j)
        for (std::uint32_t i = 0; i + 1 < row; ++i) {
            const std::uint32_t a = j * row + i, b = a + row;
            if (j + 1 < std::uint32_t(stacks)) geometry.addTriangle(a, b, b + 1);
            if (j > 0) geometry.addTriangle(a, b + 1, a + 1);
        }
    return finish(std::move(geometry), true);
}

SurfaceGeometryPtr createCylinder(int slices) {
    SurfaceGeometry geometry;
    for (int i = 0; i <= slices; ++i) {
        const double angle = 2 * Pi * i / slices;
        const Vec3 n(std::cos(angle), 0, -std::sin(angle));
        geometry.addVertex(n + Vec3(0, -1, 0), n);
        geometry.addVertex(n + Vec3(0, 1, 0), n);
    }
    for (std::uint32_t i = 0; i < std::uint32_t(slices); ++i) {
        geometry.addTriangle(2 * i, 2 * i + 2, 2 * i + 3);
        geometry.addTriangle(2 * i, 2 * i + 3, 2 * i + 1);
    }
    addCap(geometry, 1, 1, slices);
    addCap(geometry, -1, -1, slices);
    return finish(std::move(geometry), true);
}

SurfaceGeometryPtr createCircle(int slices) {
    SurfaceGeometry geometry;
    geometry.addVertex(Vec3(0), Vec3(0, 0, 1));
    for (int i = 0; i < slices; ++i) {
        const double angle = 2 * Pi * i / slices;
        geometry.addVertex(Vec3(std::cos(angle), std::sin(angle), 0), Vec3(0, 0, 1));
    }
    for (int i = 0; i < slices; ++i) {
        const std::uint32_t a = 1 + std::uint32_t(i), b = 1 + std::uint32_t((i + 1) % slices);
        geometry.addTriangle(0, a, b);
        geometry.addEdge(a, b);
    }
    return finish(std::move(geometry), false);
}

SurfaceGeometryPtr createCone(int slices) {
    SurfaceGeometry geometry;
    const double slope = std::sqrt(0.5);
    for (int i = 0; i < slices; ++i) {
        const double angle = 2 * Pi * i / slices, middle = 2 * Pi * (i + 0.5) / slices;
        geometry.addVertex(Vec3(std::cos(angle), 0, -std::sin(angle)),
                           slope * Vec3(std::cos(angle), 1, -std::sin(angle)));
        geometry.addVertex(Vec3(0, 1, 0), slope * Vec3(std::cos(middle), 1, -std::sin(middle)));
    }
    for (std::uint32_t i = 0; i < std::uint32_t(slices); ++i)
        geometry.addTriangle(2 * i, 2 * ((i + 1) % std::uint32_t(slices)), 2 * i + 1);
    addCap(geometry, 0, -1, slices);
    return finish(std::move(geometry), true);
}

SurfaceGeometryPtr createTorus(double tubeRadius, int slices) {
    SurfaceGeometry geometry;
    const int around = std::max(12, slices / 2);
    for (int j = 0; j <= slices; ++j) {
        const double major = 2 * Pi * j / slices;
        const Vec3 outward(std::cos(major), std::sin(major), 0);
        for (int i = 0; i <= around; ++i) {
            const double minor = 2 * Pi * i / around;
            const Vec3 n = std::cos(minor) * outward + Vec3(0, 0, std::sin(minor));
            geometry.addVertex(outward + tubeRadius * n, n);
        }
    }
    const std::uint32_t row = std::uint32_t(around) + 1;
    for (std::uint32_t j = 0; j < std::uint32_t(slices); ++j)
        for (std::uint32_t i = 0; i + 1 < row; ++i) {
            const std::uint32_t a = j * row + i, b = a + row;
            geometry.addTriangle(a, b, b + 1);
            geometry.addTriangle(a, b + 1, a + 1);
        }
    return finish(std::move(geometry), true);
}

SurfaceGeometryPtr createFromPolygons(const SimTK::PolygonalMesh& mesh) {
    // Files such as STL repeat a vertex for each of its faces.
    std::vector<float> positions;
    std::vector<int> welded;
    std::map<std::array<float, 3>, int> known;
    for (int v = 0; v < mesh.getNumVertices(); ++v) {
        const Vec3& p = mesh.getVertexPosition(v);
        if (!p.isFinite())
            throw std::runtime_error("vertex " + std::to_string(v) + " of the mesh is not finite");
        const std::array<float, 3> key = {float(p[0]), float(p[1]), float(p[2])};
        const auto [place, isNew] = known.emplace(key, int(known.size()));
        if (isNew) positions.insert(positions.end(), key.begin(), key.end());
        welded.push_back(place->second);
    }

    std::vector<std::array<int, 3>> triangles;
    for (int f = 0; f < mesh.getNumFaces(); ++f) {
        const int n = mesh.getNumVerticesForFace(f);
        if (n < 3)
            throw std::runtime_error("face " + std::to_string(f) + " of the mesh has " +
                                     std::to_string(n) + " vertices");
        const int first = welded[mesh.getFaceVertex(f, 0)];
        for (int k = 1; k + 1 < n; ++k) {
            const int b = welded[mesh.getFaceVertex(f, k)],
                      c = welded[mesh.getFaceVertex(f, k + 1)];
            if (first != b && b != c && c != first) triangles.push_back({first, b, c});
        }
    }

    const CreasedSurface creased = splitAtCreases(positions, triangles, polygonCreaseAngle);
    SurfaceGeometry geometry;
    for (const int node : creased.vertexNode) {
        const float* p = &positions[3 * std::size_t(node)];
        geometry.addVertex(Vec3(p[0], p[1], p[2]), Vec3(0));
    }
    geometry.triangles = creased.triangles;
    geometry.featureEdges = creased.featureEdges;
    calcNormals(geometry);
    return finish(std::move(geometry), false);
}

}  // namespace simflex
