// A heavy top with a flexible stem: a disc on a beam on a ball joint. Energy and angular momentum
// about the vertical are conserved; with a nearly rigid stem it precesses like Lagrange's top.

#include <gtest/gtest.h>

#include <cmath>

#include "simflex/solver/BdfIntegrator.h"
#include "validation/HeavyTop.h"

namespace simflex::test {
namespace {

using namespace SimTK;

struct Drift {
    Real energy = 0, momentum = 0;  ///< largest, relative to mgd and to the first value
};

/** Steps a top and samples it every 5 ms. **/
template <class Step>
Drift calcDrift(HeavyTop& top, const State& start, Real duration, const Step& stepTo) {
    const auto measure = [&](const State& state) {
        top.system.realize(state, Stage::Dynamics);
        return Vec2(top.flexible.calcEnergy(state), top.flexible.calcMomentum(state)[0][1]);
    };
    const Vec2 first = measure(start);
    Drift drift;
    for (int k = 1; 0.005 * k <= duration; ++k) {
        const Vec2 change = (measure(stepTo(0.005 * k)) - first).abs();
        drift.energy = std::max(drift.energy, change[0] / top.calcWeightMoment());
        drift.momentum = std::max(drift.momentum, change[1] / std::abs(first[1]));
    }
    return drift;
}

Drift runBdf(Real accuracy) {
    HeavyTop top(1);
    BdfIntegrator integrator(top.system);
    integrator.setAccuracy(accuracy);
    integrator.initialize(top.makeSteadyState());
    return calcDrift(top, integrator.getState(), 1, [&](Real t) -> const State& {
        integrator.stepTo(t);
        return integrator.getState();
    });
}

TEST(HeavyTop, KeepsEnergyAndMomentumAboutTheVertical) {
    const Drift coarse = runBdf(1e-6), fine = runBdf(1e-8);
    EXPECT_LT(coarse.energy, 1e-4);
    EXPECT_LT(coarse.momentum, 1e-4);
    const Real order = std::pow(100, 2.0 / 3);  // BDF2
    EXPECT_GT(coarse.energy / fine.energy, order);
    EXPECT_GT(coarse.momentum / fine.momentum, order);
}

// Released from rest it nutates for three turns of precession; only the stem constrains the disc's
// rotation about its axis.
TEST(HeavyTop, KeepsThemAndItsSpinOverThreeTurnsOfPrecession) {
    HeavyTop top(1);
    BdfIntegrator integrator(top.system);
    integrator.setAccuracy(1e-6);
    integrator.initialize(top.makeReleasedState());
    Real spin = 0;
    const Real duration = 3 * 2 * Pi / HeavyTop::calcPrecession();
    const Drift drift =
        calcDrift(top, integrator.getState(), duration, [&](Real t) -> const State& {
            integrator.stepTo(t);
            spin = std::max(spin, std::abs(top.calcSpin(integrator.getState()) - HeavyTop::Spin));
            return integrator.getState();
        });
    EXPECT_LT(drift.energy, 1e-4 * duration);  // as in one second
    EXPECT_LT(drift.momentum, 1e-4 * duration);
    EXPECT_LT(spin, 1e-5 * HeavyTop::Spin);
}

// With a stem of few modes, axially soft too, explicit steps are small enough anyway.
TEST(HeavyTop, KeepsThemUnderSimbodysIntegrators) {
    HeavyTop top(0.05);
    State state = top.makeSteadyState();
    top.flexible.initializeNative(state);
    RungeKuttaMersonIntegrator integrator(top.system);
    integrator.setAccuracy(1e-6);
    TimeStepper stepper(top.system, integrator);
    stepper.initialize(state);
    const Drift drift = calcDrift(top, stepper.getState(), 0.05, [&](Real t) -> const State& {
        stepper.stepTo(t);
        return stepper.getState();
    });
    EXPECT_LT(drift.energy, 1e-6);
    EXPECT_LT(drift.momentum, 1e-8);
}

// The effect of bending falls with the stiffness.
TEST(HeavyTop, OnAStiffStemItPrecessesAsLagrangesTop) {
    const auto calcDifference = [](Real stiffening) {
        HeavyTop top(stiffening);
        BdfIntegrator integrator(top.system);
        integrator.setAccuracy(1e-8);
        integrator.initialize(top.makeSteadyState());
        Real largest = 0;
        for (int k = 1; k <= 50; ++k) {
            const Real t = 0.01 * k;
            integrator.stepTo(t);
            largest = std::max(largest, std::abs(top.calcAzimuth(integrator.getState()) -
                                                 t * HeavyTop::calcPrecession()));
        }
        return largest;
    };
    const Real soft = calcDifference(10), stiff = calcDifference(100),
               stiffer = calcDifference(1000);
    EXPECT_NEAR(soft / stiff, 10, 0.5);
    EXPECT_GT(stiff / stiffer, 10);
    EXPECT_LT(stiffer, 1e-4 * 0.5 * HeavyTop::calcPrecession());
}

}  // namespace
}  // namespace simflex::test
