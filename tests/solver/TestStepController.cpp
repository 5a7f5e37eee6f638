// The filter H211b of Söderlind (2003): its formula and its behaviour.

#include "simflex/solver/integration/StepController.h"

#include <gtest/gtest.h>

#include <cmath>

namespace simflex {
namespace {

constexpr double Largest = 5;

double limit(double ratio) {
    return 1 + std::atan(ratio - 1);
}

TEST(StepController, FirstRatioRestsOnOneErrorAlone) {
    for (const int order : {1, 2, 5})
        for (const double error : {0.1, 0.4, 0.9}) {
            StepController controller;
            EXPECT_DOUBLE_EQ(controller.calcRatio(error, order, Largest),
                             limit(std::pow(StepController::Target / error, 1.0 / (order + 1))));
            // So does the first step after a restart.
            controller.restart();
            EXPECT_DOUBLE_EQ(controller.calcRatio(error, order, Largest),
                             limit(std::pow(StepController::Target / error, 1.0 / (order + 1))));
        }
}

TEST(StepController, LaterRatiosAreThoseOfTheFilter) {
    StepController controller;
    const double first = controller.calcRatio(0.2, 2, Largest);
    const double k = 3, target = StepController::Target;
    EXPECT_DOUBLE_EQ(controller.calcRatio(0.7, 2, Largest),
                     limit(std::pow(target / 0.7, 0.25 / k) * std::pow(target / 0.2, 0.25 / k) *
                           std::pow(first, -0.25)));
}

TEST(StepController, AnErrorThatIsAimedAtKeepsTheStep) {
    StepController controller;
    for (int i = 0; i < 5; ++i)
        EXPECT_DOUBLE_EQ(controller.calcRatio(StepController::Target, 3, Largest), 1);
}

TEST(StepController, StepsSettleWhereTheErrorIsTheOneAimedAt) {
    for (const int order : {1, 2, 5})
        for (const double start : {0.01, 0.3, 3.0}) {
            StepController controller;
            double h = start;  // the error is 1 at h = 1
            for (int i = 0; i < 60; ++i)
                h *= controller.calcRatio(std::pow(h, order + 1), order, Largest);
            EXPECT_NEAR(h, std::pow(StepController::Target, 1.0 / (order + 1)), 1e-6)
                << "order " << order << " from " << start;
        }
}

TEST(StepController, RatiosStayWithinTheirLimits) {
    StepController controller;
    EXPECT_LE(controller.calcRatio(0, 1, 1.5), 1.5);
    controller.restart();
    EXPECT_GE(controller.calcRatio(1e12, 1, Largest), 0.3);
}

TEST(StepController, ARejectedStepIsTriedWhereItsErrorWouldBeTheOneAimedAt) {
    StepController controller;
    const double ratio = controller.calcRatioAfterRejection(3, 2);
    EXPECT_NEAR(3 * std::pow(ratio, 3), StepController::Target, 1e-12);
    EXPECT_EQ(controller.calcRatioAfterRejection(1.0000001 * StepController::Target, 2), 0.8);
    EXPECT_EQ(controller.calcRatioAfterRejection(1e9, 2), 0.2);
    // The earlier history is discarded.
    EXPECT_DOUBLE_EQ(controller.calcRatio(0.1, 1, Largest), limit(2));
}

}  // namespace
}  // namespace simflex
