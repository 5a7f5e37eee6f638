// Simbody's own force elements in the Newton matrix: ImplicitIntegrator::addForceJacobian().

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"
#include "simflex/forces/TwoPointSpringDamper.h"
#include "simflex/solver/BdfIntegrator.h"
#include "simflex/solver/equations/Evaluation.h"
#include "simflex/solver/equations/ForceDifferences.h"
#include "support/PointMassPart.h"

namespace simflex::test {
namespace {

using namespace SimTK;
using ::testing::AllOf;
using ::testing::HasSubstr;

/** A typical user force: a spring and damper between stations of two bodies. **/
class UserSpring : public Force::Custom::Implementation {
public:
    UserSpring(const MobilizedBody& first, const Vec3& atFirst, const MobilizedBody& second,
               const Vec3& atSecond, Real stiffness, Real damping, Real freeLength)
        : m_first(first),
          m_second(second),
          m_atFirst(atFirst),
          m_atSecond(atSecond),
          m_stiffness(stiffness),
          m_damping(damping),
          m_freeLength(freeLength) {}

    void calcForce(const State& state, Vector_<SpatialVec>& bodyForces, Vector_<Vec3>&,
                   Vector&) const override {
        const Vec3 between = m_second.findStationLocationInGround(state, m_atSecond) -
                             m_first.findStationLocationInGround(state, m_atFirst);
        const Vec3 rate = m_second.findStationVelocityInGround(state, m_atSecond) -
                          m_first.findStationVelocityInGround(state, m_atFirst);
        const Vec3 along = between / between.norm();
        const Real pull = m_stiffness * (between.norm() - m_freeLength) + m_damping * ~rate * along;
        m_first.applyForceToBodyPoint(state, m_atFirst, pull * along, bodyForces);
        m_second.applyForceToBodyPoint(state, m_atSecond, -pull * along, bodyForces);
    }
    Real calcPotentialEnergy(const State&) const override { return 0; }

private:
    const MobilizedBody &m_first, &m_second;
    Vec3 m_atFirst, m_atSecond;
    Real m_stiffness, m_damping, m_freeLength;
};

Body makeBrick() {
    return Body::Rigid(MassProperties(2, Vec3(0), 2 * UnitInertia(0.01, 0.02, 0.025)));
}

const Vec3 kApart(0.2, -0.2, 0.1);  ///< distance between the frames of two bodies
const Rotation kTurn(0.3, ZAxis);

enum class Jacobian { None, Found, Named };

/** Two flexible bodies, the first on a ball joint, and a brick, with stiff springs from frame to
frame and from frame to brick. **/
struct SprungBodies {
    explicit SprungBodies(Real stiffness)
        : first(flexible, part, "first"),
          second(flexible, part, "second"),
          brick(matter.updGround(), makeBrick()),
          root(flexible, matter.Ground(), first.interface("A"), "root"),
          between(forces, new UserSpring(first.getFrame(), Vec3(0), second.getFrame(),
                                         Vec3(0.1, 0, 0), stiffness, 1e-3 * stiffness,
                                         (kApart + kTurn * Vec3(0.1, 0, 0)).norm())),
          strut(forces, new UserSpring(second.getFrame(), Vec3(0), brick, Vec3(0, 0.05, 0),
                                       stiffness, 0, 0.2)) {}

    State makeState() {
        State state = system.realizeTopology();
        first.setPoseByInterface(state, "A", Transform());
        system.realize(state, Stage::Position);
        const Vec3 p = first.getFramePose(state).p();
        second.setFramePose(state, Transform(kTurn, p + kApart));
        brick.setQToFitTransform(state, Transform(p + kApart - Vec3(0, 0.25, 0)));
        return state;
    }

    /** Returns the initial location of a point on the brick. **/
    Vec3 getStart() {
        const State state = makeState();
        system.realize(state, Stage::Position);
        return brick.findStationLocationInGround(state, Vec3(0.1, 0, 0));
    }

    /** Returns the location of that point after `time`. **/
    Vec3 run(BdfIntegrator& integrator, Jacobian jacobian, Real time) {
        using Bodies = std::vector<MobilizedBodyIndex>;
        const MobilizedBodyIndex ends[] = {first.getFrame().getMobilizedBodyIndex(),
                                           second.getFrame().getMobilizedBodyIndex(),
                                           brick.getMobilizedBodyIndex()};
        if (jacobian == Jacobian::Named) {
            integrator.addForceJacobian(between, Bodies{ends[0], ends[1]});
            integrator.addForceJacobian(strut, Bodies{ends[1], ends[2]});
        } else if (jacobian == Jacobian::Found) {
            integrator.addForceJacobian(between);
            integrator.addForceJacobian(strut);
        }
        integrator.initialize(makeState());
        integrator.stepTo(time);
        const State& state = integrator.getState();
        return brick.findStationLocationInGround(state, Vec3(0.1, 0, 0));
    }

    const std::shared_ptr<const ReducedBody> part = makePointMassPart().body;
    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    Force::Gravity gravity{forces, matter, -YAxis, 9.81};
    FlexibleBodySubsystem flexible{system, matter};
    FlexibleBody first, second;
    MobilizedBody::Free brick;
    Joint::Ball root;
    Force::Custom between, strut;
};

TEST(ForceJacobian, StiffUserForcesTakeStepsThatNewtonCouldNotTakeWithout) {
    for (const Jacobian jacobian : {Jacobian::Found, Jacobian::Named}) {
        SprungBodies model(1e7);
        BdfIntegrator integrator(model.system);
        integrator.setFixedStep(1e-3);
        model.run(integrator, jacobian, 0.1);
        EXPECT_LT(integrator.getStatistics().newtonIterations, 3 * 100);  // 100 steps
    }
    SprungBodies model(1e7);
    BdfIntegrator integrator(model.system);
    integrator.setFixedStep(1e-3);
    EXPECT_THROW(model.run(integrator, Jacobian::None, 0.1), std::runtime_error);
}

TEST(ForceJacobian, ChangesConvergenceAndNotTheSolution) {
    Vec3 end[3];
    long iterations[3];
    for (const Jacobian jacobian : {Jacobian::None, Jacobian::Found, Jacobian::Named}) {
        SprungBodies model(1e6);
        BdfIntegrator integrator(model.system);
        integrator.setAccuracy(1e-7);
        end[int(jacobian)] = model.run(integrator, jacobian, 0.05);
        iterations[int(jacobian)] = integrator.getStatistics().newtonIterations;
    }
    // Differences are within the integration error; both ways to name the bodies are identical.
    EXPECT_LT((end[1] - end[0]).norm(), 1e-6);
    EXPECT_EQ(end[2], end[1]);
    EXPECT_LT(1.5 * iterations[1], iterations[0]);
    EXPECT_GT((end[1] - SprungBodies(1e6).getStart()).norm(), 1e-3);
}

TEST(ForceJacobian, SolutionIsThatOfSimbodysIntegrator) {
    SprungBodies model(1e6), native(1e6);
    BdfIntegrator integrator(model.system);
    integrator.setAccuracy(1e-8);
    const Vec3 end = model.run(integrator, Jacobian::Found, 0.02);

    State state = native.makeState();
    native.flexible.initializeNative(state);
    RungeKuttaMersonIntegrator rungeKutta(native.system);
    rungeKutta.setAccuracy(1e-8);
    TimeStepper stepper(native.system, rungeKutta);
    stepper.initialize(state);
    stepper.stepTo(0.02);
    const Vec3 expected =
        native.brick.findStationLocationInGround(stepper.getState(), Vec3(0.1, 0, 0));
    EXPECT_GT((expected - native.getStart()).norm(), 1e-4);
    EXPECT_LT((end - expected).norm(), 1e-6);
}

/** A cable that is slack at the start and pulls later: its path gives the bodies. **/
TEST(ForceJacobian, OfACableThatIsSlackIsThatOfItsPath) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    CableTrackerSubsystem cables(system);
    GeneralForceSubsystem forces(system);
    MobilizedBody::Free first(matter.Ground(), makeBrick()), other(matter.Ground(), makeBrick());
    MobilizedBody::Pin carried(first, Transform(), makeBrick(), Transform());
    CablePath path(cables, matter.Ground(), Vec3(0), carried, Vec3(0.1, 0, 0));
    CableSpring cable(forces, path, 1e4, 2, 0);  // free length 2 m
    State state = system.realizeTopology();
    first.setQToFitTranslation(state, Vec3(0.5, 0, 0));
    system.realize(state, Stage::Velocity);
    EXPECT_EQ(cable.getTension(state), 0);
    std::vector<ForceDifferences::Speed> speeds;
    for (const MobilizedBody& body :
         {MobilizedBody(first), MobilizedBody(other), MobilizedBody(carried)})
        for (int u = 0; u < body.getNumU(state); ++u)
            speeds.push_back(
                {body.getMobilizedBodyIndex(), int(body.getFirstUIndex(state)) + u, 1, 1e-6});
    const ForceDifferences differences(system, {cable, {}}, speeds, state);
    ASSERT_EQ(differences.getSpeeds().size(), 7u);  // of the carried body and its carrier
    for (const ForceDifferences::Speed& speed : differences.getSpeeds())
        EXPECT_NE(speed.body, other.getMobilizedBodyIndex());
}

/** At its free length a spring has the stiffness k d dᵀ alone, d = ∂(length)/∂q·N, and a damper
along it c d dᵀ. **/
TEST(ForceJacobian, TermsOfASpringAreThoseOfItsClosedForm) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    const MobilizedBody::Free first(matter.Ground(), makeBrick()),
        second(matter.Ground(), makeBrick());
    const Vec3 atFirst(0.1, 0.2, -0.1), atSecond(-0.2, 0.1, 0.3);
    const Real k = 3e4, c = 20, gamma = 2e-3;
    const Vec3 between(0.3, -0.4, 1.2);
    Force::Custom spring(forces,
                         new UserSpring(first, atFirst, second, atSecond, k, c, between.norm()));
    State state = system.realizeTopology();
    const Rotation R_GA(0.7, UnitVec3(1, 2, 3)), R_GB(-1.2, UnitVec3(2, 0, 1));
    first.setQToFitTransform(state, Transform(R_GA, Vec3(1, 2, 3) - R_GA * atFirst));
    second.setQToFitTransform(state, Transform(R_GB, Vec3(1, 2, 3) + between - R_GB * atSecond));
    system.realize(state, Stage::Velocity);

    std::vector<ForceDifferences::Speed> speeds;
    for (int u = 0; u < 12; ++u)
        speeds.push_back({u < 6 ? first.getMobilizedBodyIndex() : second.getMobilizedBodyIndex(), u,
                          u % 6 < 3 ? 0.3 : 1, 1e-6});
    ForceDifferences differences(system, {spring, {}}, speeds, state);
    differences.calcTerms(state, gamma);
    ASSERT_EQ(differences.getSpeeds().size(), 12u);

    const Vec3 n = between / between.norm();
    Vector d(12);
    for (int a = 0; a < 3; ++a) {
        d[a] = -((R_GA * atFirst) % n)[a];
        d[3 + a] = -n[a];
        d[6 + a] = ((R_GB * atSecond) % n)[a];
        d[9 + a] = n[a];
    }
    for (int i = 0; i < 12; ++i)
        for (int j = 0; j < 12; ++j) {
            Real sum = 0;
            for (int term = 0; term < differences.getNumTerms(); ++term)
                sum += differences.getSign(term) * differences.getDirection(term, i) *
                       differences.getDirection(term, j);
            EXPECT_NEAR(sum, (gamma * k + c) * d[i] * d[j], 1e-6 * (gamma * k + c))
                << i << " " << j;
        }
}

/** Returns Σ σ d dᵀ of the rows beyond the constraints, in all speeds of the solver. **/
Matrix expandTerms(const NewtonSystem& system, int numConstraints) {
    const int n = system.numSpeeds();
    Matrix Gt(n, int(system.c.size()), Real(0)), sum(n, n, Real(0));
    int first = 0;
    for (const NewtonSystem::Block& block : system.blocks) {
        std::vector<double> columns(size_t(block.size * block.numColumns()));
        system.expandGt(block, columns.data());
        for (int k = 0; k < block.numColumns(); ++k)
            for (int i = 0; i < block.size; ++i)
                Gt(first + i, block.rows[size_t(k)]) += columns[size_t(k * block.size + i)];
        first += block.size;
    }
    for (int row = numConstraints; row < Gt.ncol(); ++row)
        sum += system.compliance[size_t(row)] * (Gt(row) * ~Gt(row));
    return sum;
}

/** Flexible bodies with and without joints, that is, with and without an arrow. **/
TEST(ForceJacobian, TermsAreTheDerivativesOfTheResidual) {
    const Real stiffness = 1e4, gamma = 2e-3, h = 1e-5;
    SprungBodies model(stiffness), bare(0);
    const State state = model.makeState(), bareState = bare.makeState();
    model.system.realize(state, Stage::Velocity);
    bare.system.realize(bareState, Stage::Velocity);
    Evaluation with(model.system, state, Topology::Setting::Implicit,
                    {{model.between, {}}, {model.strut, {}}}),
        without(bare.system, bareState);
    const int n = with.getTopology().numU;
    ASSERT_EQ(without.getTopology().numU, n);
    std::vector<double> q(size_t(with.getTopology().numQ)), u(size_t(n), 0), uDot(size_t(n), 0),
        lambda(size_t(with.getTopology().numMultipliers), 0);
    with.getBlocks().getFromState(state, q.data(), u.data());

    const auto calcForce = [&](int speed, double step) {
        std::vector<double> moved = q, movedU = u, delta(size_t(n), 0), r(size_t(n), 0), bareR = r;
        delta[size_t(speed)] = step;
        movedU[size_t(speed)] += step / gamma;
        with.realize(0, q.data(), u.data());
        with.getBlocks().moveQ(delta.data(), moved.data());
        with.realize(0, moved.data(), movedU.data());
        with.calcResidual(moved.data(), movedU.data(), uDot.data(), lambda.data(), r.data());
        without.realize(0, moved.data(), movedU.data());
        without.calcResidual(moved.data(), movedU.data(), uDot.data(), lambda.data(), bareR.data());
        Vector force(n);
        for (int i = 0; i < n; ++i) force[i] = r[size_t(i)] - bareR[size_t(i)];
        return force;
    };
    Matrix expected(n, n);
    for (int j = 0; j < n; ++j)
        expected(j) = gamma / (2 * h) * (calcForce(j, h) - calcForce(j, -h));

    with.realize(0, q.data(), u.data());
    std::vector<double> r(size_t(n), 0);
    with.calcResidual(q.data(), u.data(), uDot.data(), lambda.data(), r.data());
    NewtonSystem system = with.getTopology().makeNewtonSystem();
    with.formNewtonSystem(NewtonFactors(gamma), false, q.data(), u.data(), uDot.data(), system);
    system.checkSizes();
    EXPECT_GE(system.blocks[0].part, 0);
    const Real scale = gamma * stiffness + 1e-3 * stiffness;
    EXPECT_GT(expected.norm(), 0.1 * scale);
    EXPECT_LT((expandTerms(system, with.getTopology().numMultipliers) - expected).norm(),
              1e-6 * scale);

    // No force depends on accelerations.
    with.formMassSystem(system);
    EXPECT_EQ(expandTerms(system, with.getTopology().numMultipliers).norm(), 0);
}

/** A force that is undefined on one side. **/
class OneSided : public Force::Custom::Implementation {
public:
    explicit OneSided(const MobilizedBody& slider) : m_slider(slider) {}
    void calcForce(const State& state, Vector_<SpatialVec>&, Vector_<Vec3>&,
                   Vector& mobilityForces) const override {
        m_slider.applyOneMobilityForce(state, 0, -std::sqrt(m_slider.getOneQ(state, 0)),
                                       mobilityForces);
    }
    Real calcPotentialEnergy(const State&) const override { return 0; }

private:
    const MobilizedBody& m_slider;
};

/** A force that throws outside its range. **/
class Ranged : public Force::Custom::Implementation {
public:
    explicit Ranged(const MobilizedBody& slider) : m_slider(slider) {}
    void calcForce(const State& state, Vector_<SpatialVec>&, Vector_<Vec3>&,
                   Vector& mobilityForces) const override {
        if (m_slider.getOneQ(state, 0) < 0) throw std::out_of_range("table ends at 0");
        m_slider.applyOneMobilityForce(state, 0, -1, mobilityForces);
    }
    Real calcPotentialEnergy(const State&) const override { return 0; }

private:
    const MobilizedBody& m_slider;
};

TEST(ForceJacobian, ForcesThatThrowAreNamed) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    const MobilizedBody::Slider slider(matter.Ground(), makeBrick());
    Force::Custom ranged(forces, new Ranged(slider));
    const State state = system.realizeTopology();
    system.realize(state, Stage::Velocity);
    const MobilizedBodyIndex body = slider.getMobilizedBodyIndex();
    ForceDifferences differences(system, {ranged, {}}, {{body, 0, 1, 1e-6}}, state);
    try {
        differences.calcTerms(state, 1e-3);
        FAIL() << "the table was left";
    } catch (const std::runtime_error& error) {
        EXPECT_THAT(error.what(), AllOf(HasSubstr("force element 0 failed near t = 0"),
                                        HasSubstr("table ends at 0")));
    }
}

TEST(ForceJacobian, WhatCannotBeDifferentiatedIsNamed) {
    const auto messageOf = [](const std::function<void()>& action) -> std::string {
        try {
            action();
        } catch (const std::exception& error) {
            return error.what();
        }
        return "";
    };
    MultibodySystem system, other;
    SimbodyMatterSubsystem matter(system), otherMatter(other);
    GeneralForceSubsystem forces(system), otherForces(other);
    const MobilizedBody::Slider slider(matter.Ground(), makeBrick());
    const MobilizedBody::Free away(matter.Ground(), makeBrick());
    Force::Custom oneSided(forces, new OneSided(slider));
    Force::TwoPointLinearSpring slack(forces, matter.Ground(), Vec3(0), away, Vec3(0), 0, 0);
    Force::UniformGravity foreign(otherForces, otherMatter, Vec3(0));
    State state = system.realizeTopology();
    away.setQToFitTranslation(state, Vec3(1, 0, 0));
    other.realizeTopology();
    const auto initializeWith = [&](const Force& force, std::vector<MobilizedBodyIndex> bodies) {
        return messageOf([&] {
            BdfIntegrator integrator(system);
            integrator.addForceJacobian(force, bodies);
            integrator.initialize(state);
            integrator.stepTo(0.1);
        });
    };
    EXPECT_THAT(initializeWith(oneSided, {}),
                HasSubstr("force element 0 is not a finite number near t = 0"));
    EXPECT_THAT(initializeWith(slack, {}), HasSubstr("force element 1 acts on no body"));
    EXPECT_THAT(initializeWith(slack, {MobilizedBodyIndex(7)}),
                HasSubstr("there is no mobilized body 7"));
    EXPECT_THAT(initializeWith(foreign, {}), HasSubstr("belongs to another system"));
    BdfIntegrator integrator(system);
    EXPECT_THAT(messageOf([&] { integrator.addForceJacobian(Force()); }), HasSubstr("empty Force"));
    EXPECT_THAT(messageOf([&] { integrator.addForceJacobian(std::vector<MobilizedBodyIndex>()); }),
                HasSubstr("no bodies"));
}

/** A brick that swings on a spring: Simbody's with its Jacobian, or ours. **/
IntegratorStatistics swing(bool isOurs, Jacobian jacobian) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    Force::Gravity gravity(forces, matter, -YAxis, 9.81);
    const MobilizedBody::Free brick(matter.Ground(), makeBrick());
    const Vec3 at(0, 0.1, 0.02);
    Force::TwoPointLinearSpring spring(forces, matter.Ground(), Vec3(0), brick, at, 1e6, 0.5);
    FlexibleBodySubsystem flexible(system, matter);
    if (isOurs) {
        TwoPointSpringDamper(flexible, matter.Ground(), Attachment(brick, at), 1e6, 0, 0.5);
        spring.setDisabledByDefault(true);
    }
    State state = system.realizeTopology();
    brick.setQToFitTransform(state, Transform(Vec3(0.5, -0.1, 0)));
    BdfIntegrator integrator(system);
    integrator.setAccuracy(1e-5);
    if (jacobian == Jacobian::Found) integrator.addForceJacobian(spring);
    integrator.initialize(state);
    integrator.stepTo(0.5);
    return integrator.getStatistics();
}

TEST(ForceJacobian, SimbodysSpringTakesTheStepsOfOurs) {
    const IntegratorStatistics ours = swing(true, Jacobian::None),
                               with = swing(false, Jacobian::Found),
                               without = swing(false, Jacobian::None);
    EXPECT_NEAR(with.stepsTaken, ours.stepsTaken, 0.02 * ours.stepsTaken);
    EXPECT_NEAR(with.newtonIterations, ours.newtonIterations, 0.02 * ours.newtonIterations);
    // In rigid systems, stiff forces are detected when the iteration does not converge.
    EXPECT_LT(without.newtonIterations, 2 * ours.newtonIterations);
}

/** A pendulum of three links in one tree with a stiff spring and damper on the last pin: it swings
as if locked there. **/
TEST(ForceJacobian, SpringsOnMobilitiesCount) {
    const auto swingTo = [](Real stiffness, Real* angle) {
        MultibodySystem system;
        SimbodyMatterSubsystem matter(system);
        GeneralForceSubsystem forces(system);
        Force::Gravity gravity(forces, matter, -YAxis, 9.81);
        MobilizedBody::Pin upper(matter.Ground(), Vec3(0), makeBrick(), Vec3(0, 0.2, 0)),
            middle(upper, Vec3(0, -0.2, 0), makeBrick(), Vec3(0, 0.2, 0)),
            lower(middle, Vec3(0, -0.2, 0), makeBrick(), Vec3(0, 0.2, 0));
        Force::MobilityLinearSpring spring(forces, lower, MobilizerQIndex(0), stiffness, 0.2);
        Force::MobilityLinearDamper damper(forces, lower, MobilizerUIndex(0), 0.01 * stiffness);
        State state = system.realizeTopology();
        upper.setAngle(state, 1);
        lower.setAngle(state, 0.2);
        if (stiffness == 0) lower.lock(state);
        BdfIntegrator integrator(system);
        integrator.setAccuracy(1e-6);
        if (stiffness > 0) {
            integrator.addForceJacobian(spring);
            integrator.addForceJacobian(damper);
        }
        integrator.initialize(state);
        integrator.stepTo(0.5);
        *angle = upper.getAngle(integrator.getState());
        return integrator.getStatistics();
    };
    Real locked, held;
    const IntegratorStatistics rigid = swingTo(0, &locked), stiff = swingTo(1e7, &held);
    EXPECT_NEAR(held, locked, 1e-4);
    EXPECT_GT(std::abs(locked - 1), 0.5);
    EXPECT_LT(stiff.newtonIterations, 1.5 * rigid.newtonIterations);
}

/** A ball bounces on the ground until it rests. Contact subsystems are not force elements, so the
bodies are named. **/
TEST(ForceJacobian, ContactsOfNamedBodiesCount) {
    const auto run = [](bool hasJacobian) {
        MultibodySystem system;
        SimbodyMatterSubsystem matter(system);
        GeneralForceSubsystem forces(system);
        Force::Gravity gravity(forces, matter, -YAxis, 9.81);
        ContactTrackerSubsystem tracker(system);
        CompliantContactSubsystem contacts(system, tracker);
        const ContactMaterial steel(1e9, 0.3, 0, 0);
        matter.updGround().updBody().addContactSurface(
            Transform(Rotation(-Pi / 2, ZAxis)),
            ContactSurface(ContactGeometry::HalfSpace(), steel));
        Body::Rigid ball(MassProperties(100, Vec3(0), 100 * UnitInertia::sphere(0.05)));
        ball.addContactSurface(Transform(), ContactSurface(ContactGeometry::Sphere(0.05), steel));
        const MobilizedBody::Free falling(matter.Ground(), ball);
        State state = system.realizeTopology();
        falling.setQToFitTranslation(state, Vec3(0, 0.05 - 3e-4, 0));
        BdfIntegrator integrator(system);
        integrator.setFixedStep(1.25e-2);
        if (hasJacobian) integrator.addForceJacobian({falling.getMobilizedBodyIndex()});
        integrator.initialize(state);
        integrator.stepTo(0.5);
        return falling.getBodyOriginLocation(integrator.getState())[1];
    };
    // Hertz: F = 4/3 k √R δ^(3/2), k of two bodies as Simbody combines them.
    const Real k = std::pow(std::pow(1e9, 2.0 / 3) / 2, 1.5);
    const Real depth = std::pow(100 * 9.81 / (4.0 / 3 * k * std::sqrt(0.05)), 2.0 / 3);
    EXPECT_NEAR(run(true), 0.05 - depth, 1e-4 * depth);
    EXPECT_THROW(run(false), std::runtime_error);
}

/** A ball that slides, starts to roll and rolls on a floor whose friction is regularised within 1
mm/s. **/
TEST(ForceJacobian, FrictionIsDifferentiatedByItself) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    ContactTrackerSubsystem tracker(system);
    CompliantContactSubsystem contacts(system, tracker);
    contacts.setTransitionVelocity(1e-3);
    Force::Gravity(forces, matter, -YAxis, 10);
    const ContactMaterial material(1e7, 1, 0.2, 0.2, 0);
    matter.Ground().updBody().addContactSurface(
        Transform(Rotation(-Pi / 2, ZAxis), Vec3(0)),
        ContactSurface(ContactGeometry::HalfSpace(), material));
    const Real radius = 0.1;
    Body::Rigid ball(MassProperties(1, Vec3(0), UnitInertia::sphere(radius)));
    ball.addContactSurface(Transform(), ContactSurface(ContactGeometry::Sphere(radius), material));
    MobilizedBody::Free free(matter.Ground(), ball);
    State state = system.realizeTopology();
    free.setQToFitTranslation(state, Vec3(0, radius - 1e-4, 0));
    free.setUToFitLinearVelocity(state, Vec3(2, 0, 0));
    BdfIntegrator integrator(system);
    integrator.setAccuracy(1e-5);
    integrator.initialize(state);
    integrator.stepTo(1);
    // A sphere rolls at 5/7 of its initial speed from 2 v/(7 μ g) = 0.286 s on.
    const SpatialVec V = free.getBodyVelocity(integrator.getState());
    EXPECT_NEAR(V[1][0], 10.0 / 7, 5e-3);
    EXPECT_NEAR(-V[0][2] * radius, 10.0 / 7, 5e-3);
    EXPECT_LT(integrator.getStatistics().stepsTaken, 700);
}

}  // namespace
}  // namespace simflex::test
