#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>
#include <set>

#include "TestParts.h"
#include "simflex/part/MeshFaces.h"
#include "simflex/render/skin/CurvedSurface.h"

namespace simflex {
namespace {

using SimTK::Vec3;
using Map = std::function<Vec3(const Vec3&)>;

// Makes a grid of Hex20 elements over the box from `low` to `high`, with nodes moved by `map`. Node
// numbers follow their position in a grid twice as fine.
Mesh makeHex20Grid(int nx, int ny, int nz, const Vec3& low, const Vec3& high, const Map& map) {
    constexpr int corner[8][3] = {{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0},
                                  {0, 0, 2}, {2, 0, 2}, {2, 2, 2}, {0, 2, 2}};
    constexpr int middle[12][3] = {{1, 0, 0}, {2, 1, 0}, {1, 2, 0}, {0, 1, 0},
                                   {1, 0, 2}, {2, 1, 2}, {1, 2, 2}, {0, 1, 2},
                                   {0, 0, 1}, {2, 0, 1}, {2, 2, 1}, {0, 2, 1}};
    Mesh mesh;
    std::map<std::array<int, 3>, int> numbers;
    const int size[3] = {2 * nx, 2 * ny, 2 * nz};
    ElementBlock block;
    block.type = ElementType::Hex20;
    for (int i = 0; i < nx; ++i)
        for (int j = 0; j < ny; ++j)
            for (int k = 0; k < nz; ++k)
                for (int n = 0; n < 20; ++n) {
                    const int* offset = n < 8 ? corner[n] : middle[n - 8];
                    const std::array<int, 3> place = {2 * i + offset[0], 2 * j + offset[1],
                                                      2 * k + offset[2]};
                    const auto [entry, isNew] = numbers.try_emplace(place, mesh.numNodes());
                    block.nodes.push_back(entry->second);
                    if (!isNew) continue;
                    mesh.nodeNumbers.push_back(mesh.numNodes() + 1);
                    Vec3 p;
                    for (int a = 0; a < 3; ++a)
                        p[a] = low[a] + (high[a] - low[a]) * place[std::size_t(a)] / size[a];
                    p = map(p);
                    mesh.positions.insert(mesh.positions.end(), {p[0], p[1], p[2]});
                }
    mesh.elements.push_back(block);
    return mesh;
}

// Makes a ball of radius 1 from a cube.
Mesh makeBall(int n) {
    return makeHex20Grid(n, n, n, Vec3(-1), Vec3(1), [](const Vec3& p) {
        const double largest = std::max({std::abs(p[0]), std::abs(p[1]), std::abs(p[2])});
        return largest > 0 ? Vec3(p * (largest / p.norm())) : p;
    });
}

// A quarter of a pipe of radii 0.6 and 1 about z, height 0.5, with `around` elements.
Mesh makeQuarterPipe(int around) {
    return makeHex20Grid(
        1, around, 1, Vec3(0.6, 0, 0), Vec3(1, SimTK::Pi / 2, 0.5),
        [](const Vec3& p) { return Vec3(p[0] * std::cos(p[1]), p[0] * std::sin(p[1]), p[2]); });
}

Vec3 getNode(const Mesh& mesh, int node) {
    const auto p = mesh.position(node);
    return Vec3(p[0], p[1], p[2]);
}

std::vector<Vec3> calcPoints(const Mesh& mesh, const CurvedSurface& surface) {
    std::vector<Vec3> points;
    for (const int node : surface.mesh.nodes) points.push_back(getNode(mesh, node));
    for (int i = 0; i < surface.between.size(); ++i) {
        Vec3 p(0);
        for (int k = surface.between.starts[std::size_t(i)];
             k < surface.between.starts[std::size_t(i) + 1]; ++k)
            p += double(surface.between.weights[std::size_t(k)]) *
                 points[std::size_t(surface.between.nodes[std::size_t(k)])];
        points.push_back(p);
    }
    return points;
}

struct Measures {
    double area = 0, volume = 0;
    bool isClosed = true;
};

// Volume by the divergence theorem; closed if every edge is used once in each direction.
Measures measure(const std::vector<Vec3>& points, const SurfaceMesh& surface) {
    Measures result;
    std::set<std::pair<int, int>> sides;
    for (const auto& t : surface.triangles) {
        const Vec3 a = points[std::size_t(t[0])], b = points[std::size_t(t[1])],
                   c = points[std::size_t(t[2])];
        result.area += 0.5 * SimTK::cross(b - a, c - a).norm();
        result.volume += SimTK::dot(a, SimTK::cross(b, c)) / 6;
        for (std::size_t k = 0; k < 3; ++k)
            if (!sides.insert({t[k], t[(k + 1) % 3]}).second) result.isClosed = false;
    }
    for (const auto& side : sides)
        if (sides.count({side.second, side.first}) == 0) result.isClosed = false;
    return result;
}

// Evaluates the exact face: serendipity functions at ξ, η from −1 to 1.
Vec3 evaluateSquare(const Mesh& mesh, const MeshFace& face, double x, double y) {
    const double sx[4] = {-1, 1, 1, -1}, sy[4] = {-1, -1, 1, 1};
    Vec3 p(0);
    for (std::size_t k = 0; k < 4; ++k)
        p += 0.25 * (1 + sx[k] * x) * (1 + sy[k] * y) * (sx[k] * x + sy[k] * y - 1) *
             getNode(mesh, face.corners[k]);
    p += 0.5 * (1 - x * x) * (1 - y) * getNode(mesh, face.middles[0]);
    p += 0.5 * (1 + x) * (1 - y * y) * getNode(mesh, face.middles[1]);
    p += 0.5 * (1 - x * x) * (1 + y) * getNode(mesh, face.middles[2]);
    p += 0.5 * (1 - x) * (1 - y * y) * getNode(mesh, face.middles[3]);
    return p;
}

// Volume under the exact faces: ∮ x·n/3 dA with four Gauss points per side.
double calcExactVolume(const Mesh& mesh) {
    const double at[4] = {-0.861136311594053, -0.339981043584856, 0.339981043584856,
                          0.861136311594053};
    const double weight[4] = {0.347854845137454, 0.652145154862546, 0.652145154862546,
                              0.347854845137454};
    const double h = 1e-5;
    double volume = 0;
    for (const MeshFace& face : extractBoundaryFaces(mesh))
        for (int i = 0; i < 4; ++i)
            for (int j = 0; j < 4; ++j) {
                const double x = at[i], y = at[j];
                const Vec3 dx =
                    (evaluateSquare(mesh, face, x + h, y) - evaluateSquare(mesh, face, x - h, y)) /
                    (2 * h);
                const Vec3 dy =
                    (evaluateSquare(mesh, face, x, y + h) - evaluateSquare(mesh, face, x, y - h)) /
                    (2 * h);
                volume += weight[i] * weight[j] *
                          SimTK::dot(evaluateSquare(mesh, face, x, y), SimTK::cross(dx, dy)) / 3;
            }
    return volume;
}

// Distance of a point from a triangle.
double calcDistance(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
    const Vec3 n = SimTK::cross(b - a, c - a);
    const Vec3 corners[3] = {a, b, c};
    bool isInside = true;
    double nearest = SimTK::Infinity;
    for (int k = 0; k < 3; ++k) {
        const Vec3 from = corners[k], side = corners[(k + 1) % 3] - from;
        if (SimTK::dot(SimTK::cross(n, side), p - from) < 0) isInside = false;
        const double s = std::min(1.0, std::max(0.0, SimTK::dot(p - from, side) / side.normSqr()));
        nearest = std::min(nearest, (p - from - s * side).norm());
    }
    return isInside ? std::abs(SimTK::dot(p - a, n)) / n.norm() : nearest;
}

class CurvedBall : public testing::TestWithParam<int> {};

TEST_P(CurvedBall, IsDrawnWithinTheToleranceOfItsExactFaces) {
    const Mesh mesh = makeBall(GetParam());
    for (const double tolerance : {1e-2, 1e-3}) {
        const CurvedSurface surface = extractCurvedSurface(mesh, tolerance);
        const std::vector<Vec3> points = calcPoints(mesh, surface);
        double farthest = 0;
        for (const MeshFace& face : extractBoundaryFaces(mesh))
            for (int i = 0; i < 7; ++i)
                for (int j = 0; j < 7; ++j) {
                    const Vec3 p = evaluateSquare(mesh, face, -0.95 + 0.317 * i, -0.93 + 0.31 * j);
                    double nearest = SimTK::Infinity;
                    for (const auto& t : surface.mesh.triangles)
                        nearest = std::min(nearest, calcDistance(p, points[std::size_t(t[0])],
                                                                 points[std::size_t(t[1])],
                                                                 points[std::size_t(t[2])]));
                    farthest = std::max(farthest, nearest);
                }
        // Sides stay within the tolerance; in its interior a triangle adds at most the errors of
        // its three sides.
        EXPECT_LT(farthest, 2 * tolerance) << "tolerance " << tolerance;
    }
}

TEST_P(CurvedBall, HasNoGapsAndTheVolumeOfItsExactFaces) {
    const Mesh mesh = makeBall(GetParam());
    const double exact = calcExactVolume(mesh);
    for (const double tolerance : {3e-2, 3e-3, 3e-4}) {
        const CurvedSurface surface = extractCurvedSurface(mesh, tolerance);
        const Measures m = measure(calcPoints(mesh, surface), surface.mesh);
        EXPECT_TRUE(m.isClosed);
        EXPECT_NEAR(m.volume, exact, m.area * tolerance);
    }
}

TEST_P(CurvedBall, AddsNoMoreTrianglesThanItsCurvatureNeeds) {
    // A ball within t of its facets needs about 2π/t triangles of the best shape.
    const Mesh mesh = makeBall(GetParam());
    const double tolerance = 1e-3;
    const CurvedSurface surface = extractCurvedSurface(mesh, tolerance);
    EXPECT_GT(surface.between.size(), 0);
    EXPECT_LT(double(surface.mesh.triangles.size()), 4 * 2 * SimTK::Pi / tolerance);
}

INSTANTIATE_TEST_SUITE_P(Divided, CurvedBall, testing::Values(1, 2, 3));

TEST(CurvedSurface, OfABallApproachesTheSphereWithTheThirdPowerOfTheElementsSize) {
    const auto calcDistance = [](int n) {
        const Mesh mesh = makeBall(n);
        double farthest = 0;
        for (const Vec3& p : calcPoints(mesh, extractCurvedSurface(mesh, 1e-5)))
            farthest = std::max(farthest, std::abs(p.norm() - 1));
        return farthest;
    };
    const double coarse = calcDistance(2), fine = calcDistance(4);
    EXPECT_GT(coarse, 7 * fine);
    EXPECT_LT(fine, 0.01);
}

TEST(CurvedSurface, CutsOffATenthOfWhatChordsCutOff) {
    const Mesh mesh = makeBall(4);
    const double sphere = 4 * SimTK::Pi / 3;
    const CurvedSurface surface = extractCurvedSurface(mesh, 1e-5);
    const SurfaceMesh chords = extractSurface(mesh);
    std::vector<Vec3> nodes;
    for (const int node : chords.nodes) nodes.push_back(getNode(mesh, node));
    EXPECT_GT(std::abs(measure(nodes, chords).volume - sphere),
              10 * std::abs(measure(calcPoints(mesh, surface), surface.mesh).volume - sphere));
}

TEST(CurvedSurface, EdgesOfAPipeAreParabolasThroughTheCircle) {
    // Seen from above, one parabola per element bounds the end face: between three points of the
    // circle that are angle/2 apart, the area under it is that of the chord plus 2/3 of a box.
    for (const int around : {1, 2, 4}) {
        const Mesh mesh = makeQuarterPipe(around);
        const double angle = SimTK::Pi / 2 / around;
        const auto calcSector = [&](double radius) {
            const double chord = 2 * radius * std::sin(angle / 2);
            return 0.5 * radius * radius * std::sin(angle) +
                   2.0 / 3 * chord * radius * (1 - std::cos(angle / 2));
        };
        const double exact = around * (calcSector(1) - calcSector(0.6));
        const double tolerance = around == 1 ? 5e-4 : 1e-4;  // the limit for 32 chords
        const CurvedSurface surface = extractCurvedSurface(mesh, tolerance);
        const std::vector<Vec3> points = calcPoints(mesh, surface);
        double silhouette = 0;
        for (const auto& t : surface.mesh.triangles) {
            const Vec3 a = points[std::size_t(t[0])], b = points[std::size_t(t[1])],
                       c = points[std::size_t(t[2])];
            silhouette += std::max(0.0, 0.5 * SimTK::cross(b - a, c - a)[2]);
        }
        EXPECT_NEAR(silhouette, exact, tolerance * (1 + 0.6) * SimTK::Pi / 2) << around;
        // The circle itself: a parabola over a quarter of it is off by 1.2 %, over an eighth by
        // less.
        if (around == 4) {
            EXPECT_NEAR(silhouette, (1 - 0.36) * SimTK::Pi / 4, 2e-4);
        }
    }
}

TEST(CurvedSurface, FlatFacesStayAsTheyAre) {
    const Mesh mesh = makeHex20Grid(3, 2, 2, Vec3(0), Vec3(3, 2, 1), [](const Vec3& p) {
        return Vec3(p[0] + 0.2 * p[1], p[1], p[2] - 0.1 * p[0]);
    });
    const CurvedSurface surface = extractCurvedSurface(mesh, 1e-9);
    EXPECT_EQ(surface.between.size(), 0);
    EXPECT_EQ(surface.mesh.triangles.size(), 6u * 2 * (6 + 6 + 4));
}

// Straight edges do not make a face flat: this one is z = 1 + xy/5.
TEST(CurvedSurface, TwistedFacesWithStraightEdgesAreDrawnWithinTheTolerance) {
    const Mesh mesh = makeHex20Grid(1, 1, 1, Vec3(0), Vec3(1), [](const Vec3& p) {
        return Vec3(p[0], p[1], p[2] * (1 + 0.2 * p[0] * p[1]));
    });
    for (const double tolerance : {5e-3, 5e-4}) {
        const CurvedSurface surface = extractCurvedSurface(mesh, tolerance);
        const std::vector<Vec3> points = calcPoints(mesh, surface);
        EXPECT_TRUE(measure(points, surface.mesh).isClosed);
        int onTop = 0;
        for (const auto& t : surface.mesh.triangles) {
            const Vec3 a = points[std::size_t(t[0])], b = points[std::size_t(t[1])],
                       c = points[std::size_t(t[2])];
            const Vec3 n = SimTK::cross(b - a, c - a);
            if (n[2] < 0.5 * n.norm()) continue;
            ++onTop;
            // In its interior a triangle adds at most the errors of its three sides.
            for (const Vec3& p : {(a + b + c) / 3, (a + b) / 2, (b + c) / 2, (c + a) / 2})
                EXPECT_NEAR(p[2], 1 + 0.2 * p[0] * p[1], 2 * tolerance);
        }
        EXPECT_GT(onTop, 6);
    }
}

TEST(CurvedSurface, FlatEndsOfAPipeAreDividedOnlyAlongTheirRims) {
    const CurvedSurface surface = extractCurvedSurface(makeQuarterPipe(2), 1e-4);
    const Mesh mesh = makeQuarterPipe(2);
    const std::vector<Vec3> points = calcPoints(mesh, surface);
    EXPECT_TRUE(measure(points, surface.mesh).isClosed);
    // The cut planes x = 0 and y = 0 are squares with straight sides.
    int inCut = 0;
    for (const auto& t : surface.mesh.triangles) {
        bool isInCut = true;
        for (const int point : t)
            isInCut = isInCut && std::abs(points[std::size_t(point)][1]) < 1e-9;
        inCut += isInCut;
    }
    EXPECT_EQ(inCut, 6);
}

TEST(CurvedSurface, ElementEdgesFollowTheCurve) {
    const Mesh mesh = makeQuarterPipe(2);
    const double tolerance = 1e-4;
    const CurvedSurface surface = extractCurvedSurface(mesh, tolerance);
    const std::vector<Vec3> points = calcPoints(mesh, surface);
    double outerRim = 0;
    for (const auto& edge : surface.mesh.elementEdges) {
        const Vec3 a = points[std::size_t(edge[0])], b = points[std::size_t(edge[1])];
        if (std::abs(a[2]) > 1e-9 || std::abs(b[2]) > 1e-9) continue;
        if (a.norm() < 0.99 || b.norm() < 0.99) continue;
        outerRim += (b - a).norm();
    }
    EXPECT_NEAR(outerRim, SimTK::Pi / 2, 2e-3);
}

TEST(CurvedSurface, LinearFieldsAtAddedPointsAreThoseOfTheirPositions) {
    const Mesh mesh = makeBall(2);
    const CurvedSurface surface = extractCurvedSurface(mesh, 1e-3);
    const std::vector<Vec3> points = calcPoints(mesh, surface);
    std::vector<float> values, positions;
    for (const int node : surface.mesh.nodes) {
        const Vec3 p = getNode(mesh, node);
        values.push_back(float(2 - 3 * p[0] + p[1] + 0.5 * p[2]));
        for (int k = 0; k < 3; ++k) positions.push_back(float(p[k]));
    }
    const std::size_t count = std::size_t(surface.between.size());
    std::vector<float> between(count), places(3 * count);
    surface.between.interpolate(values.data(), between.data());
    surface.between.interpolate3(positions.data(), places.data());
    for (std::size_t i = 0; i < count; ++i) {
        const Vec3 p = points[surface.mesh.nodes.size() + i];
        EXPECT_NEAR(between[i], 2 - 3 * p[0] + p[1] + 0.5 * p[2], 1e-5);
        for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(places[3 * i + k], p[int(k)], 1e-6);
    }
}

TEST(BoundaryFaces, AreThoseThatNoOtherElementHas) {
    // Compares with an all-pairs comparison of faces.
    Mesh mesh = makeBall(2);
    mesh.elements[0].nodes.erase(mesh.elements[0].nodes.begin() + 40,
                                 mesh.elements[0].nodes.begin() + 60);
    const std::vector<MeshFace> skin = extractBoundaryFaces(mesh);
    constexpr int faces[6][4] = {{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4},
                                 {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}};
    std::vector<std::multiset<int>> all;
    for (std::size_t e = 0; e < mesh.elements[0].nodes.size(); e += 20)
        for (const auto& face : faces) {
            std::multiset<int> nodes;
            for (const int corner : face)
                nodes.insert(mesh.elements[0].nodes[e + std::size_t(corner)]);
            all.push_back(nodes);
        }
    std::vector<std::multiset<int>> expected, found;
    for (const auto& face : all)
        if (std::count(all.begin(), all.end(), face) == 1) expected.push_back(face);
    for (const MeshFace& face : skin) found.emplace_back(face.corners.begin(), face.corners.end());
    EXPECT_EQ(found, expected);  // also in mesh order
}

}  // namespace
}  // namespace simflex
