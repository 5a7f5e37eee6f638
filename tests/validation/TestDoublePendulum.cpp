// A flexible double pendulum of soft parts with few modes: Simbody's own integrators, using the
// exact accelerations, converge to the same motion as block elimination.

#include <gtest/gtest.h>

#include <cmath>

#include "support/DoublePendulum.h"

namespace simflex::test {
namespace {

using namespace SimTK;

template <class Integrator>
void expectDifferenceFallsWithAccuracy() {
    DoublePendulum model;
    const State state = model.makeState();
    const Vector expected = model.runBdf(state, 1e-11, 5);
    EXPECT_GT((expected(15, 3) - expected(3, 3)).norm(), 0.1);  // it moves
    Vector differences(3);
    for (int k = 0; k < 3; ++k) {
        const Vector places = model.runNatively<Integrator>(state, std::pow(10, -4 - 2 * k));
        differences[k] = (places - expected).normInf();
    }
    EXPECT_LT(differences[1], 0.3 * differences[0]);
    EXPECT_LT(differences[2], 0.3 * differences[1]);
    EXPECT_LT(differences[2], 1e-6);
}

TEST(DoublePendulum, RungeKuttaMersonFindsTheMotionOfBdf) {
    expectDifferenceFallsWithAccuracy<RungeKuttaMersonIntegrator>();
}

TEST(DoublePendulum, CPodesFindsTheMotionOfBdf) {
    expectDifferenceFallsWithAccuracy<CPodesIntegrator>();
}

// BDF2's error falls at least as accuracy^(2/3); at the tightest accuracies both agree to 1e-6.
TEST(DoublePendulum, BdfApproachesTheMotionOfRungeKuttaMerson) {
    DoublePendulum model;
    const State state = model.makeState();
    const Vector expected = model.runNatively<RungeKuttaMersonIntegrator>(state, 1e-10);
    Vector differences(3);
    for (int k = 0; k < 3; ++k)
        differences[k] = (model.runBdf(state, std::pow(10, -5 - 2 * k), 2) - expected).normInf();
    EXPECT_LT(differences[1], 0.1 * differences[0]);
    EXPECT_LT(differences[2], 0.1 * differences[1]);
    EXPECT_LT(differences[2], std::pow(1e-4, 2.0 / 3) * differences[0]);
    EXPECT_LT(differences[2], 1e-6);
}

}  // namespace
}  // namespace simflex::test
