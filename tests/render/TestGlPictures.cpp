#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <string>

#include "GlScene.h"

namespace simflex {
namespace {

using SimTK::Transform;
using SimTK::Vec3;

const Vec3 red(0.9, 0.2, 0.1), green(0.1, 0.7, 0.2), blue(0.1, 0.3, 0.9), black(0), white(1);

// Sizes, depth and background of pictures by GlRenderer, against closed forms. The camera is on the
// z axis, looking along −z; colours are unlit, the background is white.
class GlPictures : public test::GlScene {
protected:
    static void SetUpTestSuite() { shared = std::make_unique<GlRenderer>(); }
    static void TearDownTestSuite() { shared.reset(); }

    // Adds items of every kind, with light and a ground.
    void fill() {
        style.isLit = true;
        style.hasTriad = true;
        style.ground.isShown = true;
        style.ground.X_GP = Transform(
            SimTK::Rotation(SimTK::UnitVec3(0, 1, 0), SimTK::ZAxis, Vec3(1, 0, 0), SimTK::XAxis),
            Vec3(0, -0.9, 0));
        style.ground.gridSpacing = 0.2;
        style.palette.ground = Vec3(0.91, 0.92, 0.93);
        style.palette.grid = Vec3(0.7, 0.73, 0.76);
        style.palette.backgroundTop = Vec3(0.8, 0.85, 0.9);
        camera.X_GC.updR() = SimTK::Rotation(-0.15, SimTK::XAxis);
        camera.X_GC.updP() = camera.X_GC.R() * Vec3(0, 0, 6);
        camera.farPlane = 30;
        add(createSphere(64), Vec3(-0.8, 0.2, 0), Vec3(0.5), red);
        add(createBrick(), Vec3(0.7, -0.3, 0.3), Vec3(0.4, 0.3, 0.5), blue);
        add(createTorus(0.3, 48), Vec3(0, 0.3, 0), Vec3(0.6), green, 0.5);
        add(createSphere(64), Vec3(0.5, 0.3, 0), Vec3(0.4), red, 0.4);
        scene.lines.push_back({Vec3(-1, 0.9, 0), Vec3(1, 0.5, 0.4), black, 1, 3});
        scene.points.push_back({Vec3(-0.2, -0.4, 0.6), black, 1, 12});
        TextItem text;
        text.text = "text";
        text.X_GT = Transform(Vec3(-0.3, 0.95, 0));
        text.height = 0.15;
        text.color = black;
        scene.texts.push_back(text);
    }

    Image draw(int width, int height, DepthPicture* depth = nullptr) {
        style.unit = height / 720.0;
        const Image image = renderer.draw(scene, camera, style, width, height, depth);
        if (const char* folder = std::getenv("SIMFLEX_TEST_PICTURES"))
            image.writePng(std::string(folder) + "/" +
                           testing::UnitTest::GetInstance()->current_test_info()->name() + ".png");
        return image;
    }

    // Returns the black area on white [pixel], counting partial coverage.
    static double calcBlackArea(const Image& image) {
        double sum = 0;
        for (std::size_t i = 0; i < image.getNumBytes(); i += 4)
            sum += (255 - image.getData()[i]) / 255.0;
        return sum;
    }

    static std::unique_ptr<GlRenderer> shared;
    GlRenderer& renderer = *shared;
};

std::unique_ptr<GlRenderer> GlPictures::shared;

// Returns the share of bytes that differ by more than `tolerance`.
double calcDifferentShare(const Image& a, const Image& b, int tolerance) {
    EXPECT_EQ(a.getNumBytes(), b.getNumBytes());
    std::size_t different = 0;
    for (std::size_t i = 0; i < a.getNumBytes(); ++i)
        different += std::abs(int(a.getData()[i]) - int(b.getData()[i])) > tolerance;
    return double(different) / double(a.getNumBytes());
}

// Blends `picture` over a uniform background.
Image layOver(const Image& picture, const Vec3& color) {
    Image result = picture;
    for (std::size_t i = 0; i < result.getNumBytes(); i += 4) {
        std::uint8_t* p = result.updData() + i;
        const double alpha = p[3] / 255.0;
        for (int k = 0; k < 3; ++k)
            p[k] = std::uint8_t(std::lround(alpha * p[k] + (1 - alpha) * 255 * color[k]));
        p[3] = 255;
    }
    return result;
}

TEST_F(GlPictures, SphereInPerspectiveCoversTheEllipseOfItsCone) {
    // A sphere of radius r at distance D on the axis fills the cone tan α = r / √(D² − r²).
    const int width = 640, height = 480;
    add(createSphere(256), Vec3(0), Vec3(1.2), black);
    const double radius =
        0.5 * height / std::tan(camera.fieldOfView / 2) * 1.2 / std::sqrt(36 - SimTK::square(1.2));
    const double expected = SimTK::Pi * radius * radius;
    EXPECT_NEAR(calcBlackArea(draw(width, height)), expected, 1e-3 * expected);
}

TEST_F(GlPictures, DepthOfSphereIsThatOfItsRays) {
    const int width = 320, height = 240;
    const double r = 1.2;
    add(createSphere(200), Vec3(0), Vec3(r), red);
    for (const bool isOrthographic : {false, true}) {
        camera.isOrthographic = isOrthographic;
        camera.viewHeight = 3.2;
        DepthPicture depth;
        draw(width, height, &depth);
        const auto calcDistance = [&](double x, double y) {
            const double u = (x - 0.5 * width) / (0.5 * height),
                         v = (y - 0.5 * height) / (0.5 * height);
            if (isOrthographic) {
                const double a = 0.5 * camera.viewHeight;
                return 6 - std::sqrt(r * r - a * a * (u * u + v * v));  // NaN outside
            }
            // |(0, 0, 6) + s (u t, v t, −1)| = r
            const double t = std::tan(camera.fieldOfView / 2), q = 1 + t * t * (u * u + v * v);
            return (6 - std::sqrt(36 - q * (36 - r * r))) / q;
        };
        int numInside = 0, numOutside = 0;
        for (int y = 1; y < height; ++y)
            for (int x = 1; x < width; ++x) {
                const double distance = calcDistance(x + 0.5, y + 0.5);
                // NaN next to the edge.
                const double slope =
                    std::abs(calcDistance(x + 1.0, y + 0.5) - calcDistance(x + 0.0, y + 0.5)) +
                    std::abs(calcDistance(x + 0.5, y + 1.0) - calcDistance(x + 0.5, y + 0.0));
                if (slope < 0.015) {
                    EXPECT_NEAR(depth.getDistance(x, y), distance, 0.02 * slope + 3e-4);
                    ++numInside;
                } else if (std::isnan(calcDistance(x, y)) && std::isnan(calcDistance(x + 1, y)) &&
                           std::isnan(calcDistance(x, y + 1)) &&
                           std::isnan(calcDistance(x + 1, y + 1)) && std::isnan(distance)) {
                    EXPECT_EQ(depth.getDistance(x, y), SimTK::Infinity);
                    ++numOutside;
                }
            }
        EXPECT_GT(numInside, 9000);
        EXPECT_GT(numOutside, 30000);
    }
}

TEST_F(GlPictures, DepthOfFaceIsExactInBands) {
    add(createBrick(), Vec3(0), Vec3(1, 1, 0.5), red);
    renderer.setMaxBandPixels(200 * 31);
    DepthPicture depth;
    draw(200, 150, &depth);
    renderer.setMaxBandPixels(GlRenderer::defaultBandPixels);
    const double half = 75 / std::tan(camera.fieldOfView / 2) / 5.5;
    int numInside = 0;
    for (int y = 0; y < 150; ++y)
        for (int x = 0; x < 200; ++x) {
            const double away = std::max(std::abs(x + 0.5 - 100), std::abs(y + 0.5 - 75));
            if (away < half - 1) {
                EXPECT_NEAR(depth.getDistance(x, y), 5.5, 1e-5);
                ++numInside;
            } else if (away > half + 1) {
                EXPECT_EQ(depth.getDistance(x, y), SimTK::Infinity);
            }
        }
    EXPECT_GT(numInside, 4 * (half - 2) * (half - 2));
}

TEST_F(GlPictures, LinesAndPointsHaveTheirSizeInPixelsInBothProjections) {
    for (const bool isOrthographic : {false, true}) {
        camera.isOrthographic = isOrthographic;
        camera.viewHeight = 3;
        scene.clear();
        scene.lines.push_back({Vec3(0, -5, 1), Vec3(0, 5, -1), black, 1, 8});
        EXPECT_NEAR(calcBlackArea(draw(400, 720)), 8 * 720, 8) << isOrthographic;
        scene.clear();
        scene.points.push_back({Vec3(0.3, 0.2, 1), black, 1, 40});
        const double area = SimTK::Pi * 20 * 20;
        EXPECT_NEAR(calcBlackArea(draw(400, 720)), area, 0.01 * area) << isOrthographic;
    }
}

TEST_F(GlPictures, TransparentSphereIsSeenThroughRightlyInOrthographicProjection) {
    camera.isOrthographic = true;
    camera.viewHeight = 4;
    add(createSphere(128), Vec3(0, 0, 0.2), Vec3(1), red, 0.5);
    add(createSphere(128), Vec3(0), Vec3(0.5), blue, 0.4);
    const Image image = draw(200, 200);
    Vec3 color = white;
    for (const auto& [paint, opacity] :
         {std::pair(red, 0.5), std::pair(blue, 0.4), std::pair(blue, 0.4), std::pair(red, 0.5)})
        color = opacity * paint + (1 - opacity) * color;
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(image.getPixel(100, 100)[k], 255 * color[k], 2.1);
}

TEST_F(GlPictures, PictureInBandsIsThePictureInOnePiece) {
    fill();
    const Image whole = draw(640, 360);
    renderer.setMaxBandPixels(640 * 50);
    const Image banded = draw(640, 360);
    renderer.setMaxBandPixels(GlRenderer::defaultBandPixels);
    EXPECT_LT(calcDifferentShare(whole, banded, 2), 1e-3);
    EXPECT_LT(calcDifferentShare(whole, banded, 40), 2e-5);
}

TEST_F(GlPictures, PictureOfTwiceTheSizeShowsTheSame) {
    fill();
    const Image small = draw(1280, 720), large = draw(2560, 1440);
    EXPECT_LT(calcDifferentShare(large.resized(1280, 720), small, 12), 6e-3);
}

TEST_F(GlPictures, EightThousandPixelsAcrossAreDrawn) {
    const int width = 7680, height = 4320;
    add(createSphere(500), Vec3(0), Vec3(1.2), black);
    const double radius =
        0.5 * height / std::tan(camera.fieldOfView / 2) * 1.2 / std::sqrt(36 - SimTK::square(1.2));
    const double expected = SimTK::Pi * radius * radius;
    EXPECT_NEAR(calcBlackArea(draw(width, height)), expected, 1e-4 * expected);
}

TEST_F(GlPictures, SizesBeyondTheContextsLimitAreRefused) {
    for (const auto& [width, height] : {std::pair(100000, 10), std::pair(10, 100000)}) try {
            renderer.draw(scene, camera, style, width, height);
            FAIL();
        } catch (const std::runtime_error& e) {
            const std::string size = std::to_string(width) + "x" + std::to_string(height);
            EXPECT_NE(std::string(e.what()).find("a picture of " + size +
                                                 " pixels is not between 1x1 and "),
                      std::string::npos)
                << e.what();
        }
}

TEST_F(GlPictures, MillionTrianglesCoverWhatTheyShould) {
    const auto sphere = createSphere(1010);
    ASSERT_GT(sphere->triangles.size() / 3, 1000000u);
    add(sphere, Vec3(0), Vec3(1.2), black);
    const double radius =
        240 / std::tan(camera.fieldOfView / 2) * 1.2 / std::sqrt(36 - SimTK::square(1.2));
    const double expected = SimTK::Pi * radius * radius;
    EXPECT_NEAR(calcBlackArea(draw(640, 480)), expected, 1e-3 * expected);
}

TEST_F(GlPictures, ScenesOfAnySizeLookTheSame) {
    fill();
    scene.texts.clear();
    const Image image = draw(320, 180);
    const Scene scene1 = scene;
    const Camera camera1 = camera;
    const GroundStyle ground1 = style.ground;
    for (const double factor : {1e-12, 1e-6, 1e6, 1e12}) {
        scene = scene1;
        for (SurfaceItem& item : scene.surfaces) {
            item.scale *= factor;
            item.X_GM.updP() *= factor;
        }
        for (LineItem& item : scene.lines) item.start *= factor, item.end *= factor;
        for (PointItem& item : scene.points) item.location *= factor;
        camera = camera1;
        camera.X_GC.updP() *= factor;
        camera.nearPlane *= factor;
        camera.farPlane *= factor;
        style.ground = ground1;
        style.ground.X_GP.updP() *= factor;
        style.ground.gridSpacing *= factor;
        style.ground.radius *= factor;
        EXPECT_LT(calcDifferentShare(draw(320, 180), image, 2), 2e-3) << factor;
    }
}

TEST_F(GlPictures, TransparentBackgroundHasTheAreaOfTheShapeAsAlpha) {
    style.isBackgroundTransparent = true;
    add(createSphere(256), Vec3(0), Vec3(1.2), red);
    const Image image = draw(640, 480);
    const double radius =
        240 / std::tan(camera.fieldOfView / 2) * 1.2 / std::sqrt(36 - SimTK::square(1.2));
    double area = 0;
    for (int y = 0; y < 480; ++y)
        for (int x = 0; x < 640; ++x) {
            const Image::Pixel pixel = image.getPixel(x, y);
            area += pixel[3] / 255.0;
            const double r = std::hypot(x + 0.5 - 320, y + 0.5 - 240);
            if (r < radius - 1) {
                EXPECT_EQ(pixel[3], 255);
            } else if (r > radius + 1) {
                EXPECT_EQ(pixel, Image::Pixel({0, 0, 0, 0}));
            }
            // Edges have the shape's own colour, not darkened by the empty background.
            for (int k = 0; k < 3 && pixel[3] > 0; ++k) EXPECT_NEAR(pixel[k], 255 * red[k], 3);
        }
    const double expected = SimTK::Pi * radius * radius;
    EXPECT_NEAR(area, expected, 1e-3 * expected);
}

TEST_F(GlPictures, TransparentBackgroundLaidOverTheBackgroundIsTheNormalPicture) {
    fill();
    style.ground.isShown = false;
    style.palette.backgroundTop = style.palette.backgroundBottom = Vec3(0.3, 0.6, 0.8);
    const Image normal = draw(640, 360);
    style.isBackgroundTransparent = true;
    const Image over = layOver(draw(640, 360), Vec3(0.3, 0.6, 0.8));
    EXPECT_EQ(calcDifferentShare(normal, over, 2), 0);
}

TEST_F(GlPictures, ShadowOnTransparentBackgroundIsThatOnTheGround) {
    fill();
    const Vec3 color(0.9, 0.91, 0.92);
    for (Vec3* paint : {&style.palette.ground, &style.palette.grid, &style.palette.backgroundTop,
                        &style.palette.backgroundBottom})
        *paint = color;
    const Image normal = draw(640, 360);
    style.isBackgroundTransparent = true;
    const Image transparent = draw(640, 360);
    EXPECT_EQ(calcDifferentShare(normal, layOver(transparent, color), 2), 0);
    int numVeiled = 0;
    for (std::size_t i = 0; i < transparent.getNumBytes(); i += 4) {
        const std::uint8_t* p = transparent.getData() + i;
        numVeiled += p[3] > 40 && p[3] < 110 && std::max({p[0], p[1], p[2]}) < 45;
    }
    EXPECT_GT(numVeiled, 2000);
}

}  // namespace
}  // namespace simflex
