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
            const test::RotatingModes modes = test::calcRotatingModes(row.eta * scale);
            for (const Eigenmode& mode : modes.all) EXPECT_NEAR(mode.dampingRatio, 0, 1e-7);
            const std::vector<double>& found = isFlap ? modes.flap : modes.lag;
            for (size_t k = 0; k < 2; ++k) {
                // In the plane of rotation the centrifugal force turns with the beam.
                const Real lambda = row.lambda[k];
                const Real expected =
                    scale * (isFlap ? lambda : std::sqrt(square(lambda) - square(row.eta)));
                EXPECT_NEAR(found[k], expected, 5e-3 * expected)
                    << (isFlap ? "flap" : "lag") << " at " << row.eta;
            }
        }
    }
}

}  // namespace
}  // namespace simflex
