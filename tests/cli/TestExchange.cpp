/** @file
Files for other programs, and pictures, written by the simflex program. **/

#include <gmock/gmock.h>
#include <signal.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "cli/CliTest.h"
#include "simflex/part/ReducedBodyFile.h"
#include "simflex/render/Image.h"
#include "support/VtuReader.h"

namespace simflex {
namespace {

using ::testing::AllOf;
using ::testing::ContainsRegex;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

/** Returns the hue of a saturated colour [degrees]: red 0, green 120, blue 240; -1 for a pale
one. **/
double calcHue(const Image::Pixel& pixel) {
    const double r = pixel[0], g = pixel[1], b = pixel[2];
    const double most = std::max({r, g, b}), chroma = most - std::min({r, g, b});
    if (chroma < 0.4 * most || most < 80) return -1;
    if (most == r) return std::fmod(60 * (g - b) / chroma + 360, 360);
    return most == g ? 60 * (b - r) / chroma + 120 : 60 * (r - g) / chroma + 240;
}

class ExchangeTest : public CliTest {
protected:
    void SetUp() override {
        testing::Brick brick;
        brick.nu = 0;  // uniform strain under tension, for any ties of the ends
        testing::writeText(folder / "brick.inp", brick.text());
        ASSERT_EQ(run("reduce -q brick.inp -i left=LEFT -i right=RIGHT -m 20 -o part.h5"), 0)
            << err;
    }
};

TEST_F(ExchangeTest, ExportWritesTheMeshInTheDecksCoordinatesWithEveryMode) {
    ASSERT_EQ(run("export part.h5 -o part.vtu"), 0) << err;
    EXPECT_THAT(out, HasSubstr("part: 14 modes"));
    const ReducedBody part = readReducedBody(folder / "part.h5");
    const test::VtuContent found = test::readVtu(folder / "part.vtu");
    EXPECT_EQ(found.numPoints, part.mesh.numNodes());
    EXPECT_EQ(found.numCells, 32);
    const std::vector<double>& x = found["Points"].values;
    double last = 0;
    for (size_t i = 0; i < x.size(); i += 3) last = std::max(last, x[i]);
    EXPECT_NEAR(last, 0.2, 1e-12);
    EXPECT_NEAR(*std::min_element(x.begin(), x.end()), -0.015, 1e-12);
    EXPECT_EQ(std::count_if(found.arrays.begin(), found.arrays.end(),
                            [](const auto& array) { return array.first.find("mode ") == 0; }),
              14);
}

TEST_F(ExchangeTest, ExportSaysWhatItCannotDo) {
    EXPECT_EQ(run("export part.h5 -o part.step"), 2);
    EXPECT_THAT(err, AllOf(HasSubstr("'part.step'"), HasSubstr(".vtu")));
    EXPECT_EQ(run("export none.h5 -o part.vtu"), 1);
    EXPECT_THAT(err, HasSubstr("none.h5"));
    EXPECT_EQ(run("export part.h5 -o no/where.vtu"), 1);
    EXPECT_THAT(err, HasSubstr("no folder"));
    EXPECT_EQ(run("export part.h5"), 2);
    EXPECT_THAT(testing::listFiles(folder.path()), ElementsAre("brick.inp", "part.h5", "tmp"));
}

TEST_F(ExchangeTest, InfoHasALineForEveryInterfaceAndMode) {
    ASSERT_EQ(run("info part.h5"), 0);
    EXPECT_THAT(out, ContainsRegex("left +rigid +9 +0 +0 +0 +0\\.018027[0-9]"));
    EXPECT_THAT(out, ContainsRegex("right +rigid +9 +0\\.2 +0 +0 +0\\.018027[0-9]"));
    EXPECT_THAT(out, ContainsRegex("\n +1 +[0-9.]+ +[0-9.]+ +[0-9]+"));
    EXPECT_THAT(out, ContainsRegex("\n +14 +[0-9.]+ +[0-9.]+ +[0-9]+"));
    EXPECT_THAT(out, ContainsRegex("stress +none"));
    std::istringstream lines(out);
    for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 100u) << line;
}

TEST_F(ExchangeTest, InfoComparesWithTheFullModelWhereThePartHasItsFrequencies) {
    ReducedBody part = readReducedBody(folder / "part.h5");
    part.report.emplace();
    part.report->numConstraintModes = 12;
    part.report->normalFrequencies = {1000, 2000};
    part.report->effectiveMasses = {0.081, 0, 0, 0, 0, 0, 0.0405, 0, 0, 0, 0, 1};
    part.report->rigidMasses = {0.324, 0.324, 0.324, 1, 2, 4};
    const double lowest = std::sqrt(part.omegaSquared[0]) / (2 * M_PI);
    part.report->fullFrequencies = {lowest / 1.0025};
    part.interfaces[1].tie = TieType::Distributing;
    part.interfaces[1].weights.assign(9, 1.0 / 9);
    part.modalStress.emplace();
    part.modalStress->nodes = {3, 4};
    part.modalStress->stress.assign(size_t(12 * part.numModes), 1);
    part.modalStress->strain = part.modalStress->stress;
    writeReducedBody(folder / "part.h5", part);
    ASSERT_EQ(run("info part.h5"), 0) << err;
    EXPECT_THAT(out, ContainsRegex("\n +1 +[0-9.]+ +[0-9.]+ +[0-9]+ +[0-9.]+ +0\\.25\n"));
    EXPECT_THAT(out, ContainsRegex("\n +1 +1000 +25\\.000 +0\\.000 +0\\.000"));
    EXPECT_THAT(out, ContainsRegex("\n +sum +37\\.500 .* 25\\.000\n"));
    EXPECT_THAT(out, ContainsRegex("right +distributing +9"));
    EXPECT_THAT(out, HasSubstr("12 constraint, 0 attachment, 2 normal modes"));
    EXPECT_THAT(out, ContainsRegex("stress +yes: .*2 of 81 nodes"));
    ASSERT_EQ(run("info part.h5 --json"), 0);
    EXPECT_THAT(out, AllOf(HasSubstr("\"tie\": \"distributing\""), HasSubstr("\"frequency_error\""),
                           HasSubstr("\"num_stress_nodes\": 2"), HasSubstr("\"normal_modes\"")));
}

TEST_F(ExchangeTest, PythonReadsThePartAndFindsTheSameMassFrequenciesAndElongation) {
    const std::string command = "cd '" + folder.path() +
                                "' && /usr/bin/python3 '" SIMFLEX_SOURCE_DIR
                                "/tests/cli/check_part_file.py' '" SIMFLEX_PROGRAM
                                "' '" SIMFLEX_SOURCE_DIR
                                "/examples/part_file.py' part.h5 "
                                ">tmp.out 2>&1";
    EXPECT_EQ(std::system(command.c_str()), 0) << testing::readText(folder / "tmp.out");
}

TEST_F(ExchangeTest, PictureOfInterfacesHasDotsInTheirColoursWhereTheyAre) {
    ASSERT_EQ(run("info part.h5 --picture interfaces.png"), 0) << err;
    ASSERT_EQ(run("reduce -q brick.inp -i left=LEFT -i right=RIGHT -m 20 -o part.h5 "
                  "--picture same.png"),
              0)
        << err;
    const Image image = Image::readPng(folder / "interfaces.png");
    EXPECT_TRUE(Image::readPng(folder / "same.png") == image);
    // Dots of the first interface are orange, of the second sky blue; axes are red, green and blue.
    // The brick runs along x.
    int orangeLeft = 0, orangeRight = 0, blueLeft = 0, blueRight = 0;
    for (int y = 0; y < image.getHeight(); ++y)
        for (int x = 0; x < image.getWidth(); ++x) {
            const double hue = calcHue(image.getPixel(x, y));
            const bool isLeft = x < image.getWidth() / 2;
            if (hue > 15 && hue < 40) ++(isLeft ? orangeLeft : orangeRight);
            if (hue > 190 && hue < 209) ++(isLeft ? blueLeft : blueRight);
        }
    EXPECT_GT(orangeLeft, 9 * 4);
    EXPECT_GT(blueRight, 9 * 4);
    EXPECT_GT(orangeLeft, 10 * orangeRight);
    EXPECT_GT(blueRight, 10 * blueLeft);
    EXPECT_EQ(run("info part.h5 --picture no/where.png"), 1);
    EXPECT_THAT(err, HasSubstr("no/where.png"));
}

TEST_F(ExchangeTest, ModesMakesAFilmOfEachAndASheet) {
    ASSERT_EQ(run("modes part.h5 --modes 2,7-8 --gif --size 320x200 --output shapes"), 0) << err;
    EXPECT_THAT(out, HasSubstr("3 modes -> shapes/contact_sheet.png"));
    EXPECT_THAT(testing::listFiles(folder / "shapes"),
                ElementsAre("contact_sheet.png", "mode_02.gif", "mode_07.gif", "mode_08.gif"));
    const std::string gif = testing::readText(folder / "shapes/mode_02.gif");
    EXPECT_EQ(gif.substr(0, 10), std::string("GIF89a\x40\x01\xC8\x00", 10));  // 320 × 200
    int frames = 0;  // each has a graphic control extension of four bytes
    for (size_t at = 0; (at = gif.find("\x21\xF9\x04", at)) != std::string::npos; ++at) ++frames;
    EXPECT_EQ(frames, 24);
    const Image sheet = Image::readPng(folder / "shapes/contact_sheet.png");
    EXPECT_EQ(sheet.getWidth(), 3 * 486 + 6);
    // All colours from zero to the largest displacement appear.
    int dark = 0, yellow = 0;
    for (int y = 0; y < sheet.getHeight(); ++y)
        for (int x = 0; x < sheet.getWidth(); ++x) {
            const auto pixel = sheet.getPixel(x, y);
            yellow += pixel[0] > 180 && pixel[1] > 160 && pixel[2] < 90;
            dark += pixel[2] > pixel[1] + 40 && pixel[2] > 60 && pixel[1] < 60;
        }
    EXPECT_GT(yellow, 100);
    EXPECT_GT(dark, 100);
}

TEST_F(ExchangeTest, ModesSaysWhatItCannotDoBeforeItDraws) {
    EXPECT_EQ(run("modes none.h5"), 1);
    EXPECT_THAT(err, HasSubstr("none.h5"));
    EXPECT_EQ(run("modes part.h5 --modes 3,99"), 1);
    EXPECT_THAT(err, HasSubstr("has no mode 99; it has modes 1 to 14"));
    for (const char* list : {"3-1", "0", "1,,2", "1-", "two", "1-2-3", "-1", "1,"}) {
        EXPECT_EQ(run("modes part.h5 --modes=" + std::string(list)), 2) << list;
        EXPECT_THAT(err, HasSubstr("list of modes")) << list;
    }
    EXPECT_EQ(run("modes part.h5 --output part.h5/shapes"), 1);
    EXPECT_THAT(err, HasSubstr("part.h5/shapes"));
    EXPECT_EQ(run("modes part.h5 --scale 0"), 2);
    for (const char* size : {"640", "640x", "10x10", "99999x100", "640x480x3"})
        EXPECT_EQ(run("modes part.h5 --size " + std::string(size)), 2) << size;
    EXPECT_THAT(testing::listFiles(folder.path()), ElementsAre("brick.inp", "part.h5", "tmp"));
}

TEST_F(ExchangeTest, ControlCKeepsTheModesThatAreDone) {
    const pid_t pid = fork();
    if (pid == 0) {
        if (chdir(folder.path().c_str()) != 0 || !freopen("err.txt", "w", stderr)) _exit(99);
        execl(SIMFLEX_PROGRAM, "simflex", "modes", "part.h5", "--modes", "all", "--gif", "--size",
              "240x160", "-o", "shapes", nullptr);
        _exit(99);
    }
    testing::await("the second mode", [&] {
        return access((folder / "shapes/mode_02.gif").c_str(), F_OK) == 0 || testing::hasEnded(pid);
    });
    kill(pid, SIGINT);
    int status = 0;
    waitpid(pid, &status, 0);
    ASSERT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), 130);
    EXPECT_THAT(testing::readText(folder / "err.txt"),
                ContainsRegex("simflex: stopped; [1-9] of 14 modes are in 'shapes'"));
    const std::vector<std::string> files = testing::listFiles(folder / "shapes");
    EXPECT_THAT(files, ::testing::Contains("contact_sheet.png"));
    EXPECT_THAT(files, ::testing::Contains("mode_01.gif"));
    EXPECT_THAT(files, Not(::testing::Contains("mode_14.gif")));
    for (const std::string& file : files)
        EXPECT_THAT(file, ::testing::AnyOf("contact_sheet.png", ContainsRegex("^mode_..\\.gif$")));
}

}  // namespace
}  // namespace simflex
