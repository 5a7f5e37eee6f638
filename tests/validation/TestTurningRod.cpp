// A rod that turns about its end (after Code_Aster SSLV104): steady stretch tan(kL)/k − L with
// k² = ρω²/E, softening included.

#include <gtest/gtest.h>

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"
#include "simflex/solver/StaticEquilibrium.h"
#include "validation/BrickParts.h"

namespace simflex {
namespace {

using namespace SimTK;

TEST(TurningRod, StretchesByCentrifugalForceAndSoftening) {
    simflex::testing::Brick brick;
    brick.size = {0.5, 0.02, 0.02};
    brick.elements = {40, 1, 1};
    brick.E = 2e11;
    brick.nu = 0;
    brick.rho = 7800;
    const auto part = test::reduceBrick(brick, 60);
    for (const Real speed : {300.0, 3000.0}) {
        MultibodySystem system;
        SimbodyMatterSubsystem matter(system);
        FlexibleBodySubsystem flexible(system, matter);
        const FlexibleBody rod(flexible, part, "rod");
        Joint::Pin pin(flexible, matter.Ground(), rod.interface("left"), "pin");
        State state = system.realizeTopology();
        rod.setPoseByInterface(state, "left", Transform(Rotation(0.3, ZAxis)));
        setSteadyRotation(system, state, Vec3(0, 0, speed));
        StaticEquilibrium equilibrium(system);
        equilibrium.solveSteadyMotion(state);
        const Real L = brick.size[0], k = speed * std::sqrt(brick.rho / brick.E);
        const Real expected = std::tan(k * L) / k - L;
        const Vec3 tip = rod.interface("right").calcMotion(equilibrium.getState()).X.p();
        // Few of the reduced modes are axial.
        EXPECT_NEAR(tip.norm() - L, expected, 1e-3 * expected) << speed;
        // Turning freely is a motion that nothing holds.
        ASSERT_EQ(equilibrium.getFreeMotions().size(), 1u);
        EXPECT_EQ(equilibrium.getFreeMotions()[0], "'rod' is free to move");
        // The pin pulls with the centripetal force of the stretched rod.
        const Real force =
            pin.calcForceOnM(equilibrium.getState(), equilibrium.getMultipliers(pin))[1].norm();
        const Real r = rod.getFramePose(equilibrium.getState()).p().norm();
        EXPECT_NEAR(force, part->mass * speed * speed * r, 1e-8 * force);
    }
}

}  // namespace
}  // namespace simflex
