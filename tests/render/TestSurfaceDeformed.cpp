#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <omp.h>

#include <cmath>

#include "AllocationCount.h"
#include "TestParts.h"
#include "simflex/render/gl/GlRenderer.h"
#include "simflex/render/skin/DeformedSurface.h"

namespace simflex {
namespace {

using SimTK::Vec3;
using SimTK::Vector;
using Part = std::shared_ptr<const ReducedBody>;

constexpr double ringRadius = 2, tubeRadius = 0.5;

// A solid ring about z of wedges around its core. Modes: uniform growth u = s, then waves.
Part makeRing(int around, int across, int numModes = 1) {
    auto part = std::make_shared<ReducedBody>();
    part->name = "ring";
    part->mass = 1;
    part->inertia = {1, 1, 1, 0, 0, 0};
    part->numModes = numModes;
    part->omegaSquared.assign(std::size_t(numModes), 1);
    Mesh& mesh = part->mesh;
    ElementBlock block;
    block.type = ElementType::Wedge6;
    for (int i = 0; i < around; ++i) {
        const double angle = 2 * SimTK::Pi * i / around;
        for (int j = 0; j <= across; ++j) {
            const double turn = 2 * SimTK::Pi * j / across, r = j == 0 ? 0 : tubeRadius;
            const double outward = ringRadius + r * std::cos(turn);
            mesh.nodeNumbers.push_back(mesh.numNodes() + 1);
            mesh.positions.insert(
                mesh.positions.end(),
                {outward * std::cos(angle), outward * std::sin(angle), r * std::sin(turn)});
        }
        for (int j = 0; j < across; ++j)
            for (const int section : {i, (i + 1) % around})
                for (const int corner : {0, 1 + (j + 1) % across, 1 + j})
                    block.nodes.push_back(section * (across + 1) + corner);
    }
    mesh.elements.push_back(block);
    const std::size_t rows = mesh.positions.size();
    part->Phi = mesh.positions;
    for (int mode = 1; mode < numModes; ++mode)
        for (std::size_t row = 0; row < rows; ++row)
            part->Phi.push_back(0.1 * std::sin(mode * mesh.positions[row] + double(row % 3)));
    return part;
}

Vec3 getVector(const SurfaceGeometry& geometry, int vertex, int offset) {
    const float* v = &geometry.vertices[std::size_t(vertex) * SurfaceGeometry::floatsPerVertex +
                                        std::size_t(offset)];
    return Vec3(v[0], v[1], v[2]);
}

// Returns the volume by the divergence theorem.
double calcVolume(const SurfaceGeometry& geometry) {
    double volume = 0;
    for (std::size_t i = 0; i < geometry.triangles.size(); i += 3) {
        Vec3 p[3];
        for (std::size_t k = 0; k < 3; ++k)
            p[k] = getVector(geometry, int(geometry.triangles[i + k]), 0);
        volume += SimTK::dot(p[0], SimTK::cross(p[1], p[2])) / 6;
    }
    return volume;
}

TEST(DeformedSurface, NormalsOfATorusAreThoseOfItsEquation) {
    for (const double growth : {0.0, 0.5}) {  // growth rotates no normal
        double previous = 0;
        for (const int across : {20, 40}) {
            DeformedSurface surface(extractSkinModes(makeRing(4 * across, across), SimTK::Pi));
            surface.update(Vector(1, growth), 1);
            const SurfaceGeometry& geometry = *surface.getDeformed();
            double largest = 0;
            for (int v = 0; v < geometry.numVertices(); ++v) {
                const Vec3 p = getVector(geometry, v, 0) / (1 + growth);
                Vec3 core(p[0], p[1], 0);
                core *= ringRadius / core.norm();
                largest =
                    std::max(largest, ((p - core) / tubeRadius - getVector(geometry, v, 3)).norm());
            }
            EXPECT_LT(largest, 0.3 * SimTK::square(2 * SimTK::Pi / across));
            if (previous > 0) {
                EXPECT_LT(largest, 0.3 * previous);  // second order
            }
            previous = largest;
        }
    }
}

TEST(DeformedSurface, NormalsOfABentPlateFollowItsSlope) {
    // Mode 2: u_y = x². Without creases except at the box's edges, the top has slope 2 ξ x.
    const auto part = test::makeBrickPart(Vec3(2, 0.2, 1), 40, 1, 20);
    DeformedSurface surface(extractSkinModes(part, 0.6));
    const double xi = 0.25, factor = 2;
    Vector coordinates(3, 0.0);
    coordinates[2] = xi;
    surface.update(coordinates, factor);
    const SurfaceGeometry& rest = *surface.getUndeformed();
    const SurfaceGeometry& bent = *surface.getDeformed();
    int numChecked = 0;
    for (int v = 0; v < rest.numVertices(); ++v) {
        const Vec3 s = getVector(rest, v, 0);
        const bool isTop = getVector(rest, v, 3)[1] > 0.999;
        if (!isTop || std::abs(s[0]) > 0.99 || std::abs(s[2]) > 0.49) continue;
        const SimTK::UnitVec3 expected(-2 * factor * xi * s[0], 1, 0);
        EXPECT_LT((getVector(bent, v, 3) - Vec3(expected)).norm(), 2e-3);
        ++numChecked;
    }
    EXPECT_EQ(numChecked, 39 * 19);
}

TEST(DeformedSurface, EnclosesTheVolumeThatTheDeformationGives) {
    const auto part = test::makeBrickPart(Vec3(4, 3, 2), 8, 3, 2);
    DeformedSurface surface(extractSkinModes(part, 0.6));
    EXPECT_NEAR(calcVolume(*surface.getUndeformed()), 24, 1e-5);
    Vector xi(3, 0.0);
    xi[1] = 0.1;  // stretch along x
    surface.update(xi, 1);
    EXPECT_NEAR(calcVolume(*surface.getDeformed()), 24 * 1.1, 1e-4);
    surface.update(xi, 5);
    EXPECT_NEAR(calcVolume(*surface.getDeformed()), 24 * 1.5, 1e-4);
    xi[1] = 0;
    xi[2] = 0.3;  // shear along y that depends on x preserves it
    surface.update(xi, 1);
    EXPECT_NEAR(calcVolume(*surface.getDeformed()), 24, 1e-4);

    DeformedSurface ring(extractSkinModes(makeRing(160, 80), 0.6));
    const double exact = 2 * SimTK::square(SimTK::Pi * tubeRadius) * ringRadius;
    ring.update(Vector(1, 1.0), 1);
    EXPECT_NEAR(calcVolume(*ring.getDeformed()), 8 * exact, 8 * exact * 2e-3);
    EXPECT_NEAR(calcVolume(*ring.getDeformed()), 8 * calcVolume(*ring.getUndeformed()), 1e-3);
}

TEST(DeformedSurface, HasTheSameBitsForAnyNumberOfThreads) {
    const auto skin = extractSkinModes(makeRing(400, 80, 30), 0.6);
    Vector xi(30);
    for (int i = 0; i < xi.size(); ++i) xi[i] = std::sin(1.0 + i);
    std::vector<float> values(skin->nodes.size());
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = std::cos(float(i));
    const int threadsBefore = omp_get_max_threads();
    std::vector<float> first;
    for (const int threads : {1, 2, 3, 7}) {
        omp_set_num_threads(threads);
        DeformedSurface surface(skin);
        surface.update(xi, 0.1, values);
        if (first.empty()) first = surface.getDeformed()->vertices;
        EXPECT_EQ(surface.getDeformed()->vertices, first) << threads;
    }
    omp_set_num_threads(threadsBefore);
}

TEST(DeformedSurface, AllocatesNothingPerFrame) {
    const auto skin = extractSkinModes(makeRing(60, 20, 5), 0.6);
    DeformedSurface surface(skin);
    const std::vector<float> values(skin->nodes.size(), 1.0f);
    Vector xi(5, 0.01);
    surface.update(xi, 1, values);
    const long before = test::getNumAllocations();
    for (int frame = 0; frame < 100; ++frame) {
        xi[0] = 0.01 * frame;
        surface.update(xi, 1, values);
    }
    EXPECT_EQ(test::getNumAllocations() - before, 0);
}

TEST(DeformedSurface, ValuesAreThoseOfTheirNodes) {
    const auto skin = extractSkinModes(makeRing(24, 12), 0.6);
    std::vector<float> values;
    for (int i = 0; i < skin->numNodes(); ++i) values.push_back(float(i));
    values[5] = SimTK::NaN;
    DeformedSurface surface(skin);
    surface.update(Vector(1, 0.0), 1, values);
    const SurfaceGeometry& geometry = *surface.getDeformed();
    for (int v = 0; v < geometry.numVertices(); ++v) {
        const float value =
            geometry.vertices[std::size_t(v) * SurfaceGeometry::floatsPerVertex + 6];
        const int node = skin->vertexPoint[std::size_t(v)];
        EXPECT_TRUE(node == 5 ? std::isnan(value) : value == float(node)) << node;
    }
}

TEST(Creases, OfABoxAreItsTwelveEdges) {
    const auto part = test::makeBrickPart(Vec3(4, 3, 2), 4, 3, 2);
    const auto skin = extractSkinModes(part, 80 * SimTK::Pi / 180);
    // One vertex per node and side: the grids of the six sides.
    EXPECT_EQ(skin->undeformed->numVertices(), 2 * (5 * 4 + 5 * 3 + 4 * 3));
    EXPECT_EQ(skin->undeformed->featureEdges.size(), 2u * 4 * (4 + 3 + 2));
    for (int v = 0; v < skin->undeformed->numVertices(); ++v) {
        const Vec3 n = getVector(*skin->undeformed, v, 3);
        EXPECT_NEAR(std::max({std::abs(n[0]), std::abs(n[1]), std::abs(n[2])}), 1, 1e-6);
    }
    // With corners smoother than the angle: one vertex per node, and no lines.
    const auto smooth = extractSkinModes(part, 100 * SimTK::Pi / 180);
    EXPECT_EQ(smooth->undeformed->numVertices(), smooth->numNodes());
    EXPECT_TRUE(smooth->undeformed->featureEdges.empty());
}

TEST(PartWithoutElements, ShowsItsNodesInTheColoursOfTheirValues) {
    auto part = std::make_shared<ReducedBody>(*test::makeBrickPart(Vec3(4, 3, 2), 1, 1, 1));
    part->mesh.elements.clear();
    test::EmptyScene scene;
    OffscreenVisualizer viz(scene.system, 400, 300);
    test::makePlain(viz, 12);
    Vector xi(3, 0.0);
    xi[1] = 0.1;  // |u| = 0.1·|x| = 0.2 at all nodes
    viz.addDeformableMesh(test::makeStill(part, xi)).setDeformationFactor(1);
    viz.setContourRange(0, 0.2);
    const Image image = viz.drawFrame(scene.state);
    const Vec3 top = 255 * calcColor(ColorMap::Viridis, 1);
    for (const double x : {-2.2, 2.2})
        for (const double y : {-1.5, 1.5}) {
            const Vec3 pixel = viz.calcPixel(Vec3(x, y, 1));
            const Image::Pixel color = image.getPixel(int(pixel[0]), int(pixel[1]));
            for (int k = 0; k < 3; ++k) EXPECT_NEAR(color[std::size_t(k)], top[k], 3);
        }
    EXPECT_EQ(image.getPixel(200, 150), (Image::Pixel{255, 255, 255, 255}));
}

TEST(FineShapes, AreThoseOfSmallTrianglesThatTurnLittle) {
    EXPECT_TRUE(extractSkinModes(makeRing(400, 120), 0.6)->undeformed->isFine);
    EXPECT_FALSE(extractSkinModes(makeRing(48, 24), 0.6)->undeformed->isFine);
    // On large flat triangles the direction to the eye varies.
    EXPECT_FALSE(
        extractSkinModes(test::makeBrickPart(Vec3(4, 3, 2), 4, 3, 2), 0.6)->undeformed->isFine);
}

TEST(FineShapes, LookTheSameLitAtVerticesOrPixels) {
    DeformedSurface surface(extractSkinModes(makeRing(400, 120), 0.6));
    std::vector<float> values;
    for (int i = 0; i < surface.getSkin().numNodes(); ++i)
        values.push_back(surface.getSkin().restPositions[3 * std::size_t(i)]);
    surface.update(Vector(1, 0.0), 1, values);
    auto plain = std::make_shared<SurfaceGeometry>(*surface.getDeformed());
    plain->isFine = false;

    Camera camera;
    camera.X_GC = SimTK::Transform(SimTK::Rotation(0.9, SimTK::XAxis), Vec3(0, -7.8, 6.2));
    camera.fieldOfView = 0.55;
    camera.nearPlane = 5;
    camera.farPlane = 20;
    FrameStyle style;
    style.ground.isShown = false;
    style.hasTriad = false;
    style.up = SimTK::UnitVec3(SimTK::ZAxis);
    style.contourLow = -2.5;
    style.contourHigh = 2.5;
    GlRenderer renderer;
    const auto draw = [&](const std::shared_ptr<const SurfaceGeometry>& geometry) {
        Scene scene;
        SurfaceItem item;
        item.geometry = geometry;
        item.style = SurfaceItem::Style::Contour;
        scene.surfaces.push_back(item);
        return renderer.draw(scene, camera, style, 480, 360);
    };
    const Image fine = draw(surface.getDeformed()), other = draw(plain);
    int numCovered = 0, numDifferent = 0, numFar = 0;
    double sum = 0;
    for (int y = 0; y < 360; ++y)
        for (int x = 0; x < 480; ++x) {
            const Image::Pixel a = fine.getPixel(x, y), b = other.getPixel(x, y);
            int difference = 0;
            for (std::size_t k = 0; k < 3; ++k)
                difference = std::max(difference, std::abs(int(a[k]) - int(b[k])));
            numCovered += a[0] > 0 || a[1] > 0 || a[2] > 0;
            numDifferent += difference > 0;
            numFar += difference > 6;
            sum += difference;
        }
    EXPECT_GT(numCovered, 20000);
    EXPECT_GT(numDifferent, 0);             // both used different paths
    EXPECT_LT(numFar, 0.002 * numCovered);  // pixels of the silhouette
    EXPECT_LT(sum / numCovered, 0.3);
}

}  // namespace
}  // namespace simflex
