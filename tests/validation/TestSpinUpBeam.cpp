// Spin-up of the flexible beam of Simo and Vu-Quoc: it lags behind, and is supported by the
// stiffness from centrifugal tension.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "simflex/solver/BdfIntegrator.h"
#include "validation/SpinUpBeam.h"

namespace simflex::test {
namespace {

using namespace SimTK;

class SpinUpBeamTest : public ::testing::Test {
protected:
    SpinUpBeamTest() { integrator.setAccuracy(1e-6); }

    Vec2 calcTip() const { return model.calcTip(integrator.getState()); }

    SpinUpBeam model;
    BdfIntegrator integrator{model.system};
};

TEST_F(SpinUpBeamTest, WithStiffeningTheTipLagsAndComesBack) {
    integrator.initialize(model.makeState());
    Real peak = 0, peakTime = 0;
    for (Real t = 0.02; t < SpinUpBeam::RampTime; t += 0.02) {
        integrator.stepTo(t);
        const Real lag = calcTip()[1];
        if (lag < peak) peak = lag, peakTime = t;
    }
    EXPECT_NEAR(peak, SpinUpBeam::PeakLag, -0.01 * SpinUpBeam::PeakLag);
    EXPECT_NEAR(peakTime, SpinUpBeam::PeakTime, 0.01 * SpinUpBeam::PeakTime);

    // Afterwards the beam oscillates about the radius.
    Real least = Infinity, largest = -Infinity, extension = 0;
    int count = 0;
    for (Real t = SpinUpBeam::RampTime; t < 20; t += 0.01, ++count) {
        integrator.stepTo(t);
        const Vec2 tip = calcTip();
        least = std::min(least, tip[1]);
        largest = std::max(largest, tip[1]);
        extension += tip[0];
    }
    EXPECT_NEAR((largest - least) / 2, SpinUpBeam::Swing, 0.05 * SpinUpBeam::Swing);
    EXPECT_NEAR((largest + least) / 2, 0, 0.05 * SpinUpBeam::Swing);
    EXPECT_NEAR(extension / count, SpinUpBeam::Extension, 0.01 * SpinUpBeam::Extension);
}

// A theory with its frame at the root diverges without geometric stiffness. Here the frame follows
// the whole beam and the root's force supports it in part, so the beam is merely too soft.
TEST_F(SpinUpBeamTest, WithoutStiffeningTheTipLagsTooFarAndTooLong) {
    State state = model.makeState();
    model.beam.disableStiffening(state);
    integrator.initialize(state);
    integrator.stepTo(SpinUpBeam::PeakTime);
    EXPECT_LT(calcTip()[1], SpinUpBeam::PeakLag * 1.1);
    integrator.stepTo(8);
    EXPECT_LT(calcTip()[1], SpinUpBeam::PeakLag * 1.1);
    integrator.stepTo(SpinUpBeam::RampTime);
    Real largest = 0;
    for (Real t = SpinUpBeam::RampTime; t < 20; t += 0.05) {
        integrator.stepTo(t);
        largest = std::max(largest, std::abs(calcTip()[1]));
    }
    EXPECT_GT(largest, 2 * SpinUpBeam::Swing);
}

}  // namespace
}  // namespace simflex::test
