// What a formula of a model file costs against the same function compiled: value, and both
// derivatives with it.

#include <chrono>
#include <cmath>
#include <cstdio>

#include "simflex/model/file/ModelReader.h"

namespace simflex {
namespace model {
namespace {

constexpr int kCalls = 200000;

/** Mean time of a call [s]; the sum keeps the compiler from leaving it out. **/
template <class Function>
double measure(const Function& function, double& sum) {
    const auto start = std::chrono::steady_clock::now();
    for (int i = 0; i < kCalls; ++i) sum += function(1e-5 * i);
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() / kCalls;
}

int run() {
    ModelText text;
    text.path = "formula.yaml";
    text.text =
        "simflex: 1\n"
        "bodies: {arm: {mass: 1, inertia: [1, 1, 1]}}\n"
        "joints: {pin: {type: pin, between: [ground, arm]}}\n"
        "motions: {swing: {joint: pin, position: 0.1*sin(2*pi*5*t)}}\n";
    const Expression formula =
        readModel(text).get("motions").get("swing").get("position").getExpression();
    double sum = 0;
    const double compiled =
        measure([](double t) { return 0.1 * std::sin(2 * SimTK::Pi * 5 * t); }, sum);
    const double value = measure([&](double t) { return formula.calcValue(t); }, sum);
    const double motion = measure([&](double t) { return formula.calcMotion(t)[2]; }, sum);
    std::printf("0.1*sin(2*pi*5*t)%s\n", std::isfinite(sum) ? "" : " is not finite");
    std::printf("  compiled           %8.1f ns\n", 1e9 * compiled);
    std::printf("  value              %8.1f ns %8.1f times\n", 1e9 * value, value / compiled);
    std::printf("  with derivatives   %8.1f ns %8.1f times\n", 1e9 * motion, motion / compiled);
    std::printf("\n{\"value\": %.2f, \"with_derivatives\": %.2f}\n", value / compiled,
                motion / compiled);
    return 0;
}

}  // namespace
}  // namespace model
}  // namespace simflex

int main() {
    return simflex::model::run();
}
