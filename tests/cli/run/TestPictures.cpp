/** @file
Pictures requested by a model. **/

#include <algorithm>
#include <filesystem>
#include <tuple>

#include "cli/run/RunTest.h"
#include "simflex/render/Image.h"

namespace simflex {
namespace {

using ::testing::HasSubstr;

class RunPicturesTest : public RunTest {
protected:
    bool isThere(const std::string& file) { return access((folder / file).c_str(), F_OK) == 0; }
};

TEST_F(RunPicturesTest, FramesShowTheMotionAtTheirOwnRate) {
    writeModel(makePendulum("1", R"(analyses: {run: {type: transient, duration: 0.5}}
pictures:
  size: [160, 120]
  rate: 10
  slow_motion: 2
  folder: shots
  video: run.gif
  shadows: false
  cameras: [{view: front}, {name: near, position: [1, 0, 3], look_at: [0, -0.5, 0], inset: [0.6, 0, 0.4, 0.4]}]
  plots: [{probes: [pivot], title: Angle}]
)"));
    ASSERT_EQ(runModel("--no-pictures"), 0) << err;
    EXPECT_FALSE(isThere("shots"));
    const std::string results = readWithoutSeconds("model.results.h5");
    ASSERT_EQ(runModel(), 0) << err;
    // 20 pictures for a simulated second, the last one at the end.
    const std::vector<std::string> files = testing::listFiles(folder / "shots");
    EXPECT_EQ(std::count_if(
                  files.begin(), files.end(),
                  [](const std::string& name) { return name.find(".png") != std::string::npos; }),
              11);
    EXPECT_EQ(testing::readText(folder / "run.gif").substr(0, 3), "GIF");
    EXPECT_THAT(out, HasSubstr("pictures: 11 in shots, run.gif\n"));
    // Pictures do not change the results.
    EXPECT_TRUE(results == readWithoutSeconds("model.results.h5"));
}

TEST_F(RunPicturesTest, ModesAreDrawnWhereAsked) {
    testing::writeText(folder / "bar.inp", testing::Brick().text());
    writeModel(R"(simflex: 1
parts: {bar: {deck: bar.inp, interfaces: {root: LEFT, tip: RIGHT}, modes: 14}}
bodies: {bar: {part: bar}}
joints: {wall: {type: weld, between: [ground, bar.root]}}
analyses: {modes: {type: eigen, count: 2, pictures: true}}
pictures: {size: [160, 120], folder: films, shadows: false, contour: displacement_y}
)");
    ASSERT_EQ(runModel(), 0) << err;
    EXPECT_EQ(testing::readText(folder / "films/modes_mode_1.gif").substr(0, 3), "GIF");
    EXPECT_TRUE(isThere("films/modes_mode_2.gif"));
    EXPECT_FALSE(isThere("films/modes_mode_3.gif"));
    EXPECT_THAT(out, HasSubstr("pictures: 2 modes, films/modes_mode_*.gif\n"));
}

TEST_F(RunPicturesTest, ThoseOfMotionTooFastToSeeAreWarnedOf) {
    writeModel(makePendulum("1", R"(analyses: {run: {type: transient, duration: 0.1}}
pictures: {size: [160, 120], slow_motion: 1e-6, shadows: false}
)"));
    ASSERT_EQ(runModel("-q"), 0) << err;
    EXPECT_THAT(err, HasSubstr("so there are only those of the start and the end"));
}

TEST_F(RunPicturesTest, ConnectorsAndLoadsAreDrawnUnlessHidden) {
    const auto draw = [&](const std::string& choice) {
        writeModel(makePendulum(
            "1",
            "connectors:\n"
            "  pull: {type: spring, between: [{on: ground, position: [1, 0, 0]}, rod], stiffness: "
            "20, damping: 1}\n"
            "  coil: {type: torsion_spring, between: [ground, rod], stiffness: 1}\n"
            "  floor: {type: stop, between: [{on: ground, position: [0, -1, 0], rotation: "
            "[-90*deg, 0, 0]}, rod], stiffness: 1e4}\n"
            "loads: {push: {on: rod, force: [0, 0, 5*t], torque: [0, 1, 0]}}\n"
            "analyses: {run: {type: transient, duration: 0.1}}\n"
            "pictures: {size: [320, 240], rate: 10, shadows: false, folder: shots, " +
                choice + "}\n"));
        EXPECT_EQ(runModel(), 0) << err;
        return Image::readPng(folder / "shots/frame_00001.png");
    };
    // Only loads are crimson.
    const auto countCrimson = [](const Image& image) {
        int count = 0;
        for (int y = 0; y < image.getHeight(); ++y)
            for (int x = 0; x < image.getWidth(); ++x) {
                const Image::Pixel p = image.getPixel(x, y);
                count += p[0] > 90 && p[0] > 2.5 * p[1] && p[0] > 1.8 * p[2] && p[2] > p[1];
            }
        return count;
    };
    const Image all = draw("joints: false"), noLoads = draw("loads: false"),
                noConnectors = draw("connectors: false"),
                none = draw("loads: false, connectors: false");
    EXPECT_GT(countCrimson(all), 50);
    EXPECT_GT(countCrimson(noConnectors), 50);
    EXPECT_EQ(countCrimson(noLoads), 0);
    EXPECT_FALSE(all == noConnectors);
    EXPECT_FALSE(noLoads == none);
}

TEST_F(RunPicturesTest, AFollowedFrameStaysInTheMiddleThoughItsBodyTurns) {
    // A black ball away from the body's own frame, on a rod that swings by half a turn.
    writeModel(R"(simflex: 1
gravity: [0, -9.81, 0]
bodies:
  rod: {mass: 2, inertia: [1/6, 0.001, 1/6], shape: {sphere: 0.04, position: [0, -0.4, 0]}, color: [0, 0, 0], mobilizer: {type: pin, parent: ground}}
frames: {ball: {on: rod, position: [0, -0.4, 0]}}
initial: {bodies: {rod: {coordinates: [1.5], rates: [3]}}}
analyses: {run: {type: transient, duration: 0.5}}
pictures: {size: [160, 120], rate: 10, shadows: false, axes: false, ground: none, folder: shots, cameras: [{view: front, follow: ball, height: 0.5}]}
)");
    ASSERT_EQ(runModel(), 0) << err;
    for (int frame = 0; frame <= 5; ++frame) {
        const Image image =
            Image::readPng(folder / ("shots/frame_0000" + std::to_string(frame) + ".png"));
        double count = 0, x = 0, y = 0;
        for (int row = 25; row < 95; ++row)
            for (int column = 45; column < 115; ++column)
                if (image.getPixel(column, row)[0] < 60) {
                    ++count;
                    x += column + 0.5;
                    y += row + 0.5;
                }
        ASSERT_GT(count, 100) << frame;
        EXPECT_NEAR(x / count, 80, 1) << frame;
        EXPECT_NEAR(y / count, 60, 1) << frame;
    }
}

TEST_F(RunPicturesTest, VideosThatCannotBeWrittenAreRefusedBeforeTheRun) {
    writeModel(makePendulum("1", R"(analyses: {run: {type: transient, duration: 0.1}}
pictures: {video: [run.gif, run.avi]}
)"));
    EXPECT_EQ(runModel("--check"), 1);
    EXPECT_THAT(err, ::testing::AllOf(HasSubstr("run.avi"), HasSubstr(".webp")));
    EXPECT_EQ(runModel(), 1);
    EXPECT_FALSE(isThere("model.results.h5"));
}

TEST_F(RunPicturesTest, ContoursThatAPartCannotShowAreRefusedBeforeTheRun) {
    testing::writeText(folder / "bar.inp", testing::Brick().text());
    writeModel(R"(simflex: 1
parts: {bar: {deck: bar.inp, interfaces: {root: LEFT, tip: RIGHT}, modes: 14}}
bodies: {bar: {part: bar}}
joints: {wall: {type: weld, between: [ground, bar.root]}}
analyses: {run: {type: transient, duration: 0.001}}
pictures: {contour: von_mises}
)");
    EXPECT_EQ(runModel(), 1);
    EXPECT_THAT(err, HasSubstr("model.yaml:6:"));
    EXPECT_THAT(err, HasSubstr("stress"));
    EXPECT_FALSE(isThere("model.results.h5"));
}

TEST_F(RunPicturesTest, FoldersAreCalledLikeTheModel) {
    testing::writeText(folder / "keep.txt", "");
    ASSERT_EQ(runProgram("mkdir", "frames"), 0);
    testing::writeText(folder / "frames/frame_00000.png", "another model's");
    writeModel(makePendulum("1", R"(analyses: {run: {type: transient, duration: 0.1}}
pictures: {size: [160, 120], rate: 10, shadows: false}
)"));
    ASSERT_EQ(runModel(), 0) << err;
    EXPECT_EQ(testing::listFiles(folder / "model.frames"),
              (std::vector<std::string>{"frame_00000.png", "frame_00001.png"}));
    EXPECT_EQ(testing::readText(folder / "frames/frame_00000.png"), "another model's");
}

TEST_F(RunPicturesTest, FoldersThatAreLinksAreRefused) {
    ASSERT_EQ(runProgram("mkdir", "others"), 0);
    testing::writeText(folder / "others/frame_99999.png", "another model's");
    for (const auto& [link, target, key] : {std::tuple("model.frames", "others", ""),
                                            std::tuple("way", ".", ", folder: way/others")}) {
        std::filesystem::create_directory_symlink(target, folder / link);
        writeModel(makePendulum("1", R"(analyses: {run: {type: transient, duration: 0.1}}
pictures: {size: [160, 120], rate: 10, shadows: false)" +
                                         std::string(key) + "}\n"));
        EXPECT_EQ(runModel(), 1);
        EXPECT_THAT(err, HasSubstr("'" + std::string(link) + "' is a link to '" + target + "'"));
        EXPECT_EQ(testing::listFiles(folder / "others"),
                  std::vector<std::string>{"frame_99999.png"});
        EXPECT_TRUE(isThere("model.results.h5"));
        std::filesystem::remove(folder / link);
    }
}

TEST_F(RunPicturesTest, InsetsLieOverAPictureThatStaysAsItIs) {
    const auto draw = [&](const std::string& cameras) {
        writeModel(makePendulum("1",
                                "analyses: {run: {type: transient, duration: 0.1}}\n"
                                "pictures: {size: [320, 240], rate: 10, shadows: false, "
                                "folder: shots, cameras: " +
                                    cameras + "}\n"));
        EXPECT_EQ(runModel(), 0) << err;
        return Image::readPng(folder / "shots/frame_00001.png");
    };
    const Image alone = draw("[{view: front}]");
    const std::string inset = "{view: top, inset: [0.7, 0, 0.3, 0.3]}";
    const Image both = draw("[{view: front}, " + inset + "]"),
                swapped = draw("[" + inset + ", {view: front}]");
    ASSERT_EQ(both.getWidth(), 320);
    int numOther = 0, numInInset = 0;
    for (int y = 0; y < 240; ++y)
        for (int x = 0; x < 320; ++x) {
            EXPECT_EQ(both.getPixel(x, y), swapped.getPixel(x, y));
            if (both.getPixel(x, y) == alone.getPixel(x, y)) continue;
            // A free line borders an inset.
            (x >= 223 && y <= 73 ? numInInset : numOther) += 1;
        }
    EXPECT_EQ(numOther, 0);
    EXPECT_GT(numInInset, 1000);
}

/** Returns a bar that sags under its weight by a few micrometres at most. **/
std::string makeSaggingBar(const std::string& pictures) {
    return R"(simflex: 1
gravity: [0, -9.81, 0]
parts: {bar: {deck: bar.inp, interfaces: {root: LEFT, tip: RIGHT}, modes: 14}}
bodies: {bar: {part: bar, damping: 0.1}}
joints: {wall: {type: weld, between: [ground, bar.root]}}
initial: {start: static}
solver: {accuracy: 1e-7}
analyses: {run: {type: transient, duration: 0.001}}
pictures: {size: [640, 360], rate: 1000, shadows: false, folder: shots, )" +
           pictures + "}\n";
}

TEST_F(RunPicturesTest, ColorBarStaysFreeOfInsets) {
    testing::writeText(folder / "bar.inp", testing::Brick().text());
    writeModel(makeSaggingBar("cameras: [{view: front}, {view: top, inset: [0.6, 0, 0.4, 0.5]}]"));
    ASSERT_EQ(runModel(), 0) << err;
    const Image image = Image::readPng(folder / "shots/frame_00001.png");
    // Both ends of the colour range, at the right edge below the inset.
    const Image::Pixel largest{253, 231, 37, 255}, least{68, 1, 84, 255};
    int numLargest = 0, numLeast = 0;
    for (int y = 181; y < 360; ++y)
        for (int x = 640 - 59; x < 640; ++x) {
            numLargest += image.getPixel(x, y) == largest;
            numLeast += image.getPixel(x, y) == least;
        }
    EXPECT_GE(numLargest, 6);
    EXPECT_GE(numLeast, 6);
}

TEST_F(RunPicturesTest, TinyDeformationsAreNotExaggeratedWithoutLimit) {
    testing::writeText(folder / "bar.inp", testing::Brick().text());
    writeModel(makeSaggingBar("exaggeration: auto"));
    ASSERT_EQ(runModel(), 0) << err;
    const std::string bytes = testing::readText(folder / "shots/frame_00001.png");
    writeModel(makeSaggingBar("exaggeration: 1000"));
    ASSERT_EQ(runModel(), 0) << err;
    EXPECT_TRUE(bytes == testing::readText(folder / "shots/frame_00001.png"));
}

TEST_F(RunPicturesTest, DisplacementsAreMeasuredFromTheJointUnlessAnotherFrameIsNamed) {
    testing::writeText(folder / "bar.inp", testing::Brick().text());
    const auto draw = [&](const std::string& reference) {
        writeModel(makeSaggingBar("exaggeration: 100" + reference));
        EXPECT_EQ(runModel(), 0) << err;
        return testing::readText(folder / "shots/frame_00001.png");
    };
    const std::string usual = draw("");
    EXPECT_FALSE(usual.empty());
    EXPECT_TRUE(draw(", relative_to: joints") == usual);
    EXPECT_TRUE(draw(", relative_to: bar.root") == usual);
    EXPECT_TRUE(draw(", relative_to: [bar.root]") == usual);
    const std::string ofTip = draw(", relative_to: bar.tip"), ofMean = draw(", relative_to: mean");
    EXPECT_FALSE(ofTip == usual);
    EXPECT_FALSE(ofMean == usual);
    EXPECT_FALSE(ofMean == ofTip);

    writeModel(makeSaggingBar("relative_to: ground"));
    EXPECT_NE(runModel(), 0);
    EXPECT_THAT(err, HasSubstr("pictures.relative_to: must be on a flexible body"));
    writeModel(makeSaggingBar("relative_to: [bar.root, bar.tip]"));
    EXPECT_NE(runModel(), 0);
    EXPECT_THAT(err, HasSubstr("is a second frame on one body; leave one of them out"));
}

TEST_F(RunPicturesTest, BodiesAreHiddenSeenThroughAndColoredAsAsked) {
    testing::writeText(folder / "bar.inp", testing::Brick().text());
    // The ball hangs in front of the bar's middle.
    const auto draw = [&](const std::string& choice) {
        std::string model = makeSaggingBar(
            "cameras: [{view: front}], ghost: false, axes: false, ground: none" + choice);
        const std::string bodies = "bodies: {";
        model.insert(model.find(bodies) + bodies.size(),
                     "ball: {mass: 1, inertia: [1, 1, 1], shape: {sphere: 0.02, position: [0.1, 0, "
                     "0.05]}, color: [1, 0, 0], mobilizer: {type: weld}}, ");
        writeModel(model);
        EXPECT_EQ(runModel(), 0) << err;
        return Image::readPng(folder / "shots/frame_00001.png");
    };
    const auto count = [](const Image& image, const auto& isMeant) {
        int number = 0;
        for (int y = 0; y < image.getHeight(); ++y)
            for (int x = 0; x < image.getWidth(); ++x) number += isMeant(image.getPixel(x, y));
        return number;
    };
    const auto isRed = [](const Image::Pixel& p) { return p[0] > 3 * p[1] && p[0] > 3 * p[2]; };
    const auto isBlue = [](const Image::Pixel& p) { return p[2] > 3 * p[1] && p[2] > 3 * p[0]; };
    // The upper end of the colour bar.
    const auto isLargest = [](const Image::Pixel& p) {
        return p == Image::Pixel{253, 231, 37, 255};
    };
    const Image usual = draw("");
    EXPECT_GT(count(usual, isRed), 100);
    EXPECT_EQ(count(usual, isBlue), 0);
    EXPECT_GE(count(usual, isLargest), 6);

    const Image withoutBall = draw(", bodies: {ball: {visible: false}}");
    EXPECT_EQ(count(withoutBall, isRed), 0);
    EXPECT_GE(count(withoutBall, isLargest), 6);
    const Image blueBar = draw(", bodies: {bar: {color: [0, 0, 1]}}");
    EXPECT_GT(count(blueBar, isBlue), 100);
    EXPECT_EQ(count(blueBar, isLargest), 0);
    const Image withoutBar = draw(", bodies: {bar: {visible: false}}");
    EXPECT_GT(count(withoutBar, isRed), 100);
    EXPECT_EQ(count(withoutBar, isLargest), 0);
    // The bar's blue shines through the ball.
    const Image behindGlass = draw(", bodies: {bar: {color: [0, 0, 1]}, ball: {opacity: 0.3}}");
    EXPECT_GT(count(behindGlass, isBlue), count(blueBar, isBlue) + 20);

    writeModel(makeSaggingBar("bodies: {baar: {visible: false}}"));
    EXPECT_NE(runModel(), 0);
    EXPECT_THAT(err,
                HasSubstr("pictures.bodies.baar: there is no body 'baar'; did you mean 'bar'"));
}

/** The stick leads from the pin in the middle of the picture to the mass centre half a metre
below. **/
TEST_F(RunPicturesTest, BodiesWithoutAShapeAreSticksToTheirJoints) {
    writeModel(makePendulum("0", R"(analyses: {rest: {type: static}}
pictures:
  size: [200, 200]
  folder: shots
  shadows: false
  joints: false
  axes: false
  ground: none
  cameras: [{position: [0, 0, 4], look_at: [0, 0, 0], perspective: 30*deg}]
)"));
    ASSERT_EQ(runModel(), 0) << err;
    const Image with = Image::readPng(folder / "shots/rest.png");
    ASSERT_EQ(runModel("--set pictures.bodies='{rod: {visible: false}}'"), 0) << err;
    const Image without = Image::readPng(folder / "shots/rest.png");
    int left = 200, right = -1, top = 200, bottom = -1;
    for (int y = 0; y < 200; ++y)
        for (int x = 0; x < 200; ++x) {
            const auto a = with.getPixel(x, y), b = without.getPixel(x, y);
            if (a[0] == b[0] && a[1] == b[1] && a[2] == b[2]) continue;
            left = std::min(left, x);
            right = std::max(right, x);
            top = std::min(top, y);
            bottom = std::max(bottom, y);
        }
    // 200 pixels are 2·4 m·tan 15°; the ball has a radius of 25 mm.
    const double metre = 200 / (8 * std::tan(SimTK::Pi / 12));
    EXPECT_NEAR(top, 100, 2);
    EXPECT_NEAR(bottom, 100 + 0.525 * metre, 2);
    EXPECT_NEAR(left, 100 - 0.025 * metre, 2);
    EXPECT_NEAR(right, 100 + 0.025 * metre, 2);
}

TEST_F(RunPicturesTest, ArrowsOfReactionsEndWhenAnEventReleasesTheJoint) {
    testing::writeText(folder / "bar.inp", testing::Brick().text());
    const auto countOrange = [&](const char* frame) {
        const Image image =
            Image::readPng(folder / (std::string("shots/frame_0000") + frame + ".png"));
        int number = 0;
        for (int y = 0; y < image.getHeight(); ++y)
            for (int x = 100; x < image.getWidth(); ++x) {  // without the small axes
                const Image::Pixel p = image.getPixel(x, y);
                number += p[0] > 150 && p[0] > 2 * p[2] && p[1] > 50 && p[1] < 140;
            }
        return number;
    };
    const std::string model = makeSaggingBar("contour: none, ghost: false, reactions: true");
    writeModel(model);
    ASSERT_EQ(runModel(), 0) << err;
    EXPECT_GT(countOrange("0"), 200);
    EXPECT_GT(countOrange("1"), 200);
    writeModel(model + "events: {drop: {when: t > 0.0005, do: [{release: wall}]}}\n");
    ASSERT_EQ(runModel(), 0) << err;
    EXPECT_GT(countOrange("0"), 200);
    EXPECT_LT(countOrange("1"), 10);
}

/** A flexible body without a contour has its own colour. **/
TEST_F(RunPicturesTest, FlexibleBodiesHaveTheirColorWithoutContour) {
    testing::writeText(folder / "bar.inp", testing::Brick().text());
    std::string model = makeSaggingBar("contour: none, ghost: false, ground: none");
    model.replace(model.find("damping: 0.1"), 12, "color: [0, 0, 1]");
    writeModel(model);
    ASSERT_EQ(runModel(), 0) << err;
    const Image image = Image::readPng(folder / "shots/frame_00001.png");
    int numBlue = 0;
    for (int y = 0; y < image.getHeight(); ++y)
        for (int x = 0; x < image.getWidth(); ++x) {
            const Image::Pixel p = image.getPixel(x, y);
            numBlue += p[2] > 3 * p[1] && p[2] > 3 * p[0];
        }
    EXPECT_GT(numBlue, 100);
}

}  // namespace
}  // namespace simflex
