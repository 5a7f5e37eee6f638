#include <gtest/gtest.h>

#include <algorithm>

#include "TestParts.h"
#include "simflex/render/OffscreenVisualizer.h"

namespace simflex {
namespace {

using namespace test;
using SimTK::Transform;
using SimTK::Vec3;
using SimTK::Vector;

void makePlainPart(OffscreenVisualizer& viz) {
    makePlain(viz, 5);
    viz.setShowUndeformed(false).setShowFeatureEdges(false);
}

// Returns the mean row of all non-white pixels.
double calcMiddleRow(const Image& image) {
    double sum = 0, rows = 0;
    for (int y = 0; y < image.getHeight(); ++y)
        for (int x = 400; x < image.getWidth() - 400; ++x) {  // captions are on the left
            const double cover = 255 - image.getPixel(x, y)[0];
            sum += cover;
            rows += cover * (y + 0.5);
        }
    return rows / sum;
}

TEST(Contour, ColourAtANodeIsThatOfItsDisplacement) {
    EmptyScene scene;
    OffscreenVisualizer viz(scene.system);
    makePlainPart(viz);
    const auto part = makeBrickPart(Vec3(2, 1, 0.1), 8, 4, 1);
    const double xi = 2e-3;
    viz.addDeformableMesh(makeStill(part, Vector(Vec3(0, xi, 0)))).setDeformationFactor(0);
    const double largest = xi * 1.0;  // at |x| = 1
    for (const ColorMap map : {ColorMap::Viridis, ColorMap::Plasma, ColorMap::BlueWhiteRed}) {
        viz.setColorMap(map).setContourRange(0, largest);
        const Image image = viz.drawFrame(scene.state);
        for (int i = 1; i < 8; ++i) {
            const double x = -1 + 0.25 * i;
            const Vec3 pixel = viz.calcPixel(Vec3(x, 0.25, 0.05));
            const Image::Pixel found = image.getPixel(int(pixel[0]), int(pixel[1]));
            const Vec3 expected = calcColor(map, std::abs(x) * xi / largest);
            // Half a pixel from the node the value differs by 0.3 % of the range.
            for (int k = 0; k < 3; ++k) EXPECT_NEAR(found[k], 255 * expected[k], 3) << "x = " << x;
        }
    }
}

TEST(Contour, WithoutBarAndFactorNothingIsWritten) {
    EmptyScene scene;
    OffscreenVisualizer viz(scene.system);
    makePlain(viz, 12);
    viz.addDeformableMesh(
        makeStill(makeBrickPart(Vec3(1, 1, 0.1), 4, 4, 1), Vector(Vec3(0, 1e-3, 0))));
    // The brick fills the middle half of the picture, with all text at the sides.
    const auto countAtTheSides = [&] {
        const Image image = viz.drawFrame(scene.state);
        int count = 0;
        for (int y = 0; y < image.getHeight(); ++y)
            for (int x = 0; x < image.getWidth(); ++x)
                if (x < image.getWidth() / 4 || x > 3 * image.getWidth() / 4)
                    count += image.getPixel(x, y) != Image::Pixel{255, 255, 255, 255};
        return count;
    };
    const int withBoth = countAtTheSides();
    viz.setShowDeformationFactor(false);
    const int withBar = countAtTheSides();
    EXPECT_GT(withBoth, withBar + 200);
    EXPECT_GT(withBar, 16 * 300);  // its colours
    viz.setShowColorBar(false);
    EXPECT_EQ(countAtTheSides(), 0);
}

TEST(Contour, RangesPerRunAndPerFrame) {
    EmptyScene scene;
    OffscreenVisualizer viz(scene.system, 320, 180);
    viz.addDeformableMesh(
        {makeBrickPart(Vec3(2, 1, 0.1), 4, 2, 1), "brick",
         [](const SimTK::State&) { return Transform(); },
         [](const SimTK::State& s) { return Vector(Vec3(s.getTime() * 1e-3, 0, 0)); }});
    std::vector<SimTK::State> states(5, scene.state);
    for (int i = 0; i < 5; ++i) states[i].setTime(0.9 * i);

    viz.setContourRange(OffscreenVisualizer::ContourRange::PerFrame);
    viz.drawFrame(states[1]);
    EXPECT_NEAR(viz.getContourRange()[1], 0.9e-3, 1e-9);
    viz.setContourRange(OffscreenVisualizer::ContourRange::PerRun);
    viz.fitToMotion(states);
    viz.drawFrame(states[0]);
    EXPECT_NEAR(viz.getContourRange()[1], 4e-3, 1e-12);  // 3.6 mm, rounded up
    viz.setContourRange(1e-3, 2e-3);
    viz.drawFrame(states[0]);
    EXPECT_EQ(viz.getContourRange(), SimTK::Vec2(1e-3, 2e-3));
}

TEST(Deformation, FactorMovesTheSilhouetteByThatManyPixels) {
    EmptyScene scene;
    OffscreenVisualizer viz(scene.system);
    makePlainPart(viz);
    viz.setContour(OffscreenVisualizer::Contour::None).setCameraFieldOfView(0.5);
    viz.addDeformableMesh(
        makeStill(makeBrickPart(Vec3(0.6, 0.3, 0.002), 6, 3, 1), Vector(Vec3(1e-3, 0, 0))));
    const double focal = 360 / std::tan(0.25), distance = 5 - 0.001;
    double rows[3];
    const double factors[] = {0, 100, 250};
    for (int i = 0; i < 3; ++i) {
        viz.setDeformationFactor(factors[i]);
        rows[i] = calcMiddleRow(viz.drawFrame(scene.state));
    }
    EXPECT_NEAR(rows[0], 360, 0.1);
    EXPECT_NEAR(rows[0] - rows[1], focal * 0.1 / distance, 0.15);
    EXPECT_NEAR(rows[0] - rows[2], focal * 0.25 / distance, 0.15);
}

TEST(Deformation, AutomaticFactorIsRoundAndVisible) {
    EmptyScene scene;
    OffscreenVisualizer viz(scene.system, 320, 180);
    viz.addDeformableMesh(
        makeStill(makeBrickPart(Vec3(2, 0.2, 0.2), 8, 1, 1), Vector(Vec3(0, 0, 1e-4))));
    viz.setAutomaticDeformationFactor();
    EXPECT_EQ(viz.getDeformationFactor(), 1);
    viz.fitToMotion({scene.state});
    // 4 % of the size, 0.0808 m, over 1e-4 m is 808: the round factor below is 500.
    EXPECT_NEAR(viz.getDeformationFactor(), 500, 1e-9);
}

TEST(Deformation, AutomaticFactorsAreOneTwoAndFiveTimesPowersOfTen) {
    // 4 % of the size is 0.0808 m.
    const double factors[][2] = {{0.9e-4, 500}, {2e-4, 200}, {5e-4, 100}, {9e-4, 50}, {0.2, 1}};
    for (const auto& [displacement, factor] : factors) {
        EmptyScene scene;
        OffscreenVisualizer viz(scene.system, 320, 180);
        viz.addDeformableMesh(
            makeStill(makeBrickPart(Vec3(2, 0.2, 0.2), 8, 1, 1), Vector(Vec3(0, 0, displacement))));
        viz.setAutomaticDeformationFactor().fitToMotion({scene.state});
        EXPECT_NEAR(viz.getDeformationFactor(), factor, 1e-9 * factor) << displacement << " m";
    }
}

TEST(Deformation, AutomaticFactorFindsTheOneNodeThatMoves) {
    for (const std::size_t node : {0, 1, 2, 3, 35}) {
        EmptyScene scene;
        OffscreenVisualizer viz(scene.system, 320, 180);
        auto part = std::make_shared<ReducedBody>(*makeBrickPart(Vec3(2, 0.2, 0.2), 8, 1, 1));
        std::fill(part->Phi.begin(), part->Phi.end(), 0.0);
        const double u[3] = {1, 2, 2};
        std::copy_n(u, 3, &part->Phi[3 * node]);
        viz.addDeformableMesh(makeStill(part, Vector(Vec3(5.5e-5, 0, 0))));
        viz.setAutomaticDeformationFactor().fitToMotion({scene.state});
        // 0.0808 m over 1.65e-4 m is 490.
        EXPECT_NEAR(viz.getDeformationFactor(), 200, 1e-9) << "node " << node;
    }
}

TEST(Deformation, AutomaticFactorLeavesASmallPartInALargeSceneItsShape) {
    EmptyScene scene;
    OffscreenVisualizer viz(scene.system, 320, 180);
    viz.addDecoration(SimTK::MobilizedBodyIndex(0), Transform(), SimTK::DecorativeSphere(100));
    viz.addDeformableMesh(
        makeStill(makeBrickPart(Vec3(2, 0.2, 0.2), 8, 1, 1), Vector(Vec3(0, 0, 1e-4))));
    viz.fitToMotion({scene.state});
    // A quarter of the part's 2.02 m, over 1e-4 m, is 5050: the round factor below is 5000.
    EXPECT_NEAR(viz.getDeformationFactor(), 5000, 1e-9);
}

TEST(Deformation, RigidPoseMovesThePart) {
    EmptyScene scene;
    OffscreenVisualizer viz(scene.system);
    makePlainPart(viz);
    viz.setContour(OffscreenVisualizer::Contour::None);
    const Vec3 p(0.3, -0.4, 0);
    viz.addDeformableMesh(makeStill(makeBrickPart(Vec3(0.2), 1, 1, 1), Vector(3, 0.0),
                                    Transform(SimTK::Rotation(0.3, SimTK::ZAxis), p)));
    const Image image = viz.drawFrame(scene.state);
    const Vec3 pixel = viz.calcPixel(p + Vec3(0, 0, 0.1));
    EXPECT_LT(image.getPixel(int(pixel[0]), int(pixel[1]))[0], 200);
    EXPECT_EQ(image.getPixel(640, 360), (Image::Pixel{255, 255, 255, 255}));
}

TEST(Deformation, GhostStandsWhereThePartWas) {
    EmptyScene scene;
    OffscreenVisualizer viz(scene.system);
    makePlainPart(viz);
    viz.setContour(OffscreenVisualizer::Contour::None).setDeformationFactor(500);
    viz.addDeformableMesh(
        makeStill(makeBrickPart(Vec3(0.4, 0.2, 0.1), 4, 2, 1), Vector(Vec3(1e-3, 0, 0))));
    EXPECT_EQ(viz.drawFrame(scene.state).getPixel(640, 360), (Image::Pixel{255, 255, 255, 255}));
    viz.setShowUndeformed(true);
    const Image image = viz.drawFrame(scene.state);
    const int value = image.getPixel(640, 360)[0];
    EXPECT_GT(value, 100);
    EXPECT_LT(value, 250);
    const Vec3 moved = viz.calcPixel(Vec3(0, 0.5, 0.05));
    EXPECT_NEAR(image.getPixel(int(moved[0]), int(moved[1]))[0], 255 * 0.66, 2);
}

TEST(Deformation, ElementEdgesAreDrawnOnRequest) {
    EmptyScene scene;
    OffscreenVisualizer viz(scene.system);
    makePlainPart(viz);
    viz.setContour(OffscreenVisualizer::Contour::None);
    viz.addDeformableMesh(makeStill(makeBrickPart(Vec3(1, 1, 0.1), 4, 4, 1), Vector(3, 0.0)));
    const Image without = viz.drawFrame(scene.state);
    viz.setShowElementEdges(true);
    const Image with = viz.drawFrame(scene.state);
    int numDarker = 0;
    for (int y = 0; y < with.getHeight(); ++y)
        for (int x = 0; x < with.getWidth(); ++x)
            numDarker += with.getPixel(x, y)[0] + 10 < without.getPixel(x, y)[0];
    const double side =
        viz.calcPixel(Vec3(0.5, 0, 0.05))[0] - viz.calcPixel(Vec3(-0.5, 0, 0.05))[0];
    EXPECT_GT(numDarker, 6 * side);  // three inner lines each way, about a pixel wide
}

}  // namespace
}  // namespace simflex
