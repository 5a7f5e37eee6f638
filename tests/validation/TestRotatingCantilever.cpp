// Frequencies of a rotating cantilever, zero hub radius, against the table of Wright, Smith,
// Thresher and Wang (see RotatingCantilever.h).

#include <gtest/gtest.h>

#include <cmath>

#include "validation/RotatingCantilever.h"
#include "validation/SteadyRotation.h"

namespace simflex::test {
namespace {

class RotatingCantilever : public ::testing::TestWithParam<WrightRow> {};

std::vector<double> select(const std::vector<SteadyRotation::Mode>& modes, bool flap) {
    std::vector<double> frequencies;
    for (const auto& mode : modes)
        if (mode.isFlap == flap) frequencies.push_back(mode.frequency);
    return frequencies;
}

INSTANTIATE_TEST_SUITE_P(Speeds, RotatingCantilever, ::testing::ValuesIn(kWrightTable));

constexpr double kTolerance = 0.005;

TEST_P(RotatingCantilever, FlapFrequenciesAreThoseOfTheTable) {
    const double scale = calcFrequencyUnit(getRotatingCantileverOptions().width);
    const SteadyRotation rotation(getRotatingCantileverPart(), GetParam().eta * scale,
                                  SteadyRotation::Stiffening::On);
    const auto flap = select(rotation.calcModes(8), true);
    ASSERT_GE(flap.size(), 2u);
    for (size_t k = 0; k < 2; ++k) {
        EXPECT_NEAR(flap[k] / scale, GetParam().lambda[k], kTolerance * GetParam().lambda[k]);
    }
}

TEST_P(RotatingCantilever, LagFrequenciesAreThoseOfTheTableLessTheTurningForce) {
    const double scale = calcFrequencyUnit(getRotatingCantileverOptions().height),
                 eta = GetParam().eta;
    const SteadyRotation rotation(getRotatingCantileverPart(), eta * scale,
                                  SteadyRotation::Stiffening::On);
    const auto lag = select(rotation.calcModes(8), false);
    ASSERT_GE(lag.size(), 2u);
    for (size_t k = 0; k < 2; ++k) {
        const double lambda = std::sqrt(std::pow(GetParam().lambda[k], 2) - eta * eta);
        EXPECT_NEAR(lag[k] / scale, lambda, kTolerance * lambda);
    }
}

TEST(FastCantilever, WithoutStiffeningFlapFrequenciesAreTooLow) {
    const WrightRow row = kWrightTable[3];
    const double scale = calcFrequencyUnit(getRotatingCantileverOptions().width);
    const SteadyRotation rotation(getRotatingCantileverPart(), row.eta * scale,
                                  SteadyRotation::Stiffening::Off);
    EXPECT_LT(select(rotation.calcModes(8), true).at(0) / scale, 0.95 * row.lambda[0]);
}

}  // namespace
}  // namespace simflex::test
