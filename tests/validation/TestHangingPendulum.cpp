// A flexible brick that hangs on a pin at its end swings as a physical pendulum, ω² = mgd/I: in
// floating coordinates all of that stiffness is the derivative of the joint's forces.

#include <gtest/gtest.h>

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"
#include "simflex/solver/Eigenmodes.h"
#include "simflex/solver/StaticEquilibrium.h"
#include "validation/BrickParts.h"

namespace simflex {
namespace {

using namespace SimTK;

TEST(HangingPendulum, SwingsWithTheFrequencyOfAPhysicalPendulum) {
    constexpr Real Gravity = 9.81;
    const ReducedBody soft = *test::reduceBrick({}, 30);
    for (const double stiffening : {1.0, 1e4}) {
        const auto part = std::make_shared<const ReducedBody>(soft.withScaledStiffness(stiffening));
        MultibodySystem system;
        SimbodyMatterSubsystem matter(system);
        GeneralForceSubsystem forces(system);
        Force::Gravity gravity(forces, matter, -YAxis, Gravity);
        FlexibleBodySubsystem flexible(system, matter);
        const FlexibleBody body(flexible, part);
        Joint::Pin pin(flexible, matter.Ground(), body.interface("left"), "pin");
        State state = system.realizeTopology();
        // Started somewhere, found hanging: x of the brick points down.
        body.setPoseByInterface(state, "left", Transform(Rotation(-0.4, ZAxis)));
        StaticEquilibrium equilibrium(system);
        equilibrium.solve(state);
        const Vec3 center = body.getFramePose(equilibrium.getState()).p();
        EXPECT_NEAR(center[0], 0, 1e-9);

        const std::vector<Eigenmode> modes =
            calcEigenmodes(calcLinearization(system, equilibrium.getState()));
        const Real d = -part->interfaces[0].position[0];
        const Real I = part->inertia[2] + part->mass * d * d;
        const Real omega = std::sqrt(part->mass * Gravity * d / I);
        const Real lowest = std::sqrt(part->omegaSquared[0]);
        // Bending makes it slower by about (ω/Ω)².
        EXPECT_NEAR(2 * Pi * modes[0].frequency, omega, omega * (2 * square(omega / lowest) + 1e-9))
            << stiffening;
        EXPECT_LT(modes[0].frequency, omega / (2 * Pi) * (1 + 1e-9));
        EXPECT_EQ(modes[0].dampingRatio, 0);
    }
}

}  // namespace
}  // namespace simflex
