#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <vector>

#include "GlScene.h"
#include "simflex/render/gl/GlTransparency.h"

namespace simflex {
namespace {

using SimTK::Rotation;
using SimTK::Transform;
using SimTK::Vec3;

constexpr int width = 320, height = 240;

struct Layer {
    double distance;  // along the ray
    Vec3 color;
    double opacity;
};

// Adds the layers where a ray meets a shape.
using Meet = std::function<void(const Vec3& origin, const Vec3& direction, std::vector<Layer>&)>;

// Both ways of sorting at each sample: fragment lists where the context supports them, and depth
// peeling.
enum class Way { Lists, Peeling };

class Transparency : public test::GlScene, public testing::WithParamInterface<Way> {
protected:
    void addPlane(const Transform& X_GP, double halfSize, const Vec3& color, double opacity) {
        add(createBrick(), X_GP, Vec3(halfSize, halfSize, 1e-4), color, opacity);
        shapes.push_back([=](const Vec3& o_G, const Vec3& d_G, std::vector<Layer>& out) {
            const Vec3 o = ~X_GP * o_G, d = ~X_GP.R() * d_G;
            const double s = -o[2] / d[2];
            const Vec3 p = o + s * d;
            if (std::abs(p[0]) > halfSize || std::abs(p[1]) > halfSize) return;
            for (int side = 0; side < 2; ++side) out.push_back({s, color, opacity});
        });
    }

    void addBrick(const Transform& X_GB, const Vec3& half, const Vec3& color, double opacity) {
        add(createBrick(), X_GB, half, color, opacity);
        shapes.push_back([=](const Vec3& o_G, const Vec3& d_G, std::vector<Layer>& out) {
            const Vec3 o = ~X_GB * o_G, d = ~X_GB.R() * d_G;
            double first = -SimTK::Infinity, last = SimTK::Infinity;
            for (int k = 0; k < 3; ++k) {
                const double a = (-half[k] - o[k]) / d[k], b = (half[k] - o[k]) / d[k];
                first = std::max(first, std::min(a, b));
                last = std::min(last, std::max(a, b));
            }
            if (first > last) return;
            for (const double s : {first, last}) out.push_back({s, color, opacity});
        });
    }

    void addSphere(const Vec3& center, double radius, const Vec3& color, double opacity) {
        add(createSphere(160), center, Vec3(radius), color, opacity);
        shapes.push_back([=](const Vec3& o, const Vec3& d, std::vector<Layer>& out) {
            const Vec3 m = o - center;
            const double b = SimTK::dot(m, d), c = m.normSqr() - radius * radius;
            if (b * b < c) return;
            for (const double sign : {-1.0, 1.0})
                out.push_back({-b + sign * std::sqrt(b * b - c), color, opacity});
        });
    }

    void addTorus(const Transform& X_GT, double tube, const Vec3& color, double opacity) {
        add(createTorus(tube, 200), X_GT, Vec3(1), color, opacity);
        shapes.push_back([=](const Vec3& o_G, const Vec3& d_G, std::vector<Layer>& out) {
            // Zeros of (√(x² + y²) − 1)² + z² − tube², by marching and bisection.
            const Vec3 o = ~X_GT * o_G, d = ~X_GT.R() * d_G;
            const auto outside = [&](double s) {
                const Vec3 p = o + s * d;
                return SimTK::square(std::hypot(p[0], p[1]) - 1) + p[2] * p[2] - tube * tube;
            };
            // Only within the bounding ball.
            const double middle = -SimTK::dot(o, d);
            const double half2 = SimTK::square(1 + tube) - (o.normSqr() - middle * middle);
            if (half2 <= 0) return;
            constexpr double step = 0.02;
            for (double s = middle - std::sqrt(half2); s < middle + std::sqrt(half2); s += step) {
                double a = s, b = s + step;
                if (outside(a) * outside(b) >= 0) continue;
                for (int i = 0; i < 40; ++i)
                    (outside(a) * outside((a + b) / 2) < 0 ? b : a) = (a + b) / 2;
                out.push_back({a, color, opacity});
            }
        });
    }

    std::vector<Layer> meetAll(double column, double row) const {
        const double tangent = std::tan(camera.fieldOfView / 2);
        const Vec3 d_C((column - 0.5 * width) / (0.5 * height) * tangent,
                       -(row - 0.5 * height) / (0.5 * height) * tangent, -1);
        std::vector<Layer> layers;
        const Vec3 d_G = camera.X_GC.R() * (d_C / d_C.norm());
        for (const Meet& meet : shapes) meet(camera.X_GC.p(), d_G, layers);
        std::sort(layers.begin(), layers.end(),
                  [](const Layer& a, const Layer& b) { return a.distance < b.distance; });
        return layers;
    }

    // Returns the largest error of the picture, in 1/255, relative to layers blended from far to
    // near, over pixels where the same well-separated surfaces are met in the whole neighbourhood.
    double calcLargestError(const Image& image, int& numCompared, std::size_t& mostLayers) const {
        std::vector<std::vector<Layer>> met;
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) met.push_back(meetAll(x + 0.5, y + 0.5));

        double largest = 0;
        numCompared = 0;
        mostLayers = 0;
        for (int y = 2; y < height - 2; ++y)
            for (int x = 2; x < width - 2; ++x) {
                const auto& layers = met[y * width + x];
                bool isInside = true;
                for (int j = -2; j <= 2; ++j)
                    for (int i = -2; i <= 2; ++i) {
                        const auto& others = met[(y + j) * width + x + i];
                        isInside = isInside && others.size() == layers.size();
                        for (std::size_t k = 0; isInside && k < layers.size(); ++k)
                            isInside = others[k].color == layers[k].color;
                    }
                if (!isInside) continue;
                ++numCompared;
                mostLayers = std::max(mostLayers, layers.size());
                Vec3 color(1);
                for (auto layer = layers.rbegin(); layer != layers.rend(); ++layer)
                    color = layer->opacity * layer->color + (1 - layer->opacity) * color;
                const Image::Pixel pixel = image.getPixel(x, y);
                for (int k = 0; k < 3; ++k)
                    largest = std::max(largest, std::abs(pixel[k] - 255 * color[k]));
            }
        return largest;
    }

    Image draw() { return renderer.draw(scene, camera, style, width, height); }

    void lookFrom(double azimuth) {
        camera.X_GC = Transform(Rotation(azimuth, SimTK::YAxis));
        camera.X_GC.updP() = camera.X_GC.R() * Vec3(0, 0, 6);
    }

    bool isListed() { return renderer.updTransparency().hasListed(); }
    int getNumPeeled() { return renderer.updTransparency().getNumLayers(); }
    bool isSorted() { return !isListed() && getNumPeeled() == 0; }

    void expectExact(int leastLayers) {
        const Image image = draw();
        if (const char* folder = std::getenv("SIMFLEX_TEST_PICTURES"))
            image.writePng(std::string(folder) + "/" +
                           testing::UnitTest::GetInstance()->current_test_info()->name() + ".png");
        int numCompared = 0;
        std::size_t mostLayers = 0;
        // Each eight-bit layer is rounded once.
        EXPECT_LE(calcLargestError(image, numCompared, mostLayers), 2.6);
        EXPECT_GT(numCompared, width * height / 2);
        EXPECT_GE(mostLayers, std::size_t(leastLayers));
    }

    static void TearDownTestSuite() { shared.clear(); }

    static GlRenderer& getRenderer(Way way) {
        std::unique_ptr<GlRenderer>& renderer = shared[way];
        if (!renderer) {
            renderer = std::make_unique<GlRenderer>();
            if (way == Way::Peeling) renderer->updTransparency().forbidLists();
        }
        return *renderer;
    }

    static std::map<Way, std::unique_ptr<GlRenderer>> shared;
    GlRenderer& renderer = getRenderer(GetParam());
    std::vector<Meet> shapes;
};

std::map<Way, std::unique_ptr<GlRenderer>> Transparency::shared;

const Vec3 red(0.9, 0.2, 0.1), green(0.1, 0.7, 0.2), blue(0.1, 0.3, 0.9), yellow(0.9, 0.8, 0.1);

TEST_P(Transparency, OneSphereNeedsNoPeeling) {
    addSphere(Vec3(0), 1, red, 0.4);
    expectExact(2);
    EXPECT_TRUE(isSorted());
}

TEST_P(Transparency, SpheresBehindEachOtherNeedNoPeelingInAnyOrderOfDrawing) {
    addSphere(Vec3(0.2, 0, 1.5), 0.6, red, 0.4);
    addSphere(Vec3(0, 0, -1.5), 1, blue, 0.6);
    addSphere(Vec3(-0.1, 0.1, 0.2), 0.5, green, 0.5);
    expectExact(6);
    EXPECT_TRUE(isSorted());
}

TEST_P(Transparency, SpheresThatAPlaneKeepsApartNeedNoPeelingAndAreExact) {
    // Their boxes, distances from the camera and positions in the picture all overlap.
    addSphere(Vec3(-0.25, 0, 0.35), 0.4, red, 0.4);
    addSphere(Vec3(0.3, 0.1, -0.3), 0.42, blue, 0.5);
    addSphere(Vec3(0.15, -0.7, 0.3), 0.35, green, 0.6);
    expectExact(4);
    EXPECT_TRUE(isSorted());
}

TEST_P(Transparency, NestedSpheresAreExact) {
    addSphere(Vec3(0), 0.4, red, 0.5);
    addSphere(Vec3(0), 1.2, blue, 0.3);
    addSphere(Vec3(0.05, 0, 0), 0.8, green, 0.4);
    expectExact(6);
    EXPECT_EQ(getNumPeeled(), GetParam() == Way::Peeling ? 6 : 0);
}

TEST_P(Transparency, InterpenetratingSpheresAreExact) {
    addSphere(Vec3(-0.4, 0, 0), 0.8, red, 0.5);
    addSphere(Vec3(0.4, 0, 0.1), 0.8, blue, 0.5);
    addSphere(Vec3(0, 0.5, -0.2), 0.7, yellow, 0.3);
    expectExact(6);
}

TEST_P(Transparency, InterlockedToriAreExact) {
    addTorus(Vec3(-0.5, 0, 0), 0.22, red, 0.5);
    addTorus(Transform(Rotation(SimTK::Pi / 2 - 0.3, SimTK::XAxis), Vec3(0.5, 0, 0)), 0.22, blue,
             0.5);
    camera.X_GC = Transform(Rotation(1.2, SimTK::YAxis));
    camera.X_GC.updP() = camera.X_GC.R() * Vec3(0, 0, 6);
    expectExact(6);
}

TEST_P(Transparency, SpheresInABrickAreExactFromAllAround) {
    addBrick(Transform(Rotation(0.3, SimTK::XAxis)), Vec3(1.1, 0.7, 0.6), green, 0.3);
    addSphere(Vec3(0.2, 0, 0), 0.5, red, 0.5);
    addSphere(Vec3(-0.7, 0.1, 0.2), 0.3, blue, 0.6);
    for (const double azimuth : {0.2, 1.7, 3.4, 5.0}) {
        lookFrom(azimuth);
        expectExact(4);
        EXPECT_FALSE(isSorted());
    }
}

TEST_P(Transparency, ParallelPlanesBlendInTheOrderSeenFromEitherSide) {
    addPlane(Vec3(0.2, 0, 0.5), 0.8, red, 0.6);
    addPlane(Vec3(-0.2, 0.1, -0.5), 0.9, blue, 0.7);
    for (const double azimuth : {0.1, SimTK::Pi + 0.1}) {
        lookFrom(azimuth);
        expectExact(4);
        EXPECT_TRUE(isSorted());
    }
}

TEST_P(Transparency, PlanesThatCutEachOtherBlendInTheOrderOfEachHalfFromEitherSide) {
    addPlane(Transform(Rotation(0.6, SimTK::YAxis)), 1, red, 0.6);
    addPlane(Transform(Rotation(-0.6, SimTK::YAxis)), 1, blue, 0.7);
    for (const double azimuth : {0.1, SimTK::Pi + 0.1}) {
        lookFrom(azimuth);
        expectExact(4);
        EXPECT_FALSE(isSorted());
    }
}

TEST_P(Transparency, OpaqueSurfaceHidesWhatIsBehindItAndShowsThroughWhatIsBefore) {
    addSphere(Vec3(0), 1.2, blue, 0.3);
    addSphere(Vec3(0.3, 0, 0.2), 0.7, green, 0.4);
    addSphere(Vec3(0.1, 0.1, 0.3), 0.5, red, 1);
    addSphere(Vec3(-0.2, 0.1, -0.6), 0.3, yellow, 0.5);
    expectExact(6);
}

TEST_P(Transparency, LineBeforeTransparentSurfaceKeepsItsColor) {
    addSphere(Vec3(-0.4, 0, 0), 0.8, red, 0.5);
    addSphere(Vec3(0.4, 0, 0.1), 0.8, blue, 0.5);
    scene.lines.push_back({Vec3(-2, 0, 2), Vec3(2, 0, 2), green, 1, 8});
    scene.points.push_back({Vec3(0, 0.4, 2), yellow, 1, 20});
    const Image image = draw();
    const auto expectColor = [&](const Vec3& p, const Vec3& color) {
        const Vec3 pixel = camera.calcPixel(p, width, height);
        const auto found = image.getPixel(int(pixel[0]), int(pixel[1]));
        for (int k = 0; k < 3; ++k) EXPECT_NEAR(found[k], 255 * color[k], 1);
    };
    expectColor(Vec3(-0.3, 0, 2), green);
    expectColor(Vec3(0.3, 0, 2), green);
    expectColor(Vec3(0, 0.4, 2), yellow);
}

TEST_P(Transparency, NearestSurfaceOfGhostTakesItsPlaceAmongTheLayers) {
    // An unlit ghost sphere between two transparent ones: one layer of its colour, from outside
    // only.
    addSphere(Vec3(0, 0, 0), 1.2, blue, 0.3);
    addSphere(Vec3(0, 0, 0), 0.5, red, 0.5);
    add(createSphere(160), Vec3(0), Vec3(0.9), green, 0.4).style = SurfaceItem::Style::Ghost;
    shapes.push_back([](const Vec3& o, const Vec3& d, std::vector<Layer>& out) {
        const double b = SimTK::dot(o, d), c = o.normSqr() - 0.81;
        if (b * b >= c) out.push_back({-b - std::sqrt(b * b - c), green, 0.4});
    });
    expectExact(5);
}

TEST_P(Transparency, PointsAndLinesOfATranslucentShapeAreLaidOnce) {
    // Each corner belongs to up to six triangles, each edge to two.
    const Vec3 half(0.8, 0.6, 0.5);
    const auto least = [&](const Vec3& p, const Image& image) {  // green around a point
        const Vec3 pixel = camera.calcPixel(p, width, height);
        int result = 255;
        for (int j = -1; j <= 1; ++j)
            for (int i = -1; i <= 1; ++i)
                result =
                    std::min(result, int(image.getPixel(int(pixel[0]) + i, int(pixel[1]) + j)[1]));
        return result;
    };
    const double once = 255 * (0.5 * red[1] + 0.5);
    SurfaceItem& item = add(createBrick(), Vec3(0), half, red, 0.5);
    item.representation = SimTK::DecorativeGeometry::DrawPoints;
    EXPECT_NEAR(least(half, draw()), once, 2);
    item.representation = SimTK::DecorativeGeometry::DrawWireframe;
    const int ofEdge = least(Vec3(0.3 * half[0], half[1], half[2]), draw());
    EXPECT_GE(ofEdge, once - 2);
    EXPECT_LE(ofEdge, 230);
}

TEST_P(Transparency, MoreLayersThanAreKeptLeaveTheNearest) {
    // Parallel discs in a row, twice as many as layers. A small off-centre one cuts through the
    // third, so that they cannot be sorted.
    const auto disc = createCircle(12);
    const int number = 2 * 32;
    Vec3 color(0);
    double light = 1;
    for (int i = 0; i < number; ++i) {
        const Transform X(Rotation(0.5, SimTK::YAxis), Vec3(0, 0, 1 - 0.02 * i));
        const Vec3 paint = i % 2 == 0 ? red : blue;
        add(disc, X, Vec3(0.3), paint, 0.15);
        if (i < 32) {
            color += light * 0.15 * paint;
            light *= 0.85;
        }
    }
    const Rotation R(0.5, SimTK::YAxis);
    add(disc,
        Transform(R * Rotation(0.5 * SimTK::Pi, SimTK::YAxis),
                  Vec3(0, 0, 0.96) + R * Vec3(0.2, 0, 0)),
        Vec3(0.05), red, 0.15);
    const Image image = draw();
    EXPECT_EQ(getNumPeeled(), GetParam() == Way::Peeling ? 32 : 0);
    const auto found = image.getPixel(width / 2, height / 2);
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(found[k], 255 * (color[k] + light), 16);
}

TEST_P(Transparency, NothingTransparentCostsNoLayers) {
    addSphere(Vec3(0), 1, red, 1);
    addSphere(Vec3(0.3, 0, 0), 1, blue, 1);
    draw();
    EXPECT_TRUE(isSorted());
}

TEST_P(Transparency, LayersAreTheSameInBands) {
    addTorus(Vec3(-0.5, 0, 0), 0.22, red, 0.5);
    addTorus(Transform(Rotation(SimTK::Pi / 2 - 0.3, SimTK::XAxis), Vec3(0.5, 0, 0)), 0.22, blue,
             0.5);
    renderer.setMaxBandPixels(width * height / 7);
    expectExact(4);
    renderer.setMaxBandPixels(GlRenderer::defaultBandPixels);
}

TEST_P(Transparency, MoreFragmentsThanAreHeldAtATimeGiveTheSamePicture) {
    addSphere(Vec3(-0.4, 0, 0), 0.8, red, 0.5);
    addSphere(Vec3(0.4, 0, 0.1), 0.8, blue, 0.5);
    const Image whole = draw();
    renderer.updTransparency().setMaxFragments(5000);
    const Image inStrips = draw();
    renderer.updTransparency().setMaxFragments(GlFragments::defaultMaxNumber);
    EXPECT_TRUE(whole == inStrips);
}

TEST_P(Transparency, OfCoincidentSurfacesTheEarlierIsBeforeTheLater) {
    // Two bricks with coplanar faces, and a third that crosses them.
    addBrick(Vec3(0), Vec3(0.5), red, 0.6);
    add(createBrick(), Vec3(0), Vec3(0.5), blue, 0.6);
    addBrick(Vec3(0.4, 0, 0), Vec3(0.5), green, 0.1);
    const Image image = draw();
    const auto found = image.getPixel(width / 2 - 20, height / 2);
    const auto mix = [](const Vec3& over, const Vec3& under) {
        return Vec3(0.6 * over + 0.4 * under);
    };
    const Vec3 expected = mix(red, mix(blue, mix(red, mix(blue, Vec3(1)))));
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(found[k], 255 * expected[k], 2.6);
}

INSTANTIATE_TEST_SUITE_P(Ways, Transparency, testing::Values(Way::Lists, Way::Peeling),
                         [](const auto& parameters) {
                             return parameters.param == Way::Lists ? "Lists" : "Peeling";
                         });

}  // namespace
}  // namespace simflex
