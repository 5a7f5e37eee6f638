// Bodies that are temporarily rigid: motion against rigid bodies in plain Simbody, with BDF,
// generalized-α and Simbody's own integrators; accelerations of the first two against the last.

#include <gtest/gtest.h>

#include <functional>

#include "simflex/forces/AttachmentForce.h"
#include "simflex/forces/DistributedLoad.h"
#include "simflex/forces/ModalDamping.h"
#include "simflex/solver/BdfIntegrator.h"
#include "simflex/solver/Eigenmodes.h"
#include "simflex/solver/GeneralizedAlphaIntegrator.h"
#include "simflex/solver/NewtonSystem.h"
#include "simflex/solver/StaticEquilibrium.h"
#include "solver/SliderCrankModel.h"
#include "support/PointMassPart.h"

namespace simflex::test {
namespace {

using namespace SimTK;

const Vec3 GravityVector(1, -9.81, 2);

PointMassPartOptions makeOptions(unsigned seed, int numModes, double stiffening = 0) {
    PointMassPartOptions options;
    options.seed = seed;
    options.numModes = numModes;
    options.lowestFrequency = 6;
    options.highestFrequency = 25;
    options.stiffening = stiffening;
    return options;
}

enum class Way { Bdf, GeneralizedAlpha, RungeKuttaMerson };

const char* nameOf(Way way) {
    return way == Way::Bdf                ? "Bdf"
           : way == Way::GeneralizedAlpha ? "GeneralizedAlpha"
                                          : "RungeKuttaMerson";
}

/** Returns the State at `time`, realized to Stage::Dynamics. **/
State run(const MultibodySystem& system, const State& start, Real time, Real accuracy, Way way) {
    State end;
    if (way == Way::RungeKuttaMerson) {
        RungeKuttaMersonIntegrator integrator(system);
        integrator.setAccuracy(accuracy);
        integrator.setConstraintTolerance(1e-9);
        TimeStepper stepper(system, integrator);
        stepper.initialize(start);
        stepper.stepTo(time);
        end = stepper.getState();
    } else {
        std::unique_ptr<ImplicitIntegrator> integrator;
        if (way == Way::Bdf) {
            auto bdf = std::make_unique<BdfIntegrator>(system);
            bdf->setMaximumOrder(4);
            integrator = std::move(bdf);
        } else {
            integrator = std::make_unique<GeneralizedAlphaIntegrator>(system);
        }
        integrator->setAccuracy(accuracy);
        integrator->initialize(start);
        integrator->stepTo(time);
        end = integrator->getState();
    }
    system.realize(end, Stage::Dynamics);
    return end;
}

class RigidSwitch : public testing::TestWithParam<Way> {};

//---------------------------------------------------------------------------------------------------------
// one body on a ball joint

/** Makes a body rigid at 0.1 s and flexible at 0.2 s. **/
class SwitchTwice : public ScheduledEventHandler {
public:
    /** @param native  subsystem if Simbody's own integrator runs, whose handlers must return an
    assembled State
    **/
    SwitchTwice(const FlexibleBody& body, const FlexibleBodySubsystem* native)
        : m_body(body), m_native(native) {}
    Real getNextEventTime(const State& state, bool includeCurrent) const override {
        for (const Real time : {0.1, 0.2})
            if (state.getTime() < time || (includeCurrent && state.getTime() == time)) return time;
        return Infinity;
    }
    void handleEvent(State& state, Real, bool&) const override {
        if (state.getTime() < 0.15)
            m_body.setRigid(state);
        else
            m_body.setFlexible(state);
        if (m_native) m_native->initializeNative(state);
    }

private:
    FlexibleBody m_body;
    const FlexibleBodySubsystem* m_native;
};

struct Pendulum {
    explicit Pendulum(double stiffening = 0)
        : matter(system),
          forces(system),
          gravity(forces, matter, GravityVector),
          flexible(system, matter),
          boom(flexible, makePointMassPart(makeOptions(3, 8, stiffening)).body, "boom"),
          hinge(flexible, matter.Ground(), boom.interface("A"), "hinge") {}

    State makeState() {
        State state = system.realizeTopology();
        const Rotation tilt(0.7, ZAxis);
        const Vec3 omega(0.4, 1, -0.5);
        boom.setPoseByInterface(state, "A", Transform(tilt));
        boom.setFrameVelocity(state, SpatialVec(omega, omega % getCenter(state)));
        flexible.initializeNative(state);
        return state;
    }

    Vec3 getCenter(const State& state) const {
        system.realize(state, Stage::Position);
        return boom.getFramePose(state).p();
    }

    MultibodySystem system;
    SimbodyMatterSubsystem matter;
    GeneralForceSubsystem forces;
    Force::Gravity gravity;
    FlexibleBodySubsystem flexible;
    FlexibleBody boom;
    Joint::Ball hinge;
};

MassProperties massPropertiesOf(const ReducedBody& part) {
    const auto& I = part.inertia;
    return MassProperties(part.mass, Vec3(0), Inertia(I[0], I[1], I[2], I[3], I[4], I[5]));
}

Vec3 positionOf(const ReducedBody& part, const std::string& interface) {
    const auto& s = part.getInterface(interface).position;
    return {s[0], s[1], s[2]};
}

/** The same body, rigid, on Simbody's own Ball mobilizer. **/
struct RigidPendulum {
    explicit RigidPendulum(const ReducedBody& part)
        : RigidPendulum(massPropertiesOf(part), positionOf(part, "A")) {}
    RigidPendulum(const MassProperties& properties, const Vec3& hook)
        : matter(system),
          forces(system),
          gravity(forces, matter, GravityVector),
          ball(matter.Ground(), Transform(), Body::Rigid(properties), Transform(hook)) {}

    /** Returns the pose of the body `time` after a State of the flexible model. **/
    Transform moveFrom(const Pendulum& model, const State& start, Real time) {
        State state = system.realizeTopology();
        ball.setQToFitRotation(state, model.boom.getFramePose(start).R());
        ball.setUToFitAngularVelocity(state, model.boom.getFrameVelocity(start)[0]);
        RungeKuttaMersonIntegrator integrator(system);
        integrator.setAccuracy(1e-10);
        TimeStepper stepper(system, integrator);
        stepper.initialize(state);
        stepper.stepTo(time);
        system.realize(stepper.getState(), Stage::Position);
        return ball.getBodyTransform(stepper.getState());
    }

    MultibodySystem system;
    SimbodyMatterSubsystem matter;
    GeneralForceSubsystem forces;
    Force::Gravity gravity;
    MobilizedBody::Ball ball;
};

/** Returns the difference of two frames in metres at the part's ends. **/
Real calcDifference(const Transform& a, const Transform& b) {
    return (a.p() - b.p()).norm() + 0.2 * (a.R().asMat33() - b.R().asMat33()).norm();
}

TEST_P(RigidSwitch, RigidBodyMovesAsSimbodysOwn) {
    for (const double stiffening : {0.0, 1.0}) {
        Pendulum model(stiffening);
        ModalDamping(model.flexible, model.boom, 0.1);  // no effect
        State state = model.makeState();
        model.boom.setRigid(state);
        model.system.realize(state, Stage::Dynamics);
        const Real energy = model.flexible.calcEnergy(state);
        RigidPendulum rigid(model.boom.getPart());
        const Transform expected = rigid.moveFrom(model, state, 0.4);
        Real errors[2];
        for (int k = 0; k < 2; ++k) {
            const State end = run(model.system, state, 0.4, k == 0 ? 1e-6 : 1e-9, GetParam());
            errors[k] = calcDifference(model.boom.getFramePose(end), expected);
            EXPECT_EQ(model.boom.getModalCoordinates(end).normInf(), 0);
            EXPECT_EQ(model.boom.getModalSpeeds(end).normInf(), 0);
            const Real allowed = (k == 0 ? 1e-2 : 1e-5) * model.flexible.calcKineticEnergy(end);
            EXPECT_NEAR(model.flexible.calcEnergy(end), energy, allowed);
        }
        EXPECT_LT(errors[1], 0.1 * errors[0]);
        EXPECT_LT(errors[1], 2e-6);
        EXPECT_GT(calcDifference(model.boom.getFramePose(state), expected), 0.1);
    }
}

TEST_P(RigidSwitch, BodyLockedInABentShapeMovesAsARigidOneOfThatShape) {
    Pendulum model;
    State state = model.makeState();
    const int n = model.boom.getNumModes();
    Vector xi(n);
    for (int i = 0; i < n; ++i) xi[i] = 0.03 * std::cos(1.0 + i);
    model.boom.setModalCoordinates(state, xi);
    model.boom.setModalSpeeds(state, Vector(n, Real(0)));
    for (int k = 0; k < model.boom.getNumModalMobilizers(); ++k)
        model.boom.getModalMobilizer(k).lock(state);
    EXPECT_FALSE(model.boom.isRigid(state));
    model.flexible.initializeNative(state);

    // The point masses at the positions given by ξ.
    const PointMassPart part = makePointMassPart(makeOptions(3, 8));
    const size_t rows = part.body->Phi.size() / size_t(n);
    Inertia inertia(0);
    Vec3 hook = positionOf(*part.body, "A");
    for (int i = 0; i < n; ++i)
        for (int a = 0; a < 3; ++a)
            hook[a] += xi[i] * part.body->getInterface("A").Phi[size_t(3 * i + a)];
    for (size_t node = 0; node < part.masses.size(); ++node) {
        Vec3 s;
        for (size_t a = 0; a < 3; ++a) {
            s[int(a)] = part.body->mesh.positions[3 * node + a];
            for (int i = 0; i < n; ++i)
                s[int(a)] += xi[i] * part.body->Phi[rows * size_t(i) + 3 * node + a];
        }
        inertia += Inertia(s, part.masses[node]);
    }
    RigidPendulum rigid(MassProperties(part.body->mass, Vec3(0), inertia), hook);
    const Transform expected = rigid.moveFrom(model, state, 0.4);
    const State end = run(model.system, state, 0.4, 1e-9, GetParam());
    EXPECT_LT(calcDifference(model.boom.getFramePose(end), expected), 2e-6);
    EXPECT_EQ((model.boom.getModalCoordinates(end) - xi).normInf(), 0);
    RigidPendulum straight(model.boom.getPart());
    EXPECT_GT(calcDifference(straight.moveFrom(model, state, 0.4), expected), 1e-3);
}

TEST_P(RigidSwitch, HandlersSwitchAsFreshRunsDo) {
    Pendulum model;
    const bool isNative = GetParam() == Way::RungeKuttaMerson;
    model.system.addEventHandler(new SwitchTwice(model.boom, isNative ? &model.flexible : nullptr));
    const State start = model.makeState();
    constexpr Real Accuracy = 1e-9;
    const State bent = run(model.system, start, 0.0999, Accuracy, GetParam());
    EXPECT_GT(model.boom.calcLargestDisplacement(bent), 5e-4);
    const State rigid = run(model.system, start, 0.1999, Accuracy, GetParam());
    EXPECT_EQ(model.boom.getModalCoordinates(rigid).normInf(), 0);
    EXPECT_LT(model.hinge.calcPositionErrors(rigid).norm(), 1e-8);
    const State end = run(model.system, start, 0.3, Accuracy, GetParam());
    EXPECT_GT(model.boom.calcLargestDisplacement(end), 5e-4);

    // Three runs of models without a switch, each starting from the previous end.
    Pendulum fresh;
    const State first = run(fresh.system, fresh.makeState(), 0.1, Accuracy, GetParam());
    Pendulum held;
    State second = held.makeState();
    second.updQ() = first.getQ();
    second.updU() = first.getU();
    second.setTime(0.1);
    held.boom.setRigid(second);
    if (isNative) held.flexible.initializeNative(second);
    second = run(held.system, second, 0.2, Accuracy, GetParam());
    Pendulum freed;
    State third = freed.makeState();
    third.updQ() = second.getQ();
    third.updU() = second.getU();
    third.setTime(0.2);
    const State expected = run(freed.system, third, 0.3, Accuracy, GetParam());
    EXPECT_LT(calcDifference(model.boom.getFramePose(end), freed.boom.getFramePose(expected)),
              1e-6);
    EXPECT_LT(
        (model.boom.getModalCoordinates(end) - freed.boom.getModalCoordinates(expected)).normInf(),
        1e-6);
}

TEST_P(RigidSwitch, AFreedBodyIsAFlexibleOneStartedFromThere) {
    Pendulum model, fresh;
    State state = model.makeState();
    model.boom.setRigid(state);
    state = run(model.system, state, 0.15, 1e-9, GetParam());
    model.boom.setFlexible(state);
    // Simbody 3.7 may keep Force::Gravity's old energy in a copy if the original is not realized.
    model.system.realize(state, Stage::Velocity);
    State same = fresh.makeState();
    same.setTime(0.15);
    same.updQ() = state.getQ();
    same.updU() = state.getU();
    const State end = run(model.system, state, 0.3, 1e-9, GetParam());
    const State expected = run(fresh.system, same, 0.3, 1e-9, GetParam());
    EXPECT_EQ((end.getQ() - expected.getQ()).normInf(), 0);
    EXPECT_EQ((end.getU() - expected.getU()).normInf(), 0);
    EXPECT_GT(model.boom.calcLargestDisplacement(end), 5e-4);
    model.system.realize(state, Stage::Dynamics);
    EXPECT_NEAR(model.flexible.calcEnergy(end), model.flexible.calcEnergy(state),
                1e-4 * model.flexible.calcKineticEnergy(end));
}

INSTANTIATE_TEST_SUITE_P(All, RigidSwitch,
                         testing::Values(Way::Bdf, Way::GeneralizedAlpha, Way::RungeKuttaMerson),
                         [](const testing::TestParamInfo<Way>& test) {
                             return std::string(nameOf(test.param));
                         });

//---------------------------------------------------------------------------------------------------------
// rigid and flexible bodies side by side

/** Two links of one part and one of another, under all kinds of loads. **/
struct Links {
    explicit Links(double stiffening) : matter(system), forces(system), flexible(system, matter) {
        Force::Gravity(forces, matter, GravityVector);
        const auto part = makePointMassPart(makeOptions(4, 9, stiffening)).body;
        first = std::make_unique<FlexibleBody>(flexible, part, "first");
        second = std::make_unique<FlexibleBody>(flexible, part, "second");
        third = std::make_unique<FlexibleBody>(flexible, makePointMassPart(makeOptions(5, 7)).body,
                                               "third");
        Joint::Pin(flexible, matter.Ground(), first->interface("A"), "shoulder");
        Joint::Ball(flexible, first->interface("B"), second->interface("A"), "elbow");
        Joint::Universal(flexible, second->node(7), third->interface("A"), "wrist");
        for (const auto* body : {&first, &second, &third}) {
            const int n = (*body)->getNumModes();
            Matrix D(n, n, Real(0.5));
            for (int i = 0; i < n; ++i) D(i, i) = 5 + i;
            ModalDamping::matrix(flexible, **body, D);
            DistributedLoad(flexible, **body,
                            LoadShape::fromNodalForces((*body)->getPart(), {2, 5},
                                                       {Vec3(1, -2, 3), Vec3(-4, 5, 6)}));
            AttachmentForce(flexible, (*body)->node(3),
                            SpatialVec(Vec3(0.1, 0.2, -0.3), Vec3(3, 2, 1)),
                            AttachmentForce::Axes::Attachment);
            springs.push_back(Force::TwoPointLinearSpring(forces, matter.Ground(),
                                                          Vec3(0.1, 0.5, 0), (*body)->getFrame(),
                                                          Vec3(0.05, 0.02, 0.01), 300, 0.3));
            modalSprings.push_back(Force::MobilityLinearSpring(
                forces, (*body)->getModalMobilizer(0), MobilizerQIndex(2), 500, 0.01));
        }
        // A constraint that couples a mode to a rigid motion.
        Array_<MobilizedBodyIndex> bodies(2);
        bodies[0] = third->getModalMobilizer(0).getMobilizedBodyIndex();
        bodies[1] = third->getFrame().getMobilizedBodyIndex();
        Array_<MobilizerUIndex> speeds(2);
        speeds[0] = MobilizerUIndex(1);
        speeds[1] = MobilizerUIndex(4);
        Constraint::SpeedCoupler(matter, new Function::Linear(Vector(Vec3(0.7, 1, 0.2))), bodies,
                                 speeds);
        state = system.realizeTopology();
        for (int i = 0; i < state.getNU(); ++i) state.updU()[i] = 0.3 * std::cos(1.3 * i);
        for (const auto* body : {&first, &second, &third}) {
            Vector xi((*body)->getNumModes());
            for (int i = 0; i < xi.size(); ++i) xi[i] = 2e-3 * std::sin(2.0 + i);
            (*body)->setModalCoordinates(state, xi);
        }
    }

    MultibodySystem system;
    SimbodyMatterSubsystem matter;
    GeneralForceSubsystem forces;
    FlexibleBodySubsystem flexible;
    std::unique_ptr<FlexibleBody> first, second, third;
    std::vector<Force> springs, modalSprings;  ///< by body
    State state;
};

TEST(RigidBodies, AccelerationsAndMultipliersAreSimbodysWithLockedModes) {
    for (const double stiffening : {0.0, 1.0})
        for (int which = 1; which < 8; ++which)
            for (const auto form :
                 {BdfIntegrator::BlockForm::Arrow, BdfIntegrator::BlockForm::Dense}) {
                Links links(stiffening);
                State state = links.state;
                if (which & 1) links.first->setRigid(state);
                if (which & 2) links.second->setRigid(state);
                if (which & 4) links.third->setRigid(state);
                links.flexible.initializeNative(state, 1e-12);
                links.system.realize(state, Stage::Acceleration);
                BdfIntegrator integrator(links.system);
                integrator.setBlockForm(form);
                integrator.setProjectInitialState(false);
                integrator.initialize(state);
                const Vector uDot = state.getUDot(), multipliers = state.getMultipliers();
                EXPECT_LT((uDot - integrator.getUDot()).normInf(), 1e-10 * uDot.normInf()) << which;
                EXPECT_LT((multipliers - integrator.getMultipliers()).normInf(),
                          1e-10 * multipliers.normInf())
                    << which;
            }
}

TEST(RigidBodies, StepsAreThoseOfBodiesWhoseModesAMotionHolds) {
    Links links(0), other(0);
    State state = links.state;
    links.first->setRigid(state);
    links.third->setRigid(state);
    links.flexible.initializeNative(state, 1e-12);
    for (const auto* body : {&other.first, &other.third})
        for (int k = 0; k < (*body)->getNumModalMobilizers(); ++k) {
            const MobilizedBody& modes = (*body)->getModalMobilizer(k);
            Motion::Sinusoid(other.matter.updMobilizedBody(modes.getMobilizedBodyIndex()),
                             Motion::Position, 0, 1, 0);
        }
    State motions = other.system.realizeTopology();
    motions.updQ() = state.getQ();
    motions.updU() = state.getU();
    for (const auto form : {BdfIntegrator::BlockForm::Arrow, BdfIntegrator::BlockForm::Dense}) {
        BdfIntegrator rigid(links.system), held(other.system);
        for (BdfIntegrator* integrator : {&rigid, &held}) {
            integrator->setBlockForm(form);
            integrator->setFixedStep(1e-3);
            integrator->setAccuracy(1e-9);
            const Links& own = integrator == &rigid ? links : other;
            for (int k : {0, 1}) integrator->addForceJacobian(own.springs[size_t(k)]);
            integrator->addForceJacobian(own.modalSprings[0]);  // on modes of a rigid body only
            integrator->addForceJacobian(own.springs[2],
                                         {own.third->getFrame().getMobilizedBodyIndex(),
                                          own.third->getModalMobilizer(0).getMobilizedBodyIndex()});
        }
        rigid.initialize(state);
        held.initialize(motions);
        rigid.stepTo(0.05);
        held.stepTo(0.05);
        EXPECT_LT((rigid.getState().getQ() - held.getState().getQ()).normInf(), 1e-9);
        EXPECT_LT((rigid.getState().getU() - held.getState().getU()).normInf(), 1e-8);
        EXPECT_NEAR(rigid.getWork(), held.getWork(), 1e-8);
    }
}

TEST(RigidBodies, HaveSixUnknownsInTheNewtonSystem) {
    FlexibleSliderCrank model;
    State state = model.state;
    model.rod.setRigid(state);
    BdfIntegrator integrator(model.system);
    int sizes[2] = {0, 0};
    integrator.setNewtonSystemObserver([&](const NewtonSystem& system) {
        for (size_t b = 0; b < 2; ++b) sizes[b] = system.blocks[b].size;
        EXPECT_EQ(system.blocks[0].form, NewtonSystem::Block::Form::Arrow);
    });
    integrator.initialize(state);
    integrator.stepTo(1e-3);
    EXPECT_EQ(sizes[0], 6 + model.crank.getNumModes());
    EXPECT_EQ(sizes[1], 6);
}

TEST(RigidBodies, SliderCrankOfThemMovesAsSimbodysRigidMechanism) {
    FlexibleSliderCrank model;
    State state = model.state;
    model.crank.setRigid(state);
    model.rod.setRigid(state);
    RigidSliderCrank rigid;
    const State expected = rigid.integrate(0.1);
    const State end = run(model.system, state, 0.1, 1e-10, Way::Bdf);
    EXPECT_NEAR(model.getSliderPosition(end), rigid.slider.getOneQ(expected, 0), 1e-7);
    EXPECT_NEAR(model.slider.getOneU(end, 0), rigid.slider.getOneU(expected, 0), 1e-4);
    EXPECT_GT(std::abs(model.getSliderPosition(end) - model.getSliderPosition(state)), 1e-3);
}

TEST(RigidBodies, HangAndSwingAsAPhysicalPendulum) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    Force::Gravity(forces, matter, Vec3(0, 0, -9.81));
    FlexibleBodySubsystem flexible(system, matter);
    const FlexibleBody boom(flexible, makePointMassPart(makeOptions(3, 8)).body);
    Joint::Pin(flexible, Attachment(matter.Ground(), Transform(Rotation(Pi / 2, XAxis))),
               boom.interface("A", Transform(Rotation(Pi / 2, XAxis))));  // about −y
    State state = system.realizeTopology();
    boom.setPoseByInterface(state, "A", Transform());
    boom.setRigid(state);
    StaticEquilibrium equilibrium(system);
    equilibrium.solve(state);
    const State hanging = equilibrium.getState();
    system.realize(hanging, Stage::Velocity);
    EXPECT_TRUE(boom.isRigid(hanging));
    EXPECT_EQ(boom.getModalCoordinates(hanging).normInf(), 0);
    const ReducedBody& part = boom.getPart();
    const Vec3 s = positionOf(part, "A");
    const Real arm = std::hypot(s[0], s[2]);
    EXPECT_NEAR(boom.getFramePose(hanging).p()[2], -arm, 1e-9);

    const Linearization linear = calcLinearization(system, hanging);
    int numHeld = 0;
    for (int i = 0; i < linear.K.nrow(); ++i) {
        EXPECT_EQ(linear.isHeld[unsigned(i)], linear.isModal[unsigned(i)]);
        numHeld += linear.isHeld[unsigned(i)];
    }
    EXPECT_EQ(numHeld, boom.getNumModes());
    const std::vector<Eigenmode> modes = calcEigenmodes(linear);
    ASSERT_EQ(modes.size(), 1u);
    const Real omega =
        std::sqrt(part.mass * 9.81 * arm / (part.inertia[1] + part.mass * arm * arm));
    EXPECT_NEAR(2 * Pi * modes[0].frequency, omega, 1e-7 * omega);
    for (const State& frame : calcModeStates(system, linear, modes[0], 0.01, 4))
        EXPECT_EQ(boom.getModalCoordinates(frame).normInf(), 0);
}

}  // namespace
}  // namespace simflex::test
