/** @file
Functions of time against closed forms, and tables against the functions that they sample. **/

#include <gmock/gmock.h>

#include <cmath>
#include <fstream>
#include <thread>

#include "cli/model/ReadText.h"
#include "simflex/model/file/Formula.h"
#include "support/TestFolder.h"

using namespace simflex;
using namespace simflex::model;
using simflex::formula::readTableFile;
using simflex::formula::Table;
using simflex::testing::readRest;
using simflex::testing::refuseRest;
using ::testing::HasSubstr;

namespace {

const char* const kTables =
    "parameters: {A: 0.1, f: 5}\n"
    "tables:\n"
    "  cubic: {x: [-1, 0, 0.5, 2, 3, 4.5], y: [-5, 1, 2.125, 11, 31, 98.125]}\n"
    "  lines: {x: [0, 1, 3], y: [0, 5, 1], interpolation: linear, extrapolation: linear}\n"
    "  stairs: {x: [0, 1, 3], y: [0, 5, 1], interpolation: step}\n"
    "  strict: {x: [0, 1, 3], y: [0, 5, 1], extrapolation: refuse}\n";

Expression make(const std::string& formula) {
    return readRest(kTables + ("motions: {m: {joint: j, position: \"" + formula + "\"}}\n"))
        .get("motions")
        .get("m")
        .get("position")
        .getExpression();
}

double calcConstantOf(const std::string& formula) {
    return calcConstant(formula, formula::Scope());
}

std::string refuseFormula(const std::string& formula) {
    try {
        readFormula(formula, {}, {"t"});
    } catch (const formula::SyntaxError& error) {
        return error.what();
    }
    ADD_FAILURE() << "accepted: " << formula;
    return "";
}

double calcCubic(double x) {
    return x * x * x + x / 2 + 1;
}

}  // namespace

TEST(Expression, FunctionsHaveTheirUsualValues) {
    EXPECT_DOUBLE_EQ(calcConstantOf("2^3^2"), 512);
    EXPECT_DOUBLE_EQ(calcConstantOf("-2^2"), -4);
    EXPECT_DOUBLE_EQ(calcConstantOf("1 - 2 - 3"), -4);
    EXPECT_DOUBLE_EQ(calcConstantOf("ln(exp(2)) + log(exp(1)) + log10(1000)"), 6);
    EXPECT_DOUBLE_EQ(calcConstantOf("atan2(1, -1)"), 3 * M_PI / 4);
    EXPECT_DOUBLE_EQ(calcConstantOf("hypot(3, 4) + floor(-1.5) + ceil(1.2) + sign(-3)"), 4);
    EXPECT_DOUBLE_EQ(calcConstantOf("min(3, 1, 2) + max(4, 6) + abs(-2)"), 9);
    EXPECT_DOUBLE_EQ(calcConstantOf("mod(-1, 3)"), 2);
    EXPECT_DOUBLE_EQ(calcConstantOf("if(1 < 2, 10, 20) + (3 >= 4 ? 1 : 2)"), 12);
    EXPECT_DOUBLE_EQ(calcConstantOf("1 == 1 && 2 != 3 || 0"), 1);
    EXPECT_DOUBLE_EQ(calcConstantOf("sinh(1)^2"), std::pow(std::cosh(1.0), 2) - 1);
    EXPECT_DOUBLE_EQ(calcConstantOf("asin(1) + acos(1) + atan(0) + tan(0) + tanh(0)"), M_PI / 2);
    EXPECT_DOUBLE_EQ(calcConstantOf(".5 + 1.e-1 + 1E+1"), 10.6);
}

TEST(Expression, PulseRampAndStepHaveTheirShapes) {
    const Expression pulse = make("pulse(t, 1, 2)");
    EXPECT_EQ(pulse.calcValue(0.99), 0);
    EXPECT_EQ(pulse.calcValue(1), 1);
    EXPECT_EQ(pulse.calcValue(2), 0);
    const Expression ramp = make("ramp(t, 1, 10, 3, 20)");
    EXPECT_EQ(ramp.calcValue(0), 10);
    EXPECT_EQ(ramp.calcValue(2), 15);
    EXPECT_EQ(ramp.calcValue(9), 20);
    const Expression step = make("step(t, 1, 10, 3, 20)");
    EXPECT_EQ(step.calcValue(1), 10);
    EXPECT_EQ(step.calcValue(2), 15);
    EXPECT_EQ(step.calcValue(3), 20);
    for (double end : {1.0, 3.0}) {  // s³(10 - 15 s + 6 s²) is flat and straight at both ends
        EXPECT_NEAR(step.calcMotion(end)[1], 0, 1e-5);
        EXPECT_NEAR(step.calcMotion(end)[2], 0, 2e-3);
    }
    EXPECT_NEAR(step.calcMotion(2)[1], 10 * 1.875 / 2, 1e-10);
}

TEST(Expression, DerivativesMatchClosedForms) {
    struct Case {
        const char* formula;
        double time, first, second, scale;
    };
    const double w = 2 * M_PI * 5, w3 = 2 * M_PI * 3000;
    const Case cases[] = {
        {"150*t", 0.3, 150, 0, 150},
        {"150*t", 1000, 150, 0, 150e3},
        {"A*sin(2*pi*f*t)", 0.123, 0.1 * w * std::cos(w * 0.123),
         -0.1 * w * w * std::sin(w * 0.123), 0.1 * w},
        {"A*sin(2*pi*f*t)", 50.1, 0.1 * w * std::cos(w * 50.1), -0.1 * w * w * std::sin(w * 50.1),
         0.1 * w},
        {"exp(-3*t)", 1, -3 * std::exp(-3.0), 9 * std::exp(-3.0), 1},
        {"t^5", 2, 80, 160, 100},
        {"sin(2*pi*3000*t)", 1e-4, w3 * std::cos(w3 * 1e-4), -w3 * w3 * std::sin(w3 * 1e-4), w3},
        {"1/(1+t^2)", 0.5, -1 / 1.5625, (6 * 0.25 - 2) / std::pow(1.25, 3), 1},
    };
    for (const Case& c : cases) {
        SCOPED_TRACE(c.formula);
        const Expression expression = make(c.formula);
        EXPECT_NEAR(expression.calcMotion(c.time)[1], c.first, 1e-9 * c.scale);
        EXPECT_NEAR(expression.calcMotion(c.time)[2], c.second,
                    1e-6 * std::max(c.scale, std::fabs(c.second)));
    }
}

TEST(Expression, WholeNumbersOfPeriodsDoNotHideTheMotion) {
    for (int hertz : {1, 10, 27, 50, 100, 1000}) {
        const Expression expression = make("sin(2*pi*" + std::to_string(hertz) + "*t)");
        EXPECT_NEAR(expression.calcMotion(3)[1], 2 * M_PI * hertz, 1e-6 * hertz) << hertz;
    }
}

TEST(Expression, ABranchThatIsNotTakenIsNotCalculated) {
    for (const char* formula :
         {"t < 1 ? sqrt(1 - t) : 0", "if(t < 1, sqrt(1 - t), 0)", "if(t >= 1, 0, strict(4*t - 1))",
          "t < 1 ? strict(t) : 0", "if(t < 1, strict(t), if(t < 1.5, 1/0, 0))",
          "2*if(t<1,ln(1-t),0)", "t > 1 ? 0 : if(t < 0.5, t, sqrt(1 - t))"}) {
        SCOPED_TRACE(formula);
        const Expression expression = make(formula);
        EXPECT_EQ(expression.calcValue(2), 0);
        EXPECT_EQ(expression.calcMotion(2)[1], 0);
        EXPECT_EQ(expression.calcMotion(2)[2], 0);
    }
    EXPECT_DOUBLE_EQ(make("if(t < 1, sqrt(1 - t), 0)").calcValue(0.75), 0.5);
    EXPECT_DOUBLE_EQ(make("2*if(t<1,ln(1-t),0) + 1").calcValue(0.5), 1 + 2 * std::log(0.5));
    EXPECT_DOUBLE_EQ(make("if(if(t > 1, 1, 0), max(1, t), min(2*t, 3))").calcValue(1.5), 1.5);
    EXPECT_DOUBLE_EQ(make("if(if(t > 1, 1, 0), max(1, t), min(2*t, 3))").calcValue(0.5), 1);
    EXPECT_DOUBLE_EQ(make("3 - if(t > A, t, 0) - if(A > 1, 1, 2)").calcValue(0.5), 0.5);
    // The selected branch still fails.
    EXPECT_THROW(make("if(t < 1, 0, sqrt(1 - t))").calcValue(2), ModelError);
    EXPECT_THROW(make("t < 1 ? 0 : strict(4*t)").calcValue(2), ModelError);
    EXPECT_THAT(refuseFormula("if(t < 1, 2)"), HasSubstr("'if' has too few arguments"));
    EXPECT_THAT(refuseFormula("1 + if(t < 1, 2, 3, 4)"), HasSubstr("'if' has too many arguments"));
}

TEST(Expression, DerivativesOnBothSidesOfABranchAreThoseOfTheSide) {
    for (const double distance : {1e-4, 1e-3, 0.01, 0.04, 0.3}) {
        SCOPED_TRACE(distance);
        const double before = 1 - distance, after = 1 + distance;
        const Expression root = make("t < 1 ? sqrt(1 - t) : 0");
        const double slope = -0.5 / std::sqrt(distance);
        EXPECT_NEAR(root.calcMotion(before)[1] / slope, 1, 1e-6);
        EXPECT_NEAR(root.calcMotion(before)[2] / (0.5 * slope / distance), 1, 1e-3);
        EXPECT_NEAR(root.calcMotion(after)[1], 0, 1e-9);
        EXPECT_NEAR(root.calcMotion(after)[2], 0, 1e-6);

        const Expression smooth = make("if(t < 1, t^2, 2*t - 1)");
        EXPECT_NEAR(smooth.calcMotion(before)[1], 2 * before, 1e-8);
        EXPECT_NEAR(smooth.calcMotion(after)[1], 2, 1e-8);
        EXPECT_NEAR(smooth.calcMotion(before)[2], 2, 1e-3);
        EXPECT_NEAR(smooth.calcMotion(after)[2], 0, 1e-3);

        const Expression start = make("t < 1 ? 0 : 0.1*(1 - cos(20*(t - 1)))");
        EXPECT_NEAR(start.calcMotion(before)[1], 0, 1e-9);
        EXPECT_NEAR(start.calcMotion(before)[2], 0, 1e-6);
        EXPECT_NEAR(start.calcMotion(after)[1], 2 * std::sin(20 * distance), 1e-7);
        EXPECT_NEAR(start.calcMotion(after)[2], 40 * std::cos(20 * distance), 1e-2);
    }
}

TEST(Expression, ValuesThatAreNotFiniteNameTheFormula) {
    try {
        make("sqrt(1 - t)").calcValue(2);
        FAIL() << "the root of a negative number is a number";
    } catch (const ModelError& error) {
        EXPECT_THAT(error.what(),
                    ::testing::StartsWith("m.yaml:8:36: motions.m.position: 'sqrt(1 - t)' has "
                                          "no finite value at t = 2"));
    }
    EXPECT_THROW(make("1/(t-1)").calcValue(1), ModelError);
}

TEST(Expression, ConstantsDoNotMove) {
    for (const char* formula : {"3", "pi/2", "2*A"}) {
        const Expression expression = make(formula);
        EXPECT_TRUE(expression.isConstant());
        EXPECT_EQ(expression.calcMotion(1)[1], 0);
        EXPECT_EQ(expression.calcMotion(1)[2], 0);
    }
    EXPECT_FALSE(make("0*t").isConstant());
    EXPECT_EQ(Expression(2.5).calcValue(7), 2.5);
    EXPECT_EQ(Expression(2.5).getText(), "2.5");
}

TEST(Expression, NothingButFormulasIsRead) {
    EXPECT_THAT(refuseFormula("t = 3"), HasSubstr("assigns nothing"));
    EXPECT_THAT(refuseFormula("\"a\""), HasSubstr("has no meaning"));
    EXPECT_THAT(refuseFormula("t; t"), HasSubstr("has no meaning"));
    EXPECT_THAT(refuseFormula("system(1)"),
                HasSubstr("'system' is not a parameter, table or function"));
    EXPECT_THAT(refuseFormula("rnd()"), HasSubstr("not a parameter, table or function"));
    EXPECT_THAT(refuseFormula("_pi"), HasSubstr("not a parameter, table or function"));
    EXPECT_THAT(refuseFormula("sin(t"), HasSubstr("')' is missing"));
    EXPECT_THAT(refuseFormula("sin t"), HasSubstr("sin needs its arguments in parentheses"));
    EXPECT_THAT(refuseFormula("t)"), HasSubstr("')' too many"));
    EXPECT_THAT(refuseFormula("atan2(t)"), HasSubstr("too few arguments"));
    EXPECT_THAT(refuseFormula("sin(t, t)"), HasSubstr("too many arguments"));
    EXPECT_THAT(refuseFormula("t +"), HasSubstr("ends too early"));
    EXPECT_THAT(refuseFormula("t ? 1"), HasSubstr("':'"));
    EXPECT_THAT(refuseFormula("t**2"), HasSubstr("write ^"));
    EXPECT_THAT(refuseFormula("3,5"), HasSubstr("decimals are written with a point"));
    EXPECT_THAT(refuseFormula("\xC2\xB5"), HasSubstr("not allowed in a formula"));
    EXPECT_THAT(refuseFormula(""), HasSubstr("missing"));
    EXPECT_THAT(refuseFormula(std::string(20000, '1')), HasSubstr("at most 10000"));
}

TEST(Expression, SeveralThreadsMayEvaluateTheSame) {
    const Expression expression = make("A*sin(2*pi*f*t) + cubic(t)");
    std::vector<double> alone;
    for (int i = 0; i < 4000; ++i) alone.push_back(expression.calcValue(1e-3 * i));
    std::vector<int> numDifferent(4, 0);
    std::vector<std::thread> threads;
    for (int k = 0; k < 4; ++k)
        threads.emplace_back([&, k] {
            for (int i = 0; i < 4000; ++i)
                if (expression.calcValue(1e-3 * i) != alone[size_t(i)]) ++numDifferent[size_t(k)];
        });
    for (std::thread& thread : threads) thread.join();
    EXPECT_THAT(numDifferent, ::testing::Each(0));
}

TEST(Table, SplinesReproduceCubics) {
    std::vector<double> x{-1, 0, 0.5, 2, 3, 4.5}, y;
    for (double value : x) y.push_back(calcCubic(value));
    const Table table("cubic", x, y);
    for (double value = -1; value <= 4.5; value += 0.05) {
        EXPECT_NEAR(table.calc(value), calcCubic(value), 1e-12 * 100);
        EXPECT_NEAR(table.calc(value, 1), 3 * value * value + 0.5, 1e-11 * 100);
        EXPECT_NEAR(table.calc(value, 2), 6 * value, 1e-10 * 100);
    }
}

TEST(Table, ThreePointsMakeAParabolaAndTwoALine) {
    const Table parabola("p", {0, 1, 3}, {1, 2, 10});
    for (double x : {0.0, 0.7, 2.2, 3.0}) EXPECT_NEAR(parabola.calc(x), 1 + x * x, 1e-14 * 10);
    const Table line("l", {0, 2}, {1, 5});
    EXPECT_DOUBLE_EQ(line.calc(0.5), 2);
    EXPECT_DOUBLE_EQ(line.calc(0.5, 1), 2);
}

TEST(Table, SplinesOfSmoothFunctionsConvergeWithFourthOrder) {
    const auto calcError = [](int count) {
        std::vector<double> x, y;
        for (int i = 0; i <= count; ++i) {
            x.push_back(2.0 * i / count);
            y.push_back(std::sin(3 * x.back()));
        }
        const Table table("sine", x, y);
        double error = 0;
        for (double at = 0; at <= 2; at += 0.0013)
            error = std::max(error, std::fabs(table.calc(at) - std::sin(3 * at)));
        return error;
    };
    const double order = std::log2(calcError(40) / calcError(80));
    EXPECT_GT(order, 3.7);
    EXPECT_LT(order, 4.4);
}

TEST(Table, SplinesAreTwiceContinuouslyDifferentiable) {
    const Table table("t", {0, 1, 1.5, 4, 5}, {0, 3, -1, 2, 2});
    for (double knot : {1.0, 1.5, 4.0})
        for (int order : {0, 1, 2})
            EXPECT_NEAR(table.calc(knot - 1e-9, order), table.calc(knot + 1e-9, order), 1e-6)
                << knot;
    const double y[] = {0, 3, -1, 2, 2}, x[] = {0, 1, 1.5, 4, 5};
    for (int i = 0; i < 5; ++i) EXPECT_NEAR(table.calc(x[i]), y[i], 1e-14);
}

TEST(Table, LinesAndStepsAndEndsAreAsNamed) {
    const Expression lines = make("lines(t)"), stairs = make("stairs(t)"),
                     strict = make("strict(t)");
    EXPECT_DOUBLE_EQ(lines.calcValue(2), 3);
    EXPECT_DOUBLE_EQ(lines.calcMotion(2)[1], -2);
    EXPECT_DOUBLE_EQ(lines.calcValue(4), -1);
    EXPECT_DOUBLE_EQ(lines.calcValue(-1), -5);
    EXPECT_DOUBLE_EQ(stairs.calcValue(0.99), 0);
    EXPECT_DOUBLE_EQ(stairs.calcValue(1), 5);
    EXPECT_DOUBLE_EQ(stairs.calcValue(3), 1);
    EXPECT_DOUBLE_EQ(make("cubic(t)").calcValue(-7), -5);
    EXPECT_DOUBLE_EQ(make("cubic(t)").calcMotion(-7)[1], 0);
    try {
        strict.calcValue(3.5);
        FAIL() << "a table that refuses went on";
    } catch (const ModelError& error) {
        EXPECT_THAT(error.what(), HasSubstr("evaluated at 3.5, outside its points from 0 to 3"));
    }
}

TEST(Table, BoundsHoldEveryValueBetween) {
    using simflex::formula::Interval;
    for (const auto interpolation :
         {Table::Interpolation::Spline, Table::Interpolation::Linear, Table::Interpolation::Step}) {
        const Table table("t", {0, 1, 1.5, 4, 5}, {0, 3, -1, 2, 2}, interpolation);
        for (double low = -0.5; low < 5.5; low += 0.17)
            for (double width : {0.0, 0.1, 0.6, 3.0})
                for (int order : {0, 1, 2}) {
                    const Interval bounds = table.calcBounds({low, low + width}, order);
                    for (int i = 0; i <= 20; ++i) {
                        const double value = table.calc(low + i / 20.0 * width, order);
                        EXPECT_GE(value, bounds.low - 1e-12);
                        EXPECT_LE(value, bounds.high + 1e-12);
                    }
                }
    }
}

TEST(Table, DerivativesOfTablesAreExact) {
    const Table table("cubic", {-1, 0, 0.5, 2, 3, 4.5}, {-5, 1, 2.125, 11, 31, 98.125});
    const Expression expression = make("cubic(t)");
    EXPECT_EQ(expression.calcMotion(1.7)[1], table.calc(1.7, 1));
    EXPECT_EQ(expression.calcMotion(1.7)[2], table.calc(1.7, 2));
}

TEST(Table, FilesAreReadInTheUsualFormats) {
    const simflex::testing::TestFolder folder;
    const auto read = [&](const std::string& text, int columnX, int columnY) {
        std::ofstream(folder / "table.csv", std::ios::binary) << text;
        auto columns = readTableFile(folder / "table.csv", {columnX, columnY});
        columns[0].insert(columns[0].end(), columns[1].begin(), columns[1].end());
        return columns[0];
    };
    using ::testing::ElementsAre;
    EXPECT_THAT(read("0,1\n2,3\n", 0, 1), ElementsAre(0, 2, 1, 3));
    EXPECT_THAT(read("\xEF\xBB\xBFtime;force\r\n0;1\r\n2;3\r\n", 0, 1), ElementsAre(0, 2, 1, 3));
    EXPECT_THAT(read("# x y z\n 0\t1\t5\n\n 2 3 6", 0, 2), ElementsAre(0, 2, 5, 6));
    EXPECT_THAT(read("0, -1e-3\n2, +3\n", 1, 0), ElementsAre(-1e-3, 3, 0, 2));
}

TEST(Table, BadFilesAreRefusedWithTheirLine) {
    const simflex::testing::TestFolder folder;
    const auto refuse = [&](const std::string& text) -> std::string {
        std::ofstream(folder / "table.csv", std::ios::binary) << text;
        try {
            readTableFile(folder / "table.csv", {0, 1});
        } catch (const std::runtime_error& error) {
            return error.what();
        }
        return "accepted";
    };
    EXPECT_THAT(refuse("0,1\n1,a\n"), HasSubstr("table.csv:2: 'a' is not a finite number"));
    EXPECT_THAT(refuse("0,1\n1\n"), HasSubstr("table.csv:2: the line has 1 columns"));
    EXPECT_THAT(refuse("0,nan\n1,2\n"), HasSubstr("table.csv:1: 'nan' is not a finite number"));
    EXPECT_THAT(refuse("0,1\ntime,2\n"), HasSubstr("table.csv:2"));
    // Text after a zero byte is not silently lost, with or without an end of line.
    for (const std::string rest : {"5", "5\n"})
        EXPECT_THAT(refuse("0,1\n1,2" + std::string(1, '\0') + rest),
                    HasSubstr("table.csv:2: there is a zero byte"));
    EXPECT_EQ(refuse("0,1\n1,2"), "accepted");
    EXPECT_THAT(refuse("0,1\n" + std::string(200000, '1')),
                HasSubstr("table.csv:2: the line is too long"));
    // Decimal commas, as in European spreadsheets.
    for (const char* line : {"0;1,5", "0,0;1,5", "0\t1,5", "0 1,5", "0;1.000,5"})
        EXPECT_THAT(refuse("0;1\n" + std::string(line) + "\n"),
                    ::testing::AllOf(HasSubstr("table.csv:2:"), HasSubstr("not with a comma")))
            << line;
}
