// Frequencies of a rotating cantilever, zero hub radius: the table is that of A. D. Wright,
// C. E. Smith, R. W. Thresher, J. L. C. Wang, Vibration modes of centrifugally stiffened beams,
// J. Appl. Mech. 49 (1982) 197–202.
//
//     η = Ω √(mL⁴/EI),   λ = ω √(mL⁴/EI)
//
// In the plane of rotation the centrifugal force turns with the beam: λ² is η² less.

#include <gtest/gtest.h>

#include <cmath>

#include "validation/Beam.h"
#include "validation/SteadyRotation.h"

namespace simflex::test {
namespace {

struct Row {
    double eta;
    double lambda[2];  ///< flap
};

class RotatingCantilever : public ::testing::TestWithParam<Row> {
protected:
    /** Two sections that differ a little: flap and lag never coincide at rest. **/
    static BeamOptions makeOptions() {
        BeamOptions options;
        options.height = 0.01;
        options.width = 0.0105;
        return options;
    }

    static std::shared_ptr<const ReducedBody> part() {
        static const auto beam = makeBeam(makeOptions());
        return beam;
    }

    /** √(EI/mL⁴) for bending that moves the section along its side `depth`. **/
    static double unit(double depth) {
        const BeamOptions o = makeOptions();
        return std::sqrt(o.E * depth * depth / (12 * o.density)) / (o.length * o.length);
    }

    static std::vector<double> select(const std::vector<SteadyRotation::Mode>& modes, bool flap) {
        std::vector<double> frequencies;
        for (const auto& mode : modes)
            if (mode.isFlap == flap) frequencies.push_back(mode.frequency);
        return frequencies;
    }
};

INSTANTIATE_TEST_SUITE_P(Speeds, RotatingCantilever,
                         ::testing::Values(Row{0, {3.5160, 22.0345}}, Row{1, {3.6816, 22.1810}},
                                           Row{2, {4.1373, 22.6149}}, Row{4, {5.5850, 24.2733}},
                                           Row{8, {9.2568, 29.9954}}, Row{12, {13.1702, 37.6031}}));

constexpr double kTolerance = 0.005;

TEST_P(RotatingCantilever, FlapFrequenciesAreThoseOfTheTable) {
    const double scale = unit(makeOptions().width);
    const SteadyRotation rotation(part(), GetParam().eta * scale, SteadyRotation::Stiffening::On);
    const auto flap = select(rotation.calcModes(8), true);
    ASSERT_GE(flap.size(), 2u);
    for (size_t k = 0; k < 2; ++k) {
        EXPECT_NEAR(flap[k] / scale, GetParam().lambda[k], kTolerance * GetParam().lambda[k]);
    }
}

TEST_P(RotatingCantilever, LagFrequenciesAreThoseOfTheTableLessTheTurningForce) {
    const double scale = unit(makeOptions().height), eta = GetParam().eta;
    const SteadyRotation rotation(part(), eta * scale, SteadyRotation::Stiffening::On);
    const auto lag = select(rotation.calcModes(8), false);
    ASSERT_GE(lag.size(), 2u);
    for (size_t k = 0; k < 2; ++k) {
        const double lambda = std::sqrt(std::pow(GetParam().lambda[k], 2) - eta * eta);
        EXPECT_NEAR(lag[k] / scale, lambda, kTolerance * lambda);
    }
}

class FastCantilever : public RotatingCantilever {};

INSTANTIATE_TEST_SUITE_P(Speeds, FastCantilever, ::testing::Values(Row{4, {5.5850, 24.2733}}));

TEST_P(FastCantilever, WithoutStiffeningFlapFrequenciesAreTooLow) {
    const double scale = unit(makeOptions().width);
    const SteadyRotation rotation(part(), GetParam().eta * scale, SteadyRotation::Stiffening::Off);
    EXPECT_LT(select(rotation.calcModes(8), true)[0] / scale, 0.95 * GetParam().lambda[0]);
}

}  // namespace
}  // namespace simflex::test
