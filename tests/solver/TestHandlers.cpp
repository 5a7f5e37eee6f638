// Errors in handlers, and reading the state, leave the integration unchanged.

#include <gtest/gtest.h>

#include "simflex/body/Assembly.h"
#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"
#include "simflex/forces/Bushing.h"
#include "simflex/solver/BdfIntegrator.h"
#include "simflex/solver/GeneralizedAlphaIntegrator.h"
#include "simflex/solver/RadauIntegrator.h"
#include "simflex/solver/equations/Evaluation.h"
#include "support/PointMassPart.h"

namespace simflex {
namespace {

using namespace SimTK;
using Status = ImplicitIntegrator::StepStatus;

/** A closed loop: two bars on pins from Ground, joined at the top by a third; two more swing from
it. **/
struct Loop {
    Loop() {
        const Body::Rigid bar(MassProperties(1, Vec3(0, -0.5, 0), Inertia(0.34, 0.01, 0.34)));
        left = MobilizedBody::Pin(matter.Ground(), Transform(), bar, Transform());
        right = MobilizedBody::Pin(matter.Ground(), Transform(Vec3(1.2, 0, 0)), bar, Transform());
        cross = MobilizedBody::Pin(left, Transform(Vec3(0, -1, 0)), bar, Transform());
        Joint::Ball(flexible, Attachment(cross, Transform(Vec3(0, -1, 0))),
                    Attachment(right, Transform(Vec3(0, -1, 0))), "hinge");
    }

    void start() {
        state = system.realizeTopology();
        left.setAngle(state, 0.4);
        cross.setAngle(state, 1.2);
        right.setAngle(state, 0.3);
    }

    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    Force::Gravity gravity{forces, matter, -YAxis, 9.81};
    FlexibleBodySubsystem flexible{system, matter};
    MobilizedBody::Pin left, right, cross;
    State state;
};

/** Records the times at which the left bar passes the vertical, and changes nothing. **/
class Passing : public TriggeredEventHandler {
public:
    explicit Passing(const MobilizedBody& body)
        : TriggeredEventHandler(Stage::Position), m_body(body) {}
    Real getValue(const State& state) const override { return m_body.getOneQ(state, 0); }
    void handleEvent(State& state, Real, bool&) const override { times.push_back(state.getTime()); }
    mutable std::vector<Real> times;

private:
    const MobilizedBody& m_body;
};

class Clock : public PeriodicEventReporter {
public:
    explicit Clock(Real interval) : PeriodicEventReporter(interval) {}
    void handleEvent(const State& state) const override { times.push_back(state.getTime()); }
    mutable std::vector<Real> times;
};

TEST(Interruption, LosesNoReportWhereTriggersAreLocated) {
    struct Run {
        Loop model;
        Passing* passing = new Passing(model.left);
        Clock* clock = new Clock(0.003);
        Run() {
            model.system.addEventHandler(passing);
            model.system.addEventReporter(clock);
            model.start();
        }
    } whole, interrupted;
    BdfIntegrator a(whole.model.system), b(interrupted.model.system);
    b.setStepObserver([](Real) { return false; });
    a.initialize(whole.model.state);
    b.initialize(interrupted.model.state);
    for (const Real time : {0.01, 0.5, 1.0, 2.0}) {
        a.stepTo(time);
        while (b.stepTo(time) == Status::Interrupted) EXPECT_LE(b.getTime(), time);
        EXPECT_EQ(b.getTime(), time);
        EXPECT_EQ((a.getState().getQ() - b.getState().getQ()).norm(), 0);
        EXPECT_EQ((a.getState().getU() - b.getState().getU()).norm(), 0);
    }
    EXPECT_GT(whole.passing->times.size(), 1u);
    EXPECT_EQ(whole.passing->times, interrupted.passing->times);
    EXPECT_EQ(whole.clock->times, interrupted.clock->times);
}

template <class Integrator>
void expectNoTraceOfReports() {
    for (const Real accuracy : {1e-1, 1e-2, 1e-3, 1e-6}) {
        Loop model;
        model.start();
        model.left.setRate(model.state, 12);
        Integrator rarely(model.system), often(model.system);
        for (Integrator* integrator : {&rarely, &often}) {
            integrator->setAccuracy(accuracy);
            integrator->initialize(model.state);
        }
        for (int k = 1; k <= 3000; ++k) {
            often.stepTo(0.001 * k);
            if (k % 1000 != 0) continue;
            rarely.stepTo(0.001 * k);
            EXPECT_EQ((rarely.getState().getQ() - often.getState().getQ()).norm(), 0);
            EXPECT_EQ((rarely.getState().getU() - often.getState().getU()).norm(), 0);
            EXPECT_EQ((rarely.getMultipliers() - often.getMultipliers()).norm(), 0);
        }
        EXPECT_LT(often.getLargestConstraintError(), 1e-9);
        EXPECT_EQ(rarely.getStatistics().stepsTaken, often.getStatistics().stepsTaken);
        EXPECT_EQ(rarely.getStatistics().factorizations, often.getStatistics().factorizations);
    }
}

TEST(Reports, ChangeNoBitOfTheMotion) {
    expectNoTraceOfReports<BdfIntegrator>();
    expectNoTraceOfReports<GeneralizedAlphaIntegrator>();
    expectNoTraceOfReports<RadauIntegrator>();
}

/** Changes the State at 0.1 s, then calls `then`. **/
class Trouble : public ScheduledEventHandler {
public:
    Trouble(const Loop& model, std::function<void(State&)> then) : m_model(model), m_then(then) {}
    Real getNextEventTime(const State& state, bool includeCurrent) const override {
        const bool isAhead = state.getTime() < 0.1 || (includeCurrent && state.getTime() == 0.1);
        return isAhead ? 0.1 : Infinity;
    }
    void handleEvent(State& state, Real, bool&) const override {
        m_model.left.setOneU(state, 0, 100);
        m_then(state);
        m_model.left.setOneU(state, 0, 0.1);
    }

private:
    const Loop& m_model;
    std::function<void(State&)> m_then;
};

void expectToGoOnAfter(const std::function<void(const Loop&, State&)>& trouble,
                       const std::string& message) {
    Loop model;
    bool isTrouble = true;
    model.system.addEventHandler(new Trouble(model, [&](State& state) {
        if (isTrouble) trouble(model, state);
    }));
    model.start();
    BdfIntegrator integrator(model.system), undisturbed(model.system);
    for (BdfIntegrator* each : {&integrator, &undisturbed}) each->initialize(model.state);
    isTrouble = false;
    undisturbed.stepTo(0.3);
    isTrouble = true;
    for (int attempt = 0; attempt < 2; ++attempt) {
        try {
            integrator.stepTo(0.3);
            ADD_FAILURE() << "nothing went wrong";
        } catch (const std::exception& error) {
            EXPECT_NE(std::string(error.what()).find(message), std::string::npos) << error.what();
        }
        EXPECT_EQ(integrator.getTime(), 0.1);
        const State& now = integrator.getState();
        EXPECT_EQ(now.getTime(), 0.1);
        EXPECT_LT(std::abs(model.left.getRate(now)), 10) << "half changed";
        EXPECT_FALSE(model.left.isLocked(now));
        EXPECT_GE(now.getSystemStage(), Stage::Velocity);
        EXPECT_EQ(integrator.getMultipliers().size(), 3);
    }
    // The event is still pending.
    isTrouble = false;
    EXPECT_EQ(integrator.stepTo(0.3), Status::ReachedTime);
    EXPECT_EQ((integrator.getState().getQ() - undisturbed.getState().getQ()).norm(), 0);
    EXPECT_EQ((integrator.getState().getU() - undisturbed.getState().getU()).norm(), 0);
}

TEST(Handlers, OneThatThrowsHasChangedNothing) {
    expectToGoOnAfter([](const Loop&, State&) { throw std::runtime_error("no idea"); }, "no idea");
}

TEST(Handlers, OneThatLeavesWhatCannotBeAssembledHasChangedNothing) {
    expectToGoOnAfter(
        [](const Loop& model, State& state) {
            model.left.setOneQ(state, 0, Pi);
            model.left.lock(state);
            model.right.setOneQ(state, 0, 0.0);
            model.right.lock(state);
        },
        "hinge");
}

template <class Call>
void expectRefused(const std::string& method, Call call) {
    try {
        call();
        ADD_FAILURE() << method << " is not refused";
    } catch (const std::logic_error& error) {
        EXPECT_EQ(error.what(), method +
                                    "() after initialize(): an integration keeps the settings it "
                                    "began with; set them before, or make another integrator");
    }
}

/** Locks at 0.3 s. **/
class Brake : public ScheduledEventHandler {
public:
    Brake(const MultibodySystem& system, const Joint::Lock& lock)
        : m_system(system), m_lock(lock) {}
    Real getNextEventTime(const State& state, bool includeCurrent) const override {
        const bool isAhead = state.getTime() < 0.3 || (includeCurrent && state.getTime() == 0.3);
        return isAhead ? 0.3 : Infinity;
    }
    void handleEvent(State& state, Real, bool&) const override {
        m_lock.lock(state);
        assemble(m_system, state, 1e-12);
    }

private:
    const MultibodySystem& m_system;
    const Joint::Lock& m_lock;
};

TEST(Handlers, ThatLockAJointMakeTwoBodiesOne) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    const Force::Gravity gravity(forces, matter, -YAxis, 9.81);
    FlexibleBodySubsystem flexible(system, matter);
    const Body::Rigid bar(MassProperties(1, Vec3(0, -0.5, 0), Inertia(0.34, 0.01, 0.34)));
    MobilizedBody::Free upper(matter.Ground(), bar), lower(matter.Ground(), bar);
    const Vec3 end(0, -1, 0);
    const Joint::Pin hip(flexible, Attachment(matter.Ground()), Attachment(upper), "hip");
    const Joint::Pin knee(flexible, Attachment(upper, end), Attachment(lower), "knee");
    const Joint::Lock lock(flexible, knee, "knee lock");
    system.addEventHandler(new Brake(system, lock));
    State state = system.realizeTopology();
    EXPECT_FALSE(lock.isLocked(state));
    upper.setQToFitRotation(state, Rotation(1.2, ZAxis));
    lower.setQToFitRotation(state, Rotation(0.4, ZAxis));
    lower.setQToFitTranslation(state, Rotation(1.2, ZAxis) * end);
    RadauIntegrator integrator(system);
    integrator.setAccuracy(1e-9);
    integrator.initialize(state);
    const auto calcMomentum = [&] {  // about the hip, where its reaction has no moment
        const SpatialVec momentum =
            matter.calcSystemMomentumAboutGroundOrigin(integrator.getState());
        return momentum[0][2];
    };
    const auto calcEnergy = [&] {
        system.realize(integrator.getState(), Stage::Dynamics);
        return system.calcEnergy(integrator.getState());
    };
    integrator.stepTo(0.3 - 1e-9);
    const Real momentum = calcMomentum(), energy = calcEnergy();
    const Real angle = knee.calcCoordinates(integrator.getState())[0];
    EXPECT_GT(std::abs(knee.calcCoordinateDots(integrator.getState())[0]), 1);
    integrator.stepTo(0.3 + 1e-9);
    const State locked = integrator.getState();
    EXPECT_NEAR(calcMomentum(), momentum, 1e-6);
    EXPECT_LT(calcEnergy(), energy - 0.1) << "an inelastic impact";
    EXPECT_TRUE(lock.isLocked(locked));
    EXPECT_NEAR(lock.getLockValue(locked), angle, 1e-6);

    integrator.stepTo(1.3);
    EXPECT_NEAR(knee.calcCoordinates(integrator.getState())[0], angle, 1e-6);
    RungeKuttaMersonIntegrator native(system);
    native.setAccuracy(1e-9);
    native.setConstraintTolerance(1e-11);
    native.initialize(locked);
    while (native.getTime() < 1.3) native.stepTo(1.3);
    EXPECT_LT((native.getState().getQ() - integrator.getState().getQ()).norm(), 1e-6);
    EXPECT_LT((native.getState().getU() - integrator.getState().getU()).norm(), 1e-5);
}

/** Calls a function at 0.1 s. **/
class AtATenth : public ScheduledEventHandler {
public:
    explicit AtATenth(std::function<void(State&)> act) : m_act(std::move(act)) {}
    Real getNextEventTime(const State& state, bool includeCurrent) const override {
        const bool isAhead = state.getTime() < 0.1 || (includeCurrent && state.getTime() == 0.1);
        return isAhead ? 0.1 : Infinity;
    }
    void handleEvent(State& state, Real, bool&) const override { m_act(state); }

private:
    std::function<void(State&)> m_act;
};

/** Two rods in a row rotate as one at 1 rad/s; then the first is locked. The momentum of the second
about its pin is (1/12 + 3/4) kg m²/s before and (1/12 + 1/4) kg m² ω after; springs do not affect
it. **/
template <class Integrator>
void expectRodsStop(Real stiffness) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    const Body::Rigid rod(
        MassProperties(1, Vec3(0.5, 0, 0),
                       Inertia(0.01, 1.0 / 12, 1.0 / 12).shiftFromMassCenter(Vec3(0.5, 0, 0), 1)));
    MobilizedBody::Pin a(matter.Ground(), Transform(), rod, Transform());
    MobilizedBody::Pin b(a, Transform(Vec3(1, 0, 0)), rod, Transform());
    Force::MobilityLinearSpring(forces, b, MobilizerQIndex(0), stiffness, 0);
    Force::MobilityLinearDamper(forces, b, MobilizerUIndex(0), 0.1 * stiffness);
    system.addEventHandler(new AtATenth([&](State& now) { a.lock(now); }));
    State state = system.realizeTopology();
    a.setRate(state, 1);
    Integrator integrator(system);
    integrator.setAccuracy(1e-8);
    integrator.initialize(state);
    integrator.stepTo(0.1);
    EXPECT_EQ(a.getRate(integrator.getState()), 0);
    EXPECT_NEAR(b.getRate(integrator.getState()), 2.5, 1e-9);
}

TEST(Handlers, ThatLockAMobilizerMakeAnImpact) {
    for (const Real stiffness : {0.0, 1.0}) {
        expectRodsStop<RadauIntegrator>(stiffness);
        expectRodsStop<BdfIntegrator>(stiffness);
        expectRodsStop<GeneralizedAlphaIntegrator>(stiffness);
    }
}

/** Two flexible bodies on a hinge, with a bushing, in free flight: an impact at the hinge conserves
all six momenta and adds no energy. **/
template <class Integrator>
void expectMomentaKept(Real stiffness, Real damping) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    FlexibleBodySubsystem flexible(system, matter);
    test::PointMassPartOptions options;
    const FlexibleBody a(flexible, test::makePointMassPart(options).body, "a");
    options.seed = 2;
    const FlexibleBody b(flexible, test::makePointMassPart(options).body, "b");
    const Joint::Pin hinge(flexible, a.interface("B"), b.interface("A"), "hinge");
    const Joint::Lock lock(flexible, hinge, "lock");
    Bushing(flexible, a.interface("B"), b.interface("A"),
            Bushing::diagonal(Vec6(0, 0, stiffness, 0, 0, 0)),
            Bushing::diagonal(Vec6(0, 0, damping, 0, 0, 0)));
    struct Motion {
        SpatialVec momentum;
        Real energy, rate;
    };
    const auto look = [&](const State& state) {
        system.realize(state, Stage::Velocity);
        return Motion{flexible.calcMomentum(state), flexible.calcKineticEnergy(state),
                      hinge.calcCoordinateDots(state)[0]};
    };
    const auto expectImpact = [](const Motion& before, const Motion& after) {
        for (int k = 0; k < 2; ++k)
            EXPECT_LT((after.momentum[k] - before.momentum[k]).norm(),
                      1e-9 * before.momentum[k].norm());
        EXPECT_LT(after.energy, before.energy);
    };
    Motion before, after;
    system.addEventHandler(new AtATenth([&](State& now) {
        before = look(now);
        lock.lock(now);
        assemble(system, now, 1e-12);
        after = look(now);
    }));
    State state = system.realizeTopology();
    a.setPoseByInterface(state, "B", Transform());
    b.setPoseByInterface(state, "A", Transform());
    a.setFrameVelocity(state, SpatialVec(Vec3(0.5, 0.2, 3), Vec3(1, 0, 2)));
    b.setFrameVelocity(state, SpatialVec(Vec3(0.3, -0.2, -4), Vec3(0, 1, 0)));
    Integrator integrator(system);
    integrator.setAccuracy(1e-6);
    integrator.initialize(state);
    expectImpact(look(state), look(integrator.getState()));
    integrator.stepTo(0.11);
    EXPECT_GT(std::abs(before.rate), 0.1);
    EXPECT_NEAR(after.rate, 0, 1e-9);
    expectImpact(before, after);
}

TEST(Handlers, ImpactsOfFlexibleBodiesKeepMomentaWhateverForcesAct) {
    for (const Real size : {0.0, 20.0}) {
        expectMomentaKept<RadauIntegrator>(size, 0.02 * size);
        expectMomentaKept<BdfIntegrator>(size, 0.02 * size);
        expectMomentaKept<GeneralizedAlphaIntegrator>(size, 0.02 * size);
    }
}

TEST(Settings, AreRefusedByNameOnceTheIntegrationHasBegun) {
    Loop model;
    model.start();
    BdfIntegrator bdf(model.system);
    GeneralizedAlphaIntegrator alpha(model.system);
    bdf.setAccuracy(1e-5);
    bdf.initialize(model.state);
    alpha.initialize(model.state);
    expectRefused("BdfIntegrator::setFormulation",
                  [&] { bdf.setFormulation(BdfIntegrator::Formulation::Index3); });
    expectRefused("BdfIntegrator::setBlockForm",
                  [&] { bdf.setBlockForm(BdfIntegrator::BlockForm::Dense); });
    expectRefused("BdfIntegrator::setNewtonTolerances", [&] { bdf.setNewtonTolerances({}); });
    expectRefused("BdfIntegrator::setProjectionNorm",
                  [&] { bdf.setProjectionNorm(BdfIntegrator::ProjectionNorm::Inertia); });
    expectRefused("BdfIntegrator::setProjectInitialState",
                  [&] { bdf.setProjectInitialState(false); });
    expectRefused("BdfIntegrator::setMaximumOrder", [&] { bdf.setMaximumOrder(3); });
    expectRefused("BdfIntegrator::setFixedOrder", [&] { bdf.setFixedOrder(3); });
    expectRefused("BdfIntegrator::addBreakTimes", [&] { bdf.addBreakTimes({1.0}); });
    expectRefused("BdfIntegrator::addForceJacobian",
                  [&] { bdf.addForceJacobian({model.left.getMobilizedBodyIndex()}); });
    expectRefused("GeneralizedAlphaIntegrator::setSpectralRadius",
                  [&] { alpha.setSpectralRadius(0.5); });
    // Settings that take effect immediately may change at any time.
    bdf.setNumThreads(2);
    bdf.setStepObserver([](Real) { return true; });
    bdf.stepTo(0.1);
    EXPECT_THROW(bdf.setFinalTime(0.05), std::invalid_argument);
    bdf.setFinalTime(0.2);
    EXPECT_EQ(bdf.stepTo(1), Status::ReachedFinalTime);
    bdf.setFinalTime(0.3);
    EXPECT_EQ(bdf.stepTo(1), Status::ReachedFinalTime);
    EXPECT_EQ(bdf.getTime(), 0.3);
}

/** Holds a force on a mobility, with a new value in every period. **/
class Holder : public PeriodicEventHandler {
public:
    Holder(const Force::DiscreteForces& forces, const MobilizedBody& body, Real period,
           std::function<Real(Real time)> force)
        : PeriodicEventHandler(period), m_forces(forces), m_body(body), m_force(std::move(force)) {}
    void handleEvent(State& state, Real, bool&) const override {
        m_forces.setOneMobilityForce(state, m_body, MobilizerUIndex(0), m_force(state.getTime()));
    }

private:
    const Force::DiscreteForces m_forces;
    const MobilizedBody m_body;
    const std::function<Real(Real time)> m_force;
};

struct HeldSlider {
    HeldSlider(Real period, const std::function<Real(Real time)>& force) {
        system.addEventHandler(new Holder(held, mass, period, force));
        state = system.realizeTopology();
    }

    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    Force::DiscreteForces held{forces, matter};
    MobilizedBody::Slider mass{matter.Ground(),
                               Body::Rigid(MassProperties(2, Vec3(0), Inertia(1)))};
    State state;
};

TEST(HeldForces, MoveAMassAsTheirStepsSay) {
    const Real period = 0.01;
    const auto force = [](Real time) { return 3 * std::sin(40 * time + 0.5) + 1; };
    HeldSlider model(period, force);
    BdfIntegrator integrator(model.system);
    integrator.initialize(model.state);
    integrator.stepTo(1);
    Real x = 0, v = 0;
    for (int k = 0; k < 100; ++k) {
        const Real a = force(k * period) / 2;
        x += v * period + a * period * period / 2;
        v += a * period;
    }
    EXPECT_NEAR(model.mass.getLength(integrator.getState()), x, 1e-5);
    EXPECT_NEAR(model.mass.getRate(integrator.getState()), v, 1e-4);
    EXPECT_LE(integrator.getStatistics().stepsTaken, 250);
}

TEST(HeldForces, ThatStayTheSameCostNoStart) {
    HeldSlider model(1e-3, [](Real) { return 2; });
    Force::MobilityLinearSpring(model.forces, model.mass, MobilizerQIndex(0), 200, 0);
    model.state = model.system.realizeTopology();
    BdfIntegrator integrator(model.system);
    integrator.initialize(model.state);
    integrator.stepTo(1);
    // ω = 10/s about 0.01 m
    EXPECT_NEAR(model.mass.getLength(integrator.getState()), 0.01 * (1 - std::cos(10.0)), 1e-6);
    EXPECT_LE(integrator.getStatistics().starts, 2);
    EXPECT_GE(integrator.getStatistics().scheduledEvents, 1000);
    EXPECT_LE(integrator.getStatistics().stepsTaken, 1100);
}

// 75 * 0.002 and 3 * 0.05 differ in their last bit.
TEST(HeldForces, AreServedAsOftenAsBySimbodysIntegrator) {
    for (const Real period : {1e-3, 2e-3, 0.01 / 3, 0.1 / 7}) {
        const auto countCalls = [&](auto&& run) {
            int calls = 0;
            HeldSlider model(period, [&](Real time) {
                if (++calls > 2 / period) throw std::runtime_error("served for ever");
                return std::sin(time);
            });
            model.system.addEventHandler(
                new Holder(model.held, model.mass, 0.05, [](Real) { return 1; }));
            model.state = model.system.realizeTopology();
            run(model);
            return calls;
        };
        const int ours = countCalls([](HeldSlider& model) {
            BdfIntegrator integrator(model.system);
            integrator.initialize(model.state);
            integrator.stepTo(0.4995);
        });
        const int theirs = countCalls([](HeldSlider& model) {
            SimTK::RungeKuttaMersonIntegrator integrator(model.system);
            SimTK::TimeStepper stepper(model.system, integrator);
            stepper.initialize(model.state);
            stepper.stepTo(0.4995);
        });
        EXPECT_EQ(ours, theirs) << "every " << period << " s";
    }
}

/** A flying body and one that rotates on it, under forces of all kinds that hold their value. **/
struct HeldFlight {
    HeldFlight() {
        const Body::Rigid block(MassProperties(2, Vec3(0), Inertia(0.1, 0.2, 0.3)));
        flying = MobilizedBody::Free(matter.Ground(), Transform(), block, Transform());
        turning = MobilizedBody::Pin(flying, Transform(Vec3(0.5, 0, 0)), block,
                                     Transform(Rotation(0.4, YAxis), Vec3(0, -0.3, 0)));
        motor = Force::MobilityConstantForce(forces, turning, MobilizerUIndex(0), 0.7);
        brake = Force::MobilityDiscreteForce(forces, turning, MobilizerUIndex(0));
        Force::ConstantTorque(forces, flying, Vec3(0.1, -0.2, 0.3));
        system.addEventHandler(new Pusher(*this));
    }

    class Pusher : public PeriodicEventHandler {
    public:
        explicit Pusher(const HeldFlight& flight) : PeriodicEventHandler(0.05), m_flight(flight) {}
        void handleEvent(State& state, Real, bool&) const override {
            const Real t = state.getTime();
            m_flight.motor.setForce(state, std::cos(9 * t));
            m_flight.brake.setMobilityForce(state, t - 1);
            m_flight.held.setOneMobilityForce(state, m_flight.flying, MobilizerUIndex(4), t);
            m_flight.held.setOneBodyForce(state, m_flight.turning,
                                          SpatialVec(Vec3(t, 0, 0.2), Vec3(3, 20 * t, -1)));
        }

    private:
        const HeldFlight& m_flight;
    };

    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    Force::Gravity gravity{forces, matter, -YAxis, 9.81};
    Force::DiscreteForces held{forces, matter};
    Force::MobilityConstantForce motor;
    Force::MobilityDiscreteForce brake;
    MobilizedBody::Free flying;
    MobilizedBody::Pin turning;
};

TEST(HeldForces, AreWhatSimbodysIntegratorFindsAndAskedForOnceEach) {
    HeldFlight model;
    const State start = model.system.realizeTopology();
    SimTK::RungeKuttaMersonIntegrator theirs(model.system);
    theirs.setAccuracy(1e-10);
    SimTK::TimeStepper stepper(model.system, theirs);
    stepper.initialize(start);
    stepper.stepTo(0.72);
    const auto expectTheSame = [&](auto&& ours) {
        ours.setAccuracy(1e-8);
        ours.initialize(start);
        ours.stepTo(0.72);
        EXPECT_LT((ours.getState().getY() - stepper.getState().getY()).normInf(), 1e-5)
            << ours.getMethodName();
    };
    expectTheSame(BdfIntegrator(model.system));
    expectTheSame(RadauIntegrator(model.system));

    State state = start;
    model.system.realize(state, Stage::Velocity);
    EXPECT_FALSE(Evaluation(model.system, state).getTopology().needsSimbody);
    Force::TwoPointLinearSpring(model.forces, model.matter.Ground(), Vec3(0, 1, 0), model.turning,
                                Vec3(0), 200, 1);
    state = model.system.realizeTopology();
    model.system.realize(state, Stage::Velocity);
    EXPECT_TRUE(Evaluation(model.system, state).getTopology().needsSimbody);
}

TEST(ChangedSystem, IsRefusedUntilItIsInitialized) {
    HeldSlider model(0.1, [](Real) { return 2; });
    BdfIntegrator integrator(model.system);
    integrator.initialize(model.state);
    integrator.stepTo(0.1);
    model.system.realizeTopology();  // nothing has changed
    integrator.stepTo(0.2);
    const auto expectRefusal = [&] {
        try {
            integrator.stepTo(0.3);
            ADD_FAILURE() << "goes on";
        } catch (const std::logic_error& error) {
            EXPECT_NE(std::string(error.what()).find("initialize()"), std::string::npos)
                << error.what();
        }
        EXPECT_EQ(integrator.getTime(), 0.2);
    };
    Force::MobilityLinearSpring(model.forces, model.mass, MobilizerQIndex(0), 200, 0);
    expectRefusal();
    State state = model.system.realizeTopology();
    expectRefusal();
    state.setTime(integrator.getTime());
    state.updQ() = integrator.getState().getQ();
    state.updU() = integrator.getState().getU();
    integrator.initialize(state);
    integrator.stepTo(0.3);
    // From 0.02 m at 0.2 m/s, about 0.01 m, ω = 10/s.
    EXPECT_NEAR(model.mass.getLength(integrator.getState()),
                0.01 + 0.01 * std::cos(1.0) + 0.02 * std::sin(1.0), 1e-5);
}

}  // namespace
}  // namespace simflex
