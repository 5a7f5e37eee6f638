// A rod rotating about its end (after Code_Aster SSLV104): steady stretch tan(kL)/k − L with k² =
// ρω²/E, including softening.

#include <gtest/gtest.h>

#include "validation/TurningRod.h"

namespace simflex {
namespace {

using namespace SimTK;

TEST(TurningRod, StretchesByCentrifugalForceAndSoftening) {
    for (const Real speed : {300.0, 3000.0}) {
        test::TurningRod model;
        model.turn(speed);
        const Real expected = model.calcExactStretch(speed);
        // Few of the reduced modes are axial.
        EXPECT_NEAR(model.calcStretch(), expected, 1e-3 * expected) << speed;
        // The free rotation is unconstrained.
        const StaticEquilibrium& equilibrium = model.equilibrium;
        ASSERT_EQ(equilibrium.getFreeMotions().size(), 1u);
        EXPECT_EQ(equilibrium.getFreeMotions()[0], "'rod' is free to move");
        // The pin provides the centripetal force of the stretched rod.
        const State& state = equilibrium.getState();
        const Real force =
            model.pin.calcForceOnM(state, equilibrium.getMultipliers(model.pin))[1].norm();
        const Real r = model.rod.getFramePose(state).p().norm();
        EXPECT_NEAR(force, model.getPart()->mass * speed * speed * r, 1e-8 * force);
    }
}

}  // namespace
}  // namespace simflex
