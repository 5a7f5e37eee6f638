#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "TestParts.h"
#include "simflex/render/OffscreenVisualizer.h"

namespace simflex {
namespace {

using namespace test;
using SimTK::Pi;
using SimTK::Transform;
using SimTK::Vec3;
using testing::HasSubstr;
using testing::ThrowsMessage;

const Vec3 black(0);
const SimTK::MobilizedBodyIndex ground(0);
constexpr auto orthographic = CameraView::Projection::Orthographic;

void expectInside(const Vec3& pixel, int left, int top, int right, int bottom) {
    EXPECT_GT(pixel[0], left);
    EXPECT_LT(pixel[0], right);
    EXPECT_GT(pixel[1], top);
    EXPECT_LT(pixel[1], bottom);
}

// A freely moving body with a brick on it, above a fixed one.
struct FlyingBrick {
    SimTK::MultibodySystem system;
    SimTK::SimbodyMatterSubsystem matter{system};
    SimTK::MobilizedBody::Free brick;
    std::vector<SimTK::State> states;

    FlyingBrick() {
        matter.setShowDefaultGeometry(false);
        SimTK::Body::Rigid body(SimTK::MassProperties(1, Vec3(0), SimTK::UnitInertia(1)));
        body.addDecoration(Transform(),
                           SimTK::DecorativeBrick(Vec3(0.3, 0.2, 0.1)).setColor(black));
        brick = SimTK::MobilizedBody::Free(matter.Ground(), body);
        SimTK::State state = system.realizeTopology();
        for (int i = 0; i <= 6; ++i) {
            const SimTK::Rotation R(SimTK::BodyRotationSequence, 0.5 * i, SimTK::XAxis, 0.3 * i,
                                    SimTK::YAxis);
            brick.setQToFitTransform(state, Transform(R, Vec3(i, 0.2 * i * i, -0.4 * i)));
            state.setTime(0.1 * i);
            system.realize(state, SimTK::Stage::Position);
            states.push_back(state);
        }
    }
};

TEST(Orthographic, SphereCoversTheSameAreaAtAnyDistance) {
    EmptyScene scene;
    for (const double distance : {3.0, 30.0}) {
        OffscreenVisualizer viz(scene.system);
        viz.addDecoration(ground, Transform(), SimTK::DecorativeSphere(0.6).setColor(black));
        viz.setBackgroundType(SimTK::Visualizer::SolidColor)
            .setLighting(OffscreenVisualizer::Lighting::Flat)
            .setShowAxes(false)
            .setShowSimTime(false)
            .setShowScaleBar(false);
        // The field of view determines the visible height at the scene's distance: 3 m here.
        CameraView view;
        view.setTransform(Transform(Vec3(0.1, 0, distance)))
            .setFieldOfView(2 * std::atan(1.5 / distance))
            .setOrthographic();
        viz.setCamera(view);
        const double area = calcCoveredArea(viz.drawFrame(scene.state), 0, 0);
        const double R = 0.6 * 720 / 3.0;
        EXPECT_NEAR(area, Pi * R * R, 0.1 * 2 * Pi * R + std::sqrt(2 * Pi * R));
    }
}

TEST(Orthographic, ParallelLinesStayParallelAndSizesDoNotDependOnDepth) {
    EmptyScene scene;
    OffscreenVisualizer viz(scene.system);
    viz.addDecoration(ground, Transform(), SimTK::DecorativeBrick(Vec3(1, 0.5, 3)));
    viz.setCameraProjection(orthographic);
    viz.drawFrame(scene.state);
    const Vec3 span(0.5, -0.25, 0.4);
    Vec3 first = viz.calcPixel(span) - viz.calcPixel(Vec3(0));
    for (const Vec3& start : {Vec3(0, 0, 3), Vec3(1, 0.5, -3)}) {
        const Vec3 other = viz.calcPixel(start + span) - viz.calcPixel(start);
        EXPECT_NEAR((other - first).norm(), 0, 1e-9);
    }
}

TEST(Orthographic, FittedMotionStaysInThePictureAndFillsIt) {
    FlyingBrick flight;
    OffscreenVisualizer viz(flight.system, 640, 360);
    viz.setCameraProjection(orthographic).fitToMotion(flight.states);
    double left = 640, right = 0, top = 360, bottom = 0;
    for (const SimTK::State& state : flight.states) {
        viz.drawFrame(state);
        for (const double x : {-0.3, 0.3})
            for (const double y : {-0.2, 0.2}) {
                const Vec3 corner = flight.brick.getBodyTransform(state) * Vec3(x, y, 0.1);
                const Vec3 pixel = viz.calcPixel(corner);
                expectInside(pixel, 0, 0, 640, 360);
                left = std::min(left, pixel[0]);
                right = std::max(right, pixel[0]);
                top = std::min(top, pixel[1]);
                bottom = std::max(bottom, pixel[1]);
            }
    }
    EXPECT_TRUE(right - left > 0.75 * 640 || bottom - top > 0.7 * 360);
}

TEST(Follow, BodyStaysInTheMiddleAndKeepsItsSize) {
    FlyingBrick flight;
    for (const auto projection : {CameraView::Projection::Perspective, orthographic}) {
        OffscreenVisualizer viz(flight.system);
        viz.setCameraFollow(flight.brick, 1.5).setCameraProjection(projection);
        for (const SimTK::State& state : flight.states) {
            viz.drawFrame(state);
            const Vec3 p = flight.brick.getBodyOriginLocation(state);
            const Vec3 pixel = viz.calcPixel(p);
            EXPECT_NEAR(pixel[0], 640, 1e-6);
            EXPECT_NEAR(pixel[1], 360, 1e-6);
            // 1.5 m span 720 pixels; for a camera that does not rotate, "up" is constant.
            const Vec3 higher = viz.calcPixel(p + Vec3(0, 0.01, 0));
            const double inclination = std::cos(16 * Pi / 180);
            EXPECT_NEAR(pixel[1] - higher[1], 0.01 * inclination * 720 / 1.5, 0.02);
        }
    }
}

TEST(Follow, CameraThatTurnsWithTheBodySeesItsPointsInTheSamePlace) {
    FlyingBrick flight;
    OffscreenVisualizer viz(flight.system);
    viz.setCameraFollow(flight.brick, 2, CameraView::Follow::Pose);
    const Vec3 station(0.3, 0.2, -0.1);
    viz.drawFrame(flight.states[0]);
    const Vec3 first = viz.calcPixel(flight.brick.getBodyTransform(flight.states[0]) * station);
    for (const SimTK::State& state : flight.states) {
        viz.drawFrame(state);
        EXPECT_NEAR((viz.calcPixel(flight.brick.getBodyTransform(state) * station) - first).norm(),
                    0, 1e-6);
    }
}

TEST(Follow, SceneAboutTheBodyFitsWithoutAGivenSize) {
    FlyingBrick flight;
    OffscreenVisualizer viz(flight.system, 640, 360);
    viz.setCameraFollow(flight.brick).fitToMotion(flight.states);
    for (const SimTK::State& state : flight.states) {
        viz.drawFrame(state);
        const Vec3 corner = flight.brick.getBodyTransform(state) * Vec3(0.3, 0.2, 0.1);
        expectInside(viz.calcPixel(corner), 0, 0, 640, 360);
    }
}

TEST(Views, EachIsThePictureOfItsCamera) {
    FlyingBrick flight;
    const auto prepare = [](OffscreenVisualizer& viz) {
        viz.setShowAxes(false).setShowSimTime(false).setBackgroundType(
            SimTK::Visualizer::SolidColor);
    };
    CameraView second;
    second.setTransform(Transform(SimTK::Rotation(0.3, SimTK::YAxis), Vec3(1, 0.2, 8)));

    OffscreenVisualizer both(flight.system, 400, 200);
    prepare(both);
    both.setCameraTransform(Transform(Vec3(0, 0, 5))).addView(second);
    const Image frame = both.drawFrame(flight.states[1]);

    // A one-pixel line separates the views.
    OffscreenVisualizer left(flight.system, 199, 200), right(flight.system, 200, 200);
    prepare(left);
    prepare(right);
    left.setCameraTransform(Transform(Vec3(0, 0, 5)));
    right.setCamera(second);
    Image expected = frame;
    expected.paste(left.drawFrame(flight.states[1]), 0, 0);
    expected.paste(right.drawFrame(flight.states[1]), 200, 0);
    EXPECT_TRUE(frame == expected);
    EXPECT_GT(countPixels(frame, {255, 255, 255, 255}), 100);
    const Vec3 middle = flight.brick.getBodyOriginLocation(flight.states[1]);
    EXPECT_NEAR((both.calcPixel(middle, 1) - right.calcPixel(middle) - Vec3(200, 0, 0)).norm(), 0,
                1e-9);
}

TEST(Views, FourShareTheFrameAndEachShowsTheWholeMotion) {
    FlyingBrick flight;
    OffscreenVisualizer viz(flight.system, 640, 360);
    viz.addView(CameraView("front").setDirection(0, 0))
        .addView(CameraView("right").setDirection(Pi / 2, 0).setOrthographic())
        .addView(CameraView("above").setDirection(0, Pi / 2).setOrthographic())
        .fitToMotion(flight.states);
    for (const SimTK::State& state : flight.states) {
        viz.drawFrame(state);
        const Vec3 middle = flight.brick.getBodyOriginLocation(state);
        for (int view = 0; view < 4; ++view) {
            const int left = view % 2 * 320, top = view / 2 * 180;
            expectInside(viz.calcPixel(middle, view), left, top, left + 320, top + 180);
        }
    }
    EXPECT_THROW(viz.calcPixel(Vec3(0), 4), std::out_of_range);
}

TEST(Views, RectangleIsAnInsetOverTheFirstView) {
    FlyingBrick flight;
    OffscreenVisualizer viz(flight.system, 400, 200);
    viz.setCameraTransform(Transform(Vec3(0, 0, 5)));
    const Image alone = viz.drawFrame(flight.states[0]);
    viz.addView(CameraView().setRectangle(0.5, 0, 0.5, 0.5).setTransform(Transform(Vec3(0, 0, 2))));
    // The first view fills the frame only on request.
    viz.setCamera(CameraView().setRectangle(0, 0, 1, 1).setTransform(Transform(Vec3(0, 0, 5))));
    const Image inset = viz.drawFrame(flight.states[0]);
    for (const int y : {150, 190})
        for (const int x : {20, 380}) EXPECT_EQ(alone.getPixel(x, y), inset.getPixel(x, y));
    EXPECT_NE(alone.getPixel(300, 50), inset.getPixel(300, 50));
}

TEST(ScaleBar, HasTheLengthThatItsTextSays) {
    EmptyScene scene;
    OffscreenVisualizer viz(scene.system);
    viz.addDecoration(ground, Transform(), SimTK::DecorativeBrick(Vec3(0.5)));
    makePlain(viz, 4);
    viz.setShowScaleBar(true).setCameraFieldOfView(0.6);
    const Image with = viz.drawFrame(scene.state);
    viz.setShowScaleBar(false);
    const Image without = viz.drawFrame(scene.state);
    // The longest run of changed pixels is the bar.
    int longest = 0;
    for (int y = 0; y < 720; ++y) {
        int run = 0;
        for (int x = 0; x < 1280; ++x) {
            run = with.getPixel(x, y) != without.getPixel(x, y) ? run + 1 : 0;
            longest = std::max(longest, run);
        }
    }
    // 1280 / 12 pixels are 0.367 m there: the next round length is 0.5 m.
    const double wanted = viz.calcPixel(Vec3(0.5, 0, 0))[0] - viz.calcPixel(Vec3(0))[0];
    EXPECT_NEAR(longest, wanted, 1.5);
}

TEST(BadInput, CamerasThatCannotBeAreRefused) {
    CameraView view;
    EXPECT_THROW(view.setZoom(0), std::invalid_argument);
    EXPECT_THROW(view.setFieldOfView(Pi), std::invalid_argument);
    EXPECT_THROW(view.setClippingPlanes(2, 1), std::invalid_argument);
    EXPECT_THROW(view.setRectangle(0.6, 0, 0.5, 1), std::invalid_argument);
    EXPECT_THROW(view.setFollowedBody(ground, -1), std::invalid_argument);
    EmptyScene scene;
    OffscreenVisualizer viz(scene.system, 64, 64);
    viz.setCameraFollow(SimTK::MobilizedBodyIndex(7));
    EXPECT_THAT([&] { viz.drawFrame(scene.state); },
                ThrowsMessage<std::runtime_error>(HasSubstr("body 7")));
}

TEST(Titles, ThatAreLongStandOnSeveralLinesToTheirEnd) {
    EmptyScene scene;
    OffscreenVisualizer viz(scene.system, 900, 506);
    makePlain(viz);
    const std::string begin = "A title of so many words that they do not fit into one line of a ";
    const std::string more = "picture of nine hundred pixels, whatever its letters, but in ";
    const auto draw = [&](const std::string& last) {
        return viz.setWindowTitle(begin + more + last).drawFrame(scene.state);
    };
    EXPECT_FALSE(draw("two") == draw("ten"));
    // No text at the edge.
    const Image image = draw("two");
    for (int y = 0; y < image.getHeight(); ++y)
        for (int x = 890; x < 900; ++x)
            ASSERT_EQ(image.getPixel(x, y), (Image::Pixel{255, 255, 255, 255}));
}

// A brick thrown a hundred metres away at the end does not shrink the rest.
TEST(Views, WhatFliesAwayLeavesThePicture) {
    const auto calcWidth = [](double distance, int numFlights) {
        FlyingBrick scene;
        std::vector<SimTK::State> states;
        for (int i = 0; i < 40; ++i) {
            SimTK::State state = scene.states.front();
            state.setTime(0.1 * i);
            const Vec3 place = i < 40 - numFlights ? Vec3(0.01 * i, 0, 0) : Vec3(distance, 0, 0);
            scene.brick.setQToFitTransform(state, Transform(place));
            scene.system.realize(state, SimTK::Stage::Position);
            states.push_back(state);
        }
        OffscreenVisualizer viz(scene.system, 320, 180);
        viz.addDecoration(ground, Transform(), SimTK::DecorativeBrick(Vec3(1)));
        viz.fitToMotion(states);
        viz.drawFrame(states.front());
        return viz.calcPixel(Vec3(1, 0, 0))[0] - viz.calcPixel(Vec3(-1, 0, 0))[0];
    };
    const double usual = calcWidth(0, 2);
    EXPECT_GT(usual, 60);
    EXPECT_GT(calcWidth(100, 2), 0.7 * usual);
    EXPECT_LT(calcWidth(4, 2), 0.8 * usual);  // 4 m is part of the motion
}

}  // namespace
}  // namespace simflex
