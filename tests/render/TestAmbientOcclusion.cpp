// Two planes at right angles, with and without ambient occlusion: the remaining light.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "GlScene.h"

namespace simflex {
namespace {

using SimTK::Transform;
using SimTK::Vec3;

constexpr double radius = 0.4;

class AmbientOcclusion : public test::GlScene {
protected:
    AmbientOcclusion() {
        style.isLit = true;
        camera.isOrthographic = true;
        camera.viewHeight = 2;
    }

    // Adds plates along z = ±|x|: a corner open towards the viewer, or an edge.
    void addPlates(double side) {
        for (const double end : {-1.0, 1.0}) {
            const SimTK::Rotation R(-side * end * SimTK::Pi / 4, SimTK::YAxis);
            add(createBrick(), Transform(R, R * Vec3(end * 1.5, 0, -0.1)), Vec3(1.5, 1.5, 0.1),
                Vec3(0.6));
        }
    }

    Image draw(double occlusionRadius) {
        style.occlusionRadius = occlusionRadius;
        return renderer.draw(scene, camera, style, 400, 400);
    }

    // Returns the remaining light at a column of the middle row; colours are square roots of light.
    static double calcLight(const Image& dark, const Image& bright, int x) {
        const double ratio =
            double(dark.getPixel(x, 200)[1]) / std::max(1.0, double(bright.getPixel(x, 200)[1]));
        return ratio * ratio;
    }

    GlRenderer renderer;
};

TEST_F(AmbientOcclusion, CornerOfTwoPlanesKeepsHalfOfTheLight) {
    addPlates(1);
    for (const bool isOrthographic : {true, false}) {
        camera.isOrthographic = isOrthographic;
        camera.fieldOfView = 2 * std::atan(1.0 / 6);
        const Image bright = draw(0), dark = draw(radius);
        // A pixel is 5 mm wide; the corner lies between columns 199 and 200.
        // Blurring spans 14 pixels, over which light grows from 1/2 to 2/3.
        EXPECT_GT(calcLight(dark, bright, 203), 0.5);
        EXPECT_LT(calcLight(dark, bright, 203), 0.67);
        double last = 0;
        for (int x = 203; x < 280; x += 8) {
            EXPECT_GE(calcLight(dark, bright, x), last - 0.03) << x;
            EXPECT_NEAR(calcLight(dark, bright, x), calcLight(dark, bright, 399 - x), 0.05) << x;
            last = calcLight(dark, bright, x);
        }
        // r along the plane is r/√2 in the picture.
        const int far = 200 + int(radius / std::sqrt(2.0) / 0.005) + 12;
        for (int x = far; x < 330; ++x) EXPECT_EQ(dark.getPixel(x, 200), bright.getPixel(x, 200));
    }
}

TEST_F(AmbientOcclusion, EdgesAndSpheresKeepAllOfTheirLight) {
    addPlates(-1);
    EXPECT_TRUE(draw(radius) == draw(0));
    scene.surfaces.clear();
    add(createSphere(96), Transform(), Vec3(0.8), Vec3(0.6));
    const Image bright = draw(0), dark = draw(radius);
    for (std::size_t i = 0; i < bright.getNumBytes(); ++i)
        ASSERT_NEAR(bright.getData()[i], dark.getData()[i], 2) << i;
}

TEST_F(AmbientOcclusion, DepthAndAlphaStayAndUnlitColoursToo) {
    addPlates(1);
    style.isBackgroundTransparent = true;
    DepthPicture before, after;
    const Image bright = renderer.draw(scene, camera, style, 200, 100, &before);
    style.occlusionRadius = radius;
    const Image dark = renderer.draw(scene, camera, style, 200, 100, &after);
    EXPECT_EQ(before.distances, after.distances);
    for (std::size_t i = 3; i < bright.getNumBytes(); i += 4)
        ASSERT_EQ(bright.getData()[i], dark.getData()[i]);
    EXPECT_FALSE(bright == dark);
    style.isLit = false;
    const Image unlit = renderer.draw(scene, camera, style, 200, 100);
    style.occlusionRadius = 0;
    EXPECT_TRUE(unlit == renderer.draw(scene, camera, style, 200, 100));
}

}  // namespace
}  // namespace simflex
