#include "simflex/render/SurfaceMesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "TestParts.h"

namespace simflex {
namespace {

using SimTK::Vec3;

// Makes one element with the given corners and with mid-edge nodes halfway between them.
Mesh makeElement(ElementType type, const std::vector<Vec3>& corners,
                 const std::vector<std::array<int, 2>>& middles) {
    Mesh mesh;
    std::vector<Vec3> positions = corners;
    for (const auto& m : middles) positions.push_back(0.5 * (corners[m[0]] + corners[m[1]]));
    ElementBlock block;
    block.type = type;
    for (int i = 0; i < int(positions.size()); ++i) {
        mesh.nodeNumbers.push_back(i + 1);
        for (int k = 0; k < 3; ++k) mesh.positions.push_back(positions[i][k]);
        block.nodes.push_back(i);
    }
    mesh.elements.push_back(block);
    return mesh;
}

Vec3 getPosition(const Mesh& mesh, const SurfaceMesh& surface, int node) {
    const auto p = mesh.position(surface.nodes[node]);
    return Vec3(p[0], p[1], p[2]);
}

struct Measures {
    double area = 0, volume = 0;
    bool isClosed = true;
};

// Volume by the divergence theorem; closed if every edge is used once in each direction.
Measures measure(const Mesh& mesh, const SurfaceMesh& surface) {
    Measures result;
    std::map<std::pair<int, int>, int> uses;
    for (const auto& t : surface.triangles) {
        const Vec3 a = getPosition(mesh, surface, t[0]), b = getPosition(mesh, surface, t[1]),
                   c = getPosition(mesh, surface, t[2]);
        result.area += 0.5 * SimTK::cross(b - a, c - a).norm();
        result.volume += SimTK::dot(a, SimTK::cross(b, c)) / 6;
        for (int k = 0; k < 3; ++k) ++uses[{t[k], t[(k + 1) % 3]}];
    }
    for (const auto& [edge, count] : uses) {
        const auto reverse = uses.find({edge.second, edge.first});
        if (count != 1 || reverse == uses.end() || reverse->second != 1) result.isClosed = false;
    }
    return result;
}

const std::vector<Vec3> tetCorners = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 2, 0), Vec3(0, 0, 3)};
const std::vector<Vec3> hexCorners = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(1, 2, 0), Vec3(0, 2, 0),
                                      Vec3(0, 0, 3), Vec3(1, 0, 3), Vec3(1, 2, 3), Vec3(0, 2, 3)};
const std::vector<Vec3> wedgeCorners = {Vec3(0, 0, 0), Vec3(3, 0, 0), Vec3(0, 4, 0),
                                        Vec3(0, 0, 2), Vec3(3, 0, 2), Vec3(0, 4, 2)};
const std::vector<std::array<int, 2>> tetMiddles = {{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}};
const std::vector<std::array<int, 2>> hexMiddles = {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {4, 5}, {5, 6},
                                                    {6, 7}, {7, 4}, {0, 4}, {1, 5}, {2, 6}, {3, 7}};
const std::vector<std::array<int, 2>> wedgeMiddles = {{0, 1}, {1, 2}, {2, 0}, {3, 4}, {4, 5},
                                                      {5, 3}, {0, 3}, {1, 4}, {2, 5}};

struct ElementCase {
    const char* name;
    ElementType type;
    std::vector<Vec3> corners;
    std::vector<std::array<int, 2>> middles;
    double area, volume;
    int triangles;
};

std::ostream& operator<<(std::ostream& out, const ElementCase& c) {
    return out << c.name;
}

class SurfaceOfElement : public testing::TestWithParam<ElementCase> {};

TEST_P(SurfaceOfElement, IsClosedWithItsAreaAndVolume) {
    const ElementCase& c = GetParam();
    const Mesh mesh = makeElement(c.type, c.corners, c.middles);
    const SurfaceMesh surface = extractSurface(mesh);
    const Measures m = measure(mesh, surface);
    EXPECT_TRUE(m.isClosed);
    EXPECT_EQ(int(surface.triangles.size()), c.triangles);
    EXPECT_EQ(int(surface.nodes.size()), mesh.numNodes());
    EXPECT_NEAR(m.area, c.area, 1e-12 * c.area);
    EXPECT_NEAR(m.volume, c.volume, 1e-12 * c.volume);
}

const double tetArea = 0.5 * (2 + 3 + 6 + 7);  // the slanted face: |(6, 3, 2)| = 7
const double wedgeArea = 12 + 2 * (3 + 4 + 5);

INSTANTIATE_TEST_SUITE_P(
    AllTypes, SurfaceOfElement,
    testing::Values(ElementCase{"Tet4", ElementType::Tet4, tetCorners, {}, tetArea, 1, 4},
                    ElementCase{"Tet10", ElementType::Tet10, tetCorners, tetMiddles, tetArea, 1,
                                16},
                    ElementCase{"Hex8", ElementType::Hex8, hexCorners, {}, 22, 6, 12},
                    ElementCase{"Hex20", ElementType::Hex20, hexCorners, hexMiddles, 22, 6, 36},
                    ElementCase{"Wedge6", ElementType::Wedge6, wedgeCorners, {}, wedgeArea, 12, 8},
                    ElementCase{"Wedge15", ElementType::Wedge15, wedgeCorners, wedgeMiddles,
                                wedgeArea, 12, 26}),
    [](const auto& parameters) { return parameters.param.name; });

TEST(Surface, OfABlockOfElementsHasNoInnerFaces) {
    const auto part = test::makeBrickPart(Vec3(4, 3, 2), 4, 3, 2);
    const SurfaceMesh surface = extractSurface(part->mesh);
    const Measures m = measure(part->mesh, surface);
    EXPECT_TRUE(m.isClosed);
    EXPECT_EQ(surface.triangles.size(), 2u * 2u * (12 + 8 + 6));
    EXPECT_NEAR(m.area, 52, 1e-12);
    EXPECT_NEAR(m.volume, 24, 1e-12);
    EXPECT_EQ(int(surface.nodes.size()), 5 * 4 * 3 - 3 * 2 * 1);
    EXPECT_EQ(surface.elementEdges.size(),
              2u * 2u * (12 + 8 + 6));  // Euler: E = 2F for quadrilaterals
}

TEST(Surface, CurvedQuadraticFacesAreFollowed) {
    // Mid-edge nodes of the outer faces are pushed out, so the volume grows.
    Mesh mesh = makeElement(ElementType::Hex20, hexCorners, hexMiddles);
    for (int n = 8; n < 20; ++n)
        for (int k = 0; k < 3; ++k) {
            const double middle = k == 0 ? 0.5 : (k == 1 ? 1 : 1.5);
            double& x = mesh.positions[3 * n + k];
            x = middle + 1.1 * (x - middle);
        }
    const Measures m = measure(mesh, extractSurface(mesh));
    EXPECT_TRUE(m.isClosed);
    EXPECT_GT(m.volume, 6.5);
}

TEST(Surface, NodeOutsideTheMeshIsNamed) {
    Mesh mesh = makeElement(ElementType::Tet4, tetCorners, {});
    mesh.elements[0].nodes[2] = 17;
    EXPECT_THAT([&] { extractSurface(mesh); },
                testing::ThrowsMessage<std::invalid_argument>(testing::HasSubstr("17")));
}

}  // namespace
}  // namespace simflex
