/** @file
Pictures that a model asks for. **/

#include <algorithm>

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
    const std::string results = testing::readText(folder / "model.results.h5");
    ASSERT_EQ(runModel(), 0) << err;
    // 20 pictures for a simulated second, the last one at the end.
    const std::vector<std::string> files = testing::listFiles(folder / "shots");
    EXPECT_EQ(std::count_if(
                  files.begin(), files.end(),
                  [](const std::string& name) { return name.find(".png") != std::string::npos; }),
              11);
    EXPECT_EQ(testing::readText(folder / "run.gif").substr(0, 3), "GIF");
    // Pictures change nothing in the results.
    EXPECT_TRUE(results == testing::readText(folder / "model.results.h5"));
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

}  // namespace
}  // namespace simflex
