/** @file
simflex compare, and the figures of simflex plot, on results with known values. **/

#include <gmock/gmock.h>

#include <cmath>
#include <complex>
#include <functional>

#include "TestResults.h"
#include "cli/CliTest.h"
#include "simflex/base/DisplayUnit.h"
#include "simflex/base/TemporaryFolder.h"
#include "simflex/model/results/Comparison.h"
#include "simflex/model/results/ResultFigure.h"
#include "simflex/render/Image.h"

namespace simflex {
namespace {

using namespace model;
using namespace testing;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::Field;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::SizeIs;
using ::testing::StartsWith;

constexpr double pi = 3.14159265358979323846;

/** Returns a run of one probe: value(t), at `count` times from 0 to 1 s. **/
Results makeData(int count, const std::function<double(double)>& value) {
    Results data;
    data.analyses.emplace_back();
    Results::Analysis& run = data.analyses[0];
    run.name = "run";
    run.type = "transient";
    run.probes.push_back({{"wave", "m", {""}}, {}});
    for (int k = 0; k < count; ++k) {
        run.time.push_back(double(k) / (count - 1));
        run.probes[0].rows.push_back({value(run.time.back())});
    }
    return data;
}

double wave(double t) {
    return std::sin(2 * pi * t);
}

TEST(Comparison, LargestAndRmsOfASineAreThoseOfItsClosedForm) {
    const double size = 0.01;
    const auto result = compareResults(
        makeData(2001, wave), makeData(2001, [&](double t) { return (1 + size) * wave(t); }), {},
        "a", "b");
    ASSERT_THAT(result.columns, SizeIs(1));
    EXPECT_NEAR(result.columns[0].largest, size, 1e-12);
    EXPECT_NEAR(result.columns[0].time, 0.25, 1e-12);
    EXPECT_NEAR(result.columns[0].rms, size / std::sqrt(2.0), 1e-3 * size);
    EXPECT_NEAR(result.columns[0].range, 2 * (1 + size), 1e-12);
    EXPECT_NEAR(result.columns[0].getRelative(), size / (2 * (1 + size)), 1e-12);
    EXPECT_THAT(result.missing, SizeIs(0));
    EXPECT_THAT(result.notes, SizeIs(0));
}

TEST(Comparison, InterpolationBetweenOtherTimesIsOfFourthOrder) {
    double errors[2];
    for (int k = 0; k < 2; ++k) {
        const auto result =
            compareResults(makeData(103, wave), makeData(41 << k, wave), {}, "a", "b");
        ASSERT_THAT(result.notes, SizeIs(1));
        EXPECT_THAT(result.notes[0],
                    AllOf(HasSubstr("times"), HasSubstr("103"), HasSubstr("cubic")));
        errors[k] = result.columns[0].largest;
    }
    EXPECT_NEAR(std::log2(errors[0] / errors[1]), 4, 0.3);
}

TEST(Comparison, WhatOnlyOneFileHasIsNamed) {
    Results a = makeData(5, wave), b = makeData(5, wave);
    a.analyses[0].probes[0].column.name = "tip";
    b.analyses.push_back(b.analyses[0]);
    b.analyses[1].name = "walk";
    using Reason = NotCompared::Reason;
    const auto isMissing = [](Reason reason, const char* analysis, const char* column,
                              const char* text) {
        return AllOf(Field(&NotCompared::reason, reason), Field(&NotCompared::analysis, analysis),
                     Field(&NotCompared::column, column), Field(&NotCompared::text, text));
    };
    EXPECT_THAT(
        compareResults(a, b, {}, "a", "b").missing,
        ElementsAre(isMissing(Reason::OnlyInSecond, "run", "wave",
                              "probe 'wave' of analysis 'run' is only in b"),
                    isMissing(Reason::OnlyInFirst, "run", "tip",
                              "probe 'tip' of analysis 'run' is only in a"),
                    isMissing(Reason::OnlyInSecond, "walk", "", "analysis 'walk' is only in b")));
}

TEST(Comparison, AComponentThatIsZeroIsMeasuredByItsProbesRange) {
    Results a = makeData(101, wave), b = a;
    for (Results* data : {&a, &b}) {
        data->analyses[0].probes[0].column.columns = {"x", "z"};
        for (auto& row : data->analyses[0].probes[0].rows) row.push_back(data == &b ? 1e-14 : 0);
    }
    const auto result = compareResults(a, b, {"wave"}, "a", "b");
    ASSERT_THAT(result.columns, SizeIs(2));
    EXPECT_LT(result.columns[1].getRelative(), 1e-13);
}

TEST(Comparison, AConstantIsMeasuredByItsSizeNotByItsRoundOff) {
    const auto noisy = [](double t) { return 9.81 * (1 + 1e-15 * wave(t)); };
    const auto result = compareResults(makeData(101, [](double) { return 9.81; }),
                                       makeData(101, noisy), {}, "a", "b");
    EXPECT_GT(result.columns.at(0).largest, 0);
    EXPECT_LT(result.columns[0].getRelative(), 1e-14);
}

TEST(Comparison, WhatIsNoNumberOnOneSideOnlyDiffersWithoutBound) {
    const auto broken = [](double t) { return t > 0.5 ? NAN : wave(t); };
    EXPECT_EQ(compareResults(makeData(9, wave), makeData(9, broken), {}, "a", "b")
                  .columns[0]
                  .getRelative(),
              INFINITY);
    EXPECT_EQ(
        compareResults(makeData(9, broken), makeData(9, broken), {}, "a", "b").columns[0].largest,
        0);
}

/** Response x = H p of m ẍ + c ẋ + k x = p, at `count` frequencies from 1 to 20 Hz. **/
struct Oscillator {
    double m = 1.5, c = 12, k = 4000;

    std::complex<double> calc(double frequency) const {
        const std::complex<double> s(0, 2 * pi * frequency);
        return 1.0 / (m * s * s + c * s + k);
    }

    Results respond(int count) const {
        Results data;
        data.analyses.emplace_back();
        Results::Analysis& fr = data.analyses[0];
        fr.name = "fr";
        fr.type = "frequency_response";
        fr.isComplete = true;
        putPorts(fr);
        fr.frequency.emplace_back();
        for (int n = 0; n < count; ++n) {
            const double frequency = 1 + 19.0 * n / (count - 1);
            fr.frequency[0].push_back(frequency);
            fr.matrices["magnitude"].push_back({std::abs(calc(frequency))});
            fr.matrices["phase"].push_back({std::arg(calc(frequency)) * 180 / pi});
        }
        return data;
    }

    /** @param scale  of the second state relative to the speed **/
    Results linearize(double scale) const {
        Results data;
        data.analyses.emplace_back();
        Results::Analysis& lin = data.analyses[0];
        lin.name = "lin";
        lin.type = "linear";
        putPorts(lin);
        lin.matrices = {{"A", {{0, 1 / scale}, {-k / m * scale, -c / m}}},
                        {"B", {{0}, {scale / m}}},
                        {"C", {{1, 0}}},
                        {"D", {{0}}}};
        return data;
    }

private:
    static void putPorts(Results::Analysis& analysis) {
        analysis.inputs = {"push"};
        analysis.inputUnits = {"N"};
        analysis.outputs = {"x"};
        analysis.outputUnits = {"m"};
    }
};

TEST(Comparison, ResponsesDifferAsComplexNumbers) {
    const Oscillator soft;
    Oscillator stiff;
    stiff.k *= 1.1;
    const auto result = compareResults(soft.respond(101), stiff.respond(101), {}, "a", "b");
    ASSERT_THAT(result.columns, SizeIs(1));
    EXPECT_EQ(result.columns[0].name, "x by push");
    EXPECT_EQ(result.columns[0].unit, "m/N");
    double largest = 0, size = 0, at = 0;
    const Results given = soft.respond(101);
    for (const double f : given.analyses[0].frequency[0]) {
        const double difference = std::abs(stiff.calc(f) - soft.calc(f));
        if (difference > largest) largest = difference, at = f;
        size = std::max({size, std::abs(soft.calc(f)), std::abs(stiff.calc(f))});
    }
    EXPECT_NEAR(result.columns[0].largest, largest, 1e-12 * largest);
    EXPECT_EQ(result.columns[0].time, at);
    EXPECT_NEAR(result.columns[0].getRelative(), largest / size, 1e-12);
    EXPECT_THAT(result.notes, SizeIs(0));
    // Of equal magnitude in the opposite direction.
    Results turned = soft.respond(101);
    for (auto& row : turned.analyses[0].matrices["phase"]) row[0] += 180;
    EXPECT_NEAR(compareResults(soft.respond(101), turned, {}, "a", "b").columns[0].getRelative(), 2,
                1e-12);
    EXPECT_EQ(compareResults(turned, turned, {}, "a", "b").columns[0].largest, 0);
    EXPECT_THAT(compareResults(turned, turned, {"y"}, "a", "b").columns, SizeIs(0));
}

TEST(Comparison, WhatOtherFrequenciesMakeDifferIsTold) {
    // A grid that misses the peak, one that barely resolves it, and one that does: the response is
    // the same.
    const Oscillator body;
    for (const int count : {6, 24, 151}) {
        const auto result = compareResults(body.respond(400), body.respond(count), {}, "a", "b");
        ASSERT_THAT(result.notes, SizeIs(1));
        const std::string start = "makes differences of up to ";
        const size_t at = result.notes[0].find(start);
        ASSERT_NE(at, std::string::npos) << result.notes[0];
        const double told = std::stod(result.notes[0].substr(at + start.size())),
                     actual = result.columns.at(0).getRelative();
        EXPECT_GT(actual, 0);
        EXPECT_GT(told, 0.9 * actual) << count;
        EXPECT_LT(told, 1.5 * actual) << count;
    }
    Results beyond = body.respond(9);
    for (double& frequency : beyond.analyses[0].frequency[0]) frequency += 100;
    const auto result = compareResults(body.respond(9), beyond, {}, "a", "b");
    EXPECT_THAT(result.columns, SizeIs(0));
    ASSERT_THAT(result.missing, SizeIs(1));
    EXPECT_THAT(result.missing[0].text, HasSubstr("no frequency that both"));
}

TEST(Comparison, LinearModelsAreThoseOfTheirPolesAndResponsesWhateverTheirStates) {
    const Oscillator soft;
    const auto same = compareResults(soft.linearize(1), soft.linearize(-0.02), {}, "a", "b");
    ASSERT_THAT(same.columns, SizeIs(2));
    for (const auto& column : same.columns) EXPECT_LT(column.getRelative(), 1e-12) << column.name;

    Oscillator stiff = soft;
    stiff.k *= 4;
    const auto calcPole = [](const Oscillator& of) {
        return std::complex<double>(-of.c / (2 * of.m),
                                    std::sqrt(of.k / of.m - std::pow(of.c / (2 * of.m), 2)));
    };
    const auto result = compareResults(soft.linearize(1), stiff.linearize(1), {}, "a", "b");
    ASSERT_THAT(result.columns, SizeIs(2));
    EXPECT_EQ(result.columns[0].name, "pole 1");
    EXPECT_NEAR(result.columns[0].largest, std::abs(calcPole(stiff) - calcPole(soft)), 1e-9);
    EXPECT_EQ(result.columns[1].name, "x by push");
    ASSERT_THAT(result.columns[1].x, SizeIs(3));  // below, between and above
    for (size_t n = 0; n < 3; ++n) {
        const double f = result.columns[1].x[n],
                     difference = std::abs(stiff.calc(f) - soft.calc(f));
        EXPECT_NEAR(result.columns[1].difference[n], difference, 1e-9 * difference);
    }

    Results larger = soft.linearize(1);
    auto& matrices = larger.analyses[0].matrices;
    matrices["A"] = {{0, 1, 0}, {-soft.k / soft.m, -soft.c / soft.m, 0}, {0, 0, -7}};
    matrices["B"].push_back({0});
    matrices["C"][0].push_back(1);
    const auto unlike = compareResults(soft.linearize(1), larger, {}, "a", "b");
    ASSERT_THAT(unlike.missing, SizeIs(1));
    EXPECT_THAT(unlike.missing[0].text, HasSubstr("poles are not compared"));
    ASSERT_THAT(unlike.columns, SizeIs(1));  // its third state has no counterpart
    EXPECT_LT(unlike.columns[0].getRelative(), 1e-12);
}

TEST(Comparison, EffectiveValuesAndDensitiesOfRandomMotionAreCompared) {
    Results a = Oscillator().respond(20), b;
    for (size_t n = 0; n < 20; ++n) a.analyses[0].matrices["density"].push_back({1});
    a.analyses[0].statistics["rms of x"] = 4;
    b = a;
    b.analyses[0].matrices["density"][7] = {2};
    b.analyses[0].statistics["rms of x"] = 5;
    const auto result = compareResults(a, b, {}, "a", "b");
    ASSERT_THAT(result.columns, SizeIs(3));
    EXPECT_EQ(result.columns[1].name, "density of x");
    EXPECT_EQ(result.columns[1].getRelative(), 0.5);
    EXPECT_EQ(result.columns[2].name, "rms of x");
    EXPECT_EQ(result.columns[2].getRelative(), 0.2);
}

TEST(Comparison, DampingRatiosAreMeasuredByThemselves) {
    Results a, b;
    a.analyses = {makeAnalysis("eigen")};
    b = a;
    b.analyses[0].dampingRatio[0][0] *= 0.75;
    const auto result = compareResults(a, b, {}, "a", "b");
    EXPECT_EQ(result.columns.at(1).name, "damping ratio 1");
    EXPECT_NEAR(result.columns[1].getRelative(), 0.25, 1e-12);
}

TEST(Comparison, WhatCannotBeComparedIsNamed) {
    Results a = makeData(5, wave);
    a.analyses[0].type = "rumour";
    const auto result = compareResults(a, a, {}, "a", "b");
    ASSERT_THAT(result.missing, SizeIs(1));
    EXPECT_THAT(result.missing[0].text, HasSubstr("'run' is not compared"));
}

TEST(DisplayUnit, PrefixesAreThoseThatPeopleUse) {
    const auto name = [](const std::string& unit, double largest) {
        return chooseDisplayUnit(unit, largest).name;
    };
    EXPECT_EQ(name("m", 2.5e-5), "µm");
    EXPECT_EQ(name("m", 2.5e-4), "mm");  // tenths of a millimetre
    EXPECT_EQ(name("m", 0.02), "mm");
    EXPECT_EQ(name("m", 0.3), "mm");
    EXPECT_EQ(name("m", 5000), "km");
    EXPECT_EQ(name("Pa", 3e8), "MPa");
    EXPECT_EQ(name("N m", 2e4), "kN m");
    EXPECT_EQ(name("m/s^2", 20), "m/s²");
    EXPECT_EQ(name("rad", 1e-5), "rad");
    EXPECT_EQ(name("m^2", 1e-5), "m²");
    EXPECT_EQ(chooseDisplayUnit("m", 0.02).size, 1e-3);
    EXPECT_EQ(name("m", 0), "mm");
}

TEST(ResultFigure, ProbesOfOneUnitButOtherSizesHavePanelsOfTheirOwn) {
    Results data = makeData(11, wave);
    auto& probes = data.analyses[0].probes;
    probes.push_back(probes[0]);
    probes[1].column.name = "small";
    for (auto& row : probes[1].rows) row[0] *= 1e-4;
    const Figure figure = makeResultFigure({{"a", &data.analyses[0]}}, {});
    ASSERT_THAT(figure.panels, SizeIs(2));
    EXPECT_EQ(figure.panels[1].label, "small [µm]");
    EXPECT_NEAR(figure.panels[1].curves[0].y[2], 100 * wave(0.2), 1e-12);
    FigureWishes wishes;
    wishes.panels = FigureWishes::Panels::Together;
    wishes.from = 0.35;
    EXPECT_THAT(makeResultFigure({{"a", &data.analyses[0]}}, wishes).panels, SizeIs(1));
    EXPECT_THAT(makeResultFigure({{"a", &data.analyses[0]}}, wishes).panels[0].curves[0].x,
                SizeIs(7));
}

TEST(Figure, WordsBesideAnSvgAreEscaped) {
    const TemporaryFolder folder;
    Figure figure;
    figure.title = "a < b & c\n<script>";
    figure.panels.push_back({"label [m]", {{"</desc>", {0, 1}, {0, 1}}}});
    drawFigure(folder.path() / "a.svg", figure);
    const std::string svg = testing::readText(folder.path() / "a.svg");
    EXPECT_THAT(svg, HasSubstr("<title>a &lt; b &amp; c &lt;script&gt;</title>"));
    EXPECT_THAT(svg, HasSubstr("\nlabel [m]\n&lt;/desc&gt;\n</desc>"));
    EXPECT_THAT(svg, Not(HasSubstr("<script>")));
}

class PlotTest : public CliTest {
protected:
    void SetUp() override {
        CliTest::SetUp();
        ResultHeader header = makeHeader();
        header.title = "Swing'; system('touch owned'); `touch owned`";
        writeRun(folder / "a.h5", 60);
        ResultWriter writer(folder / "b.h5", header);
        writer.beginTransient("run", makeProbes(), makeStates());
        addCircle(writer, 0, 60);
        writer.setComplete("run");
    }

    /** Whether a picture contains this colour. **/
    static bool hasColor(const Image& image, const Image::Pixel& color) {
        for (int y = 0; y < image.getHeight(); ++y)
            for (int x = 0; x < image.getWidth(); ++x)
                if (image.getPixel(x, y) == color) return true;
        return false;
    }
};

TEST_F(PlotTest, PngHasItsSizeTwiceAndTheCurvesColours) {
    ASSERT_EQ(run("plot b.h5 swing -o swing.png --size 500x300"), 0) << err;
    EXPECT_EQ(out, "swing.png\n");
    const Image image = Image::readPng(folder / "swing.png");
    EXPECT_EQ(image.getWidth(), 1000);
    EXPECT_EQ(image.getHeight(), 600);
    EXPECT_TRUE(hasColor(image, {0, 114, 178, 255}));
    EXPECT_TRUE(hasColor(image, {213, 94, 0, 255}));
    EXPECT_THAT(listFiles(folder.path()), Not(::testing::Contains("owned")));
}

TEST_F(PlotTest, SvgHasTitleUnitsAndLegend) {
    ASSERT_EQ(run("plot a.h5 b.h5 swing.x angle -o swing.svg"), 0) << err;
    const std::string svg = readText(folder / "swing.svg");
    for (const char* text : {"Swing", "swing.x [m]", "angle [rad]", "time [s]", "\na\n", "\nb\n"})
        EXPECT_THAT(svg, HasSubstr(text));
    ASSERT_EQ(run("plot a.h5 --analysis modes -o modes.svg --title ''"), 0) << err;
    EXPECT_THAT(readText(folder / "modes.svg"),
                AllOf(HasSubstr("natural frequency [Hz]"), HasSubstr("damping ratio [%]")));
    ASSERT_EQ(run("plot a.h5 --analysis map --orders 1 -o map.pdf"), 0) << err;
    EXPECT_EQ(readText(folder / "map.pdf").substr(0, 5), "%PDF-");
}

TEST_F(PlotTest, MistakesAreExplained) {
    EXPECT_EQ(run("plot a.h5 wing"), 1);
    EXPECT_THAT(err, AllOf(HasSubstr("'wing'"), HasSubstr("did you mean 'swing'?")));
    EXPECT_EQ(run("plot a.h5 --analysis walk"), 1);
    EXPECT_THAT(err, AllOf(HasSubstr("'walk'"), HasSubstr("rest, run, modes, map")));
    EXPECT_EQ(run("plot a.h5 -o swing.jpg"), 1);
    EXPECT_THAT(err, HasSubstr(".png, .svg or .pdf"));
    EXPECT_EQ(run("plot a.h5 --analysis rest"), 1);
    EXPECT_THAT(err, HasSubstr("static"));
    EXPECT_EQ(run("plot a.h5 --together"), 1);
    EXPECT_THAT(err, HasSubstr("one unit"));
    EXPECT_EQ(run("plot a.h5 --x swing"), 1);
    EXPECT_THAT(err, HasSubstr("swing.x, swing.y"));
    EXPECT_EQ(run("plot none.h5"), 1);
    EXPECT_THAT(err, HasSubstr("does not exist"));
    EXPECT_EQ(run("plot a.h5 -o none/swing.png"), 1);
    EXPECT_THAT(err, HasSubstr("none/swing.png"));
}

TEST_F(PlotTest, CompareTellsByItsExitStatusWhetherResultsAgree) {
    EXPECT_EQ(run("compare a.h5 a.h5 --tolerance 0"), 0) << err;
    EXPECT_THAT(out, StartsWith("no difference: "));
    EXPECT_THAT(out, Not(HasSubstr("damping")));
    EXPECT_EQ(run("compare a.h5 b.h5"), 1);
    EXPECT_THAT(err, HasSubstr("analysis 'rest' is only in a"));
    EXPECT_EQ(run("compare a.h5 b.h5 --analysis run --tolerance 0"), 0) << err;
    ResultWriter writer(folder / "c.h5", makeHeader());
    writer.beginTransient("run", makeProbes());
    for (int k = 0; k < 60; ++k) {
        const double t = k * kStep;
        writer.addRow(t, {2 * std::cos(t), 2 * std::sin(t), 1.001 * t});
    }
    writer.flush();
    EXPECT_EQ(run("compare b.h5 c.h5 --plot difference.svg"), 1);
    EXPECT_THAT(err, AllOf(HasSubstr("'angle'"), HasSubstr("0.000999")));
    EXPECT_THAT(out, AllOf(HasSubstr("\n  angle [rad]  0.00059 "), StartsWith("run:\n"),
                           Not(HasSubstr("swing")), HasSubstr("2 of 3 columns are identical")));
    EXPECT_THAT(readText(folder / "difference.svg"),
                AllOf(HasSubstr("angle [rad]"), HasSubstr("difference [rad]")));
    EXPECT_EQ(run("compare b.h5 c.h5 --tolerance 2e-3"), 0) << err;
    EXPECT_EQ(run("compare b.h5 c.h5 swing"), 0) << err;
    EXPECT_EQ(run("compare b.h5 c.h5 wing"), 1);
}

TEST_F(PlotTest, CompareSeesThatResponsesDiffer) {
    Oscillator body;
    for (const char* file : {"a.h5", "b.h5"}) {
        ResultWriter(folder / file, makeHeader()).add(body.respond(50).analyses[0]);
        body.k *= 1.25;
    }
    EXPECT_EQ(run("compare a.h5 a.h5"), 0) << err;
    EXPECT_EQ(run("compare a.h5 b.h5 --plot d.svg"), 1);
    EXPECT_THAT(out, HasSubstr("x by push [m/N]"));
    EXPECT_THAT(err, HasSubstr("'x by push' of analysis 'fr'"));
    EXPECT_THAT(readText(folder / "d.svg"), HasSubstr("frequency [Hz]"));
}

}  // namespace
}  // namespace simflex
