// The rasterizer against OpenGL's pictures of the same scenes, and against closed forms.
#include <omp.h>

#include <cmath>
#include <limits>

#include "GlScene.h"
#include "PictureDifference.h"
#include "simflex/render/raster/Rasterizer.h"

namespace simflex {
namespace {

using namespace test;
using SimTK::Pi;
using SimTK::Transform;
using SimTK::Vec3;

const Vec3 red(0.9, 0.2, 0.1), green(0.1, 0.7, 0.2), blue(0.1, 0.3, 0.9), black(0);

class RasterizerTest : public GlScene {
protected:
    /** A sphere of so many metres whose values rise along x, and are none in one octant. **/
    static SurfaceGeometryPtr makeColored() {
        auto sphere = std::make_shared<SurfaceGeometry>(*createSphere(48));
        for (int i = 0; i < sphere->numVertices(); ++i) {
            float* const v = &sphere->vertices[std::size_t(i) * SurfaceGeometry::floatsPerVertex];
            const bool hasValue = !(v[0] > 0.2f && v[1] > 0.2f && v[2] > 0.2f);
            v[6] = hasValue ? v[0] : std::numeric_limits<float>::quiet_NaN();
        }
        return sphere;
    }

    /** Some of everything that the rasterizer draws, reaching below the ground. **/
    void fill() {
        style.isLit = style.hasTriad = style.ground.isShown = true;
        style.ground.X_GP = Transform(
            SimTK::Rotation(SimTK::UnitVec3(0, 1, 0), SimTK::ZAxis, Vec3(1, 0, 0), SimTK::XAxis),
            Vec3(0, -0.5, 0));
        style.ground.gridSpacing = 0.2;
        style.palette.ground = Vec3(0.91, 0.92, 0.93);
        style.palette.grid = Vec3(0.7, 0.73, 0.76);
        style.palette.backgroundTop = Vec3(0.8, 0.85, 0.9);
        style.palette.ghost = Vec3(0.45, 0.5, 0.6);
        style.contourLow = -0.9;
        style.contourHigh = 0.9;
        camera.X_GC.updR() = SimTK::Rotation(-0.25, SimTK::XAxis);
        camera.X_GC.updP() = camera.X_GC.R() * Vec3(0.1, 0.1, 5);
        camera.farPlane = 30;
        camera.viewHeight = 2.4;
        add(makeColored(), Vec3(-0.8, 0.1, 0), Vec3(0.5), red).style = SurfaceItem::Style::Contour;
        SurfaceItem& brick =
            add(createBrick(), Transform(SimTK::Rotation(0.5, SimTK::YAxis), Vec3(0.7, -0.3, 0.3)),
                Vec3(0.4, 0.3, 0.5), blue);
        brick.showFeatureEdges = brick.showElementEdges = true;
        add(createTorus(0.3, 48), Vec3(0, 0.3, 0), Vec3(0.6), green).style =
            SurfaceItem::Style::Ghost;
        add(createSphere(48), Vec3(-0.75, 0.15, 0), Vec3(0.5, 0.55, 0.5), green, 0.42).style =
            SurfaceItem::Style::Ghost;
        add(createCircle(32), Vec3(0.1, -0.2, -0.4), Vec3(0.5), red);  // from both sides
        scene.lines.push_back({Vec3(-1, 0.9, 0), Vec3(1, 0.5, 0.4), black, 1, 3});
        scene.lines.push_back({Vec3(-1, -0.4, 0.5), Vec3(1, 0.1, 9), red, 0.5, 5});
        scene.points.push_back({Vec3(-0.2, -0.4, 0.6), black, 1, 12});
        scene.points.push_back({Vec3(0.3, 0.6, 0.2), red, 0.6, 20});
    }

    Image draw(int width, int height) {
        style.unit = height / 720.0;
        EXPECT_TRUE(raster::Rasterizer::canDraw(scene, camera, style, width, height));
        return rasterizer.draw(scene, camera, style, width, height);
    }

    void compareWithOpenGl(int width, int height) {
        const Image image = draw(width, height);
        const Image other = GlRenderer().draw(scene, camera, style, width, height);
        const PictureDifference difference = comparePictures(image, other);
        EXPECT_TRUE(difference.isNegligible())
            << difference.largest << " " << difference.fraction << " " << difference.numClustered;
        if (const char* folder = std::getenv("SIMFLEX_TEST_PICTURES")) {
            const std::string name = folder + std::string("/") +
                                     testing::UnitTest::GetInstance()->current_test_info()->name();
            image.writePng(name + ".png");
            other.writePng(name + "_gl.png");
            difference.makePicture().writePng(name + "_difference.png");
        }
    }

    raster::Rasterizer rasterizer;
};

TEST_F(RasterizerTest, DrawsWhatOpenGlDraws) {
    fill();
    compareWithOpenGl(800, 450);
}

TEST_F(RasterizerTest, DrawsWhatOpenGlDrawsWithoutPerspective) {
    fill();
    camera.isOrthographic = true;
    compareWithOpenGl(640, 480);
}

TEST_F(RasterizerTest, DrawsWhatOpenGlDrawsUnlitAndFromBelowTheGround) {
    fill();
    style.isLit = false;
    style.ground.X_GP.updP() = Vec3(0, 5, 0);
    compareWithOpenGl(401, 303);  // no multiple of anything
}

TEST_F(RasterizerTest, GivesTheSameBytesForAnyNumberOfThreadsAndWhateverWasDrawnBefore) {
    fill();
    const int usual = omp_get_max_threads();
    omp_set_num_threads(1);
    const Image one = draw(640, 360);
    omp_set_num_threads(3);
    draw(333, 222);
    EXPECT_TRUE(draw(640, 360) == one);
    omp_set_num_threads(usual);
    raster::Rasterizer other;
    EXPECT_TRUE(other.draw(scene, camera, style, 640, 360) == one);
}

// A disc of slivers that meet in its middle: black where two of them meet, not more and not less.
TEST_F(RasterizerTest, TrianglesThatShareAnEdgeCoverEachSampleOnce) {
    auto fan = std::make_shared<SurfaceGeometry>();
    constexpr int count = 997;
    fan->addVertex(Vec3(0), Vec3(0, 0, 1));
    for (int i = 0; i < count; ++i)
        fan->addVertex(Vec3(std::cos(2 * Pi * i / count), std::sin(2 * Pi * i / count), 0),
                       Vec3(0, 0, 1));
    for (int i = 0; i < count; ++i) fan->addTriangle(0, 1 + i, 1 + (i + 1) % count);
    fan->updateBounds();
    add(fan, Transform(), Vec3(0.8), black);
    camera.isOrthographic = true;
    camera.viewHeight = 2;
    const Image image = draw(400, 400);
    double area = 0;
    for (int y = 0; y < 400; ++y)
        for (int x = 0; x < 400; ++x) {
            const int value = image.getPixel(x, y)[0];
            area += (255 - value) / 255.0;
            const double r = std::hypot(x + 0.5 - 200, y + 0.5 - 200);
            if (r < 158) {
                ASSERT_EQ(value, 0) << x << ' ' << y;
            }
            if (r > 162) {
                ASSERT_EQ(value, 255) << x << ' ' << y;
            }
        }
    EXPECT_NEAR(area, Pi * 160 * 160, 1e-3 * Pi * 160 * 160);
}

TEST_F(RasterizerTest, LeavesToOpenGlWhatItDoesNotDraw) {
    const auto canDraw = [&] {
        return raster::Rasterizer::canDraw(scene, camera, style, 320, 180);
    };
    SurfaceItem& item = add(createBrick(), Transform(), Vec3(0.5), red);
    EXPECT_TRUE(canDraw());
    item.opacity = 0.5;
    EXPECT_FALSE(canDraw());
    item.opacity = 1;
    item.representation = SimTK::DecorativeGeometry::DrawWireframe;
    EXPECT_FALSE(canDraw());
    item.representation = SimTK::DecorativeGeometry::DrawSurface;
    item.scale = Vec3(5);  // the near plane cuts it
    EXPECT_FALSE(canDraw());
    item.scale = Vec3(0.5);
    style.isBackgroundTransparent = true;
    EXPECT_FALSE(canDraw());
    style.isBackgroundTransparent = false;
    scene.texts.emplace_back();
    EXPECT_FALSE(canDraw());
}

}  // namespace
}  // namespace simflex
