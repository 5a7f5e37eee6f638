#include <gtest/gtest.h>

#include "simflex/solver/BdfIntegrator.h"

namespace simflex {
namespace {

using namespace SimTK;

/** A double pendulum. **/
struct Pendulum {
    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    Force::Gravity gravity{forces, matter, -YAxis, 9.81};
    FlexibleBodySubsystem flexible{system, matter};
    State state;

    Pendulum() {
        const Body::Rigid rod(MassProperties(1, Vec3(0, -0.5, 0), Inertia(1)));
        MobilizedBody::Pin upper(matter.Ground(), Transform(), rod, Transform());
        MobilizedBody::Pin lower(upper, Transform(Vec3(0, -1, 0)), rod, Transform());
        state = system.realizeTopology();
        upper.setAngle(state, 2);
        lower.setAngle(state, 1);
    }
};

TEST(StepObserver, SeesEveryStepAndTheBodyThatLimitsIt) {
    Pendulum pendulum;
    BdfIntegrator integrator(pendulum.system);
    std::vector<Real> times;
    integrator.setStepObserver([&](Real time) {
        times.push_back(time);
        return true;
    });
    integrator.initialize(pendulum.state);
    EXPECT_EQ(integrator.getErrorSource(), "");
    EXPECT_EQ(integrator.stepTo(0.5), ImplicitIntegrator::StepStatus::ReachedTime);
    EXPECT_EQ(long(times.size()), integrator.getStatistics().stepsTaken);
    EXPECT_TRUE(std::is_sorted(times.begin(), times.end()));
    EXPECT_GE(times.back(), 0.5);
    EXPECT_NE(integrator.getErrorSource(), "");
}

TEST(StepObserver, AnInterruptedRunGoesOnWithTheSameBits) {
    Pendulum pendulum;
    BdfIntegrator whole(pendulum.system), interrupted(pendulum.system);
    whole.initialize(pendulum.state);
    int count = 0, numStops = 0;
    interrupted.setStepObserver([&](Real) { return ++count % 7 != 0; });
    interrupted.initialize(pendulum.state);
    for (const Real time : {0.1, 0.2, 0.5, 1.0}) {
        whole.stepTo(time);
        Real before = interrupted.getTime();
        while (interrupted.stepTo(time) == ImplicitIntegrator::StepStatus::Interrupted) {
            ++numStops;
            EXPECT_EQ(interrupted.getTime(), before) << "what is shown stays";
            before = interrupted.getTime();
        }
        EXPECT_EQ(interrupted.getTime(), time);
        for (int k = 0; k < 2; ++k) {
            EXPECT_EQ(whole.getState().getQ()[k], interrupted.getState().getQ()[k]);
            EXPECT_EQ(whole.getState().getU()[k], interrupted.getState().getU()[k]);
        }
    }
    EXPECT_GT(numStops, 3);
    EXPECT_EQ(whole.getStatistics().stepsTaken, interrupted.getStatistics().stepsTaken);
}

TEST(StepObserver, AnInterruptionEndsWithTheCallThatReturnsIt) {
    Pendulum pendulum;
    BdfIntegrator integrator(pendulum.system);
    bool goesOn = true;
    integrator.setStepObserver([&](Real) { return goesOn; });
    integrator.setMaximumStepSize(0.01);
    for (const bool returnsSteps : {false, true}) {
        integrator.initialize(pendulum.state);
        EXPECT_EQ(integrator.stepTo(0.5, Infinity), BdfIntegrator::StartOfContinuousInterval);
        integrator.setReturnEveryInternalStep(returnsSteps);
        goesOn = false;
        EXPECT_EQ(integrator.stepTo(0.5, Infinity), BdfIntegrator::TimeHasAdvanced);
        integrator.setReturnEveryInternalStep(false);
        goesOn = true;
        const Real next = integrator.getTime() + 0.05;
        EXPECT_EQ(integrator.stepTo(next, Infinity), BdfIntegrator::ReachedReportTime);
        EXPECT_EQ(integrator.getTime(), next);
    }
    // An interruption that ends one run is not reported by the next one.
    integrator.initialize(pendulum.state);
    integrator.stepTo(0.5, Infinity);
    integrator.setReturnEveryInternalStep(true);
    goesOn = false;
    integrator.stepTo(0.5, Infinity);
    goesOn = true;
    integrator.setReturnEveryInternalStep(false);
    integrator.initialize(pendulum.state);
    integrator.stepTo(0.5, Infinity);
    EXPECT_EQ(integrator.stepTo(0.5, Infinity), BdfIntegrator::ReachedReportTime);
}

TEST(StepObserver, MaySetTheFinalTimeAndReplaceItself) {
    Pendulum pendulum;
    BdfIntegrator integrator(pendulum.system);
    Real last = 0;
    const std::vector<int> weight(100, 1);  // of a closure that is not stored in place
    integrator.setStepObserver([&, weight](Real time) {
        if (time < 0.2) return true;
        integrator.setStepObserver([&, weight](Real later) {
            last = later;
            return weight[99] == 1;
        });
        integrator.setFinalTime(time);
        last = time;
        return weight[99] == 1;
    });
    integrator.initialize(pendulum.state);
    EXPECT_EQ(integrator.stepTo(1), ImplicitIntegrator::StepStatus::ReachedFinalTime);
    EXPECT_EQ(integrator.getTime(), last);
    EXPECT_LT(last, 0.5);
    integrator.setFinalTime(Infinity);
    EXPECT_EQ(integrator.stepTo(1), ImplicitIntegrator::StepStatus::ReachedTime);
    EXPECT_GE(last, 1);
}

}  // namespace
}  // namespace simflex
