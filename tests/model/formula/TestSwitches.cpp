/** @file
Switching times of formulas, against those that follow from their text. **/

#include <gmock/gmock.h>

#include <cmath>

#include "simflex/model/formula/Formula.h"

using namespace simflex::formula;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

namespace {

const double kPi = std::acos(-1.0);

std::vector<double> find(const std::string& text, double from, double to) {
    Scope scope;
    scope.constants["pi"] = kPi;
    scope.tables["road"] = std::make_shared<Table>("road", std::vector<double>{0, 0.125, 2, 5},
                                                   std::vector<double>{0, 3, 1, 2});
    scope.surfaces["map"] = std::make_shared<SurfaceTable>(
        "map", std::vector<double>{0, 1, 3}, std::vector<double>{0, 2, 5},
        std::vector<std::vector<double>>{{0, 1, 3}, {2, 2, 2}, {0, 1, 1}},
        Table::Interpolation::Linear);
    return Formula(text, scope, {"t"}).findSwitches(from, to);
}

void expectTimes(const std::vector<double>& found, const std::vector<double>& expected) {
    ASSERT_EQ(found.size(), expected.size());
    for (size_t i = 0; i < found.size(); ++i)
        EXPECT_NEAR(found[i], expected[i], 4e-16 * std::max(1.0, std::abs(expected[i])));
}

}  // namespace

TEST(Switches, OfLinearArgumentsAreExact) {
    EXPECT_THAT(find("20*pulse(t, 0.5, 0.6)", 0, 10), ElementsAre(0.5, 0.6));
    EXPECT_THAT(find("if(t < 0.1, 0, -20)", 0, 10), ElementsAre(0.1));
    EXPECT_THAT(find("t <= 0.1 ? 0 : -20", 0, 10), ElementsAre(0.1));
    EXPECT_THAT(find("0.1 > t ? 0 : -20", 0, 10), ElementsAre(0.1));
    EXPECT_THAT(find("step(t, 0.1, 0, 0.7, 5) + ramp(t, 3, 0, 4, 1)", 0, 10),
                ElementsAre(0.1, 0.7, 3, 4));
    EXPECT_THAT(find("abs(t - 0.3) + sign(2*t - 3) + max(t, 2.7) + min(1, 5*t)", 0, 10),
                ElementsAre(0.2, 0.3, 1.5, 2.7));
    EXPECT_THAT(find("floor(t) + ceil(2*t)", 0, 2.2), ElementsAre(0.5, 1, 1.5, 2));
    EXPECT_THAT(find("mod(t, 0.25)", 0.1, 1.1), ElementsAre(0.25, 0.5, 0.75, 1));
    EXPECT_THAT(find("2*road(t - 1)", 0, 10), ElementsAre(1, 1.125, 3, 6));
}

TEST(Switches, AreThoseInTheIntervalWithoutItsBeginning) {
    EXPECT_THAT(find("pulse(t, 0.5, 0.6)", 0.5, 0.6), ElementsAre(0.6));
    EXPECT_THAT(find("pulse(t, 0.5, 0.6)", 0.6, 100), IsEmpty());
    EXPECT_THAT(find("pulse(t, 0.5, 0.6)", 0, 0.4), IsEmpty());
}

TEST(Switches, OfSmoothFormulasAreNone) {
    EXPECT_THAT(find("sin(100*t) + t^2*exp(-t)/(1 + t)", 0, 1000), IsEmpty());
    EXPECT_THAT(find("max(1.5, sin(600*t))", 0, 1e6), IsEmpty());
    EXPECT_THAT(find("if(sin(600*t) > 2, 1, t)", 0, 1e6), IsEmpty());
}

TEST(Switches, OfOscillationsAreAllFound) {
    std::vector<double> expected;
    for (int k = 1; k * kPi / 600 <= 1; ++k) expected.push_back(k * kPi / 600);
    expectTimes(find("0.01*max(0, sin(600*t))^4", 0, 1), expected);

    expected.clear();
    for (int k = 0; k < 1000; ++k) {
        if (k > 0) expected.push_back(0.01 * k);
        expected.push_back(0.01 * k + 0.002);
    }
    const std::vector<double> train = find("mod(t, 0.01) < 0.002 ? 1 : 0", 0, 9.9999);
    ASSERT_EQ(train.size(), expected.size());
    for (size_t i = 0; i < train.size(); ++i) EXPECT_NEAR(train[i], expected[i], 1e-14);
}

TEST(Switches, OfShortPassingsAreFound) {
    // cos(x) = 0.99999 at x = 4.472e-3 from every full turn
    const double beside = std::acos(0.99999) / 50;
    std::vector<double> expected{beside};
    for (int k = 1; k < 8; ++k)
        for (double side : {-beside, beside}) expected.push_back(2 * kPi * k / 50 + side);
    const std::vector<double> found = find("if(cos(50*t) > 0.99999, 1, 0)", 0, 0.99);
    ASSERT_EQ(found.size(), expected.size());
    for (size_t i = 0; i < found.size(); ++i) EXPECT_NEAR(found[i], expected[i], 1e-11);
    EXPECT_THAT(find("if(t^2 - 2*t + 1 < 1e-8, 1, 0)", 0, 10).size(), 2);
}

TEST(Switches, OfNestedChoicesAreThoseOfWhatIsTaken) {
    EXPECT_THAT(find("if(t < 1, pulse(t, 0.2, 3), pulse(t, 0.3, 4))", 0, 10),
                ElementsAre(0.2, 1, 4));
    EXPECT_THAT(find("max(0, if(t < 1, t - 0.5, 2.5 - t))", 0, 10), ElementsAre(0.5, 1, 2.5));
    EXPECT_THAT(find("if(max(0, t - 1) > 0.5, 1, 0)", 0, 10), ElementsAre(1, 1.5));
    EXPECT_THAT(find("if(max(0, t - 1) > 0, 1, 0)", 0, 10), ElementsAre(1));
    expectTimes(find("abs(abs(t - 2) - 1)", 0, 10), {1, 2, 3});
    EXPECT_THAT(find("t > 1 && sqrt(t - 1) > 2 ? 1 : 0", 0, 10), ElementsAre(1, 5));
}

TEST(Switches, OfAbsoluteValuesAreFoundHoweverTheyAreWritten) {
    for (const char* text : {"abs(t - 0.3)", "sqrt((t - 0.3)^2)", "sqrt((t - 0.3)*(t - 0.3))",
                             "hypot(t - 0.3, 0)", "hypot(0, t - 0.3)", "((t - 0.3)^2)^0.5",
                             "hypot(t - 0.3, (t - 0.3)^2)", "1/(1 + sqrt((t - 0.3)^2))"}) {
        SCOPED_TRACE(text);
        expectTimes(find(text, 0, 10), {0.3});
    }
    // |sin| as the root of a function that never changes sign: 1 − cos 2t = 2 sin² t
    std::vector<double> expected;
    for (int k = 1; k <= 3; ++k) expected.push_back(k * kPi);
    for (const char* text : {"sqrt(sin(t)^2)", "sqrt(1 - cos(2*t))", "hypot(sin(t), t * sin(t))"}) {
        SCOPED_TRACE(text);
        const std::vector<double> found = find(text, 0, 10);
        ASSERT_EQ(found.size(), expected.size());
        for (size_t i = 0; i < found.size(); ++i) EXPECT_NEAR(found[i], expected[i], 1e-14);
    }
    // A sawtooth
    for (const char* text : {"asin(sin(t))", "acos(sin(t))"}) {
        const std::vector<double> found = find(text, 0, 10);
        ASSERT_EQ(found.size(), 3u) << text;
        for (size_t i = 0; i < found.size(); ++i)
            EXPECT_NEAR(found[i], (double(i) + 0.5) * kPi, 1e-8) << text;
    }
    for (const char* text :
         {"sqrt(t^2 + 1e-3)", "sqrt((t - 0.3)^4 + t^2)", "hypot(t - 0.3, t - 0.4)", "hypot(t, 1)",
          "hypot(sin(t), cos(t))", "sqrt(1.01 + sin(600*t))", "asin(0.999*sin(t))"}) {
        SCOPED_TRACE(text);
        EXPECT_THAT(find(text, 0.001, 1), IsEmpty());
    }
}

TEST(Switches, OfTablesInConditionsAreFound) {
    // The spline through (0,0), (0.125,3), (2,1), (5,2)
    const std::vector<double> found = find("if(road(t) > 0.5, 1, 0)", 0, 5);
    Scope scope;
    const Table table("road", {0, 0.125, 2, 5}, {0, 3, 1, 2});
    for (double time : found) {
        const bool isPoint = time == 0.125 || time == 2 || time == 5;
        if (!isPoint) {
            EXPECT_NEAR(table.calc(time), 0.5, 1e-13);
        }
    }
    int numPassings = 0;
    for (int i = 1; i <= 100000; ++i)
        if ((table.calc(5e-5 * i) > 0.5) != (table.calc(5e-5 * (i - 1)) > 0.5)) ++numPassings;
    EXPECT_EQ(int(found.size()), numPassings + 3);
    EXPECT_GT(numPassings, 0);
}

TEST(Switches, AreFoundFarFromZero) {
    EXPECT_THAT(find("pulse(t, 86400.5, 86401)", 0, 1e6), ElementsAre(86400.5, 86401));
    const std::vector<double> train = find("mod(t, 1) < 0.5 ? 1 : 0", 1e6 + 0.1, 1e6 + 2.1);
    EXPECT_THAT(train, ElementsAre(1e6 + 0.5, 1e6 + 1, 1e6 + 1.5, 1e6 + 2));
}

TEST(Switches, OfTablesOfTwoVariablesAreWhereTheirLinesAre) {
    expectTimes(find("map(t, t/2)", -1, 20), {0, 1, 3, 4, 10});
    // 2x + y/2 − xy/2 on the first facet
    expectTimes(find("map(t, 1) > 1 ? 1 : 0", 0.01, 0.9), {1. / 3});
}
