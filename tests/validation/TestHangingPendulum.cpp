// A flexible brick hanging on a pin at its end swings as a physical pendulum, ω² = mgd/I. In
// floating coordinates all of that stiffness is the derivative of the joint forces.

#include <gtest/gtest.h>

#include "simflex/solver/Eigenmodes.h"
#include "simflex/solver/StaticEquilibrium.h"
#include "validation/BrickParts.h"
#include "validation/HangingPendulum.h"

namespace simflex {
namespace {

using namespace SimTK;

TEST(HangingPendulum, SwingsWithTheFrequencyOfAPhysicalPendulum) {
    const ReducedBody soft = *test::reduceBrick({}, 30);
    for (const double stiffening : {1.0, 1e4}) {
        const auto part = std::make_shared<const ReducedBody>(soft.withScaledStiffness(stiffening));
        test::HangingPendulum model(part);
        // From a start elsewhere, the equilibrium is hanging: x of the brick points down.
        StaticEquilibrium equilibrium(model.system);
        equilibrium.solve(model.makeState(1.2));
        const Vec3 center = model.body.getFramePose(equilibrium.getState()).p();
        EXPECT_NEAR(center[0], 0, 1e-9);

        const std::vector<Eigenmode> modes =
            calcEigenmodes(calcLinearization(model.system, equilibrium.getState()));
        const Real omega = model.calcRigidFrequency();
        const Real lowest = std::sqrt(part->omegaSquared[0]);
        // Bending lowers the frequency by about (ω/Ω)².
        EXPECT_NEAR(2 * Pi * modes[0].frequency, omega, omega * (2 * square(omega / lowest) + 1e-9))
            << stiffening;
        EXPECT_LT(modes[0].frequency, omega / (2 * Pi) * (1 + 1e-9));
        EXPECT_EQ(modes[0].dampingRatio, 0);
    }
}

}  // namespace
}  // namespace simflex
