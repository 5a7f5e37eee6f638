#include "simflex/render/RunComparison.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "TestParts.h"
#include "simflex/render/FrameReporter.h"
#include "support/TestFolder.h"

namespace simflex {
namespace {

using namespace test;
using SimTK::Transform;
using SimTK::Vec3;
namespace fs = std::filesystem;

/** A swinging ball, or a brick bent by a given function of time. **/
struct Pendulum {
    SimTK::MultibodySystem system;
    SimTK::SimbodyMatterSubsystem matter{system};
    SimTK::GeneralForceSubsystem forces{system};
    SimTK::Force::Gravity gravity{forces, matter, -SimTK::YAxis, 9.81};
    SimTK::MobilizedBody::Pin pin;
    SimTK::State initial;

    Pendulum() {
        matter.setShowDefaultGeometry(false);
        SimTK::Body::Rigid bob(SimTK::MassProperties(1, Vec3(0), SimTK::UnitInertia(1)));
        bob.addDecoration(Transform(), SimTK::DecorativeSphere(0.1));
        pin =
            SimTK::MobilizedBody::Pin(matter.Ground(), Transform(), bob, Transform(Vec3(0, 1, 0)));
        initial = system.realizeTopology();
    }

    std::vector<SimTK::State> swing(double angle, int count) const {
        std::vector<SimTK::State> states(size_t(count), initial);
        for (int i = 0; i < count; ++i) {
            states[size_t(i)].setTime(0.1 * i);
            states[size_t(i)].updQ()[0] = angle * i / count;
        }
        return states;
    }
};

void addBrick(OffscreenVisualizer& viz, double bend) {
    DeformableMesh mesh;
    mesh.part = makeBrickPart(Vec3(1, 0.1, 0.1), 8, 2, 2);
    mesh.getFramePose = [](const SimTK::State&) { return Transform(); };
    mesh.getModalCoordinates = [bend](const SimTK::State& state) {
        return SimTK::Vector(Vec3(0, 0, bend * state.getTime()));
    };
    viz.addDeformableMesh(mesh);
}

TEST(RunComparison, BothRunsHaveTheCameraAndTheRangeOfBoth) {
    Pendulum little, wide;
    OffscreenVisualizer first(little.system, 160, 90), second(wide.system, 160, 90);
    addBrick(first, 0.01);
    addBrick(second, 0.05);
    const auto littleStates = little.swing(0.1, 4), wideStates = wide.swing(3, 4);
    RunComparison both(first, second);
    both.fitToMotion(littleStates, wideStates);
    EXPECT_EQ(first.getDeformationFactor(), second.getDeformationFactor());
    both.drawFrame(littleStates[1], wideStates[3]);
    for (const Vec3& p : {Vec3(0), Vec3(1, 2, 3), Vec3(-1, 0.5, 0)})
        EXPECT_LT((first.calcPixel(p) - second.calcPixel(p)).norm(), 1e-9);
    for (const SimTK::State& state : wideStates) {
        const Vec3 pixel = first.calcPixel(wide.pin.getBodyTransform(state).p());
        EXPECT_TRUE(pixel[0] > 0 && pixel[0] < 160 && pixel[1] > 0 && pixel[1] < 90) << pixel;
    }
}

TEST(RunComparison, AColorBarOrATitleInOneOfThemMovesBothCameras) {
    Pendulum pendulum;
    OffscreenVisualizer first(pendulum.system, 160, 90), second(pendulum.system, 160, 90);
    addBrick(second, 0.05);
    first.setWindowTitle("A title");
    const auto states = pendulum.swing(2, 4);
    RunComparison both(first, second);
    both.fitToMotion(states, states);
    both.drawFrame(states[1], states[1]);
    for (const Vec3& p : {Vec3(0), Vec3(1, 2, 3), Vec3(-1, 0.5, 0)})
        EXPECT_LT((first.calcPixel(p) - second.calcPixel(p)).norm(), 1e-9);
}

TEST(RunComparison, TheSameStateTwiceGivesTheSamePictureTwice) {
    Pendulum pendulum;
    OffscreenVisualizer first(pendulum.system, 160, 90), second(pendulum.system, 160, 90);
    addBrick(first, 0.02);
    addBrick(second, 0.02);
    const auto states = pendulum.swing(1, 3);
    RunComparison both(first, second, {"one", "other"});
    SideBySideStyle style;
    style.gap = 4;
    both.setStyle(style).fitToMotion(states, states);
    const Image image = both.drawFrame(states[2], states[2]);
    ASSERT_EQ(image.getWidth(), 324);
    const int strip = image.getHeight() - 90;
    EXPECT_GT(strip, 8);
    EXPECT_TRUE(image.cropped(0, strip, 160, 90) == image.cropped(164, strip, 160, 90));
    EXPECT_EQ(image.getPixel(161, strip + 40), style.background);
}

TEST(RunComparison, FramesAreTheSameForAnyNumberOfThreads) {
    Pendulum pendulum;
    std::vector<std::vector<Image>> frames;
    for (const int numThreads : {0, 3}) {
        OffscreenVisualizer first(pendulum.system, 96, 54), second(pendulum.system, 96, 54);
        addBrick(first, 0.01);
        addBrick(second, 0.03);
        const auto states = pendulum.swing(1, 8);
        RunComparison both(first, second, {"stiff", "soft"});
        ProbePlot plot("Bend");
        plot.addCurve("", {0, 1}, {0, 1});
        both.addPlot(plot, PlotSide::Below, 80);
        both.setOutputFolder("").setNumThreads(numThreads);
        frames.emplace_back();
        both.setFrameSink([&](int, const Image& image) { frames.back().push_back(image); });
        EXPECT_EQ(both.reportAll(states, states), 8);
        both.finish();
        EXPECT_EQ(both.getNumFrames(), 8);
    }
    ASSERT_EQ(frames[0].size(), 8u);
    ASSERT_EQ(frames[1].size(), 8u);
    for (size_t i = 0; i < 8; ++i) EXPECT_TRUE(frames[0][i] == frames[1][i]) << i;
    EXPECT_EQ(frames[0][0].getWidth(), 196);
}

TEST(RunComparison, RunsOfDifferentLengthAreRefused) {
    Pendulum pendulum;
    OffscreenVisualizer viz(pendulum.system, 96, 54);
    RunComparison both(viz, OffscreenVisualizer(pendulum.system, 96, 54));
    EXPECT_THROW(both.reportAll(pendulum.swing(1, 3), pendulum.swing(1, 2)), std::invalid_argument);
    EXPECT_THROW(both.fitToMotion(pendulum.swing(1, 3), {}), std::invalid_argument);
}

TEST(MotionRecorder, RecordedStatesGiveTheSamePictures) {
    Pendulum pendulum;
    SimTK::State state = pendulum.initial;
    pendulum.pin.setAngle(state, 1);
    SimTK::RungeKuttaMersonIntegrator integrator(pendulum.system);
    SimTK::TimeStepper stepper(pendulum.system, integrator);
    stepper.initialize(state);
    MotionRecorder motion(pendulum.system);
    std::vector<SimTK::State> states;
    for (int i = 0; i < 5; ++i) {
        stepper.stepTo(0.1 * i);
        motion.record(stepper.getState());
        states.push_back(stepper.getState());
    }
    ASSERT_EQ(motion.getNumStates(), 5);
    EXPECT_EQ(motion.getTime(3), states[3].getTime());
    for (int i : {4, 0, 2}) {
        EXPECT_EQ((motion.getState(i).getY() - states[size_t(i)].getY()).norm(), 0);
        EXPECT_GE(motion.getState(i).getSystemStage(), SimTK::Stage::Position);
    }
    EXPECT_THROW(motion.getState(5), std::out_of_range);

    OffscreenVisualizer fromStates(pendulum.system, 96, 54), fromMotion(pendulum.system, 96, 54);
    fromStates.fitToMotion(states);
    fromMotion.fitToMotion(motion);
    for (int i = 0; i < 5; ++i)
        EXPECT_TRUE(fromStates.drawFrame(states[size_t(i)]) ==
                    fromMotion.drawFrame(motion.getState(i)));
    Pendulum other;
    SimTK::MobilizedBody::Free more(other.matter.Ground(), SimTK::Body::Massless());
    EXPECT_THROW(motion.record(other.system.realizeTopology()), std::invalid_argument);
}

TEST(FrameReporter, FitsTheCameraToTheWholeRunWhenItIsOver) {
    Pendulum pendulum;
    const testing::TestFolder scratch;
    const std::string folder = scratch / "frames";
    OffscreenVisualizer viz(pendulum.system, 160, 90);
    viz.setOutputFolder(folder);
    auto* reporter = new FrameReporter(viz, 0.1);
    reporter->setFitToRun(true);
    pendulum.system.addEventReporter(reporter);
    SimTK::State state = pendulum.system.realizeTopology();
    pendulum.pin.setAngle(state, 2.5);
    SimTK::RungeKuttaMersonIntegrator integrator(pendulum.system);
    SimTK::TimeStepper stepper(pendulum.system, integrator);
    stepper.initialize(state);
    std::vector<Vec3> places;
    for (int i = 0; i <= 12; ++i) {
        stepper.stepTo(0.1 * i);
        places.push_back(pendulum.pin.getBodyTransform(stepper.getState()).p());
    }
    EXPECT_EQ(viz.getNumFrames(), 0);
    reporter->finish();
    EXPECT_GE(viz.getNumFrames(), 12);
    for (const Vec3& p : places) {
        const Vec3 pixel = viz.calcPixel(p);
        EXPECT_TRUE(pixel[0] > 0 && pixel[0] < 160 && pixel[1] > 0 && pixel[1] < 90) << pixel;
    }
    reporter->finish();
}

}  // namespace
}  // namespace simflex
