#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <condition_variable>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <mutex>
#include <sstream>
#include <thread>

#include "TestParts.h"
#include "simflex/render/ContactSheet.h"
#include "simflex/render/FrameReporter.h"
#include "simflex/render/OffscreenVisualizer.h"
#include "support/Await.h"
#include "support/HeapUse.h"
#include "support/TestFolder.h"

extern char** environ;

namespace simflex {
namespace {

using namespace test;
using SimTK::Transform;
using SimTK::Vec3;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;
namespace fs = std::filesystem;

/** A brick that rotates about its edge and bends more and more. **/
struct BendingBrick {
    SimTK::MultibodySystem system;
    SimTK::SimbodyMatterSubsystem matter{system};
    SimTK::MobilizedBody::Pin pin;
    SimTK::State initial;

    BendingBrick() {
        matter.setShowDefaultGeometry(false);
        SimTK::Body::Rigid body(SimTK::MassProperties(1, Vec3(0), SimTK::UnitInertia(1)));
        body.addDecoration(Transform(), SimTK::DecorativeSphere(0.1));
        pin = SimTK::MobilizedBody::Pin(matter.Ground(), Transform(), body, Transform());
        initial = system.realizeTopology();
    }

    OffscreenVisualizer makeVisualizer(int width = 96, int height = 54) const {
        OffscreenVisualizer viz(system, width, height);
        DeformableMesh mesh;
        mesh.part = makeBrickPart(Vec3(1, 0.1, 0.1), 8, 2, 2);
        mesh.getFramePose = [this](const SimTK::State& state) {
            return pin.getBodyTransform(state);
        };
        mesh.getModalCoordinates = [](const SimTK::State& state) {
            return SimTK::Vector(Vec3(0, 0, 0.02 * state.getTime()));
        };
        // Camera and ground do not adapt to the scene.
        viz.addDeformableMesh(mesh).setShowShadows(false).setGroundHeight(-0.5);
        viz.setCameraTransform(Transform(Vec3(0, 0.2, 3)));
        return viz;
    }

    SimTK::State makeState(int i) const {
        SimTK::State state = initial;
        state.setTime(0.1 * i);
        state.updQ()[0] = 0.05 * i;
        return state;
    }
    std::vector<SimTK::State> makeStates(int count) const {
        std::vector<SimTK::State> states;
        for (int i = 0; i < count; ++i) states.push_back(makeState(i));
        return states;
    }
};

std::string readFile(const std::string& path) {
    std::ostringstream text;
    text << std::ifstream(path, std::ios::binary).rdbuf();
    return text.str();
}

class FrameOutput : public ::testing::Test {
protected:
    /** When another test starts this test in a separate process, it writes to that test's
    folder. **/
    FrameOutput() : isStartedByTest(std::getenv("SIMFLEX_TEST_FOLDER")) {
        if (isStartedByTest) folder = std::getenv("SIMFLEX_TEST_FOLDER");
    }

    std::string makeName(int number) const {
        char name[32];
        std::snprintf(name, sizeof name, "/frame_%05d.png", number);
        return folder + name;
    }
    int countFiles() const {
        if (!fs::exists(folder)) return 0;
        return int(std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
    }
    std::vector<std::string> readFrames() const {
        std::vector<std::string> frames;
        for (int i = 0; fs::exists(makeName(i)); ++i) frames.push_back(readFile(makeName(i)));
        return frames;
    }
    /** Changes whenever a file is rewritten. **/
    std::pair<ino_t, time_t> identify(int number) const {
        struct stat info {};
        stat(makeName(number).c_str(), &info);
        return {info.st_ino, info.st_ctim.tv_nsec};
    }

    const bool isStartedByTest;
    const testing::TestFolder scratch;
    std::string folder = scratch / "frames";
    BendingBrick model;
};

TEST_F(FrameOutput, BytesAreTheSameForAnyNumberOfThreads) {
    std::vector<std::string> expected;
    for (const int numThreads : {0, 1, 2, 5}) {
        // The range grows from frame to frame.
        OffscreenVisualizer viz = model.makeVisualizer();
        viz.setOutputFolder(folder).setNumThreads(numThreads).setDeformationFactor(1);
        double lastHigh = 0;
        for (int i = 0; i < 12; ++i) {
            viz.report(model.makeState(i));
            if (i == 5) lastHigh = viz.getContourRange()[1];
        }
        viz.finish();
        EXPECT_GT(viz.getContourRange()[1], lastHigh);
        const std::vector<std::string> frames = readFrames();
        ASSERT_EQ(frames.size(), 12u);
        EXPECT_EQ(countFiles(), 12);
        if (expected.empty()) expected = frames;
        EXPECT_TRUE(frames == expected) << numThreads << " threads";
    }
}

TEST_F(FrameOutput, DrawFrameStandsInLineWithReportedFrames) {
    std::vector<Image> images;
    for (const int numThreads : {0, 3}) {
        OffscreenVisualizer viz = model.makeVisualizer();
        viz.setOutputFolder(folder).setNumThreads(numThreads);
        for (int i = 0; i < 6; ++i) viz.report(model.makeState(i));
        images.push_back(viz.drawFrame(model.makeState(2)));
        viz.finish();
    }
    EXPECT_TRUE(images[0] == images[1]);
}

TEST_F(FrameOutput, SinkTakesEveryFrameInOrder) {
    OffscreenVisualizer viz = model.makeVisualizer();
    std::vector<int> numbers;
    std::vector<Image> images;
    viz.setOutputFolder("").setNumThreads(4);
    viz.setFrameSink([&](int number, const Image& image) {
        numbers.push_back(number);
        images.push_back(image);
    });
    for (int i = 0; i < 30; ++i) viz.report(model.makeState(i));
    viz.finish();
    ASSERT_EQ(numbers.size(), 30u);
    for (int i = 0; i < 30; ++i) EXPECT_EQ(numbers[size_t(i)], i);
    EXPECT_EQ(viz.getNumFrames(), 30);
    EXPECT_FALSE(fs::exists("frame_00000.png"));

    OffscreenVisualizer same = model.makeVisualizer();
    for (int i = 0; i < 30; ++i)
        EXPECT_TRUE(same.drawFrame(model.makeState(i)) == images[size_t(i)]) << i;
}

TEST_F(FrameOutput, ReportReturnsBeforeTheFrameIsDrawnButTheQueueIsBounded) {
    std::mutex mutex;
    std::condition_variable changed;
    bool isReleased = false;
    std::atomic<int> numReported{0};

    OffscreenVisualizer viz = model.makeVisualizer();
    viz.setOutputFolder("").setNumThreads(2);
    viz.setFrameSink([&](int, const Image&) {
        std::unique_lock<std::mutex> lock(mutex);
        changed.wait(lock, [&] { return isReleased; });
    });
    std::thread caller([&] {
        for (int i = 0; i < 40; ++i) {
            viz.report(model.makeState(i));
            ++numReported;
        }
    });
    // Holds although no frame is delivered.
    testing::await("4 reports", [&] { return numReported >= 4; });
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    EXPECT_LE(numReported, 2 + 2 * 2) << "two in work, two per thread waiting";
    {
        const std::lock_guard<std::mutex> lock(mutex);
        isReleased = true;
    }
    changed.notify_all();
    caller.join();
    EXPECT_EQ(viz.getNumFrames(), 40);
}

TEST_F(FrameOutput, ErrorReachesTheCallerAndFramesBeforeItStay) {
    for (const int numThreads : {0, 1, 3}) {
        OffscreenVisualizer viz = model.makeVisualizer();
        viz.setOutputFolder(folder).setNumThreads(numThreads);
        bool isBroken = true;
        viz.setFrameSink([&](int number, const Image&) {
            if (number == 5 && isBroken) throw std::runtime_error("the sink is blocked");
        });
        EXPECT_THAT(
            [&] {
                for (int i = 0; i < 20; ++i) viz.report(model.makeState(i));
                viz.finish();
            },
            ThrowsMessage<std::runtime_error>(
                AllOf(HasSubstr("frame 5"), HasSubstr("frame_00005.png"), HasSubstr("0.5 s"),
                      HasSubstr("the sink is blocked"))));
        EXPECT_EQ(readFrames().size(), 5u);
        EXPECT_EQ(countFiles(), 5);

        // After the repair, numbering continues.
        isBroken = false;
        for (int i = 5; i < 8; ++i) viz.report(model.makeState(i));
        viz.finish();
        EXPECT_EQ(readFrames().size(), 8u);
        EXPECT_EQ(countFiles(), 8);
    }
}

TEST_F(FrameOutput, RangeOfTheRunForgetsFramesThatWereNotDrawn) {
    std::vector<Image> images;
    for (const bool fails : {false, true}) {
        OffscreenVisualizer viz = model.makeVisualizer();
        viz.setOutputFolder("").setNumThreads(3);
        bool isBroken = fails;
        viz.setFrameSink([&](int number, const Image& image) {
            if (isBroken && number == 2) throw std::runtime_error("no");
            if (number == 3) images.push_back(image);
        });
        viz.report(model.makeState(0));
        viz.report(model.makeState(1));
        if (fails) {
            EXPECT_THROW(
                {
                    for (int i = 0; i < 4; ++i) viz.report(model.makeState(1000));
                    viz.finish();
                },
                std::runtime_error);
            isBroken = false;
        }
        for (int i = 2; i < 4; ++i) viz.report(model.makeState(i));
        viz.finish();
    }
    ASSERT_EQ(images.size(), 2u);
    EXPECT_TRUE(images[0] == images[1]);
}

TEST_F(FrameOutput, FolderRemovedInMidRunIsNamed) {
    OffscreenVisualizer viz = model.makeVisualizer();
    viz.setOutputFolder(folder);
    for (int i = 0; i < 3; ++i) viz.report(model.makeState(i));
    EXPECT_EQ(viz.getNumFrames(), 3);
    fs::remove_all(folder);
    viz.report(model.makeState(3));
    EXPECT_THAT([&] { viz.finish(); },
                ThrowsMessage<std::runtime_error>(
                    AllOf(HasSubstr("frame_00003.png"), HasSubstr("No such file"))));
    EXPECT_EQ(viz.getNumFrames(), 3);
}

// Simulates a full disk: no file may grow beyond a few bytes.
TEST_F(FrameOutput, DiskThatIsFullIsAnErrorAndFinishedFramesStay) {
    OffscreenVisualizer viz = model.makeVisualizer();
    viz.setOutputFolder(folder).setNumThreads(2);
    for (int i = 0; i < 3; ++i) viz.report(model.makeState(i));
    EXPECT_EQ(viz.getNumFrames(), 3);

    rlimit before;
    getrlimit(RLIMIT_FSIZE, &before);
    const auto oldHandler = signal(SIGXFSZ, SIG_IGN);
    rlimit small = before;
    small.rlim_cur = 512;
    setrlimit(RLIMIT_FSIZE, &small);
    std::string message = "no error";
    try {
        for (int i = 3; i < 12; ++i) viz.report(model.makeState(i));
        viz.finish();
    } catch (const std::runtime_error& error) {
        message = error.what();
    }
    setrlimit(RLIMIT_FSIZE, &before);
    signal(SIGXFSZ, oldHandler);
    EXPECT_THAT(message, AllOf(HasSubstr("frame 3"), HasSubstr("frame_00003.png"),
                               HasSubstr("File too large")));
    EXPECT_EQ(countFiles(), 3);
    for (int i = 0; i < 3; ++i) EXPECT_EQ(Image::readPng(makeName(i)).getWidth(), 96);

    for (int i = 3; i < 6; ++i) viz.report(model.makeState(i));
    viz.finish();
    EXPECT_EQ(readFrames().size(), 6u);
}

TEST_F(FrameOutput, UnwritableFolderIsNamedAtOnce) {
    OffscreenVisualizer viz = model.makeVisualizer();
    viz.setOutputFolder("/proc/no/such/folder");
    EXPECT_THAT([&] { viz.report(model.makeState(0)); },
                ThrowsMessage<std::runtime_error>(HasSubstr("/proc/no/such/folder")));
    EXPECT_EQ(viz.getNumFrames(), 0);
}

TEST_F(FrameOutput, LastCopyCompletesAllFrames) {
    {
        OffscreenVisualizer viz = model.makeVisualizer();
        viz.setOutputFolder(folder);
        for (int i = 0; i < 9; ++i) viz.report(model.makeState(i));
    }
    EXPECT_EQ(readFrames().size(), 9u);
}

TEST_F(FrameOutput, NoFramesLeaveNothing) {
    {
        OffscreenVisualizer viz = model.makeVisualizer();
        viz.setOutputFolder(folder);
        EXPECT_EQ(viz.reportAll({}), 0);
        viz.finish();
        EXPECT_EQ(viz.getNumFrames(), 0);
    }
    EXPECT_FALSE(fs::exists(folder));
}

TEST_F(FrameOutput, VideoGrowsWithTheFramesAndNeedsNoFiles) {
    if (!isVideoAvailable()) GTEST_SKIP() << "no ffmpeg";
    fs::create_directories(folder);
    OffscreenVisualizer viz = model.makeVisualizer();
    viz.setOutputFolder("").addVideo(folder + "/a.gif", {20}).addVideo(folder + "/b.mp4");
    EXPECT_THROW(viz.addVideo(folder + "/c.avi"), std::invalid_argument);
    for (int i = 0; i < 7; ++i) viz.report(model.makeState(i));
    viz.finish();
    EXPECT_EQ(countFiles(), 2);
    const std::string gif = readFile(folder + "/a.gif");
    int count = 0;
    for (size_t at = 0; (at = gif.find("\x21\xF9\x04", at)) != std::string::npos; ++at) ++count;
    EXPECT_EQ(count, 7);
}

TEST_F(FrameOutput, VideoOfAFolderWaitsForItsFrames) {
    if (!isVideoAvailable()) GTEST_SKIP() << "no ffmpeg";
    OffscreenVisualizer viz = model.makeVisualizer();
    viz.setOutputFolder(folder);
    for (int i = 0; i < 9; ++i) viz.report(model.makeState(i));
    ASSERT_TRUE(writeVideo(folder + "/.", folder + "/v.gif", 20));
    const std::string gif = readFile(folder + "/v.gif");
    int count = 0;
    for (size_t at = 0; (at = gif.find("\x21\xF9\x04", at)) != std::string::npos; ++at) ++count;
    EXPECT_EQ(count, 9);

    for (int i = 9; i < 15; ++i) viz.report(model.makeState(i));
    EXPECT_NO_THROW(makeContactSheet(std::vector<std::string>{makeName(14)}, 1));
}

TEST_F(FrameOutput, ReportAllTellsOfProgressAndStopsWhenTold) {
    const std::vector<SimTK::State> states = model.makeStates(20);
    OffscreenVisualizer viz = model.makeVisualizer();
    viz.setOutputFolder(folder).setNumThreads(2);
    std::vector<int> told;
    EXPECT_EQ(viz.reportAll(states,
                            [&](int done, int total) {
                                EXPECT_EQ(total, 20);
                                told.push_back(done);
                                return true;
                            }),
              20);
    EXPECT_TRUE(std::is_sorted(told.begin(), told.end()));
    EXPECT_EQ(told.front(), 0);
    EXPECT_EQ(told.back(), 20);
    EXPECT_EQ(readFrames().size(), 20u);

    const int reported = viz.reportAll(states, [](int done, int) { return done < 4; });
    EXPECT_GE(reported, 4);
    EXPECT_LT(reported, 20);
    EXPECT_EQ(int(readFrames().size()), 20 + reported);
    EXPECT_EQ(viz.getNumFrames(), 20 + reported);
}

TEST_F(FrameOutput, ResumingDrawsOnlyWhatIsMissing) {
    const std::vector<SimTK::State> states = model.makeStates(10);
    const auto run = [&](int numThreads) {
        OffscreenVisualizer viz = model.makeVisualizer();
        viz.setOutputFolder(folder).setNumThreads(numThreads).setOldFrames(OldFrames::Resume);
        viz.fitToMotion(states).reportAll(states);
    };
    run(2);
    const std::vector<std::string> expected = readFrames();
    ASSERT_EQ(expected.size(), 10u);

    for (int i = 7; i < 10; ++i) fs::remove(makeName(i));
    fs::resize_file(makeName(4), fs::file_size(makeName(4)) / 2);
    std::ofstream(makeName(5)) << "no picture";
    Image(96, 54).writePng(makeName(6));
    std::ofstream(folder + "/frame_00007.png.part-999999999") << "of a process that was killed";
    std::vector<std::pair<ino_t, time_t>> before;
    for (int i = 0; i < 10; ++i) before.push_back(identify(i));
    run(3);
    EXPECT_TRUE(readFrames() == expected);
    EXPECT_EQ(countFiles(), 10);
    for (int i = 0; i < 10; ++i) EXPECT_EQ(identify(i) == before[size_t(i)], i < 4) << i;
}

TEST_F(FrameOutput, DamagedFrameIsDrawnAgainWhereItIsWanted) {
    const std::vector<SimTK::State> states = model.makeStates(4);
    const auto run = [&] {
        OffscreenVisualizer viz = model.makeVisualizer();
        int numSeen = 0;
        viz.setOutputFolder(folder).setOldFrames(OldFrames::Resume);
        viz.setFrameSink([&](int, const Image&) { ++numSeen; });
        viz.fitToMotion(states).reportAll(states);
        EXPECT_EQ(numSeen, 4);
    };
    run();
    const std::vector<std::string> expected = readFrames();
    std::string bytes = expected[2];
    bytes[bytes.size() / 2] = char(bytes[bytes.size() / 2] ^ 8);
    std::ofstream(makeName(2), std::ios::binary) << bytes;
    run();
    EXPECT_TRUE(readFrames() == expected);
}

TEST_F(FrameOutput, ResumingAnotherRunDrawsEveryFrameThatDiffers) {
    std::vector<SimTK::State> states = model.makeStates(6);
    const auto run = [&](const std::string& title) {
        OffscreenVisualizer viz = model.makeVisualizer();
        viz.setOutputFolder(folder).setOldFrames(OldFrames::Resume).setWindowTitle(title);
        viz.setContourRange(0, 1).setDeformationFactor(1);
        viz.reportAll(states);
    };
    run("first");
    std::vector<std::pair<ino_t, time_t>> before;
    for (int i = 0; i < 6; ++i) before.push_back(identify(i));
    states[3].updQ()[0] = 1;
    run("first");
    for (int i = 0; i < 6; ++i) EXPECT_EQ(identify(i) == before[size_t(i)], i != 3) << i;
    run("second");
    for (int i = 0; i < 6; ++i) EXPECT_FALSE(identify(i) == before[size_t(i)]) << i;

    states.resize(4);
    run("second");
    EXPECT_EQ(countFiles(), 4) << "frames beyond the end are not of this run";
}

TEST_F(FrameOutput, ResumingWithAnotherSettingDrawsEveryFrame) {
    using Viz = OffscreenVisualizer;
    const std::function<void(Viz&)> settings[] = {
        [](Viz& viz) { viz.setDeformationFactor(20); },
        [](Viz& viz) { viz.setContour(Viz::Contour::None); },
        [](Viz& viz) { viz.setContourRange(0, 2); },
        [](Viz& viz) { viz.setColorMap(ColorMap::Viridis); },
        [](Viz& viz) { viz.setShowUndeformed(false); },
        [](Viz& viz) { viz.setShowElementEdges(true); },
        [](Viz& viz) { viz.setShowFeatureEdges(false); },
        [](Viz& viz) { viz.setShowColorBar(false); },
        [](Viz& viz) { viz.setTheme(Viz::Theme::Dark); },
        [](Viz& viz) { viz.setLighting(Viz::Lighting::Flat); },
        [](Viz& viz) { viz.setLightDirection(Vec3(0, 1, 0)); },
        [](Viz& viz) { viz.setBackgroundType(SimTK::Visualizer::SolidColor); },
        [](Viz& viz) { viz.setGroundHeight(-0.6); },
        [](Viz& viz) { viz.setShowShadows(true); },
        [](Viz& viz) { viz.setShowAmbientOcclusion(true); },
        [](Viz& viz) { viz.setTransparentBackground(true); },
        [](Viz& viz) { viz.setShowAxes(false); },
        [](Viz& viz) { viz.setShowScaleBar(true); },
        [](Viz& viz) { viz.setShowSimTime(false); },
        [](Viz& viz) { viz.setShowFrameNumber(true); },
        [](Viz& viz) { viz.setCameraTransform(Transform(Vec3(0, 0.3, 3))); },
        [](Viz& viz) { viz.setCameraFieldOfView(0.6); },
        [](Viz& viz) { viz.setCameraClippingPlanes(0.2, 7); },
        [](Viz& viz) { viz.setCameraProjection(CameraView::Projection::Orthographic); },
    };
    int number = 0;
    for (const auto& change : settings) {
        const std::string own = scratch / ("setting" + std::to_string(number));
        const auto run = [&](bool isChanged) {
            OffscreenVisualizer viz = model.makeVisualizer();
            viz.setOutputFolder(own).setOldFrames(OldFrames::Resume);
            viz.setContourRange(0, 1).setDeformationFactor(1).setShowDeformationFactor(false);
            if (isChanged) change(viz);
            viz.reportAll({model.makeState(1)});
            struct stat info {};
            stat((own + "/frame_00000.png").c_str(), &info);
            return std::make_pair(info.st_ino, info.st_ctim.tv_nsec);
        };
        const auto first = run(false);
        EXPECT_TRUE(run(false) == first) << number;
        EXPECT_FALSE(run(true) == first) << "setting " << number;
        ++number;
    }
}

TEST_F(FrameOutput, ResumedFramesReachSinksAndVideos) {
    const std::vector<SimTK::State> states = model.makeStates(5);
    for (int run = 0; run < 2; ++run) {
        OffscreenVisualizer viz = model.makeVisualizer();
        viz.setOutputFolder(folder).setOldFrames(OldFrames::Resume).fitToMotion(states);
        int count = 0;
        viz.setFrameSink([&](int number, const Image& image) {
            EXPECT_TRUE(image == Image::readPng(makeName(number)));
            ++count;
        });
        viz.reportAll(states);
        EXPECT_EQ(count, 5);
    }
}

TEST_F(FrameOutput, PlotsMakeTheFrameLarger) {
    OffscreenVisualizer viz = model.makeVisualizer(320, 180);
    const SimTK::State state = model.makeState(3);
    const Image alone = viz.drawFrame(state);
    ProbePlot plot("Angle");
    const int curve = plot.addCurve("q", {0, 1, 2}, {0, 1, 0});
    EXPECT_EQ(viz.addPlot(plot, PlotSide::Below, 100), 0);
    EXPECT_EQ(viz.addPlot(plot, PlotSide::Right), 1);
    const Image both = viz.drawFrame(state);
    EXPECT_EQ(both.getWidth(), 320 + 134);
    EXPECT_EQ(both.getHeight(), 180 + 100);
    EXPECT_TRUE(both.cropped(0, 0, 320, 180) == alone);
    EXPECT_TRUE(both.cropped(0, 180, 320, 100) == plot.draw(320, 100, 0.3, 0.25));
    EXPECT_TRUE(both.cropped(320, 0, 134, 280) == plot.draw(134, 280, 0.3, 0.25));

    viz.updPlot(0).append(curve, 3, 2);
    EXPECT_FALSE(viz.drawFrame(state) == both);
    viz.setTheme(OffscreenVisualizer::Theme::Dark);
    EXPECT_EQ(viz.drawFrame(state).getPixel(3, 278), PlotTheme::dark().background);
    EXPECT_THROW(viz.updPlot(2), std::out_of_range);
    EXPECT_THROW(viz.addPlot(plot, PlotSide::Below, -1), std::invalid_argument);
}

TEST_F(FrameOutput, GrowingPlotShowsWhatItHeldWhenTheFrameWasReported) {
    std::vector<std::vector<Image>> images(2);
    for (const int numThreads : {0, 3}) {
        OffscreenVisualizer viz = model.makeVisualizer();
        viz.setOutputFolder("").setNumThreads(numThreads);
        const int plot = viz.addPlot(ProbePlot("Time"), PlotSide::Below, 90);
        const int curve = viz.updPlot(plot).addCurve("t");
        viz.setFrameSink([&](int, const Image& image) { images[numThreads > 0].push_back(image); });
        for (int i = 0; i < 8; ++i) {
            viz.updPlot(plot).append(curve, 0.1 * i, i * i);
            viz.report(model.makeState(i));
        }
        viz.finish();
    }
    ASSERT_EQ(images[1].size(), 8u);
    for (size_t i = 0; i < 8; ++i) EXPECT_TRUE(images[0][i] == images[1][i]) << i;
    EXPECT_FALSE(images[0][3].cropped(0, 54, 96, 90) == images[0][7].cropped(0, 54, 96, 90));
}

TEST_F(FrameOutput, WrongNumbersOfThreadsAreRefused) {
    OffscreenVisualizer viz = model.makeVisualizer();
    EXPECT_THROW(viz.setNumThreads(-1), std::invalid_argument);
    EXPECT_THROW(viz.setNumThreads(100000), std::invalid_argument);
    EXPECT_GE(viz.getNumThreads(), 1);
    EXPECT_EQ(viz.setNumThreads(16).getNumThreads(), 16);
}

// FramesOfAKilledProcessAreComplete also runs this test in a separate process, which it kills.
TEST_F(FrameOutput, RunOfManyFramesCompletesAllOfThem) {
    const int numFrames = isStartedByTest ? 400 : 40;
    OffscreenVisualizer viz = model.makeVisualizer();
    const std::vector<SimTK::State> states = model.makeStates(numFrames);
    viz.setOutputFolder(folder).setOldFrames(OldFrames::Resume).fitToMotion(states);
    viz.reportAll(states);
    EXPECT_EQ(viz.getNumFrames(), numFrames);
}

TEST_F(FrameOutput, FramesOfAKilledProcessAreCompleteAndTheRunCanBeResumed) {
    setenv("SIMFLEX_TEST_FOLDER", folder.c_str(), 1);
    const std::string program = fs::read_symlink("/proc/self/exe").string();
    char filter[] = "--gtest_filter=FrameOutput.RunOfManyFramesCompletesAllOfThem",
         quiet[] = "--gtest_brief=1";
    char* arguments[] = {const_cast<char*>(program.c_str()), filter, quiet, nullptr};
    pid_t child = 0;
    ASSERT_EQ(posix_spawn(&child, program.c_str(), nullptr, nullptr, arguments, environ), 0);
    EXPECT_TRUE(testing::await("12 frames",
                               [&] { return countFiles() >= 12 || testing::hasEnded(child); }));
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
    unsetenv("SIMFLEX_TEST_FOLDER");

    const int numComplete = int(readFrames().size());
    EXPECT_GE(numComplete, 10);
    for (const auto& entry : fs::directory_iterator(folder))
        if (entry.path().extension() == ".png") {
            EXPECT_EQ(Image::readPng(entry.path().string()).getWidth(), 96);
        }
    const auto first = identify(0), last = identify(numComplete - 1);

    const std::vector<SimTK::State> states = model.makeStates(400);
    OffscreenVisualizer viz = model.makeVisualizer();
    viz.setOutputFolder(folder).setOldFrames(OldFrames::Resume).fitToMotion(states);
    viz.reportAll(states, [&](int done, int) { return done < numComplete + 5; });
    EXPECT_TRUE(identify(0) == first);
    EXPECT_TRUE(identify(numComplete - 1) == last);
    EXPECT_GT(int(readFrames().size()), numComplete + 4);
    for (const auto& entry : fs::directory_iterator(folder))
        EXPECT_EQ(entry.path().extension(), ".png");
}

TEST_F(FrameOutput, MemoryDoesNotGrowWithFrames) {
    OffscreenVisualizer viz = model.makeVisualizer();
    viz.setOutputFolder(folder).setNumThreads(2).fitToMotion(model.makeStates(3));
    for (int i = 0; i < 100; ++i) viz.report(model.makeState(i % 10));
    viz.finish();
    const size_t before = testing::getHeapUse();
    for (int i = 0; i < 300; ++i) viz.report(model.makeState(i % 10));
    viz.finish();
    // 300 pictures of 96×54 would be 6 MB, their files 1 MB.
    EXPECT_LT(testing::getHeapUse(), before + 100000);
}

}  // namespace
}  // namespace simflex
