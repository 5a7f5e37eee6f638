// Difficult scenes: nothing to draw, NaNs, sizes from 1e-9 to 1e9 m, broken meshes, thousands of
// objects, shapes that never repeat.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <fstream>

#include "PictureDifference.h"
#include "TestParts.h"
#include "simflex/render/OffscreenVisualizer.h"
#include "simflex/render/scene/SceneBuilder.h"

namespace simflex {
namespace {

using namespace test;
using SimTK::NaN;
using SimTK::Transform;
using SimTK::Vec3;

const SimTK::MobilizedBodyIndex ground(0);

SimTK::PolygonalMesh makeMesh(const std::vector<Vec3>& points,
                              const std::vector<std::vector<int>>& faces) {
    SimTK::PolygonalMesh mesh;
    for (const Vec3& p : points) mesh.addVertex(p);
    for (const auto& corners : faces) {
        SimTK::Array_<int> face;
        for (const int corner : corners) face.push_back(corner);
        mesh.addFace(face);
    }
    return mesh;
}

Scene build(const std::vector<SimTK::DecorativeGeometry>& geometry) {
    static ShapeCache shapes;
    Scene scene;
    SceneBuilder builder(
        scene, shapes, [](int) { return Transform(); }, [](const Vec3&, double) { return 50.0; });
    for (const auto& piece : geometry) builder.add(piece);
    builder.addNotices();
    return scene;
}

TEST(RobustScene, WhatIsNotFiniteIsLeftOutAndItsBodyNamed) {
    const Scene scene =
        build({SimTK::DecorativeSphere(0.1).setBodyId(3).setTransform(Vec3(0, NaN, 0)),
               SimTK::DecorativeLine(Vec3(0), Vec3(SimTK::Infinity, 0, 0)).setBodyId(3),
               SimTK::DecorativePoint(Vec3(NaN)).setBodyId(7),
               SimTK::DecorativeArrow(Vec3(0), Vec3(0, NaN, 0)).setBodyId(7),
               SimTK::DecorativeFrame(1).setBodyId(7).setTransform(Vec3(NaN)),
               SimTK::DecorativeText("text").setBodyId(7).setTransform(Vec3(NaN)),
               SimTK::DecorativeSphere(0.2)});
    EXPECT_EQ(scene.surfaces.size(), 1u);
    EXPECT_TRUE(scene.lines.empty() && scene.points.empty() && scene.texts.empty());
    ASSERT_EQ(scene.screenTexts.size(), 2u);
    EXPECT_EQ(scene.screenTexts[0],
              "not drawn: 2 decorations of mobilized body 3 whose place or size is not finite");
    EXPECT_EQ(scene.screenTexts[1],
              "not drawn: 4 decorations of mobilized body 7 whose place or size is not finite");
}

TEST(RobustScene, WhatHasNoSizeIsNotDrawn) {
    const Scene scene =
        build({SimTK::DecorativeArrow(Vec3(1), Vec3(1)), SimTK::DecorativeMesh(makeMesh({}, {}))});
    for (const SurfaceItem& item : scene.surfaces) EXPECT_TRUE(item.geometry->triangles.empty());
    EXPECT_TRUE(scene.screenTexts.empty());
    std::vector<Vec3> bounds;
    scene.appendBounds(bounds);
    for (const Vec3& p : bounds) EXPECT_TRUE(p.isFinite());
}

TEST(RobustScene, SphereIsAsFineAsThePictureWhateverResolutionIsAskedFor) {
    for (const double resolution : {1.0, 3.0, 10.0}) {
        const Scene scene = build({SimTK::DecorativeSphere(0.1).setResolution(resolution)});
        const SurfaceGeometry& sphere = *scene.surfaces.at(0).geometry;
        int numSlices = -1;  // the equator repeats one vertex
        for (std::size_t i = 0; i < sphere.vertices.size(); i += SurfaceGeometry::floatsPerVertex)
            numSlices += std::abs(sphere.vertices[i + 1]) < 1e-6;
        const double error = 50 * (1 - std::cos(SimTK::Pi / numSlices));  // of 50 pixels
        EXPECT_LT(error, 0.2) << resolution;
        EXPECT_GT(error, 0.05) << resolution;
    }
}

// Simbody itself rejects sizes of zero.
TEST(RobustScene, FlatBrickIsDrawnAsAPlate) {
    EmptyScene scene;
    OffscreenVisualizer viz(scene.system, 320, 180);
    makePlain(viz, 5);
    viz.setLighting(OffscreenVisualizer::Lighting::Shaded);
    viz.addDecoration(ground, Transform(),
                      SimTK::DecorativeBrick(Vec3(0.5, 0.5, 1e-200)).setColor(Vec3(0.8, 0.2, 0.2)));
    const Image::Pixel p = viz.drawFrame(scene.state).getPixel(160, 90);
    EXPECT_GT(p[0], 120);
    EXPECT_LT(p[1], 120);
}

TEST(RobustScene, SizeOfTheSceneDoesNotMatter) {
    std::vector<Image> images;
    for (const double scale : {1.0, 1e-9, 1e9}) {
        EmptyScene scene;
        OffscreenVisualizer viz(scene.system, 320, 180);
        viz.setShowSimTime(false);
        viz.setBackgroundType(SimTK::Visualizer::SolidColor);
        viz.addDecoration(ground, Transform(SimTK::Rotation(0.4, SimTK::ZAxis)),
                          SimTK::DecorativeBrick(scale * Vec3(1, 0.5, 0.7)));
        viz.addDecoration(ground, Transform(scale * Vec3(1.5, 0.4, 0)),
                          SimTK::DecorativeSphere(0.5 * scale).setColor(Vec3(0.8, 0.3, 0.2)));
        viz.addDecoration(ground, Transform(scale * Vec3(-1, 1, 0)),
                          SimTK::DecorativeTorus(0.4 * scale, 0.1 * scale).setOpacity(0.5));
        viz.addDecoration(ground, Transform(), SimTK::DecorativeFrame(scale));
        images.push_back(viz.drawFrame(scene.state));
    }
    for (int i : {1, 2}) {
        const PictureDifference difference = comparePictures(images[0], images[std::size_t(i)]);
        EXPECT_TRUE(difference.isNegligible()) << i << ": ΔE " << difference.largest << ", "
                                               << difference.numClustered << " pixels in a spot";
    }
}

// 1 mm of steel on a kilometre of ground, seen from 5 mm.
TEST(RobustScene, SmallPartOnHugeGroundIsSeenFromNearby) {
    EmptyScene scene;
    OffscreenVisualizer viz(scene.system, 320, 180);
    makePlain(viz);
    viz.addDecoration(
        ground, Transform(Vec3(0, -1, 0)),
        SimTK::DecorativeBrick(Vec3(500, 0.9995, 500)).setColor(Vec3(0.2, 0.698, 0.2)));
    viz.addDecoration(ground, Transform(),
                      SimTK::DecorativeBrick(Vec3(5e-4)).setColor(Vec3(0.8, 0.1, 0.1)));
    viz.setCameraTransform(Transform(Vec3(0, 0.002, 0.005)));
    viz.pointCameraAt(Vec3(0), Vec3(0, 1, 0));
    const Image image = viz.drawFrame(scene.state);
    const auto getColor = [&](const Vec3& p) {
        const Vec3 pixel = viz.calcPixel(p);
        return image.getPixel(int(pixel[0]), int(pixel[1]));
    };
    EXPECT_EQ(getColor(Vec3(0, 0, 5e-4)), (Image::Pixel{204, 26, 26, 255}));
    EXPECT_EQ(getColor(Vec3(0.0015, -5e-4, 0)), (Image::Pixel{51, 178, 51, 255}));
}

TEST(RobustScene, BrokenMeshesAreDrawnAsFarAsTheyGo) {
    // A square of two triangles, with duplicate vertices, a degenerate triangle, a duplicate one
    // and one with a repeated corner; the square has a hole beside it.
    const auto mesh =
        makeMesh({Vec3(-0.5, -0.5, 0), Vec3(0.5, -0.5, 0), Vec3(0.5, 0.5, 0), Vec3(-0.5, 0.5, 0),
                  Vec3(0.5, 0.5, 0), Vec3(0, 0, 0), Vec3(0.25, 0, 0), Vec3(0.5, 0, 0)},
                 {{0, 1, 2}, {0, 4, 3}, {5, 6, 7}, {0, 1, 2}, {1, 1, 2}});
    EmptyScene scene;
    OffscreenVisualizer viz(scene.system, 320, 180);
    makePlain(viz, 5);
    viz.addDecoration(ground, Transform(), SimTK::DecorativeMesh(mesh).setColor(Vec3(0)));
    const Image image = viz.drawFrame(scene.state);
    const double pixels = viz.calcPixel(Vec3(1, 0, 0))[0] - viz.calcPixel(Vec3(0))[0];
    EXPECT_NEAR(calcCoveredArea(image, 0, 0), pixels * pixels, 0.125 * 4 * pixels);
}

TEST(RobustScene, TenThousandSpheresGiveTheSamePictureTwice) {
    EmptyScene scene;
    OffscreenVisualizer viz(scene.system, 640, 360);
    for (int i = 0; i < 10000; ++i)
        viz.addDecoration(ground, Transform(Vec3(i % 100, (i / 100) % 10, i / 1000)),
                          SimTK::DecorativeSphere(0.3).setColor(
                              Vec3(0.2 + 0.006 * (i % 100), 0.5, 0.9 - 0.006 * (i % 100))));
    const Image first = viz.drawFrame(scene.state);
    const Image second = viz.drawFrame(scene.state);
    EXPECT_TRUE(first == second);
    EXPECT_GT(countPixels(second, second.getPixel(0, 0)), 20000);
}

double readResidentMegabytes() {
    long pages = 0, resident = 0;
    std::ifstream("/proc/self/statm") >> pages >> resident;
    return double(resident) * double(sysconf(_SC_PAGESIZE)) / 1048576;
}

// New shapes, sizes, meshes and texts in every frame.
class NeverTheSame : public SimTK::DecorationGenerator {
public:
    void generateDecorations(const SimTK::State& state,
                             SimTK::Array_<SimTK::DecorativeGeometry>& geometry) override {
        const double t = state.getTime();
        geometry.push_back(SimTK::DecorativeText("time " + std::to_string(t)).setScale(0.2));
        geometry.push_back(SimTK::DecorativeTorus(0.5, 0.1 + 0.1 * std::sin(t)));
        geometry.push_back(SimTK::DecorativeSphere(0.1 + 1e-3 * t));
        std::vector<Vec3> points;
        std::vector<std::vector<int>> faces;
        for (int i = 0; i < 3000; ++i) {
            points.emplace_back(std::cos(0.3 * i + t), 0.001 * i, std::sin(0.3 * i + t));
            if (i > 1) faces.push_back({i - 2, i - 1, i});
        }
        geometry.push_back(SimTK::DecorativeMesh(makeMesh(points, faces)));
    }
};

TEST(RobustScene, ShapesAndTextsThatChangeEveryFrameDoNotPileUp) {
    EmptyScene scene;
    OffscreenVisualizer viz(scene.system, 96, 54);
    viz.addDecorationGenerator(new NeverTheSame);
    const auto drawSome = [&](int count) {
        for (int i = 0; i < count; ++i) {
            scene.state.setTime(scene.state.getTime() + 0.1);
            viz.drawFrame(scene.state);
        }
    };
    drawSome(40);
    const double before = readResidentMegabytes();
    drawSome(100);
    // A mesh has 3000 vertices of 28 bytes and their indices: 100 of them take 15 MB.
    EXPECT_LT(readResidentMegabytes() - before, 5);
}

}  // namespace
}  // namespace simflex
