// Starts, restarts and step size control.

#include <gtest/gtest.h>

#include <cmath>

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"
#include "simflex/solver/BdfIntegrator.h"
#include "simflex/solver/GeneralizedAlphaIntegrator.h"
#include "simflex/solver/RadauIntegrator.h"
#include "simflex/solver/equations/Evaluation.h"
#include "simflex/solver/integration/BdfScheme.h"
#include "simflex/solver/integration/NewtonMatrixReuse.h"
#include "simflex/solver/integration/SolutionHistory.h"
#include "simflex/solver/integration/StepController.h"
#include "support/PointMassPart.h"

namespace simflex {
namespace {

using namespace SimTK;

/** Gives the body a push every 0.1 s. **/
class Push : public PeriodicEventHandler {
public:
    explicit Push(const MobilizedBody& body) : PeriodicEventHandler(0.1), m_body(body) {}
    void handleEvent(State& state, Real, bool&) const override {
        m_body.setOneU(state, 0, m_body.getOneU(state, 0) + 0.5);
    }

private:
    const MobilizedBody& m_body;
};

/** A soft pendulum on a ball joint, and a stone that may be pushed. **/
struct Model {
    explicit Model(bool hasPush = false)
        : matter(system),
          forces(system),
          gravity(forces, matter, -YAxis, 9.81),
          flexible(system, matter),
          stone(matter.Ground(), Body::Rigid(MassProperties(1, Vec3(0), Inertia(1)))) {
        Force::MobilityLinearSpring(forces, stone, MobilizerQIndex(0), 400, 0);
        test::PointMassPartOptions options;
        options.numModes = 4;
        options.lowestFrequency = 2;
        options.highestFrequency = 5;
        body = std::make_unique<FlexibleBody>(flexible, test::makePointMassPart(options).body);
        Joint::Ball(flexible, matter.Ground(), body->interface("A"));
        if (hasPush) system.addEventHandler(new Push(stone));
        state = system.realizeTopology();
        body->setPoseByInterface(state, "A", Transform());
    }

    Real calcDistance(const State& a, const State& b) const {
        system.realize(a, Stage::Velocity);
        system.realize(b, Stage::Velocity);
        return std::max({(body->getFramePose(a).p() - body->getFramePose(b).p()).norm(),
                         (body->getModalCoordinates(a) - body->getModalCoordinates(b)).norm(),
                         std::abs(stone.getOneQ(a, 0) - stone.getOneQ(b, 0))});
    }

    MultibodySystem system;
    SimbodyMatterSubsystem matter;
    GeneralForceSubsystem forces;
    Force::Gravity gravity;
    FlexibleBodySubsystem flexible;
    MobilizedBody::Slider stone;
    std::unique_ptr<FlexibleBody> body;
    State state;
};

TEST(SolutionHistory, PolynomialsThroughADoubleNodeReproduceCubics) {
    const auto y = [](Real t) { return 2 - t + 3 * t * t - 0.5 * t * t * t; };
    const auto yDot = [](Real t) { return -1 + 6 * t - 1.5 * t * t; };
    SolutionHistory history;
    history.resize(1, 1, 0, 0);
    const Real times[] = {0.3, 0.7, 1.3};
    for (Real t : times) {
        SolutionPoint& point = history.push();
        point.t = t;
        point.q[0] = y(t);
        point.qDot[0] = yDot(t);
        point.work = y(t);
        point.power = yDot(t);
        if (t == times[0]) history.startAtNewest();
    }
    EXPECT_EQ(history.numNodes(), 4);
    std::vector<double> value(1);
    for (Real t : {0.5, 1.3, 2.0}) {
        history.combineQ(history.calcInterpolation(4, t), value);
        EXPECT_NEAR(value[0], y(t), 1e-13);
        EXPECT_NEAR(history.combineWork(history.calcInterpolation(4, t)), y(t), 1e-13);
    }
    // BDF of order 3 through 3 nodes and the new point is exact for cubics; so is order 4 through
    // all four nodes.
    for (int order : {3, 4}) {
        SolutionHistory::Weights weights;
        const double gamma = BdfScheme::calcCoefficients(history, order, 2, weights);
        history.combineQ(weights, value);
        EXPECT_NEAR((y(2) - value[0]) / gamma, yDot(2), 1e-12) << "order " << order;
    }
}

TEST(SolutionHistory, Bdf2FromADoubleNodeIsTheTrapezoidalRule) {
    SolutionHistory history;
    history.resize(1, 0, 0, 0);
    SolutionPoint& point = history.push();
    point.t = 1;
    point.q[0] = 5;
    point.qDot[0] = 3;
    history.startAtNewest();
    SolutionHistory::Weights weights;
    EXPECT_NEAR(BdfScheme::calcCoefficients(history, 2, 1.4, weights), 0.2, 1e-15);
    std::vector<double> value(1);
    history.combineQ(weights, value);
    EXPECT_NEAR(value[0], 5 + 0.2 * 3, 1e-14);
}

TEST(StepController, SettlesWithoutOscillationWhereTheErrorFollowsThePower) {
    // e = (h/h₀)³: the ideal step is h₀ Target^(1/3).
    StepController controller;
    Real h = 0.05;
    std::vector<Real> steps;
    for (int i = 0; i < 60; ++i) {
        h *= controller.calcRatio(h * h * h, 2, 2);
        steps.push_back(h);
    }
    const Real ideal = std::cbrt(StepController::Target);
    EXPECT_NEAR(steps.back(), ideal, 1e-3 * ideal);
    for (Real step : steps) EXPECT_LT(step, 1.1 * ideal);
}

TEST(NewtonMatrixReuse, AMatrixServesUntilItsFactorHasChangedOrItIsOld) {
    NewtonMatrixReuse reuse;
    EXPECT_TRUE(reuse.beginStep(1e-3));
    reuse.take(1e-3);
    EXPECT_TRUE(reuse.isFresh());
    EXPECT_FALSE(reuse.beginStep(1.09e-3));
    EXPECT_FALSE(reuse.isOld());
    EXPECT_TRUE(reuse.beginStep(1.11e-3));
    EXPECT_TRUE(reuse.isOld());
    reuse.take(1e-3);
    for (int step = 0; step < NewtonMatrixReuse::LongestUse; ++step)
        EXPECT_FALSE(reuse.beginStep(1e-3)) << step;
    EXPECT_TRUE(reuse.beginStep(1e-3));
    reuse.take(1e-3);
    reuse.forget();
    EXPECT_TRUE(reuse.beginStep(1e-3));
}

TEST(NewtonMatrixReuse, SlowIterationsAgeTheMatrix) {
    NewtonMatrixReuse reuse;
    reuse.take(1e-3);
    int steps = 0;
    for (; !reuse.beginStep(1e-3); ++steps) {
        reuse.noteRate(0.6);
        EXPECT_TRUE(reuse.isSlow());
        EXPECT_NEAR(reuse.calcRemaining(), 1.5, 1e-12);  // the geometric series
        reuse.endStep();
    }
    EXPECT_EQ(steps, 9);  // each counts as six
    reuse.noteRate(0.4);
    EXPECT_FALSE(reuse.isSlow());
    reuse.noteRate(0);  // one lucky change promises no more than this
    EXPECT_NEAR(reuse.calcRemaining(), 1.0 / 9, 1e-12);
}

TEST(Starts, NoStepIsTakenAtOrder1AtTheStartOrAfterHandlers) {
    const Model model(true);
    for (auto formulation : {ImplicitIntegrator::Formulation::StabilizedIndex2,
                             ImplicitIntegrator::Formulation::Index3}) {
        BdfIntegrator integrator(model.system);
        integrator.setFormulation(formulation);
        integrator.setAccuracy(1e-7);
        integrator.initialize(model.state);
        integrator.stepTo(0.55);
        const IntegratorStatistics& statistics = integrator.getStatistics();
        EXPECT_EQ(statistics.scheduledEvents, 6);
        EXPECT_EQ(statistics.stepsAtOrder[1], 0);
        EXPECT_EQ(statistics.stepsAtOrder[2], statistics.stepsTaken);
    }
}

TEST(Starts, AStartCostsAFewStepsOnly) {
    // Steps at most double, so from the cube root of the accuracy few doublings are needed.
    const Model calm(false), pushed(true);
    for (Real accuracy : {1e-5, 1e-7, 1e-9}) {
        long steps[2];
        const Model* models[] = {&calm, &pushed};
        for (int i = 0; i < 2; ++i) {
            BdfIntegrator integrator(models[i]->system);
            integrator.setAccuracy(accuracy);
            integrator.initialize(models[i]->state);
            integrator.stepTo(0.98);
            steps[i] = integrator.getStatistics().stepsTaken;
        }
        // Ten restarts; the pushes also speed up the motion.
        EXPECT_LT(steps[1], 1.8 * double(steps[0]) + 10 * 6) << "accuracy " << accuracy;
    }
}

TEST(Starts, FixedStepsHaveTheirOrderWithoutAGivenHistory) {
    const Model model;
    BdfIntegrator exact(model.system);
    exact.setMaximumOrder(5);
    exact.setAccuracy(1e-12);
    exact.initialize(model.state);
    exact.stepTo(0.4);
    for (auto formulation : {ImplicitIntegrator::Formulation::StabilizedIndex2,
                             ImplicitIntegrator::Formulation::Index3}) {
        std::vector<Real> errors;
        for (Real h : {4e-3, 2e-3, 1e-3}) {
            BdfIntegrator integrator(model.system);
            integrator.setFixedStep(h);
            integrator.setFormulation(formulation);
            integrator.setAccuracy(1e-11);
            integrator.initialize(model.state);
            integrator.stepTo(0.4);
            errors.push_back(model.calcDistance(integrator.getState(), exact.getState()));
        }
        for (size_t i = 1; i < errors.size(); ++i)
            EXPECT_NEAR(std::log2(errors[i - 1] / errors[i]), 2, 0.1) << errors[i];
    }
}

template <class Integrator>
void expectFixedStepsWhateverTheAccuracy() {
    const Model pushed(true);
    const std::vector<Real> accuracies{1e-8, 1e-5, 1e-2};
    std::vector<std::vector<Real>> times;
    Array_<State> ends;
    for (Real accuracy : accuracies) {
        times.emplace_back();
        Integrator integrator(pushed.system);
        integrator.setFixedStep(3e-3);
        integrator.setAccuracy(accuracy);
        integrator.setStepObserver([&](Real time) {
            times.back().push_back(time);
            return true;
        });
        integrator.initialize(pushed.state);
        integrator.stepTo(0.55);
        ends.push_back(integrator.getState());
    }
    for (unsigned i : {1u, 2u}) {
        EXPECT_EQ(times[i], times[0]);
        EXPECT_LT(pushed.calcDistance(ends[i], ends[0]), 0.1 * accuracies[i]);
    }
}

TEST(FixedSteps, AreTheSameWhateverTheAccuracy) {
    expectFixedStepsWhateverTheAccuracy<BdfIntegrator>();
    expectFixedStepsWhateverTheAccuracy<GeneralizedAlphaIntegrator>();
    expectFixedStepsWhateverTheAccuracy<RadauIntegrator>();
}

template <class Integrator>
void expectSameTrajectoryFromASavedState() {
    const Model model;
    for (Real accuracy : {1e-6, 1e-8}) {
        Integrator whole(model.system);
        whole.setAccuracy(accuracy);
        whole.initialize(model.state);
        whole.stepTo(0.25);
        const State saved = whole.getState();
        const Vector uDot = whole.getUDot(), lambda = whole.getMultipliers();
        whole.stepTo(0.5);

        Integrator resumed(model.system);
        resumed.setAccuracy(accuracy);
        resumed.initialize(saved);
        const Real loose = std::pow(accuracy, 1.0 / 3);
        EXPECT_LT((resumed.getUDot() - uDot).norm(), 100 * loose * (1 + uDot.norm()));
        EXPECT_LT((resumed.getMultipliers() - lambda).norm(), 10 * loose * (1 + lambda.norm()));
        resumed.stepTo(0.5);
        EXPECT_LT(model.calcDistance(resumed.getState(), whole.getState()),
                  3 * std::pow(accuracy, 2.0 / 3))
            << "accuracy " << accuracy;
    }
}

TEST(Starts, ARunFromASavedStateContinuesOnTheSameTrajectory) {
    expectSameTrajectoryFromASavedState<BdfIntegrator>();
    expectSameTrajectoryFromASavedState<GeneralizedAlphaIntegrator>();
    expectSameTrajectoryFromASavedState<RadauIntegrator>();
}

TEST(StepControl, FewTriesAreRejectedAndStepsVarySmoothly) {
    const Model model;
    for (Real accuracy : {1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8}) {
        BdfIntegrator integrator(model.system);
        integrator.setAccuracy(accuracy);
        integrator.initialize(model.state);
        integrator.stepTo(2);
        const IntegratorStatistics& statistics = integrator.getStatistics();
        EXPECT_LE(statistics.calcRejectedFraction(), 0.05) << statistics.toString();
        EXPECT_LT(statistics.calcStepRatioDeviation(), 0.25) << statistics.toString();
    }
}

TEST(StepControl, ErrorFallsMonotonicallyWithTheSlopeOfTheOrder) {
    const Model model;
    BdfIntegrator exact(model.system);
    exact.setMaximumOrder(5);
    exact.setAccuracy(1e-12);
    exact.initialize(model.state);
    Array_<State> reference;
    for (int i = 1; i <= 20; ++i) {
        exact.stepTo(0.05 * i);
        reference.push_back(exact.getState());
    }
    const std::vector<Real> accuracies = {1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8};
    for (int order : {2, 3}) {
        std::vector<Real> errors;
        for (Real accuracy : accuracies) {
            BdfIntegrator integrator(model.system);
            integrator.setMaximumOrder(order);
            integrator.setAccuracy(accuracy);
            integrator.initialize(model.state);
            Real error = 0;
            for (int i = 1; i <= 20; ++i) {
                integrator.stepTo(0.05 * i);
                error = std::max(
                    error, model.calcDistance(integrator.getState(), reference[unsigned(i - 1)]));
            }
            errors.push_back(error);
        }
        for (size_t i = 1; i < errors.size(); ++i)
            EXPECT_LT(errors[i], errors[i - 1]) << "order " << order << ", " << accuracies[i];
        const Real slope =
            std::log(errors[1] / errors.back()) / std::log(accuracies[1] / accuracies.back());
        EXPECT_GT(slope, Real(order) / (order + 1) - 0.03) << "order " << order;
    }
}

/** Masses on springs, each on its own line. **/
struct Oscillators {
    explicit Oscillators(int count) {
        for (int i = 0; i < count; ++i) {
            masses.emplace_back(matter.Ground(),
                                Body::Rigid(MassProperties(1, Vec3(0), Inertia(1))));
            Force::MobilityLinearSpring(forces, masses.back(), MobilizerQIndex(0), 100, 0);
        }
        state = system.realizeTopology();
        masses[0].setLength(state, 0.01);
    }

    State run(BdfIntegrator& integrator) {
        integrator.setConstraintTolerance(1e-10);
        integrator.initialize(state);
        integrator.stepTo(1);
        return integrator.getState();
    }

    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    std::vector<MobilizedBody::Slider> masses;
    State state;
};

TEST(AccuracyNorm, HalvedUnitsAreAHalvedAccuracy) {
    Oscillators model(1);
    BdfIntegrator tight(model.system);
    tight.setAccuracy(0.5e-4);
    const State byAccuracy = model.run(tight);
    model.state.updUWeights() = 2;
    BdfIntegrator weighed(model.system);
    weighed.setAccuracy(1e-4);
    const State byWeights = model.run(weighed);
    EXPECT_EQ(tight.getStatistics().stepsTaken, weighed.getStatistics().stepsTaken);
    EXPECT_NEAR(byAccuracy.getQ()[0], byWeights.getQ()[0], 1e-12);
}

TEST(AccuracyNorm, RestingCoordinatesThinTheMeanSquareAndNotTheWorst) {
    Oscillators one(1), four(4);
    const auto countSteps = [](Oscillators& model, Real accuracy, bool useInfinityNorm) {
        BdfIntegrator integrator(model.system);
        integrator.setAccuracy(accuracy);
        integrator.setUseInfinityNorm(useInfinityNorm);
        model.run(integrator);
        return integrator.getStatistics().stepsTaken;
    };
    EXPECT_EQ(countSteps(one, 2e-5, false), countSteps(four, 1e-5, false));
    EXPECT_EQ(countSteps(one, 1e-5, true), countSteps(four, 1e-5, true));
    EXPECT_LT(countSteps(four, 1e-5, false), countSteps(four, 1e-5, true));
}

TEST(AccuracyNorm, IsWhatSimbodysOperatorsMakeOfIt) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    const Body::Rigid body(MassProperties(1, Vec3(0), Inertia(1)));
    MobilizedBody::Free free(matter.Ground(), body);
    MobilizedBody::Pin pin(free, Vec3(0.3, 0, 0), body, Transform());
    MobilizedBody::Gimbal gimbal(pin, Vec3(0, 0.3, 0), body, Transform());
    MobilizedBody::LineOrientation line(gimbal, Vec3(0, 0, 0.2), body, Transform());
    State state = system.realizeTopology();
    const int nq = state.getNQ(), nu = state.getNU();
    for (int i = 0; i < nq; ++i) state.updQ()[i] = 0.4 + 0.1 * std::sin(i);
    for (int i = 0; i < nu; ++i) {
        state.updU()[i] = 3 * std::cos(1.0 + i);
        state.updUWeights()[i] = 0.5 + 0.2 * i;
    }
    system.realize(state, Stage::Position);
    matter.normalizeQuaternions(state);
    system.realize(state, Stage::Velocity);
    Evaluation equations(system, state);
    std::vector<double> q(size_t(nq), 0), u(size_t(nu), 0);
    equations.getBlocks().getFromState(state, q.data(), u.data());
    Vector dq(nq), du(nu), weighed(nq), scaled(nu);
    for (int i = 0; i < nu; ++i) du[i] = std::sin(2.0 + 3 * i);
    matter.multiplyByN(state, false, du, dq);
    for (int i = 0; i < nu; ++i) du[i] *= state.getUWeights()[i];
    matter.multiplyByN(state, false, du, weighed);
    for (int i = 0; i < nu; ++i) {
        du[i] = std::cos(1.0 + 2 * i);
        scaled[i] = du[i] * std::min(Real(state.getUWeights()[i]), 1 / std::abs(state.getU()[i]));
    }
    const std::vector<double> noQ(size_t(nq), 0), noU(size_t(nu), 0);
    for (const bool isWorst : {false, true}) {
        equations.updErrorNorm().setKind(isWorst ? ErrorNorm::Kind::Infinity
                                                 : ErrorNorm::Kind::RootMeanSquare);
        equations.updErrorNorm().setReference(q.data(), u.data(), nullptr);
        EXPECT_NEAR(equations.updErrorNorm().calcSize(&dq[0], noU.data(), 1),
                    isWorst ? weighed.normInf() : weighed.normRMS(), 1e-12);
        EXPECT_NEAR(equations.updErrorNorm().calcSize(noQ.data(), &du[0], 1),
                    isWorst ? scaled.normInf() : scaled.normRMS(), 1e-12);
    }
}

TEST(AccuracyNorm, MetresAreMetresAtAnyWeight) {
    Oscillators model(1);
    const auto countSteps = [&] {
        BdfIntegrator integrator(model.system);
        integrator.setAccuracyNorm(BdfIntegrator::AccuracyNorm::Displacement);
        integrator.setAccuracy(1e-5);
        model.run(integrator);
        return integrator.getStatistics().stepsTaken;
    };
    const long plain = countSteps();
    model.state.updUWeights() = 100;
    EXPECT_EQ(countSteps(), plain);
}

TEST(AccuracyNorm, FlexibleBodiesHaveMetresOnly) {
    Model model;
    BdfIntegrator integrator(model.system);
    integrator.setAccuracyNorm(BdfIntegrator::AccuracyNorm::StateWeights);
    EXPECT_THROW(integrator.initialize(model.state), std::invalid_argument);
}

TEST(DefaultOrder, FollowsTheSystem) {
    Oscillators rigid(1);
    BdfIntegrator high(rigid.system);
    rigid.run(high);
    EXPECT_GT(high.getStatistics().stepsAtOrder[5], 0);
    // x = 0.01 cos 10t
    EXPECT_NEAR(high.getState().getQ()[0], 0.01 * std::cos(10.0), 1e-4);

    Model model;
    BdfIntegrator low(model.system);
    low.initialize(model.state);
    low.stepTo(0.05);
    EXPECT_EQ(low.getStatistics().stepsAtOrder[3], 0);
}

TEST(DefaultOrder, OfTheLongestStepsTheOneOfLeastErrorIsTaken) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    Force::Gravity gravity(forces, matter, -YAxis, 9.81);
    MobilizedBody::Pin bob(matter.Ground(), Transform(),
                           Body::Rigid(MassProperties(1, Vec3(0, -1, 0), Inertia(1.1, 0.1, 1.1))),
                           Transform());
    State start = system.realizeTopology();
    bob.setAngle(start, 1);
    const auto run = [&](Real accuracy, Real longestStep) {
        BdfIntegrator integrator(system);
        integrator.setAccuracy(accuracy);
        integrator.setMaximumStepSize(longestStep);
        integrator.initialize(start);
        integrator.stepTo(2);
        return bob.getAngle(integrator.getState());
    };
    const Real end = run(1e-12, 0.1);
    // Errors fall with the step size, no matter how far below the accuracy.
    for (const Real accuracy : {1e-3, 1e-5}) {
        Real last = Infinity;
        for (const Real step : {1e-2, 2.5e-3, 1e-3}) {
            const Real error = std::abs(run(accuracy, step) - end);
            EXPECT_LT(error, last / 3) << "accuracy " << accuracy << ", step " << step;
            last = error;
        }
        EXPECT_LT(last, 2e-8);
    }
}

/** A mass on a spring with a known closed form, alone or beside a slower one with a much wider
swing. **/
struct Neighbours {
    enum class Beside { Nothing, Slower };
    Neighbours(Beside beside, Real width) {
        const auto add = [&](Real frequency) {
            masses.emplace_back(matter.Ground(),
                                Body::Rigid(MassProperties(2, Vec3(0), Inertia(1))));
            const Real omega = 2 * Pi * frequency;
            Force::MobilityLinearSpring(forces, masses.back(), MobilizerQIndex(0),
                                        2 * omega * omega, 0);
        };
        add(2);
        if (beside == Beside::Slower) add(0.2);
        state = system.realizeTopology();
        masses[0].setOneQ(state, 0, 0.1);
        if (beside == Beside::Slower) masses[1].setOneQ(state, 0, width);
    }
    template <class Scheme>
    Real calcError(Real accuracy, ImplicitIntegrator::AccuracyNorm norm) const {
        Scheme integrator(system);
        integrator.setAccuracyNorm(norm);
        integrator.setUseInfinityNorm(true);
        integrator.setAccuracy(accuracy);
        integrator.initialize(state);
        Real error = 0;
        for (int k = 1; k <= 150; ++k) {
            integrator.stepTo(0.01 * k);
            error = std::max(error, std::abs(masses[0].getOneQ(integrator.getState(), 0) -
                                             0.1 * std::cos(4 * Pi * integrator.getTime())));
        }
        return error;
    }
    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    std::vector<MobilizedBody::Slider> masses;
    State state;
};

template <class Scheme>
void expectTheErrorThatItHasAlone() {
    using Norm = ImplicitIntegrator::AccuracyNorm;
    for (const Norm norm : {Norm::Displacement, Norm::StateWeights})
        for (const Real accuracy : {1e-4, 1e-6}) {
            // Wide enough that its error dominates.
            const Real width = norm == Norm::Displacement ? 1000 : 3;
            const Neighbours alone(Neighbours::Beside::Nothing, width),
                together(Neighbours::Beside::Slower, width);
            const Real own = alone.calcError<Scheme>(accuracy, norm),
                       beside = together.calcError<Scheme>(accuracy, norm);
            EXPECT_LT(beside, 2 * own) << "accuracy " << accuracy << ", norm " << int(norm);
        }
}

TEST(ErrorsByPart, AMechanismBesideAnotherHasTheErrorThatItHasAlone) {
    expectTheErrorThatItHasAlone<RadauIntegrator>();
    expectTheErrorThatItHasAlone<BdfIntegrator>();
    expectTheErrorThatItHasAlone<GeneralizedAlphaIntegrator>();
}

/** A swing of two links whose end slides on a rod, with a spring; lengths and masses in other
units.
**/
template <class Scheme>
std::vector<Real> listSteps(Real metre, Real kilogram) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    Force::Gravity(forces, matter, -YAxis, 9.81 * metre);
    FlexibleBodySubsystem flexible(system, matter);
    const Body::Rigid bar(MassProperties(2 * kilogram, Vec3(0, -0.2 * metre, 0),
                                         Inertia(0.2, 0.01, 0.2) * (kilogram * metre * metre)));
    const Vec3 link(0, -0.4 * metre, 0);
    const Rotation first(0.4, ZAxis), second(-0.3, ZAxis), last(0.2, ZAxis);
    const Vec3 knee = first * link + second * link;
    MobilizedBody::Pin upper(matter.Ground(), Transform(), bar, Transform());
    MobilizedBody::Ball lower(upper, link, bar, Vec3(0));
    MobilizedBody::Free third(matter.Ground(), Transform(), bar, Transform());
    Joint::Ball(flexible, Attachment(lower, link), third);
    Joint::Pin(flexible, Attachment(third, link), Attachment(matter.Ground(), knee + last * link));
    State state = system.realizeTopology();
    upper.setAngle(state, 0.4);
    lower.setQToFitRotation(state, ~first * second);
    third.setQToFitTransform(state, Transform(last, knee));
    Scheme integrator(system);
    integrator.setAccuracy(1e-5 * metre);
    integrator.setConstraintTolerance(1e-8 * metre);
    std::vector<Real> steps;
    integrator.setStepObserver([&](Real time) {
        steps.push_back(time);
        return true;
    });
    integrator.initialize(state);
    integrator.stepTo(0.5);
    return steps;
}

template <class Scheme>
void expectTheSameStepsInOtherUnits() {
    const std::vector<Real> inMetres = listSteps<Scheme>(1, 1),
                            inMillimetres = listSteps<Scheme>(1000, 1e-3);
    ASSERT_EQ(inMetres.size(), inMillimetres.size());
    for (size_t k = 0; k < inMetres.size(); ++k)
        EXPECT_NEAR(inMetres[k], inMillimetres[k], 1e-4 * inMetres[k]) << k;
}

TEST(ErrorsByPart, OtherUnitsMakeNoOtherSteps) {
    expectTheSameStepsInOtherUnits<RadauIntegrator>();
    expectTheSameStepsInOtherUnits<BdfIntegrator>();
    expectTheSameStepsInOtherUnits<GeneralizedAlphaIntegrator>();
}

/** A rigid and a bending link on a pin and a universal joint, with a disk welded to their end and a
box on a bushing. Lengths and gravity are scaled by `length`; masses are not. **/
struct ScaledLinks {
    explicit ScaledLinks(Real length)
        : L(length),
          matter(system),
          forces(system),
          gravity(forces, matter, L * Vec3(1, -9, 2)),
          flexible(system, matter),
          link(matter.Ground(), makeBody(0.5, 0.2)),
          disk(matter.Ground(), makeBody(2, 0.25)) {
        test::PointMassPartOptions options;
        for (Real& size : options.size) size *= L;
        options.numModes = 6;
        bar = std::make_unique<FlexibleBody>(flexible, test::makePointMassPart(options).body);
        Joint::Pin(flexible, Attachment(matter.Ground(), Rotation(0.4, YAxis)),
                   Attachment(link, Vec3(-0.25 * L, 0, 0)), "pin");
        Joint::Universal(flexible, Attachment(link, Vec3(0.25 * L, 0, 0)), bar->interface("A"),
                         "cross");
        Joint::Weld(flexible, bar->interface("B"), Attachment(disk, Vec3(-0.125 * L, 0, 0)),
                    "weld");
        state = system.realizeTopology();
        link.setQToFitTransform(
            state, Transform(Rotation(0.4, YAxis), Rotation(0.4, YAxis) * Vec3(0.25 * L, 0, 0)));
        bar->setPoseByInterface(state, "A", Transform(Rotation(0.4, YAxis) * Vec3(0.5 * L, 0, 0)));
        system.realize(state, Stage::Position);
        const ReducedBody::Interface& B = bar->getPart().getInterface("B");
        const Transform X_GB = bar->getFramePose(state);
        disk.setQToFitTransform(
            state, Transform(X_GB.R(), X_GB * Vec3(B.position[0], B.position[1], B.position[2]) +
                                           X_GB.R() * Vec3(0.125 * L, 0, 0)));
    }

    Body::Rigid makeBody(Real mass, Real size) const {
        return Body::Rigid(MassProperties(
            mass, Vec3(0), Inertia(mass * square(size * L) * Vec3(0.25, 0.125, 0.25))));
    }

    Real L;
    MultibodySystem system;
    SimbodyMatterSubsystem matter;
    GeneralForceSubsystem forces;
    Force::Gravity gravity;
    FlexibleBodySubsystem flexible;
    MobilizedBody::Free link, disk;
    std::unique_ptr<FlexibleBody> bar;
    State state;
};

template <class Integrator>
class UnitsOfLength : public testing::Test {};
using EveryIntegrator = testing::Types<BdfIntegrator, GeneralizedAlphaIntegrator, RadauIntegrator>;
TYPED_TEST_SUITE(UnitsOfLength, EveryIntegrator);

TYPED_TEST(UnitsOfLength, ChangeNoStep) {
    struct Run {
        long steps, iterations;
        std::vector<Vec3> places;  ///< of the disk [nominal m]
    };
    const auto run = [](Real length) {
        ScaledLinks links(length);
        TypeParam integrator(links.system);
        integrator.setAccuracy(1e-6 * length);
        integrator.initialize(links.state);
        Run result{};
        for (int row = 1; row <= 20; ++row) {
            integrator.stepTo(0.05 * row);
            result.places.push_back(links.disk.getBodyOriginLocation(integrator.getState()) /
                                    length);
        }
        result.steps = integrator.getStatistics().stepsTaken;
        result.iterations = integrator.getStatistics().newtonIterations;
        return result;
    };
    const Run nominal = run(1);
    for (const Real length : {1024.0, 1.0 / 1024}) {  // powers of two give the same round-off
        const Run other = run(length);
        EXPECT_EQ(other.steps, nominal.steps) << length;
        const bool isRadau = std::is_same<TypeParam, RadauIntegrator>::value;
        EXPECT_NEAR(Real(other.iterations), Real(nominal.iterations),
                    isRadau ? 0 : 0.02 * Real(nominal.iterations))
            << length;
        for (size_t row = 0; row < nominal.places.size(); ++row)
            EXPECT_LT((other.places[row] - nominal.places[row]).norm(), isRadau ? 1e-9 : 1e-6)
                << length << ", row " << row;
    }
}

}  // namespace
}  // namespace simflex
