#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "simflex/render/scene/GroundShadow.h"
#include "simflex/render/scene/Primitives.h"

namespace simflex {
namespace {

using SimTK::Vec3;

SurfaceGeometry makeSquare(double low, double high) {
    SurfaceGeometry square;
    for (const Vec3& corner :
         {Vec3(low, low, 0), Vec3(high, low, 0), Vec3(high, high, 0), Vec3(low, high, 0)})
        square.addVertex(corner, Vec3(0, 0, 1));
    square.addTriangle(0, 1, 2);
    square.addTriangle(0, 2, 3);
    return square;
}

constexpr GroundShadow::ToTexel asItIs = {1, 0, 0, 1, 0, 0, 0, 0};

TEST(GroundShadow, AnEdgeIsBlurredByAGaussian) {
    GroundShadow shadow;
    shadow.clear();
    shadow.add(makeSquare(100, 150), asItIs);
    shadow.blur();
    EXPECT_EQ(shadow.getBox().left, 100 - GroundShadow::reach);
    EXPECT_EQ(shadow.getBox().top, 150 + GroundShadow::reach);
    for (int x = 92; x < 125; ++x) {
        const double distance = x + 0.5 - 100;
        const double expected = 255 * 0.5 * std::erfc(-distance / (2.5 * std::sqrt(2.0)));
        EXPECT_NEAR(shadow.getTexels()[std::size_t(125 * GroundShadow::size + x)], expected, 1.5)
            << x;
        EXPECT_EQ(shadow.getTexels()[std::size_t(x * GroundShadow::size + 125)],
                  shadow.getTexels()[std::size_t(125 * GroundShadow::size + x)]);
    }
    EXPECT_EQ(shadow.getTexels()[std::size_t(125 * GroundShadow::size + 91)], 0);
}

TEST(GroundShadow, IsAsLargeAsWhatCastsIt) {
    const GroundShadow::ToTexel tilted = {50, 10, -20, 60, 15, 30, 128, 128};
    const SurfaceGeometryPtr ball = createSphere(192);
    SurfaceGeometry open = *ball;
    open.isClosed = false;
    GroundShadow shadow, ofOpen;
    shadow.clear();
    shadow.add(*ball, tilted);
    shadow.blur();
    ofOpen.clear();
    ofOpen.add(open, tilted);
    ofOpen.blur();
    EXPECT_EQ(shadow.getTexels(), ofOpen.getTexels());
    // An ellipse whose half axes are the singular values of the map: area π √det(AAᵀ).
    const double xx = 50 * 50 + 20 * 20 + 15 * 15, yy = 10 * 10 + 60 * 60 + 30 * 30,
                 xy = 50 * 10 - 20 * 60 + 15 * 30;
    const double area = SimTK::Pi * std::sqrt(xx * yy - xy * xy);
    const auto& texels = shadow.getTexels();
    EXPECT_NEAR(std::accumulate(texels.begin(), texels.end(), 0.0) / 255 / area, 1, 2e-3);
}

TEST(GroundShadow, NothingCastsNone) {
    GroundShadow shadow;
    shadow.clear();
    shadow.blur();
    EXPECT_TRUE(shadow.getBox().isEmpty());
    shadow.clear();
    shadow.add(makeSquare(100.6, 101.4), asItIs);  // between texel centres
    shadow.blur();
    EXPECT_TRUE(shadow.getBox().isEmpty());
}

}  // namespace
}  // namespace simflex
