// Cost of model file formulas relative to the same functions compiled: values, derivatives with
// respect to two quantities, and first and second time derivatives.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <random>

#include "simflex/model/formula/Formula.h"

namespace simflex {
namespace formula {
namespace {

constexpr int kCalls = 20000, kRounds = 30;

using Function = double (*)(double t, double x, double v);

struct Case {
    const char* text;
    Function compiled;
};

const double kPi = std::acos(-1.0);

/** Returns the least mean time of a call [s]. Accumulating `sum` keeps the compiler from removing
the calls. **/
template <class Call>
double measure(const std::vector<double>& inputs, const Call& call, double& sum) {
    double least = std::numeric_limits<double>::infinity();
    for (int round = 0; round < kRounds; ++round) {
        const auto start = std::chrono::steady_clock::now();
        for (std::size_t i = 0; i < inputs.size(); i += 3) sum += call(&inputs[i]);
        const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start;
        least = std::min(least, spent.count() / kCalls);
    }
    return least;
}

int run() {
    const Case cases[] = {
        {"0.1*sin(2*pi*5*t)",
         [](double t, double, double) { return 0.1 * std::sin(10 * kPi * t); }},
        {"40*(1 - v/157)", [](double, double, double v) { return 40 * (1 - v / 157); }},
        {"max(0, 2e5*(x - 3) + 400*v)",
         [](double, double x, double v) { return std::max(0.0, 2e5 * (x - 3) + 400 * v); }},
        {"8e4*clamp(10*(0.9 - x), -1, 1) - 300*v",
         [](double, double x, double v) {
             return 8e4 * std::clamp(10 * (0.9 - x), -1.0, 1.0) - 300 * v;
         }},
        {"-5*sign(v, 0.1)*(1 + 0.2*v^2)",
         [](double, double, double v) {
             return -5 * v / std::hypot(v, 0.1) * (1 + 0.2 * std::pow(v, 2));
         }},
        {"mod(x, 2*pi) < pi ? 12*sin(x)^2 : 0",
         [](double, double x, double) {
             const double turn = 2 * kPi, rest = x - turn * std::floor(x / turn);
             return rest < kPi ? 12 * std::pow(std::sin(x), 2) : 0.0;
         }},
        {"exp(-x^2)*sin(5*v + t) + atan2(v, x + 2)",
         [](double t, double x, double v) {
             return std::exp(-std::pow(x, 2)) * std::sin(5 * v + t) + std::atan2(v, x + 2);
         }},
        {"300*x + 40*x^3 + 5*v + tanh(v/0.01)",
         [](double, double x, double v) {
             return 300 * x + 40 * std::pow(x, 3) + 5 * v + std::tanh(v / 0.01);
         }},
    };
    std::mt19937 random(1);
    std::uniform_real_distribution<double> place(-3, 3);
    std::vector<double> inputs(3 * kCalls);
    for (double& input : inputs) input = place(random);

    double sum = 0, worst[3] = {0, 0, 0}, mean[3] = {0, 0, 0};
    int count = 0;
    std::printf("%-44s %9s %9s %9s %9s   times\n", "[ns]", "compiled", "value", "slopes", "motion");
    for (const Case& c : cases) {
        const Formula formula(c.text, {{{"pi", kPi}}, {}, {}}, {"t", "x", "v"});
        volatile Function compiled = c.compiled;
        const double native = measure(
            inputs, [&](const double* x) { return compiled(x[0], x[1], x[2]); }, sum);
        const double value = measure(
            inputs, [&](const double* x) { return formula.calc(x); }, sum);
        const double slopes = measure(
            inputs,
            [&](const double* x) {
                double gradient[3];
                formula.calcSlopes(x, gradient, 3);
                return gradient[1] + gradient[2];
            },
            sum);
        const double motion = measure(
            inputs,
            [&](const double* x) {
                const Jet<double> now[3] = {Jet<double>::makeVariable(x[0]), x[1], x[2]};
                return formula.calc(now).second;
            },
            sum);
        const double ratios[3] = {value / native, slopes / value, motion / value};
        for (int k = 0; k < 3; ++k) {
            worst[k] = std::max(worst[k], ratios[k]);
            mean[k] += std::log(ratios[k]);
        }
        ++count;
        std::printf("%-44s %9.1f %9.1f %9.1f %9.1f   %4.1f %4.1f %4.1f\n", c.text, 1e9 * native,
                    1e9 * value, 1e9 * slopes, 1e9 * motion, ratios[0], ratios[1], ratios[2]);
    }
    for (double& ratio : mean) ratio = std::exp(ratio / count);
    std::printf(
        "value per compiled, slopes and motion per value: mean %.1f %.1f %.1f, worst %.1f "
        "%.1f %.1f%s\n",
        mean[0], mean[1], mean[2], worst[0], worst[1], worst[2], std::isfinite(sum) ? "" : " ");
    std::printf("\n{\"value\": %.2f, \"slopes\": %.2f, \"with_derivatives\": %.2f}\n", mean[0],
                mean[1], mean[2]);
    return 0;
}

}  // namespace
}  // namespace formula
}  // namespace simflex

int main() {
    return simflex::formula::run();
}
