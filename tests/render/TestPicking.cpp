#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "TestParts.h"
#include "simflex/render/OffscreenVisualizer.h"

namespace simflex {
namespace {

using namespace test;
using SimTK::Transform;
using SimTK::Vec3;
using SimTK::Vector;
using ::testing::AllOf;
using ::testing::HasSubstr;

template <class Error, class Work>
std::string messageOf(const Work& work) {
    try {
        work();
    } catch (const Error& error) {
        return error.what();
    }
    return "accepted";
}

DeformableMesh makeNamed(const std::string& name, const Vec3& place) {
    DeformableMesh mesh = makeStill(makeBrickPart(Vec3(1, 1, 0.2), 5, 4, 1),
                                    Vector(Vec3(1e-3, 2e-3, 0)), Transform(place));
    mesh.name = name;
    return mesh;
}

TEST(Picking, FindsThePointWhereTheRayMeetsThePlane) {
    EmptyScene scene;
    OffscreenVisualizer viz(scene.system, 640, 360);
    makePlain(viz, 4);
    viz.addDeformableMesh(makeNamed("plate", Vec3(0.2, 0, 0))).setDeformationFactor(0);
    viz.drawFrame(scene.state);
    for (const double x : {-0.2, 0.11, 0.55})
        for (const double y : {-0.43, 0.07}) {
            const Vec3 point(x, y, 0.1);
            const Vec3 pixel = viz.calcPixel(point);
            const auto found = viz.pickNode(pixel[0], pixel[1]);
            ASSERT_TRUE(found);
            EXPECT_EQ(found->body, "plate");
            EXPECT_LT((found->location_G - point).norm(), 1e-6);
            EXPECT_NEAR(found->distance, 3.9, 1e-6);
            // u = (2e-3 x, 1e-3, 0) is linear in its components, so its magnitude is only nearly
            // linear.
            const double atNode = std::hypot(2e-3 * (found->nodeLocation_G[0] - 0.2), 1e-3);
            EXPECT_NEAR(found->nodeValue, atNode, 1e-9);
            EXPECT_NEAR(found->value, std::hypot(2e-3 * (x - 0.2), 1e-3), 2e-5);
            EXPECT_LT((found->nodeLocation_G - point).norm(), 0.5 * std::hypot(0.2, 0.25) + 1e-6);
            EXPECT_EQ(viz.findNode("plate", found->nodeNumber).location_G, found->nodeLocation_G);
        }
    EXPECT_FALSE(viz.pickNode(2, 2));
    EXPECT_FALSE(viz.pickNode(-5, 1000));
}

TEST(Picking, SeesWhatIsInFront) {
    EmptyScene scene;
    OffscreenVisualizer viz(scene.system, 640, 360);
    makePlain(viz, 4);
    viz.addDeformableMesh(makeNamed("back", Vec3(0)))
        .addDeformableMesh(makeNamed("front", Vec3(0.5, 0, 0.5)))
        .setDeformationFactor(0);
    viz.drawFrame(scene.state);
    const auto bodyAt = [&](const Vec3& point) {
        const Vec3 pixel = viz.calcPixel(point);
        const auto found = viz.pickNode(pixel[0], pixel[1]);
        return found ? found->body : "nothing";
    };
    EXPECT_EQ(bodyAt(Vec3(-0.3, 0.1, 0.1)), "back");
    EXPECT_EQ(bodyAt(Vec3(0.4, 0.1, 0.1)), "front");
    EXPECT_EQ(bodyAt(Vec3(0.8, 0.1, 0.6)), "front");
    EXPECT_EQ(bodyAt(Vec3(-0.8, 0.1, 0.1)), "nothing");

    // One node behind the other part, one in front of it, one on the far side of its own part.
    int numHidden = 0, numSeen = 0;
    for (int number = 1; number <= 60; ++number) {
        const NodeView view = viz.findNode("back", number);
        const bool isFront = number > 30;  // of two layers
        const bool isHidden = !isFront || view.location_G[0] > 0.05;
        EXPECT_EQ(view.isVisible, !isHidden) << view.location_G;
        numHidden += !view.isVisible;
        numSeen += view.isVisible;
    }
    EXPECT_EQ(numSeen, 15);
    EXPECT_EQ(numHidden, 45);

    // A decoration also hides nodes unless it is transparent.
    viz.addDecoration(SimTK::GroundIndex, Transform(Vec3(-0.3, 0, 1)),
                      SimTK::DecorativeBrick(Vec3(0.1)));
    viz.addDecoration(SimTK::GroundIndex, Transform(Vec3(0.8, 0, 1)),
                      SimTK::DecorativeBrick(Vec3(0.1)).setOpacity(0.5));
    viz.drawFrame(scene.state);
    EXPECT_EQ(bodyAt(Vec3(-0.3, 0, 0.9)), "nothing");
    EXPECT_EQ(bodyAt(Vec3(0.8, 0, 0.9)), "front");
}

TEST(Picking, WorksInEachViewOfSeveral) {
    EmptyScene scene;
    OffscreenVisualizer viz(scene.system, 640, 360);
    viz.addDeformableMesh(makeNamed("plate", Vec3(0)));
    viz.addView(CameraView("from above").setDirection(0, SimTK::Pi / 2).setOrthographic());
    viz.drawFrame(scene.state);
    const auto left = viz.pickNode(160, 180), right = viz.pickNode(480, 180);
    ASSERT_TRUE(left);
    ASSERT_TRUE(right);
    EXPECT_NEAR(left->location_G[2], 0.1, 1e-6);   // the front
    EXPECT_NEAR(right->location_G[1], 0.5, 0.01);  // the top
}

TEST(Picking, NamesWhatIsNotThere) {
    EmptyScene scene;
    OffscreenVisualizer viz(scene.system, 64, 36);
    EXPECT_THAT(messageOf<std::logic_error>([&] { viz.pickNode(1, 1); }), HasSubstr("no frame"));
    viz.addDeformableMesh(makeNamed("plate", Vec3(0)));
    viz.drawFrame(scene.state);
    EXPECT_THAT(messageOf<std::out_of_range>([&] { viz.findNode("disc", 1); }),
                AllOf(HasSubstr("'disc'"), HasSubstr("'plate'")));
    EXPECT_THAT(messageOf<std::out_of_range>([&] { viz.findNode("plate", 4711); }),
                AllOf(HasSubstr("'plate'"), HasSubstr("4711")));
}

}  // namespace
}  // namespace simflex
