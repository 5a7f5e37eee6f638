#include "SurfaceGeometry.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "simflex/render/skin/SkinProduct.h"

namespace simflex {

using SimTK::Vec3;

void SurfaceGeometry::addVertex(const Vec3& position, const Vec3& normal) {
    for (int k = 0; k < 3; ++k) vertices.push_back(float(position[k]));
    for (int k = 0; k < 3; ++k) vertices.push_back(float(normal[k]));
    vertices.push_back(0.0f);
}

void SurfaceGeometry::addTriangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    triangles.insert(triangles.end(), {a, b, c});
}

void SurfaceGeometry::addEdge(std::uint32_t a, std::uint32_t b) {
    featureEdges.insert(featureEdges.end(), {a, b});
}

void SurfaceGeometry::updateBounds() {
    float low[3] = {0, 0, 0}, high[3] = {0, 0, 0};
    if (!vertices.empty())
        for (std::size_t k = 0; k < 3; ++k) low[k] = high[k] = vertices[k];
    for (std::size_t i = 0; i < vertices.size(); i += floatsPerVertex)
        for (std::size_t k = 0; k < 3; ++k) {
            low[k] = std::min(low[k], vertices[i + k]);
            high[k] = std::max(high[k], vertices[i + k]);
        }
    for (int k = 0; k < 3; ++k) {
        lower[k] = low[k];
        upper[k] = high[k];
    }
}

namespace {

struct Edge {
    int low, high;  // nodes, low < high
    int triangle;
    int cornerLow, cornerHigh;  // corners of `triangle` at these nodes
};

// Edges of all triangles, sorted by nodes, then triangle; in linear time, since few share their
// lower node.
std::vector<Edge> collectEdges(const std::vector<std::array<int, 3>>& triangles,
                               std::size_t numNodes) {
    std::vector<std::size_t> starts(numNodes + 1, 0);
    for (const auto& t : triangles)
        for (std::size_t k = 0; k < 3; ++k)
            ++starts[std::size_t(std::min(t[k], t[(k + 1) % 3])) + 1];
    for (std::size_t i = 1; i < starts.size(); ++i) starts[i] += starts[i - 1];

    std::vector<Edge> edges(3 * triangles.size());
    std::vector<std::size_t> ends(starts.begin(), starts.end() - 1);
    for (int t = 0; t < int(triangles.size()); ++t)
        for (int k = 0; k < 3; ++k) {
            const int next = (k + 1) % 3;
            const int a = triangles[std::size_t(t)][std::size_t(k)],
                      b = triangles[std::size_t(t)][std::size_t(next)];
            Edge& edge = edges[ends[std::size_t(std::min(a, b))]++];
            if (a < b)
                edge = {a, b, t, 3 * t + k, 3 * t + next};
            else
                edge = {b, a, t, 3 * t + next, 3 * t + k};
        }
    for (std::size_t node = 0; node < numNodes; ++node)
        std::sort(edges.begin() + std::ptrdiff_t(starts[node]),
                  edges.begin() + std::ptrdiff_t(starts[node + 1]),
                  [](const Edge& x, const Edge& y) {
                      return x.high != y.high ? x.high < y.high : x.triangle < y.triangle;
                  });
    return edges;
}

std::vector<Vec3> calcTriangleNormals(const std::vector<float>& positions,
                                      const std::vector<std::array<int, 3>>& triangles) {
    std::vector<Vec3> normals;
    normals.reserve(triangles.size());
    for (const auto& t : triangles) {
        Vec3 p[3];
        for (int k = 0; k < 3; ++k) {
            const float* x = &positions[3 * std::size_t(t[k])];
            p[k] = Vec3(x[0], x[1], x[2]);
        }
        const Vec3 n = SimTK::cross(p[1] - p[0], p[2] - p[0]);
        const double length = n.norm();
        normals.push_back(length > 0 ? Vec3(n / length) : Vec3(0));
    }
    return normals;
}

class DisjointSets {
public:
    explicit DisjointSets(std::size_t size) : parents(size) {
        std::iota(parents.begin(), parents.end(), 0);
    }
    int find(int i) {
        while (parents[i] != i) i = parents[i] = parents[parents[i]];
        return i;
    }
    void unite(int a, int b) {
        a = find(a);
        b = find(b);
        parents[std::max(a, b)] = std::min(a, b);
    }

private:
    std::vector<int> parents;
};

}  // namespace

CreasedSurface splitAtCreases(const std::vector<float>& positions,
                              const std::vector<std::array<int, 3>>& triangles,
                              double creaseAngle) {
    const std::vector<Edge> edges = collectEdges(triangles, positions.size() / 3);
    const std::vector<Vec3> normals = calcTriangleNormals(positions, triangles);
    const double cosine = std::cos(creaseAngle);

    // Corners on both sides of a smooth edge share a vertex.
    DisjointSets corners(3 * triangles.size());
    std::vector<Edge> sharp;
    for (std::size_t i = 0; i < edges.size();) {
        std::size_t j = i + 1;
        while (j < edges.size() && edges[j].low == edges[i].low && edges[j].high == edges[i].high)
            ++j;
        const Edge& first = edges[i];
        const Edge& second = edges[j - 1];
        const bool isFlatTriangle =
            normals[first.triangle].normSqr() == 0 || normals[second.triangle].normSqr() == 0;
        const bool isSmooth =
            j - i == 2 && (isFlatTriangle ||
                           SimTK::dot(normals[first.triangle], normals[second.triangle]) >= cosine);
        if (isSmooth) {
            corners.unite(first.cornerLow, second.cornerLow);
            corners.unite(first.cornerHigh, second.cornerHigh);
        } else {
            sharp.push_back(first);
        }
        i = j;
    }

    CreasedSurface result;
    std::vector<int> vertexOfRoot(3 * triangles.size(), -1);
    for (int c = 0; c < int(3 * triangles.size()); ++c) {
        int& vertex = vertexOfRoot[corners.find(c)];
        if (vertex < 0) {
            vertex = int(result.vertexNode.size());
            result.vertexNode.push_back(triangles[c / 3][c % 3]);
        }
        result.triangles.push_back(std::uint32_t(vertex));
    }
    for (const Edge& edge : sharp) {
        result.featureEdges.push_back(result.triangles[edge.cornerLow]);
        result.featureEdges.push_back(result.triangles[edge.cornerHigh]);
    }
    result.nodeVertex.assign(positions.size() / 3, 0);
    for (int v = int(result.vertexNode.size()) - 1; v >= 0; --v)
        result.nodeVertex[result.vertexNode[v]] = std::uint32_t(v);
    return result;
}

VertexTriangles findVertexTriangles(const SurfaceGeometry& geometry) {
    VertexTriangles around;
    around.starts.assign(std::size_t(geometry.numVertices()) + 1, 0);
    for (const std::uint32_t vertex : geometry.triangles) ++around.starts[vertex + 1];
    for (std::size_t v = 1; v < around.starts.size(); ++v) around.starts[v] += around.starts[v - 1];
    around.triangles.resize(geometry.triangles.size());
    std::vector<std::uint32_t> ends(around.starts.begin(), around.starts.end() - 1);
    for (std::size_t i = 0; i < geometry.triangles.size(); ++i)
        around.triangles[ends[geometry.triangles[i]]++] = std::uint32_t(i / 3);
    return around;
}

void calcNormals(SurfaceGeometry& geometry, const VertexTriangles& around,
                 std::vector<float>& triangleNormals) {
    constexpr std::size_t stride = SurfaceGeometry::floatsPerVertex;
    float* vertices = geometry.vertices.data();
    const std::uint32_t* corners = geometry.triangles.data();
    const std::size_t numTriangles = geometry.triangles.size() / 3;
    const std::size_t numVertices = std::size_t(geometry.numVertices());
    triangleNormals.resize(3 * numTriangles);
    float* normals = triangleNormals.data();
    forSkinChunks(numTriangles, 16 * numTriangles, [=](std::size_t first, std::size_t end) {
        for (std::size_t t = first; t < end; ++t) {
            const float* a = vertices + corners[3 * t] * stride;
            const float* b = vertices + corners[3 * t + 1] * stride;
            const float* c = vertices + corners[3 * t + 2] * stride;
            const float e1[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
            const float e2[3] = {c[0] - a[0], c[1] - a[1], c[2] - a[2]};
            float* n = normals + 3 * t;
            n[0] = e1[1] * e2[2] - e1[2] * e2[1];
            n[1] = e1[2] * e2[0] - e1[0] * e2[2];
            n[2] = e1[0] * e2[1] - e1[1] * e2[0];
        }
    });

    const std::uint32_t* starts = around.starts.data();
    const std::uint32_t* triangles = around.triangles.data();
    forSkinChunks(numVertices, 24 * numVertices, [=](std::size_t first, std::size_t end) {
        for (std::size_t v = first; v < end; ++v) {
            float sum[3] = {0, 0, 0};
            for (std::uint32_t k = starts[v]; k < starts[v + 1]; ++k)
                for (std::size_t i = 0; i < 3; ++i)
                    sum[i] += normals[3 * std::size_t(triangles[k]) + i];
            const float length = std::sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]);
            const float scale = length > 0 ? 1.0f / length : 0.0f;
            for (std::size_t i = 0; i < 3; ++i) vertices[v * stride + 3 + i] = sum[i] * scale;
        }
    });
}

void calcNormals(SurfaceGeometry& geometry) {
    std::vector<float> triangleNormals;
    calcNormals(geometry, findVertexTriangles(geometry), triangleNormals);
}

bool isFinelyDivided(const SurfaceGeometry& geometry) {
    constexpr double cosine = 0.9945;  // of 6 degrees: half the width of a highlight
    constexpr double tinyEdge = 0.002, largestEdge = 0.04;  // relative to the bounding box's
                                                            // diagonal
    const double diagonal = (geometry.upper - geometry.lower).norm();
    const double tiny = tinyEdge * diagonal, largest = largestEdge * diagonal;
    for (std::size_t i = 0; i < geometry.triangles.size(); ++i) {
        const std::size_t next = i % 3 == 2 ? i - 2 : i + 1;
        const float* a =
            &geometry
                 .vertices[std::size_t(geometry.triangles[i]) * SurfaceGeometry::floatsPerVertex];
        const float* b = &geometry.vertices[std::size_t(geometry.triangles[next]) *
                                            SurfaceGeometry::floatsPerVertex];
        double lengthSqr = 0, turn = 0;
        for (int k = 0; k < 3; ++k) {
            lengthSqr += SimTK::square(double(a[k]) - b[k]);
            turn += double(a[3 + k]) * b[3 + k];
        }
        if (lengthSqr > largest * largest || (turn < cosine && lengthSqr > tiny * tiny))
            return false;
    }
    return !geometry.triangles.empty();
}

}  // namespace simflex
