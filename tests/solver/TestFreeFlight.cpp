// A spinning, vibrating body in free flight conserves momentum and energy to the integrator's
// tolerance; the errors fall with it.

#include <gtest/gtest.h>

#include <algorithm>

#include "simflex/body/FlexibleBody.h"
#include "simflex/solver/BdfIntegrator.h"
#include "support/PointMassPart.h"

namespace simflex {
namespace {

using namespace SimTK;

struct Drift {
    Real angularMomentum, linearMomentum, energy;
    long steps;
};

/** @param fixedStep  step size; 0 selects error control **/
Drift calcDrift(Real accuracy, int maximumOrder, BdfIntegrator::BlockForm form,
                Real fixedStep = 0) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    FlexibleBodySubsystem flexible(system, matter);
    test::PointMassPartOptions options;
    options.numModes = 7;
    options.lowestFrequency = 8;
    options.highestFrequency = 30;
    const FlexibleBody body(flexible, test::makePointMassPart(options).body);
    State state = system.realizeTopology();
    body.setFrameVelocity(state, SpatialVec(Vec3(3, 1, -2), Vec3(0.3, -0.2, 0.1)));
    Vector xi(7), xiDot(7);
    for (int i = 0; i < 7; ++i) {
        xi[i] = 2e-3 * std::cos(1.0 + i);
        xiDot[i] = 0.05 * std::sin(2.0 + i);
    }
    body.setModalCoordinates(state, xi);
    body.setModalSpeeds(state, xiDot);

    BdfIntegrator integrator(system);
    integrator.setAccuracy(accuracy);
    integrator.setMaximumOrder(maximumOrder);
    integrator.setBlockForm(form);
    if (fixedStep > 0) integrator.setFixedStep(fixedStep);
    integrator.initialize(state);
    system.realize(integrator.getState(), Stage::Dynamics);
    const SpatialVec momentum = body.calcMomentum(integrator.getState());
    const Real energy = flexible.calcEnergy(integrator.getState());
    Drift drift{0, 0, 0, 0};
    for (int i = 1; i <= 10; ++i) {
        integrator.stepTo(0.05 * i);
        const State& now = integrator.getState();
        system.realize(now, Stage::Dynamics);
        const SpatialVec change = body.calcMomentum(now) - momentum;
        drift.angularMomentum =
            std::max(drift.angularMomentum, change[0].norm() / momentum[0].norm());
        drift.linearMomentum =
            std::max(drift.linearMomentum, change[1].norm() / momentum[1].norm());
        drift.energy = std::max(drift.energy, std::abs(flexible.calcEnergy(now) - energy) / energy);
    }
    drift.steps = integrator.getStatistics().stepsTaken;
    return drift;
}

TEST(FreeFlight, MomentumAndEnergyErrorsFallWithAccuracy) {
    std::vector<Drift> drifts;
    for (Real accuracy : {1e-5, 1e-6, 1e-7, 1e-8})
        drifts.push_back(calcDrift(accuracy, 2, BdfIntegrator::BlockForm::Automatic));
    for (size_t i = 1; i < drifts.size(); ++i) {
        // accuracy^(2/3): a factor of 4.6 per decade; 2.5 leaves room for the step size's
        // granularity.
        EXPECT_LT(drifts[i].angularMomentum, drifts[i - 1].angularMomentum / 2.5);
        EXPECT_LT(drifts[i].energy, drifts[i - 1].energy / 2.5);
    }
    EXPECT_LT(drifts.back().angularMomentum, 1e-4);
    EXPECT_LT(drifts.back().energy, 1e-3);
    // m v̇ = 0 has no discretization error.
    for (const Drift& drift : drifts) EXPECT_LT(drift.linearMomentum, 1e-12);
}

TEST(FreeFlight, HigherOrderKeepsEnergyBetterInFewerSteps) {
    const Drift second = calcDrift(1e-8, 2, BdfIntegrator::BlockForm::Automatic);
    const Drift fourth = calcDrift(1e-9, 4, BdfIntegrator::BlockForm::Automatic);
    EXPECT_LT(fourth.energy, second.energy);
    EXPECT_LT(fourth.steps, second.steps);
}

TEST(FreeFlight, ArrowAndDenseBlocksGiveTheSameMotion) {
    // Equal steps give equal equations: differences come only from the Newton residual, which the
    // accuracy keeps small.
    const Drift arrow = calcDrift(1e-10, 2, BdfIntegrator::BlockForm::Arrow, 1e-3);
    const Drift dense = calcDrift(1e-10, 2, BdfIntegrator::BlockForm::Dense, 1e-3);
    EXPECT_NEAR(arrow.energy, dense.energy, 1e-4 * dense.energy);
    EXPECT_NEAR(arrow.angularMomentum, dense.angularMomentum, 1e-4 * dense.angularMomentum);
}

}  // namespace
}  // namespace simflex
