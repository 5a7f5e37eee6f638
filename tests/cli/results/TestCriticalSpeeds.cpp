/** @file
Critical speeds of Campbell diagrams. **/

#include <gtest/gtest.h>

#include <cmath>

#include "simflex/model/results/CriticalSpeeds.h"

namespace simflex {
namespace {

using namespace model;

constexpr double kTwoPi = 2 * M_PI;

/** Each branch: 2π f = a + b Ω. **/
Results::Analysis makeDiagram(const std::vector<double>& speeds,
                              const std::vector<std::pair<double, double>>& branches) {
    Results::Analysis campbell;
    campbell.speeds = speeds;
    for (const double speed : speeds) {
        campbell.frequency.emplace_back();
        for (const auto& [a, b] : branches)
            campbell.frequency.back().push_back((a + b * speed) / kTwoPi);
    }
    return campbell;
}

TEST(CriticalSpeeds, AreWhereAFrequencyIsOnceARevolution) {
    // a + b Ω = Ω at Ω = a/(1 - b)
    const auto critical = findCriticalSpeeds(
        makeDiagram({0, 10, 20, 30, 40}, {{18, -0.2}, {18, 0}, {18, 0.2}, {18, 0.7}}));
    ASSERT_EQ(critical.size(), 4u);
    EXPECT_NEAR(critical[0], 15, 1e-12);
    EXPECT_NEAR(critical[1], 18, 1e-12);
    EXPECT_NEAR(critical[2], 22.5, 1e-12);
    EXPECT_TRUE(std::isnan(critical[3]));
}

TEST(CriticalSpeeds, AtASpeedOfTheDiagramAreThatSpeedAndRestIsNone) {
    EXPECT_NEAR(findCriticalSpeeds(makeDiagram({0, 10, 20}, {{10, 0}}))[0], 10, 1e-12);
    EXPECT_NEAR(findCriticalSpeeds(makeDiagram({20, 10, 0}, {{10, 0}}))[0], 10, 1e-12);
    EXPECT_TRUE(std::isnan(findCriticalSpeeds(makeDiagram({0, 10, 20}, {{0, 0.5}}))[0]));
    EXPECT_TRUE(std::isnan(findCriticalSpeeds(makeDiagram({0, 10, 20}, {{0, 2}}))[0]));
    EXPECT_TRUE(std::isnan(findCriticalSpeeds(makeDiagram({10}, {{10, 0}}))[0]));
    EXPECT_TRUE(findCriticalSpeeds({}).empty());
}

TEST(CriticalSpeeds, AreFoundBesideSpeedsWithoutModes) {
    auto diagram = makeDiagram({0, 10, 20, 30}, {{15, 0}, {25, 0}});
    for (const size_t k : {0, 2}) diagram.frequency[k] = {NAN, NAN};
    const auto critical = findCriticalSpeeds(diagram);
    EXPECT_NEAR(critical[0], 15, 1e-12);
    EXPECT_NEAR(critical[1], 25, 1e-12);
}

TEST(CriticalSpeeds, TurningBackwardsAreThoseOfTheSize) {
    EXPECT_NEAR(findCriticalSpeeds(makeDiagram({0, -10, -20}, {{12, 0}}))[0], -12, 1e-12);
}

}  // namespace
}  // namespace simflex
