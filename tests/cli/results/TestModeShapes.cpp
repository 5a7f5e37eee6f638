/** @file
Modal assurance between results, tables and universal files. **/

#include <gmock/gmock.h>

#include "cli/CliTest.h"
#include "cli/results/TestResults.h"
#include "simflex/base/NumberText.h"
#include "simflex/model/results/ModeShapes.h"
#include "simflex/model/results/UniversalFile.h"

namespace simflex {
namespace {

using namespace model;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

/** Two modes at nodes 4 and 12, written by the format's widths: 6E13.5 fills them. **/
constexpr const char* kShapes = R"(    -1
   151
a header that is passed over
    -1
    -1
    55
Mode 1
NONE
NONE
NONE
NONE
         1         2         2         8         2         3
         2         4         1         1
  1.25000E+01  1.00000E+00  1.00000E-02  0.00000E+00
         4
-1.000000E+00-5.000000E-01-2.500000E-01
        12
  2.00000E+00  0.00000E+00  1.00000E+00
    -1
    -1
    55
Mode 2
NONE
NONE
NONE
NONE
         1         7         2         8         5         3
         2         6         1         2
 -3.00000E+00  4.00000E+01  1.00000E+00  0.00000E+00  1.00000E+00  0.00000E+00
         4
  1.00000E+00  2.00000E+00  0.00000E+00 -1.00000E+00  3.00000E+00  0.00000E+00
        12
  0.00000E+00  0.00000E+00  1.00000E+00  1.00000E+00 -2.00000E+00  0.00000E+00
    -1
)";

class ModeShapesTest : public CliTest {
protected:
    std::string write(const std::string& name, const std::string& text) {
        testing::writeText(folder / name, text);
        return folder / name;
    }
    void refuse(const std::string& text, const std::string& why) {
        const std::string path = write("bad.unv", text);
        try {
            readModeShapes(path);
            ADD_FAILURE() << "no exception: " << why;
        } catch (const std::runtime_error& error) {
            EXPECT_THAT(error.what(), HasSubstr(why));
        }
    }
};

TEST_F(ModeShapesTest, UniversalFilesHaveShapesAtNodes) {
    ModeShapes modes = readModeShapes(write("test.unv", kShapes));
    EXPECT_TRUE(modes.nameNode("12", "tip"));
    EXPECT_FALSE(modes.nameNode("12", "tip"));
    EXPECT_THROW(modes.nameNode("4", "tip"), std::runtime_error);  // two nodes at one place
    EXPECT_THAT(modes.outputs, ElementsAre("tip.x", "tip.y", "tip.z", "4.x", "4.y", "4.z"));
    EXPECT_EQ(modes.frequency[0], 12.5);
    EXPECT_NEAR(modes.frequency[1], std::hypot(3, 40) / (2 * SimTK::Pi), 1e-12);
    EXPECT_EQ(modes.shapes[0][3], -1.0);
    EXPECT_EQ(modes.shapes[0][4], -0.5);
    EXPECT_EQ(modes.shapes[0][5], -0.25);
    EXPECT_EQ(modes.shapes[1][3], std::complex<double>(1, 2));
    EXPECT_EQ(modes.shapes[1][1], std::complex<double>(1, 1));
}

// By hand: numpy.abs(numpy.vdot(a, b))**2/(numpy.vdot(a, a)*numpy.vdot(b, b)).real
TEST_F(ModeShapesTest, AssuranceIsTheCosineSquared) {
    using Shape = std::vector<std::complex<double>>;
    const Shape a{1, {0, 2}, -3}, b{{0, 1}, -2, {0, -3}}, c{{2, 1}, 0, {1, -1}};
    EXPECT_NEAR(calcModalAssurance(a, b), 1, 1e-15);  // b = i a
    EXPECT_NEAR(calcModalAssurance(a, c), 17.0 / 98, 1e-15);
    EXPECT_EQ(calcModalAssurance(a, {0, 0, 0}), 0);
    const ModeShapes test = readModeShapes(write("test.unv", kShapes));
    const auto alike = calcModalAssurance(test, test);
    EXPECT_NEAR(alike.values[0][0], 1, 1e-15);
    // aᴴb = −1(1 + 2i) − ½(−i) − ¼·3 + 2·0 + 1·(−2), of aᴴa = 6.3125 and bᴴb = 21
    EXPECT_NEAR(alike.values[0][1], (3.75 * 3.75 + 1.5 * 1.5) / (6.3125 * 21), 1e-14);
}

TEST_F(ModeShapesTest, ResponsesAreReadWhereTheyPeak) {
    // Two modes of a closed-form model; evenly spaced and in pairs, short and long.
    const auto calc = [](int node, double f) {
        const double w = 2 * SimTK::Pi * f;
        const std::complex<double> first = 1.0 / std::complex<double>(3600 - w * w, 1.2 * w),
                                   second = 1.0 / std::complex<double>(40000 - w * w, 4 * w);
        return node == 1 ? first + second : 2.0 * first - 0.5 * second;
    };
    std::string text;
    for (const int node : {1, 2}) {
        char line[200];
        text += "    -1\n    58\nFRF\nNONE\n24-NOV-26 00:00:00\nNONE\nNONE\n";
        std::snprintf(line, sizeof line, "%5d%10d%5d%10d %-10s%10d%4d %-10s%10d%4d\n", 4, 1, 0, 0,
                      "A NAME", node, node == 2 ? -3 : 3, "NONE", 1, 3);
        text += line;
        const int count = 2000;
        std::snprintf(line, sizeof line, "%10d%10d%10d%13.5E%13.5E%13.5E\n", node == 1 ? 5 : 6,
                      count, node == 1 ? 1 : 0, 0.0, node == 1 ? 0.02 : 0.0, 0.0);
        text += line;
        for (int k = 0; k < 4; ++k) text += "        18    0    0    0 Frequency            Hz\n";
        for (int k = 0; k < count; ++k) {
            const auto h = (node == 2 ? -1.0 : 1.0) * calc(node, 0.02 * k);
            if (node == 1) {
                std::snprintf(line, sizeof line, "%13.5E%13.5E%s", h.real(), h.imag(),
                              k % 3 == 2 || k + 1 == count ? "\n" : "");
            } else {
                std::snprintf(line, sizeof line, "%13.5E%20.12E%20.12E\n", 0.02 * k, h.real(),
                              h.imag());
            }
            text += line;
        }
        text += "    -1\n";
    }
    const ModeShapes modes = readModeShapes(write("frf.uff", text));
    EXPECT_THAT(modes.outputs, ElementsAre("1.z", "2.z"));
    ASSERT_EQ(modes.frequency.size(), 2u);
    EXPECT_NEAR(modes.frequency[0], 60 / (2 * SimTK::Pi), 0.02);
    EXPECT_NEAR(modes.frequency[1], 200 / (2 * SimTK::Pi), 0.02);
    // Close to the modes {1, 2} and {1, −0.5}; and measured data to all digits.
    EXPECT_GT(calcModalAssurance(modes.shapes[0], {1, 2}), 0.999);
    EXPECT_GT(calcModalAssurance(modes.shapes[1], {1, -0.5}), 0.99);
    for (size_t k = 0; k < 2; ++k) {
        const double f = modes.frequency[k];
        EXPECT_NEAR(calcModalAssurance(modes.shapes[k], {calc(1, f), calc(2, f)}), 1, 1e-9);
    }
    EXPECT_THAT(modes.notes.at(0), HasSubstr("neighbouring modes have a part"));
}

TEST_F(ModeShapesTest, OutputsThatDoNotMoveDoNotCount) {
    const ModeShapes model{{"a.x", "b.x", "a.y", "b.y", "a.z"},
                           {},
                           {10, 20, 30},
                           {{1, 2, 0, 0.5, 0}, {2, -1, 1e-15, -0.5, 0}, {1e-13, 0, 0, 3, 0}},
                           {}};
    const ModeShapes test{{"a.x", "b.x", "a.y", "b.y", "a.z"},
                          {},
                          {11, 19, 31},
                          {{1, 2, 3, 0, 0}, {2, -1, 4, 0, 0}, {3, 1, 5, 0, 0}},
                          {}};
    const auto alike = calcModalAssurance(model, test);
    EXPECT_THAT(alike.outputs, ElementsAre("a.x", "b.x"));
    EXPECT_EQ(alike.notes.at(0), "a.y, b.y, a.z are zero in all modes of one side: left out");
    EXPECT_NEAR(alike.values[0][0], 1, 1e-15);
    EXPECT_NEAR(alike.values[0][1], 0, 1e-15);
    EXPECT_NEAR(alike.values[1][2], 25.0 / (5 * 10), 1e-15);
    // Round-off is not a shape.
    EXPECT_THAT(alike.values[2], ElementsAre(0, 0, 0));
    EXPECT_FALSE(alike.findPartner(2, model.frequency, test.frequency));
    // If only one node moves, all modes look alike.
    const ModeShapes flat{{"a.x", "a.y", "a.z"}, {}, {1, 2}, {{1, 0, 0}, {-2, 0, 0}}, {}};
    try {
        calcModalAssurance(flat, flat);
        ADD_FAILURE() << "no exception";
    } catch (const std::runtime_error& error) {
        EXPECT_THAT(error.what(), HasSubstr("a.y, a.z are zero in all modes of one side, and 'a.x' "
                                            "alone is alike in all modes"));
    }
    // In a single mode, a zero is a vibration node: (1, 0, 1) and (1, 5, 1) differ.
    const ModeShapes one{{"a", "b", "c"}, {}, {1}, {{1, 0, 1}}, {}},
        other{{"a", "b", "c"}, {}, {1}, {{1, 5, 1}}, {}};
    EXPECT_NEAR(calcModalAssurance(one, other).values[0][0], 4.0 / (2 * 27), 1e-15);
}

TEST_F(ModeShapesTest, OfEqualPartnersTheNearestInFrequencyIsTaken) {
    const ModeShapes model{{"a", "b"}, {}, {10, 20, 5}, {{1, 2}, {1, 2}, {2, -1}}, {}};
    const ModeShapes test{{"a", "b"}, {}, {21, 9}, {{2, 4}, {-1, -2}}, {}};
    const auto alike = calcModalAssurance(model, test);
    EXPECT_EQ(alike.findPartner(0, model.frequency, test.frequency), 1u);
    EXPECT_EQ(alike.findPartner(1, model.frequency, test.frequency), 0u);
    EXPECT_FALSE(alike.findPartner(2, model.frequency, test.frequency));
}

TEST_F(ModeShapesTest, ARovingHammerIsARovingSensorByReciprocity) {
    // Node 3 responds along −y; forces at nodes 1 (+x), 2 (−x), 3 (+y). One mode at each of 1, 2
    // Hz.
    const auto makeFile = [](bool isRoving) {
        const double shapes[2][3] = {{1, 2, 3}, {2, -1, 1}};
        const int directions[] = {1, -1, 2};
        std::string text;
        char line[200];
        for (int node = 1; node <= 3; ++node) {
            const int moved[] = {node, directions[node - 1]}, fixed[] = {3, -2};
            const int *response = isRoving ? fixed : moved, *force = isRoving ? moved : fixed;
            text += "    -1\n    58\nFRF\nNONE\n24-NOV-26 00:00:00\nNONE\nNONE\n";
            std::snprintf(line, sizeof line, "%5d%10d%5d%10d %-10s%10d%4d %-10s%10d%4d\n", 4, 1, 0,
                          0, "NONE", response[0], response[1], "NONE", force[0], force[1]);
            text += line;
            std::snprintf(line, sizeof line, "%10d%10d%10d%13.5E%13.5E%13.5E\n", 6, 301, 1, 0.0,
                          0.01, 0.0);
            text += line;
            for (int k = 0; k < 4; ++k)
                text += "        18    0    0    0 Frequency            Hz\n";
            for (int k = 0; k <= 300; ++k) {
                std::complex<double> sum = 0;
                for (int mode = 0; mode < 2; ++mode)
                    sum += shapes[mode][node - 1] * shapes[mode][2] /
                           std::complex<double>(std::pow(mode + 1, 2) - 1e-4 * k * k,
                                                2e-5 * k * (mode + 1));
                sum *= -(directions[node - 1] < 0 ? -1.0 : 1.0);
                std::snprintf(line, sizeof line, "%20.12E%20.12E%s", sum.real(), sum.imag(),
                              k % 2 == 1 || k == 300 ? "\n" : "");
                text += line;
            }
            text += "    -1\n";
        }
        return text;
    };
    const ModeShapes hammer = readModeShapes(write("hammer.unv", makeFile(true))),
                     sensor = readModeShapes(write("sensor.unv", makeFile(false)));
    EXPECT_THAT(hammer.outputs, ElementsAre("1.x", "2.x", "3.y"));
    EXPECT_EQ(hammer.outputs, sensor.outputs);
    EXPECT_EQ(hammer.frequency, sensor.frequency);
    EXPECT_EQ(hammer.shapes, sensor.shapes);
    ASSERT_EQ(hammer.shapes.size(), 2u);
    EXPECT_GT(calcModalAssurance(hammer.shapes[0], {1, 2, 3}), 0.999);
    EXPECT_GT(calcModalAssurance(hammer.shapes[1], {2, -1, 1}), 0.999);
    EXPECT_THAT(hammer.notes.at(0), HasSubstr("by reciprocity those there to a force at '3.y'"));
}

TEST_F(ModeShapesTest, FilesThatAreNoneAreRefused) {
    refuse("no universal file\n", "begins with -1");
    refuse("    -1\n   151\nx\n    -1\n", "neither shapes of modes (dataset 55)");
    refuse("    -1\n    58b     1     1\n", "write it as text");
    refuse("    -1\n   1x5\nx\n    -1\n" + std::string(kShapes), "the dataset's number is '1x5'");
    refuse(std::string(kShapes) + "   1-1\n    55\n", "bad.unv:35: a dataset of a universal file");
    std::string text = kShapes;
    text.replace(text.find("-5.000000E-01"), 13, "abc          ");
    refuse(text, "bad.unv:16");
    refuse(std::string(kShapes).substr(0, 400), "bad.unv");
}

TEST_F(ModeShapesTest, TheProgramPairsAResultWithATest) {
    Results::Analysis modes;
    modes.name = "modes";
    modes.type = "eigen";
    modes.isComplete = true;
    modes.frequency = {{12, 41}};
    modes.dampingRatio = {{0, 0}};
    modes.outputs = {"tip.x", "tip.y", "middle.x"};
    modes.outputUnits = {"m", "m", "m"};
    modes.matrices["shape_real"] = {{0.1, 1, -0.2}, {1, 0.5, 0.4}};
    modes.matrices["shape_imaginary"] = {{0, 0, 0}, {0, 0, 0}};
    {
        ResultWriter writer(folder / "run.h5", testing::makeHeader());
        writer.add(modes);
    }
    write("test.csv", "frequency [Hz],middle.x,tip.x,tip.y,else\n40,0.8,2,1,7\n12.6,2,-1,-10,7\n");
    ASSERT_EQ(runProgram("'" SIMFLEX_PROGRAM "'", "mac run.h5 test.csv --csv mac.csv -o mac.svg"),
              0)
        << err;
    EXPECT_THAT(out, HasSubstr("modal assurance at 3 outputs"));
    EXPECT_THAT(out, HasSubstr("+5.00 %"));
    EXPECT_THAT(out, HasSubstr("1.0000"));
    EXPECT_THAT(testing::readText(folder / "mac.svg"), HasSubstr("mode of run"));
    const std::string csv = testing::readText(folder / "mac.csv");
    const double cross = (0.1 * 2 + 1 * 1 - 0.2 * 0.8) * (0.1 * 2 + 1 * 1 - 0.2 * 0.8) /
                         ((0.01 + 1 + 0.04) * (4 + 1 + 0.64));
    double found = 0;
    const size_t begin = csv.find("\n1,") + 3;
    ASSERT_TRUE(readNumber(csv.substr(begin, csv.find(',', begin) - begin), found)) << csv;
    EXPECT_NEAR(found, cross, 1e-14);
    // The output of a run can be read again.
    writeResultCsv(folder / "own.csv", modes);
    ASSERT_EQ(runProgram("'" SIMFLEX_PROGRAM "'", "mac run.h5 own.csv"), 0) << err;
    EXPECT_THAT(out, HasSubstr("+0.00 %"));
    // Files with nothing in common.
    write("other.csv", "frequency [Hz],a.x,tip.x\n1,1,2\n");
    EXPECT_NE(runProgram("'" SIMFLEX_PROGRAM "'", "mac run.h5 other.csv"), 0);
    EXPECT_THAT(err, HasSubstr("'tip.x' alone is alike in all modes"));
}

}  // namespace
}  // namespace simflex
