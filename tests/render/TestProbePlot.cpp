#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <thread>

#include "simflex/render/ProbePlot.h"

namespace simflex {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

const double none = std::numeric_limits<double>::quiet_NaN();

std::vector<double> makeTimes(int count, double end = 1) {
    std::vector<double> times;
    for (int i = 0; i < count; ++i) times.push_back(end * i / (count - 1));
    return times;
}

template <class Function>
std::vector<double> map(const std::vector<double>& times, Function f) {
    std::vector<double> values;
    for (const double t : times) values.push_back(f(t));
    return values;
}

double calcDistance(const Image::Pixel& a, const Image::Pixel& b) {
    double sum = 0;
    for (size_t c = 0; c < 3; ++c) sum += std::pow(double(a[c]) - b[c], 2);
    return std::sqrt(sum);
}

/** Returns the mean row of a colour's pixels in a column; NaN if there are none. **/
double findRow(const Image& image, int column, const Image::Pixel& color, double tolerance = 60) {
    double sum = 0, count = 0;
    for (int y = 60; y < image.getHeight() - 60; ++y)
        if (calcDistance(image.getPixel(column, y), color) < tolerance) {
            sum += y + 0.5;
            ++count;
        }
    return count > 0 ? sum / count : none;
}

int countColor(const Image& image, const Image::Pixel& color, double tolerance = 2) {
    int count = 0;
    for (int y = 0; y < image.getHeight(); ++y)
        for (int x = 0; x < image.getWidth(); ++x)
            count += calcDistance(image.getPixel(x, y), color) < tolerance;
    return count;
}

TEST(ProbePlot, ALineOfConstantSlopeIsStraightAndFillsItsRange) {
    const std::vector<double> times = makeTimes(11);
    ProbePlot plot;
    plot.addCurve("", times, map(times, [](double t) { return 3 + 2 * t; }));
    const Image image = plot.draw(800, 400);
    const Image::Pixel color = PlotTheme::light().curves[0];
    // Rows fall linearly with columns.
    const double a = findRow(image, 200, color), b = findRow(image, 400, color),
                 c = findRow(image, 600, color);
    EXPECT_GT(a, b);
    EXPECT_NEAR(a - b, b - c, 1);
    EXPECT_GT(a - c, 0.4 * 400 * 0.5);
}

TEST(ProbePlot, WhatLiesAfterTheMarkIsFaint) {
    const std::vector<double> times = makeTimes(400);
    ProbePlot plot;
    plot.addCurve("", times, map(times, [](double t) { return std::sin(20 * t); }));
    const Image::Pixel color = PlotTheme::light().curves[0];
    int last = -1;
    for (const double mark : {-1.0, 0.25, 0.5, 0.75, 2.0}) {
        const int count = countColor(plot.draw(800, 400, mark), color);
        EXPECT_GT(count, last);
        last = count;
    }
    EXPECT_EQ(countColor(plot.draw(800, 400, -1.0), color), 0);
    EXPECT_NEAR(countColor(plot.draw(800, 400), color), last, 2);
}

TEST(ProbePlot, AtTheMarkStandsADotOnTheCurve) {
    const std::vector<double> times = makeTimes(101);
    ProbePlot plot;
    plot.addCurve("", times, map(times, [](double t) { return 1 - t; }));
    const Image without = plot.draw(800, 400, -1.0), with = plot.draw(800, 400, 0.5);
    // The line and a disc at its crossing with the curve.
    int discRows = 0, column = 0;
    const Image::Pixel color = PlotTheme::light().curves[0];
    for (int x = 0; x < 800; ++x) {
        int rows = 0;
        for (int y = 60; y < 340; ++y) rows += calcDistance(with.getPixel(x, y), color) < 40;
        if (rows > discRows) {
            discRows = rows;
            column = x;
        }
    }
    EXPECT_GE(discRows, 6);
    EXPECT_LE(discRows, 11);
    EXPECT_NEAR(column, 400, 35);  // labels are on the left
    EXPECT_NEAR(findRow(with, column, color), 200, 25);
    EXPECT_EQ(countColor(without, color), 0);
}

TEST(ProbePlot, ASpikeBetweenPixelsIsSeen) {
    const int count = 200000;
    const std::vector<double> times = makeTimes(count);
    std::vector<double> values(times.size(), 0.0);
    values[count / 2 + 7] = 1;
    ProbePlot plot;
    plot.addCurve("", times, values);
    const Image image = plot.draw(700, 400);
    int highest = 400;
    for (int x = 300; x < 460; ++x)
        for (int y = 55; y < 340; ++y)
            if (calcDistance(image.getPixel(x, y), PlotTheme::light().curves[0]) < 120)
                highest = std::min(highest, y);
    EXPECT_LT(highest, 90);
}

TEST(ProbePlot, ValueAtATimeIsInterpolated) {
    ProbePlot plot;
    const int curve = plot.addCurve("", {0, 1, 1, 3}, {0, 10, 20, 40});
    EXPECT_EQ(plot.calcValue(curve, 0.5), 5);
    EXPECT_EQ(plot.calcValue(curve, 0), 0);
    EXPECT_EQ(plot.calcValue(curve, 2), 30);
    EXPECT_EQ(plot.calcValue(curve, 3), 40);
    EXPECT_TRUE(std::isnan(plot.calcValue(curve, -0.1)));
    EXPECT_TRUE(std::isnan(plot.calcValue(curve, 3.1)));
    EXPECT_THROW(plot.calcValue(1, 0), std::out_of_range);
}

TEST(ProbePlot, GrowingCurveEqualsTheOneGivenAtOnce) {
    const std::vector<double> times = makeTimes(50);
    const std::vector<double> values = map(times, [](double t) { return t * t; });
    ProbePlot whole("Both"), growing("Both");
    whole.addPanel("square", "m").addCurve("s", times, values);
    growing.addPanel("square", "m");
    const int curve = growing.addCurve("s");
    for (size_t i = 0; i < times.size(); ++i) growing.append(curve, times[i], values[i]);
    EXPECT_TRUE(growing.draw(400, 300, 0.3) == whole.draw(400, 300, 0.3));
}

TEST(ProbePlot, UnitsScaleNumbersAndNotCurves) {
    const std::vector<double> times = makeTimes(50, 0.2);
    ProbePlot meters, millimeters;
    meters.addPanel("x").addCurve("", times, map(times, [](double t) { return 1e3 * t; }));
    millimeters.addPanel("x", "", 1e-3).addCurve("", times, times);
    EXPECT_TRUE(meters.draw(400, 300) == millimeters.draw(400, 300));
}

TEST(ProbePlot, GapsAndConstantsAndNothingAreDrawn) {
    ProbePlot plot("A title");
    EXPECT_NO_THROW(plot.draw(300, 200));
    plot.addPanel("constant").addCurve("", {0, 1}, {5, 5});
    plot.addPanel("gap").addCurve("", {0, 1, 2, 3}, {1, none, 2, 3});
    plot.addPanel("one point").addCurve("", {1}, {1});
    plot.addPanel("nothing").addCurve("");
    plot.addPanel("all gaps").addCurve("", {0, 1}, {none, none});
    plot.addPanel("tiny").addCurve("", {0, 1}, {1 + 1e-15, 1});
    plot.addPanel("huge").addCurve("", {0, 1}, {-1e300, 1e300});
    EXPECT_NO_THROW(plot.draw(700, 1600, 0.5));
    EXPECT_NO_THROW(plot.draw(1, 1, 0.5));
    EXPECT_NO_THROW(plot.draw(40, 700, 0.5));
}

TEST(ProbePlot, SeveralThreadsDrawTheSameBytes) {
    const std::vector<double> times = makeTimes(300);
    ProbePlot plot("Threads");
    plot.addPanel("sine", "m").addCurve("s", times, map(times, [](double t) {
                                            return std::sin(9 * t);
                                        }));
    const Image expected = plot.draw(500, 300, 0.4);
    std::vector<Image> images(4);
    std::vector<std::thread> threads;
    for (Image& image : images)
        threads.emplace_back([&] {
            for (int i = 0; i < 5; ++i) image = plot.draw(500, 300, 0.4);
        });
    for (std::thread& thread : threads) thread.join();
    for (const Image& image : images) EXPECT_TRUE(image == expected);
}

TEST(ProbePlot, DarkThemeIsDark) {
    ProbePlot plot;
    plot.addCurve("", {0, 1}, {0, 1});
    const Image image = plot.draw(300, 200, none, 1, PlotTheme::dark());
    EXPECT_EQ(image.getPixel(2, 2), PlotTheme::dark().background);
    EXPECT_FALSE(image.hasTransparency());
}

TEST(ProbePlot, TransparentBackgroundStaysTransparent) {
    PlotTheme theme = PlotTheme::light();
    theme.background[3] = 0;
    ProbePlot plot;
    plot.addCurve("", {0, 1}, {0, 1});
    const Image image = plot.draw(300, 200, none, 1, theme);
    EXPECT_EQ(image.getPixel(2, 2)[3], 0);
    EXPECT_GT(countColor(image, theme.curves[0]), 50);
}

TEST(ProbePlot, WrongCurvesAreRefusedByName) {
    ProbePlot plot;
    EXPECT_THAT(
        [&] {
            plot.addCurve("rod", {0, 1}, {0});
        },
        ThrowsMessage<std::invalid_argument>(
            AllOf(HasSubstr("'rod'"), HasSubstr("2 times"), HasSubstr("1 values"))));
    EXPECT_THAT(
        [&] {
            plot.addCurve("rod", {0, 2, 1}, {0, 0, 0});
        },
        ThrowsMessage<std::invalid_argument>(HasSubstr("'rod'")));
    EXPECT_THROW(plot.addCurve("rod", {0, none}, {0, 0}), std::invalid_argument);
    const int curve = plot.addCurve("rod", {0, 1}, {0, 0});
    EXPECT_THROW(plot.append(curve, 0.5, 0), std::invalid_argument);
    EXPECT_THROW(plot.append(curve, none, 0), std::invalid_argument);
    EXPECT_THROW(plot.append(7, 2, 0), std::out_of_range);
    EXPECT_THROW(plot.addPanel("x", "mm", 0), std::invalid_argument);
    EXPECT_THROW(plot.setTimeRange(1, 1), std::invalid_argument);
    EXPECT_THROW(plot.setValueRange(1, none), std::invalid_argument);
    EXPECT_THROW(plot.setTimeUnit("ms", 0), std::invalid_argument);
    EXPECT_THROW(plot.draw(0, 10), std::invalid_argument);
    EXPECT_THROW(plot.draw(10, 40000), std::invalid_argument);
}

}  // namespace
}  // namespace simflex
