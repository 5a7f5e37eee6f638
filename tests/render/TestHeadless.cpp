// A typical user program for Simbody; only the include of Headless.h shows that it has no window.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <sstream>

#include "Simbody.h"
#include "TestParts.h"
#include "simflex/render/Headless.h"
#include "support/TestFolder.h"

namespace simflex {
namespace {

using namespace test;
using namespace SimTK;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;
namespace fs = std::filesystem;

constexpr int runMenu = 1, goItem = 1, replayItem = 2, quitItem = 3;

struct Swing {
    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    Force::Gravity gravity{forces, matter, -SimTK::YAxis, 9.81};
    MobilizedBody::Pin pin;

    Swing() {
        system.setUseUniformBackground(true);
        matter.setShowDefaultGeometry(false);
        Body::Rigid bob(MassProperties(1, Vec3(0), UnitInertia(1)));
        bob.addDecoration(Transform(), DecorativeSphere(0.1).setColor(SimTK::Red));
        pin = MobilizedBody::Pin(matter.Ground(), Transform(), bob, Transform(Vec3(0, 1, 0)));
    }
};

class CountingGenerator : public DecorationGenerator {
public:
    explicit CountingGenerator(int& counter) : count(counter) {}
    void generateDecorations(const State&, Array_<DecorativeGeometry>&) override { ++count; }

private:
    int& count;
};

class Watcher : public Visualizer::FrameController {
public:
    explicit Watcher(int& counter) : count(counter) {}
    void generateControls(const Visualizer& viz, const State& state,
                          Array_<DecorativeGeometry>& geometry) override {
        ++count;
        viz.setCameraTransform(Transform(Vec3(state.getTime(), 0, 10))).setSliderValue(7, 3);
        geometry.push_back(DecorativeBrick(Vec3(0.2)).setColor(SimTK::Blue));
    }

private:
    int& count;
};

int countColor(const Image& image, int channel) {
    int count = 0;
    for (int y = 0; y < image.getHeight(); ++y)
        for (int x = 0; x < image.getWidth(); ++x) {
            const Image::Pixel p = image.getPixel(x, y);
            const int other =
                std::max(p[std::size_t(channel + 1) % 3], p[std::size_t(channel + 2) % 3]);
            count += p[std::size_t(channel)] > 120 && other < 80;
        }
    return count;
}

TEST(Headless, ProgramWithMenusSlidersAndReporterRunsToItsEnd) {
    const testing::TestFolder scratch;
    const fs::path folder = scratch / "frames";
    Swing swing;
    Visualizer viz(swing.system);
    viz.setShutdownWhenDestructed(true).setBackgroundType(Visualizer::SolidColor);
    viz.setMode(Visualizer::RealTime).setDesiredFrameRate(30).setRealTimeScale(2);
    viz.setDesiredBufferLengthInSec(1);
    viz.setShowFrameRate(true);
    viz.setOutputFolder(folder.string());
    Array_<std::pair<String, int>> items;
    items.push_back(std::make_pair("Go", goItem));
    items.push_back(std::make_pair("Replay", replayItem));
    items.push_back(std::make_pair("Quit", quitItem));
    Visualizer::InputSilo* silo = new Visualizer::InputSilo();
    viz.addInputListener(silo);
    viz.addMenu("Run", runMenu, items).addSlider("Speed", 7, 0, 4, 1);
    swing.system.addEventReporter(new Visualizer::Reporter(viz, 0.1));
    State state = swing.system.realizeTopology();
    swing.pin.setAngle(state, 1);

    int menu, item;
    do {
        silo->waitForMenuPick(menu, item);
    } while (menu != runMenu || item != goItem);
    RungeKuttaMersonIntegrator integrator(swing.system);
    TimeStepper stepper(swing.system, integrator);
    stepper.initialize(state);
    stepper.stepTo(0.45);
    int numReplays = 0;
    while (true) {
        silo->waitForMenuPick(menu, item);
        if (item == quitItem) break;
        viz.report(stepper.getState());
        ++numReplays;
    }

    EXPECT_EQ(numReplays, 1);
    EXPECT_EQ(viz.getNumFrames(), 6);
    EXPECT_EQ(viz.getMode(), Visualizer::RealTime);
    const Image first = Image::readPng((folder / "frame_00000.png").string());
    const Image last = Image::readPng((folder / "frame_00005.png").string());
    EXPECT_GT(countColor(first, 0), 500);
    EXPECT_FALSE(first == last);
    std::ostringstream stats;
    viz.dumpStats(stats);
    EXPECT_THAT(stats.str(), HasSubstr("6 frames"));
}

TEST(Headless, WaitThatNobodyCanEndIsRefused) {
    Swing swing;
    Visualizer viz(swing.system);
    auto* silo = new Visualizer::InputSilo();
    viz.addInputListener(silo);
    int menu, item, slider;
    Real value;
    unsigned key, modifiers;
    EXPECT_THAT([&] { silo->waitForMenuPick(menu, item); },
                ThrowsMessage<std::runtime_error>(HasSubstr("menuSelected()")));
    EXPECT_THAT([&] { silo->waitForSliderMove(slider, value); },
                ThrowsMessage<std::runtime_error>(HasSubstr("sliderMoved()")));
    EXPECT_THAT(
        [&] {
            do {
                silo->waitForKeyHit(key, modifiers);
            } while (key != 'q');
        },
        ThrowsMessage<std::runtime_error>(HasSubstr("keyPressed()")));
    silo->waitForAnyUserInput();
    EXPECT_FALSE(silo->isAnyUserInput());
}

TEST(Headless, InputGivenBeforehandIsTakenInItsOrder) {
    Visualizer::InputSilo silo;
    silo.keyPressed('a', 0);
    silo.keyPressed('b', Visualizer::InputListener::ShiftIsDown);
    silo.menuSelected(3, 4);
    silo.sliderMoved(5, 0.25);
    unsigned key, modifiers;
    silo.waitForKeyHit(key, modifiers);
    EXPECT_EQ(key, unsigned('a'));
    ASSERT_TRUE(silo.takeKeyHit(key, modifiers));
    EXPECT_EQ(key, unsigned('b'));
    EXPECT_EQ(modifiers, unsigned(Visualizer::InputListener::ShiftIsDown));
    EXPECT_FALSE(silo.takeKeyHit(key, modifiers));
    int menu, item, slider;
    Real value;
    ASSERT_TRUE(silo.takeMenuPick(menu, item));
    EXPECT_EQ(menu, 3);
    EXPECT_EQ(item, 4);
    ASSERT_TRUE(silo.takeSliderMove(slider, value));
    EXPECT_EQ(slider, 5);
    EXPECT_EQ(value, 0.25);
    EXPECT_FALSE(silo.isAnyUserInput());
}

TEST(Headless, FrameControllerMovesTheCameraOfTheSameFrameAndIsCalledOnce) {
    Swing swing;
    int numControls = 0, numDecorations = 0;
    Visualizer viz(swing.system, 320, 180);
    viz.addSlider("Speed", 7, 0, 4, 1);
    viz.addFrameController(new Watcher(numControls));
    viz.addDecorationGenerator(new CountingGenerator(numDecorations));
    State state = swing.system.realizeTopology();
    for (const double time : {0.0, 0.5, 1.0}) {
        state.setTime(time);
        const Image image = viz.drawFrame(state);
        // The camera is at x = time, so this point is in the middle.
        const Vec3 pixel = viz.calcPixel(Vec3(time, 0, 0));
        EXPECT_NEAR(pixel[0], 160, 1e-9);
        EXPECT_NEAR(pixel[1], 90, 1e-9);
        EXPECT_GT(countColor(image, 2), 50);
    }
    EXPECT_EQ(numControls, 3);
    EXPECT_EQ(numDecorations, 3);
}

TEST(Headless, BodyFollowerKeepsItsBodyInTheMiddle) {
    Swing swing;
    Visualizer viz(swing.system, 320, 180);
    const Vec3 offset(2, 1, 3);
    viz.addFrameController(new Visualizer::BodyFollower(swing.pin, Vec3(0), offset));
    State state = swing.system.realizeTopology();
    for (const double angle : {0.0, 1.0, 2.5}) {
        swing.pin.setAngle(state, angle);
        viz.drawFrame(state);
        const Vec3 pixel = viz.calcPixel(swing.pin.getBodyOriginLocation(state));
        EXPECT_NEAR(pixel[0], 160, 1e-9);
        EXPECT_NEAR(pixel[1], 90, 1e-9);
        EXPECT_NEAR(pixel[2], offset.norm(), 1e-12);
    }
    EXPECT_THROW(Visualizer::BodyFollower(swing.pin, Vec3(0), Vec3(0)), std::invalid_argument);
}

TEST(Headless, WhatWasAddedCanBeFoundAndChanged) {
    Swing swing;
    Visualizer viz(swing.system, 320, 180);
    viz.setShowSimTime(false).setShowAxes(false);
    viz.setCameraTransform(Vec3(0, 0, 10));
    const MobilizedBodyIndex ground(0);
    const int ball = viz.addDecoration(ground, Vec3(1, 0, 0), DecorativeSphere(0.5).setColor(Blue));
    const int band =
        viz.addRubberBandLine(ground, Vec3(-1, 0, 0), ground, Vec3(0), DecorativeLine());
    ASSERT_EQ(viz.getNumDecorations(), 1);
    ASSERT_EQ(viz.getNumRubberBandLines(), 1);
    EXPECT_EQ(viz.getDecoration(ball).getBodyId(), 0);
    viz.updRubberBandLine(band).setLineThickness(3);
    EXPECT_EQ(viz.getRubberBandLine(band).getLineThickness(), 3);
    const State state = swing.system.realizeTopology();
    EXPECT_GT(countColor(viz.drawFrame(state), 2), 100);
    viz.updDecoration(ball).setRepresentation(DecorativeGeometry::Hide);
    EXPECT_EQ(countColor(viz.drawFrame(state), 2), 0);
    EXPECT_THAT([&] { viz.getDecoration(1); },
                ThrowsMessage<std::out_of_range>(HasSubstr("1 decorations")));
    EXPECT_THROW(viz.addSlider("Speed", 1, 0, 1, 2), std::invalid_argument);
    EXPECT_THROW(viz.addFrameController(nullptr), std::invalid_argument);
    EXPECT_THROW(viz.addInputListener(nullptr), std::invalid_argument);
}

TEST(Headless, WhatLeavesThePictureOfTheFirstFrameIsFollowedByAStepBack) {
    Swing swing;
    State state = swing.system.realizeTopology();
    Visualizer viz(swing.system, 320, 180);
    double distance = 0;
    for (int i = 0; i <= 24; ++i) {
        swing.pin.setAngle(state, i * SimTK::Pi / 12);
        viz.drawFrame(state);
        const Vec3 p = swing.pin.getBodyOriginLocation(state);
        for (const Vec3& rim :
             {Vec3(0.1, 0, 0), Vec3(-0.1, 0, 0), Vec3(0, 0.1, 0), Vec3(0, -0.1, 0)}) {
            const Vec3 pixel = viz.calcPixel(p + rim);
            EXPECT_TRUE(pixel[0] > 0 && pixel[0] < 320 && pixel[1] > 0 && pixel[1] < 180) << i;
        }
        // It never moves closer again.
        const double now = viz.calcPixel(Vec3(0))[2];
        EXPECT_GE(now, distance - 1e-9);
        distance = std::max(distance, now);
    }
}

}  // namespace
}  // namespace simflex
