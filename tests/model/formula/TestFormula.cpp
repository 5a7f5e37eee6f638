/** @file
Values and derivatives of formulas against closed forms, and against differences of the same
functions in extended precision. **/

#include <gmock/gmock.h>

#include <cmath>
#include <random>

#include "simflex/model/formula/Formula.h"

using namespace simflex::formula;
using ::testing::HasSubstr;

namespace {

using Real = long double;

const double kPi = std::acos(-1.0);
const double kWidth = 0.003;

Scope makeScope() {
    Scope scope;
    scope.constants = {{"pi", kPi}, {"deg", kPi / 180}, {"A", 0.1}, {"w", 7.0}};
    scope.tables["cubic"] = std::make_shared<Table>(
        "cubic", std::vector<double>{-1, 0, 0.5, 2, 3, 4.5},
        std::vector<double>{-5, 1, 2.125, 11, 31, 98.125});  // x³ + x/2 + 1... at the points
    scope.tables["lines"] =
        std::make_shared<Table>("lines", std::vector<double>{0, 1, 3}, std::vector<double>{0, 5, 1},
                                Table::Interpolation::Linear, Table::Extrapolation::Linear);
    scope.tables["strict"] = std::make_shared<Table>(
        "strict", std::vector<double>{0, 1, 3}, std::vector<double>{0, 5, 1},
        Table::Interpolation::Spline, Table::Extrapolation::Refuse);
    // x³y² + xy at the points
    const std::vector<double> x{-1, 0, 0.5, 2, 3}, y{0, 1, 1.5, 4};
    std::vector<std::vector<double>> z;
    for (double a : x) {
        z.emplace_back();
        for (double b : y) z.back().push_back(a * a * a * b * b + a * b);
    }
    using Interpolation = Table::Interpolation;
    using Extrapolation = Table::Extrapolation;
    scope.surfaces["map"] = std::make_shared<SurfaceTable>("map", x, y, z);
    scope.surfaces["facets"] = std::make_shared<SurfaceTable>(
        "facets", x, y, z, Interpolation::Linear, Extrapolation::Linear);
    scope.surfaces["grid"] = std::make_shared<SurfaceTable>("grid", x, y, z, Interpolation::Spline,
                                                            Extrapolation::Refuse);
    return scope;
}

Jet<double> calc(const std::string& text, double time) {
    const Jet<double> now = Jet<double>::makeVariable(time);
    return Formula(text, makeScope(), {"t"}).calc(&now);
}

std::string refuse(const std::string& text) {
    try {
        Formula(text, makeScope(), {"t"});
    } catch (const SyntaxError& error) {
        return error.what();
    }
    ADD_FAILURE() << "accepted: " << text;
    return "";
}

std::string explain(const std::string& text, double time) {
    const Formula formula(text, makeScope(), {"t"});
    EXPECT_FALSE(std::isfinite(formula.calc(&time))) << text;
    return formula.explain(&time);
}

}  // namespace

TEST(Formula, ValuesAndDerivativesAreThoseOfTheFunction) {
    struct Case {
        const char* text;
        Real (*function)(Real);
    };
    const Case cases[] = {
        {"3*t^2 - 2*t + 1", [](Real t) { return 3 * t * t - 2 * t + 1; }},
        {"-t^2", [](Real t) { return -t * t; }},
        {"t^0", [](Real) { return Real(1); }},
        {"t^1", [](Real t) { return t; }},
        {"t^5", [](Real t) { return std::pow(t, Real(5)); }},
        {"t^-3", [](Real t) { return 1 / (t * t * t); }},
        {"t^2.5", [](Real t) { return std::pow(t, Real(2.5)); }},
        {"2^t", [](Real t) { return std::exp2(t); }},
        {"t^t", [](Real t) { return std::pow(t, t); }},
        {"(1 + t)/(2 + sin(3*t))", [](Real t) { return (1 + t) / (2 + std::sin(3 * t)); }},
        {"1/t/t", [](Real t) { return 1 / t / t; }},
        {"5/(1 + t^2)", [](Real t) { return 5 / (1 + t * t); }},
        {"sin(w*t)*cos(t)", [](Real t) { return std::sin(7 * t) * std::cos(t); }},
        {"tan(t/2)", [](Real t) { return std::tan(t / 2); }},
        {"asin(t/4)", [](Real t) { return std::asin(t / 4); }},
        {"acos(t/4)", [](Real t) { return std::acos(t / 4); }},
        {"atan(2*t)", [](Real t) { return std::atan(2 * t); }},
        {"sinh(t) + cosh(2*t)", [](Real t) { return std::sinh(t) + std::cosh(2 * t); }},
        {"tanh(t)", [](Real t) { return std::tanh(t); }},
        {"exp(-t^2/2)", [](Real t) { return std::exp(-t * t / 2); }},
        {"ln(t) + log(2*t)", [](Real t) { return std::log(t) + std::log(2 * t); }},
        {"log10(t)", [](Real t) { return std::log10(t); }},
        {"sqrt(1 + t)", [](Real t) { return std::sqrt(1 + t); }},
        {"abs(t - 1.02)", [](Real t) { return std::fabs(t - Real(1.02)); }},
        {"sign(t - 1.02)*t", [](Real t) { return t > Real(1.02) ? t : -t; }},
        {"floor(3*t + 0.05)*t", [](Real t) { return std::floor(3 * t + Real(0.05)) * t; }},
        {"ceil(3*t + 0.05)*t^2", [](Real t) { return std::ceil(3 * t + Real(0.05)) * t * t; }},
        {"mod(t^2, 0.3)", [](Real t) { return t * t - Real(0.3) * std::floor(t * t / Real(0.3)); }},
        {"atan2(sin(2*t), cos(t))",
         [](Real t) { return std::atan2(std::sin(2 * t), std::cos(t)); }},
        {"atan2(cos(t), -sin(3*t))",
         [](Real t) { return std::atan2(std::cos(t), -std::sin(3 * t)); }},
        {"clamp(t^2, 1.03, 1.06)",
         [](Real t) { return std::clamp(t * t, Real(1.03), Real(1.06)); }},
        {"deadband(sin(5*t), 0.3)",
         [](Real t) {
             const Real x = std::sin(5 * t);
             return x > Real(0.3) ? x - Real(0.3) : x < Real(-0.3) ? x + Real(0.3) : 0;
         }},
        {"sign(t - 1, 0.1)", [](Real t) { return (t - 1) / std::hypot(t - 1, Real(0.1)); }},
        {"abs(t - 1, 0.1)", [](Real t) { return std::hypot(t - 1, Real(0.1)); }},
        {"hypot(t, 2 + t^2)", [](Real t) { return std::hypot(t, 2 + t * t); }},
        {"min(t, 1.03, 2 - t)",
         [](Real t) {
             return std::min({t, Real(1.03), 2 - t});
         }},
        {"max(t, 1.03, t^2/2)",
         [](Real t) {
             return std::max({t, Real(1.03), t * t / 2});
         }},
        {"0.01*max(0, sin(6*t))^4",
         [](Real t) { return Real(0.01) * std::pow(std::max(Real(0), std::sin(6 * t)), Real(4)); }},
        {"step(t, 0.2, 1, 2.4, 5)",
         [](Real t) {
             const Real s = (t - Real(0.2)) / Real(2.2);
             return 1 + 4 * s * s * s * (10 + s * (6 * s - 15));
         }},
        {"step(sin(t), 0, t, 1, t^2)",
         [](Real t) {
             const Real s = std::sin(t);
             return t + (t * t - t) * s * s * s * (10 + s * (6 * s - 15));
         }},
        {"ramp(t^2, 0, 1, 9, 10)", [](Real t) { return 1 + t * t; }},
        {"pulse(t, 0.5, 1.03)*t^2",
         [](Real t) { return t >= Real(0.5) && t < Real(1.03) ? t * t : 0; }},
        {"if(t < 1.03, t^2, 2*t - 1)", [](Real t) { return t < Real(1.03) ? t * t : 2 * t - 1; }},
        {"t > 1.03 && t < 1.5 || !(1 > 2) ? t^3 : t", nullptr},
        {"t > 1.03 && t < 1.52 ? t^3 : t",
         [](Real t) { return t > Real(1.03) && t < Real(1.52) ? t * t * t : t; }},
        {"lines(t)", [](Real t) { return t < 1 ? 5 * t : 7 - 2 * t; }},
        {"cubic(2*t)", nullptr},
    };
    std::mt19937 random(7);
    std::uniform_real_distribution<double> place(0.3, 2.2);
    for (const Case& c : cases) {
        if (!c.function) continue;
        SCOPED_TRACE(c.text);
        for (int k = 0; k < 40; ++k) {
            const double time = place(random);
            const Real h = 1e-4L, t = time;
            const auto f = [&](int i) { return c.function(t + i * h); };
            const Real first = (8 * (f(1) - f(-1)) - (f(2) - f(-2))) / (12 * h);
            const Real second = (16 * (f(1) + f(-1)) - (f(2) + f(-2)) - 30 * f(0)) / (12 * h * h);
            // A kink within the difference step: the differences involve both sides.
            const Real wide = (f(1) - f(-1)) / (2 * h), bend = (f(1) + f(-1) - 2 * f(0)) / (h * h);
            if (std::fabs(wide - first) > 1e-2L || std::fabs(bend - second) > 1) continue;
            const Jet<double> jet = calc(c.text, time);
            EXPECT_NEAR(jet.value, double(f(0)), 4e-15 * (1 + std::fabs(double(f(0))))) << time;
            EXPECT_NEAR(jet.first, double(first), 1e-9 * (1 + std::fabs(double(first)))) << time;
            EXPECT_NEAR(jet.second, double(second), 3e-8 * (10 + std::fabs(double(second))))
                << time;
        }
    }
}

TEST(Formula, DerivativesOfALobeBetweenDwellsAreThoseOfTheLobe) {
    // 0.01 sin⁴(600 t): v = 0.04·600 s³c, a = 0.04·600² (3 s²c² − s⁴)
    for (double time : {0.001, 0.0026, 0.004, 0.0117}) {
        const double s = std::max(0.0, std::sin(600 * time)), c = std::cos(600 * time);
        const Jet<double> cam = calc("0.01*max(0, sin(600*t))^4", time);
        EXPECT_NEAR(cam.value, 0.01 * std::pow(s, 4), 1e-16);
        EXPECT_NEAR(cam.first, 24 * s * s * s * c, 1e-12);
        EXPECT_NEAR(cam.second, 14400 * (3 * s * s * c * c - s * s * s * s), 1e-9);
    }
    const Jet<double> dwell = calc("0.01*max(0, sin(600*t))^1.5", 0.008);
    EXPECT_EQ(dwell.value, 0);
    EXPECT_EQ(dwell.first, 0);
    EXPECT_EQ(dwell.second, 0);
}

TEST(Formula, AtKinksTheNextSideCounts) {
    EXPECT_EQ(calc("abs(t - 1)", 1).first, 1);
    EXPECT_EQ(calc("abs(1 - t)", 1).first, 1);
    EXPECT_EQ(calc("max(t, 1)", 1).first, 1);
    EXPECT_EQ(calc("min(t, 1)", 1).first, 0);
    EXPECT_EQ(calc("max(0, t - 1)^2", 1).second, 2);
    EXPECT_EQ(calc("ramp(t, 1, 0, 2, 3)", 1).first, 3);
    EXPECT_EQ(calc("ramp(t, 1, 0, 2, 3)", 2).first, 0);
    EXPECT_EQ(calc("lines(t)", 1).first, -2);
    EXPECT_EQ(calc("lines(2 - t)", 1).first, -5);
    EXPECT_EQ(calc("t < 1 ? 0 : 2*t", 1).first, 2);
    EXPECT_FALSE(std::isfinite(calc("sqrt(t - 1)", 1).first));
    EXPECT_EQ(calc("(t - 1)^1.5", 1).first, 0);
    EXPECT_FALSE(std::isfinite(calc("(t - 1)^1.5", 1).second));
}

TEST(Formula, DerivativesByOneOfSeveralVariablesLeaveTheOthersConstant) {
    const Formula formula("x^2*y + sin(y*t)", makeScope(), {"t", "x", "y"});
    const double t = 0.3, x = 1.7, y = 2.5;
    const auto derive = [&](int by) {
        Jet<double> values[] = {t, x, y};
        values[by] = Jet<double>::makeVariable(values[by].value);
        return formula.calc(values);
    };
    EXPECT_DOUBLE_EQ(derive(0).first, y * std::cos(y * t));
    EXPECT_DOUBLE_EQ(derive(1).first, 2 * x * y);
    EXPECT_DOUBLE_EQ(derive(1).second, 2 * y);
    EXPECT_DOUBLE_EQ(derive(2).first, x * x + t * std::cos(y * t));
    EXPECT_DOUBLE_EQ(derive(2).second, -t * t * std::sin(y * t));
    EXPECT_THAT(formula.getUsedVariables(), ::testing::ElementsAre("t", "x", "y"));
}

TEST(Formula, OperatorsBindAsInMathematics) {
    const auto constant = [](const std::string& text) {
        return Formula(text, {}, {}).calc(static_cast<const double*>(nullptr));
    };
    EXPECT_EQ(constant("2^3^2"), 512);
    EXPECT_EQ(constant("-2^2"), -4);
    EXPECT_EQ(constant("2^-2"), 0.25);
    EXPECT_EQ(constant("2 - -3*-1"), -1);
    EXPECT_EQ(constant("8/4/2"), 1);
    EXPECT_EQ(constant("1 + 2*3 == 7 && 1 < 2"), 1);
    EXPECT_EQ(constant("0 ? 1 : 0 ? 2 : 3"), 3);
    EXPECT_EQ(constant("1 ? 0 ? 4 : 5 : 6"), 5);
    EXPECT_EQ(constant("1 || 0 && 0"), 1);
    EXPECT_EQ(constant("3 >= 3) == (2 <= 1"[0] == '3' ? "(3 >= 3) == (2 <= 1)" : ""), 0);
    EXPECT_EQ(constant("min(4, 2, 3) + max(1, +5)"), 7);
}

TEST(Formula, WhatIsNoFormulaIsRefusedWithTheReason) {
    EXPECT_EQ(refuse("1 < t < 2"),
              "comparisons do not follow each other: write a < b && b < c for a < b < c");
    EXPECT_EQ(refuse("t & 1"), "write && for and");
    EXPECT_EQ(refuse("t | 1"), "write || for or");
    EXPECT_EQ(refuse("t ** 2"), "write ^ for a power");
    EXPECT_EQ(refuse("(t + 1"), "a ')' is missing");
    EXPECT_EQ(refuse("t + 1)"), "there is one ')' too many");
    EXPECT_EQ(refuse("2 t"), "an operator is missing between '2' and 't': write 2*t");
    EXPECT_EQ(refuse("t 2"), "an operator is missing before '2'");
    EXPECT_EQ(refuse("(t)(t)"), "an operator is missing before the '('");
    EXPECT_EQ(refuse("t ? 1"), "the ':' of the '?' is missing");
    EXPECT_EQ(refuse("t : 1"), "there is a ':' without its '?'");
    EXPECT_EQ(refuse("* t"), "an operator '*' has no meaning here");
    EXPECT_EQ(refuse("t ="), "a formula assigns nothing; to compare, write ==");
    EXPECT_EQ(refuse("1.2.3"), "'1.2.3' is not a number");
    EXPECT_EQ(refuse("sin()"), "the function 'sin' has too few arguments");
    EXPECT_EQ(refuse("lines(t, 1)"), "the table 'lines' has one argument, here it gets 2");
    EXPECT_EQ(refuse("5 mm"), "numbers have no units here, all are SI: write 5e-3 instead of 5 mm");
    EXPECT_EQ(refuse(std::string(201, '(') + "t" + std::string(201, ')')),
              "parentheses are nested more than 200 deep");
    EXPECT_EQ(refuse(std::string(201, '-') + "t"), "parentheses are nested more than 200 deep");
    std::string sum = "t";
    for (int i = 0; i < 2000; ++i) sum += "+t";
    EXPECT_EQ(refuse(sum), "the formula has more than 1000 operations in a row");
}

TEST(Formula, WhatHasNoValueIsExplained) {
    EXPECT_EQ(explain("1/(t - 1)", 1), "a division by zero");
    EXPECT_EQ(explain("2 + 1/(t - 1)", 1), "a division by zero in '1/(t - 1)'");
    EXPECT_EQ(explain("atan(1/t)", 0), "a division by zero in '1/t'");
    EXPECT_EQ(explain("max(0, sqrt(1 - t))", 5), "the root of -4 in 'sqrt(1 - t)'");
    EXPECT_EQ(explain("sqrt(-t) < 1 ? 2 : 3", 4), "the root of -4 in 'sqrt(-t)'");
    EXPECT_EQ(explain("ln(t)", 0), "the logarithm of 0");
    EXPECT_EQ(explain("asin(t)", 2), "no angle has the sine 2");
    EXPECT_EQ(explain("(0 - t)^0.5", 1), "-1 to the power of 0.5");
    EXPECT_EQ(explain("mod(t, t - 1)", 1), "a division by zero");
    EXPECT_EQ(explain("exp(1000*t)", 1), "a number that is too large");
    EXPECT_EQ(explain("2*strict(t)", 4),
              "table 'strict' is evaluated at 4, outside its points from 0 to 3");
    // The branch not taken needs no value.
    const double time = 4;
    EXPECT_EQ(Formula("t < 1 ? sqrt(1 - t) : strict(t - 3)", makeScope(), {"t"}).calc(&time), 5);
}

TEST(Formula, TablesOfTwoVariablesAreExactForCubics) {
    const Formula formula("map(x, y)", makeScope(), {"x", "y"});
    std::mt19937 random(3);
    std::uniform_real_distribution<double> first(-1, 3), second(0, 4);
    for (int k = 0; k < 200; ++k) {
        const double at[] = {first(random), second(random)}, x = at[0], y = at[1];
        double slopes[2];
        EXPECT_NEAR(formula.calcSlopes(at, slopes, 2), x * x * x * y * y + x * y, 1e-11);
        EXPECT_NEAR(slopes[0], 3 * x * x * y * y + y, 1e-11);
        EXPECT_NEAR(slopes[1], 2 * x * x * x * y + x, 1e-11);
    }
    const double corner[] = {3, 4};
    EXPECT_EQ(formula.calc(corner), 27 * 16 + 12);
}

TEST(Formula, TablesOfTwoVariablesGoOnAsTheyAreTold) {
    const auto at = [](const std::string& text) {
        const double none = 0;
        return Formula(text, makeScope(), {"t"}).calc(&none);
    };
    EXPECT_EQ(at("map(5, 9)"), at("map(3, 4)"));
    EXPECT_EQ(at("map(5, 1.2)"), at("map(3, 1.2)"));
    EXPECT_NEAR(at("facets(4, 1)"), at("2*facets(3, 1) - facets(2, 1)"), 1e-12);
    EXPECT_NEAR(at("facets(4, 5)"),
                at("4*facets(3, 4) - 2*facets(2, 4) - 2*facets(3, 3) + facets(2, 3)"), 1e-11);
    EXPECT_NEAR(at("facets(0.25, 2)"), at("(facets(0, 2) + facets(0.5, 2))/2"), 1e-12);
    EXPECT_EQ(explain("grid(t, 1)", 3.5),
              "table 'grid' is evaluated at (3.5, 1), outside its grid from (-1, 0) to (3, 4)");
    // Constant beyond the last point; not constant before.
    const Jet<double> end = calc("map(t, 1)", 3), back = calc("map(6 - t, 1)", 3);
    EXPECT_EQ(end.first, 0);
    EXPECT_NEAR(back.first, -28, 1e-11);
    EXPECT_EQ(refuse("map(t)"), "the table 'map' has two arguments, here it gets 1");
    EXPECT_EQ(refuse("map(t, 1, 2)"), "the table 'map' has two arguments, here it gets 3");
}

TEST(Formula, WhatHasNoValueStaysWithout) {
    // An infinite or undefined intermediate value would look like a number.
    for (const char* text : {"1/ln(t - 1)", "1/log10(t - 1)", "1/(t - 1)^-2", "ln(0*t) < 3",
                             "sqrt(-t)^0", "1^sqrt(-t)", "sqrt(-t) || t", "sqrt(-t) && 0*t",
                             "pulse(t, sqrt(-t), 0.5)", "step(t, sqrt(-t), 0, 0.5, 7)"}) {
        const double time = 1;
        EXPECT_TRUE(std::isnan(Formula(text, makeScope(), {"t"}).calc(&time))) << text;
        EXPECT_TRUE(std::isnan(calc(text, time).value)) << text;
    }
    EXPECT_EQ(explain("1/ln(t - 1)", 1), "the logarithm of 0 in 'ln(t - 1)'");
}

TEST(Formula, SlopesAtAKinkAreThoseAhead) {
    const Formula formula("max(x, 0) + abs(-y) + 0*z", makeScope(), {"x", "y", "z"});
    const double origin[] = {0, 0, 0};
    double slopes[3];
    EXPECT_EQ(formula.calcSlopes(origin, slopes, 3), 0);
    EXPECT_EQ(slopes[0], 1);
    EXPECT_EQ(slopes[1], 1);
    EXPECT_EQ(slopes[2], 0);
}

TEST(Formula, BoundsInAWrongOrderAreRefused) {
    EXPECT_EQ(refuse("deadband(t, -2)"), "the width of deadband(x, width) is negative");
    EXPECT_EQ(refuse("clamp(t, 2, 1)"), "clamp(x, low, high) has a low above its high");
}

TEST(Formula, NotTurnsTruthsAround) {
    const std::vector<std::pair<std::string, std::string>> pairs{
        {"!(x < y)", "x >= y"},
        {"!(x <= y)", "x > y"},
        {"!(x == y)", "x != y"},
        {"!(x != y)", "x == y"},
        {"!(x < y && y < 2)", "x >= y || y >= 2"},
        {"!(x < y || y < 2)", "x >= y && y >= 2"},
        {"!!(x < y)", "x < y"},
        {"!x", "x == 0"},
        {"!x*y + 1", "(x == 0)*y + 1"},
        {"!x < y", "(x == 0) < y"},
        {"!3 || !0", "1"}};
    for (const auto& [text, same] : pairs) {
        const Formula formula(text, makeScope(), {"x", "y"}), other(same, makeScope(), {"x", "y"});
        for (const double x : {-1., 0., 1., 3.})
            for (const double y : {-1., 0., 1., 3.}) {
                const double values[] = {x, y};
                EXPECT_EQ(formula.calc(values), other.calc(values)) << text;
                EXPECT_EQ(formula.isComparison(), other.isComparison()) << text;
                if (formula.isComparison()) {
                    EXPECT_EQ(formula.calcMargin(values), other.calcMargin(values)) << text;
                }
            }
    }
    EXPECT_EQ(refuse("t ! 2"), "an operator '!' has no meaning here");
}

TEST(Formula, TimesOfStepsRampsAndPulsesAscend) {
    for (const std::string name : {"step", "ramp"}) {
        EXPECT_EQ(refuse(name + "(t, 1, 0, 0.5, 5)"),
                  "the times of " + name + "(t, t0, y0, t1, y1) must ascend: t0 <= t1");
        EXPECT_EQ(calc(name + "(t, 1, 0, 1, 5)", 1).value, 5);  // a jump
    }
    EXPECT_EQ(refuse("pulse(t, 0.7, 0.2)"), "the times of pulse(t, t0, t1) must ascend: t0 <= t1");
    // Times that depend on the motion are known when they are evaluated.
    for (const std::string text :
         {"step(t, x, 0, y, 5)", "ramp(t, x, 0, y, 5)", "pulse(t, x, y)"}) {
        const Formula formula(text, makeScope(), {"t", "x", "y"});
        for (const double at : {-1., 0.3, 0.5, 0.7, 2.}) {
            const double rising[] = {at, 0.2, 0.6}, falling[] = {at, 0.6, 0.2};
            double slopes[3];
            EXPECT_TRUE(std::isfinite(formula.calc(rising))) << text;
            EXPECT_TRUE(std::isnan(formula.calc(falling))) << text;
            EXPECT_TRUE(std::isnan(formula.calcSlopes(falling, slopes, 3))) << text;
            EXPECT_EQ(formula.explain(falling), "its times must ascend, and 0.2 follows 0.6");
        }
    }
}

TEST(Formula, FunctionsOfAProgramAreCalledAndDifferentiated) {
    Scope scope = makeScope();
    int numCalls = 0;
    OwnFunction own;
    own.fewest = 2;
    own.most = 3;
    own.calc = [&](const double* x, int count) {
        ++numCalls;
        return std::sin(x[0]) * x[1] * x[1] + (count == 3 ? x[2] : 0);
    };
    scope.functions["f"] = std::make_shared<OwnFunction>(own);
    const std::vector<std::string> names{"t", "x", "y"};
    const double at[] = {0.3, 0.7, -2.5};
    const double x = at[1], y = at[2];
    const Formula formula("1 + x*f(x, y)^2 + f(y, 2, f(t, x))", scope, names);
    const double inner = std::sin(x) * y * y;
    EXPECT_DOUBLE_EQ(formula.calc(at),
                     1 + x * inner * inner + std::sin(y) * 4 + std::sin(0.3) * x * x);
    double slopes[3];
    formula.calcSlopes(at, slopes, 3);
    EXPECT_NEAR(slopes[0], std::cos(0.3) * x * x, 1e-8);
    EXPECT_NEAR(slopes[1],
                inner * inner + 2 * x * inner * std::cos(x) * y * y + std::sin(0.3) * 2 * x, 1e-7);
    EXPECT_NEAR(slopes[2], 2 * x * inner * std::sin(x) * 2 * y + std::cos(y) * 4, 1e-7);
    const Jet<double> jets[] = {at[0], Jet<double>::makeVariable(x), at[2]};
    const Jet<double> along = formula.calc(jets);
    EXPECT_NEAR(along.first, slopes[1], 1e-8);
    EXPECT_TRUE(std::isnan(along.second));
    // The branch not taken is not called; its times are unknown.
    numCalls = 0;
    EXPECT_EQ(Formula("if(x > 1, f(x, y), 3)", scope, names).calc(at), 3);
    EXPECT_EQ(
        Formula("if(f(t, 1) > 0.1, 1, 2) + step(t, 1, 0, 2, 1)", scope, {"t"}).findSwitches(0, 10),
        (std::vector<double>{1, 2}));
    EXPECT_EQ(numCalls, 0);
    EXPECT_EQ(Formula("f(pi/2, 2)", scope, names).calc(at), 4);
    for (const char* wrong : {"f(x)", "f(1, 2, 3, 4)", "f", "f()"})
        EXPECT_THROW(Formula(wrong, scope, names), SyntaxError) << wrong;
    own.calc = [](const double*, int) { return std::nan(""); };
    scope.functions["g"] = std::make_shared<OwnFunction>(own);
    EXPECT_EQ(Formula("1 + g(x, 2)", scope, names).explain(at),
              "'g(x, 2)' gives no finite number for 0.7, 2");
}

TEST(Formula, WhatAFunctionNamesTwiceIsEvaluatedOnce) {
    Scope scope;
    int numCalls = 0;
    OwnFunction own;
    own.calc = [&](const double* x, int) {
        ++numCalls;
        return x[0];
    };
    scope.functions["f"] = std::make_shared<OwnFunction>(own);
    std::string dead = "f(x)", sign = "f(x)", timed = "t";
    const int depth = 60;  // 2^60 copies of the innermost term if it were copied
    for (int k = 0; k < depth; ++k) {
        dead = "deadband(" + dead + ", 0.003)";
        sign = "sign(" + sign + ", 1)";
        timed = "deadband(" + timed + ", 0.003)";
    }
    const double x = 2;
    double slope = 0, expected = x;
    for (int k = 0; k < depth; ++k) expected /= std::hypot(expected, 1);
    EXPECT_NEAR(Formula(dead, scope, {"x"}).calc(&x), x - depth * kWidth, 1e-14);
    EXPECT_EQ(numCalls, 1);
    EXPECT_NEAR(Formula(sign, scope, {"x"}).calc(&x), expected, 1e-14);
    EXPECT_EQ(numCalls, 2);
    EXPECT_NEAR(Formula(dead, scope, {"x"}).calcSlopes(&x, &slope, 1), x - depth * kWidth, 1e-14);
    EXPECT_NEAR(slope, 1, 1e-8);
    EXPECT_EQ(numCalls, 5);  // the value, and two for a difference
    Formula(dead, scope, {"x"}).checkUnits({"m"});
    const std::vector<double> switches = Formula(timed, {}, {"t"}).findSwitches(-1, 1);
    ASSERT_EQ(switches.size(), 2 * std::size_t(depth));
    for (int k = 0; k < depth; ++k) {
        EXPECT_NEAR(switches[std::size_t(depth + k)], (k + 1) * kWidth, 1e-12);
        EXPECT_NEAR(switches[std::size_t(depth - 1 - k)], -(k + 1) * kWidth, 1e-12);
    }
}
