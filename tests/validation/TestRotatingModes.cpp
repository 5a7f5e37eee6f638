// Natural modes about the steady rotation of a stiffened cantilever, from StaticEquilibrium and
// calcEigenmodes(), against the table of Wright, Smith, Thresher and Wang (see
// TestRotatingCantilever).

#include <gtest/gtest.h>

#include "validation/RotatingCantilever.h"

namespace simflex {
namespace {

using namespace SimTK;

TEST(RotatingModes, FlapAndLagFrequenciesAreThoseOfTheTable) {
    const test::BeamOptions options = test::getRotatingCantileverOptions();
    for (const test::WrightRow& row : test::kWrightTable) {
        for (const bool isFlap : {true, false}) {
            const Real scale = test::calcFrequencyUnit(isFlap ? options.width : options.height);
            const test::RotatingModes modes =
                test::calcRotatingModes(test::getRotatingCantileverPart(), row.eta * scale);
            for (const Eigenmode& mode : modes.all) EXPECT_NEAR(mode.dampingRatio, 0, 1e-7);
            const std::vector<double>& found = isFlap ? modes.flap : modes.lag;
            for (size_t k = 0; k < 2; ++k) {
                // In the plane of rotation the centrifugal force rotates with the beam.
                const Real lambda = row.lambda[k];
                const Real expected =
                    scale * (isFlap ? lambda : std::sqrt(square(lambda) - square(row.eta)));
                EXPECT_NEAR(found[k], expected, 5e-3 * expected)
                    << (isFlap ? "flap" : "lag") << " at " << row.eta;
            }
        }
    }
}

TEST(RotatingModes, ReferenceIsThePublishedTable) {
    // From the same authors, with a hub as long as the beam.
    constexpr test::WrightRow AtRadius[] = {{1, {3.8888, 22.3750}}, {2, {4.8337, 23.3660}}};
    for (const test::WrightRow& row : test::kWrightTable)
        for (size_t k = 0; k < 2; ++k)
            EXPECT_NEAR(test::calcFlapFrequencies(row.eta, 0, 2)[k], row.lambda[k], 6e-5);
    for (const test::WrightRow& row : AtRadius)
        for (size_t k = 0; k < 2; ++k)
            EXPECT_NEAR(test::calcFlapFrequencies(row.eta, 1, 2)[k], row.lambda[k], 6e-5);
}

// A slender beam: shear and rotation of the sections change a frequency by about (λ h/L)²,
// stretching by (η h/L)², which the table's theory neglects.
TEST(RotatingModes, OfASlenderBeamAreThoseOfTheTableForAnyHub) {
    test::BeamOptions options;
    options.height = 0.001;
    options.width = 0.00105;
    options.numElements = 120;
    options.numModes = 60;
    const auto part = test::makeBeam(options);
    for (const Real radius : {0.0, 1.0})
        for (const Real eta : {0.0, 2.0, 4.0, 8.0, 12.0})
            for (const bool isFlap : {true, false}) {
                const Real depth = isFlap ? options.width : options.height,
                           scale = test::calcFrequencyUnit(depth);
                const test::RotatingModes modes =
                    test::calcRotatingModes(part, eta * scale, radius * options.length);
                const std::vector<double>& found = isFlap ? modes.flap : modes.lag;
                const std::vector<double> table = test::calcFlapFrequencies(eta, radius, 2);
                for (size_t k = 0; k < 2; ++k) {
                    const Real lambda =
                        isFlap ? table[k] : std::sqrt(square(table[k]) - square(eta));
                    EXPECT_NEAR(found[k] / scale, lambda, 1e-4 * lambda)
                        << (isFlap ? "flap " : "lag ") << k << " at " << eta << ", hub " << radius;
                }
            }
}

}  // namespace
}  // namespace simflex
