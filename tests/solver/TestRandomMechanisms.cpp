// Random rigid mechanisms with loops, contact, springs and dampers complete with every scheme, even
// if Newton iterates go astray.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <random>

#include "simflex/body/Joint.h"
#include "simflex/solver/BdfIntegrator.h"
#include "simflex/solver/GeneralizedAlphaIntegrator.h"
#include "simflex/solver/RadauIntegrator.h"
#include "simflex/solver/equations/Evaluation.h"
#include "simflex/solver/equations/StateImage.h"

namespace simflex {
namespace {

using namespace SimTK;

/** One or more trees of a few bodies, and interactions between them. **/
struct RandomMechanism {
    explicit RandomMechanism(unsigned seed) : random(seed) {
        Force::UniformGravity(forces, matter, Vec3(3, -9.81, 1));
        const bool hasContact = pick(3) == 0;
        if (hasContact)
            matter.Ground().updBody().addContactSurface(
                Transform(Rotation(-Pi / 2, ZAxis), Vec3(0, -1.5, 0)),
                ContactSurface(ContactGeometry::HalfSpace(), steel));
        const int count = 1 + pick(5);
        for (int k = 0; k < count; ++k) addBody(hasContact);
        if (pick(2)) Force::GlobalDamper(forces, matter, draw(0.01, 1));
        if (pick(2)) {
            const MobilizedBody &a = anyBody(), &b = matter.Ground();
            Force::TwoPointLinearSpring(forces, a, drawPoint(), b, Vec3(0, 1, 0), draw(1, 1e4), 1);
        }
        state = system.realizeTopology();
        if (pick(2)) addLoop();
        for (int i = 0; i < state.getNU(); ++i) state.updU()[i] = draw(-2, 2);
    }

    unsigned pick(unsigned count) { return unsigned(random() % count); }
    Real draw(Real low, Real high) { return low + (high - low) * Real(random() % 10000) / 1e4; }
    Vec3 drawPoint() { return {draw(-0.3, 0.3), draw(-0.3, 0.3), draw(-0.3, 0.3)}; }
    MobilizedBody& anyBody() { return bodies[pick(unsigned(bodies.size()))]; }

    void addBody(bool hasContact) {
        const Real mass = std::pow(10.0, draw(-2, 1));
        Body::Rigid body(MassProperties(
            mass, Vec3(0, -0.2, 0),
            UnitInertia(0.1, 0.11, 0.12).shiftFromCentroid(Vec3(0, -0.2, 0)) * mass));
        if (hasContact)
            body.addContactSurface(
                Transform(),
                ContactSurface(ContactGeometry::Sphere(0.1), steel).joinClique(clique));
        MobilizedBody& parent = bodies.empty() || pick(4) == 0 ? matter.updGround() : anyBody();
        const Transform outside(Rotation(draw(-1, 1), XAxis), Vec3(draw(-0.3, 0.3), -0.4, 0)),
            inside(Vec3(0));
        switch (pick(6)) {
            case 0:
                bodies.push_back(MobilizedBody::Pin(parent, outside, body, inside));
                break;
            case 1:
                bodies.push_back(MobilizedBody::Universal(parent, outside, body, inside));
                break;
            case 2:
                bodies.push_back(MobilizedBody::Planar(parent, outside, body, inside));
                break;
            case 3:
                bodies.push_back(MobilizedBody::Free(parent, outside, body, inside));
                break;
            default:
                bodies.push_back(MobilizedBody::Ball(parent, outside, body, inside));
        }
    }
    void addLoop() {
        const Vec3 onGround(0.5, 0.5, 0.2), onBody(0, -0.1, 0);
        system.realize(state, Stage::Position);
        const Vec3 there = bodies.back().findStationLocationInGround(state, onBody);
        Constraint::Rod(matter.Ground(), onGround, bodies.back(), onBody,
                        (there - onGround).norm());
        state = system.realizeTopology();
    }

    std::mt19937 random;
    const ContactMaterial steel{1e6, 0.3, 0.5, 0.4, 0.1};
    const ContactCliqueId clique = ContactSurface::createNewContactClique();
    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    ContactTrackerSubsystem tracker{system};
    CompliantContactSubsystem contact{system, tracker};
    std::vector<MobilizedBody> bodies;
    State state;
};

template <class Scheme>
void expectThatItGoesThrough(unsigned seed) {
    RandomMechanism mechanism(seed);
    SCOPED_TRACE(seed);
    const MultibodySystem& system = mechanism.system;
    Scheme integrator(system);
    const Real accuracy = std::pow(10.0, mechanism.draw(-5, -2));
    integrator.setAccuracy(accuracy);
    try {
        integrator.initialize(mechanism.state);
        const auto calcEnergy = [&] {
            State now = integrator.getState();
            system.realize(now, Stage::Dynamics);
            return system.calcEnergy(now);
        };
        const Real start = calcEnergy();
        integrator.stepTo(0.15);
        // All other elements dissipate energy.
        const Real gained = calcEnergy() - start;
        if (std::getenv("SIMFLEX_MECHANISMS"))
            std::printf(
                "%u %s %g: %d steps, %d attempted, %d not evaluated, energy %+.1e of %.3g\n", seed,
                integrator.getMethodName(), accuracy, integrator.getNumStepsTaken(),
                integrator.getNumStepsAttempted(), integrator.getNumRealizationFailures(), gained,
                start);
        EXPECT_LT(gained, std::max(1e-2, 100 * accuracy) * (10 + std::abs(start)))
            << integrator.getMethodName();
    } catch (const std::exception& error) {
        ADD_FAILURE() << integrator.getMethodName() << ", accuracy " << accuracy
                      << ", t = " << integrator.getTime() << ": " << error.what();
    }
}

TEST(RandomMechanisms, GoThroughWithEveryScheme) {
    const char* from = std::getenv("SIMFLEX_FIRST_MECHANISM");
    const char* count = std::getenv("SIMFLEX_MECHANISMS");
    const unsigned first = from ? unsigned(std::atoi(from)) : 1;
    const unsigned end = first + (count ? unsigned(std::atoi(count)) : 12);
    for (unsigned seed = first; seed < end; ++seed) {
        expectThatItGoesThrough<BdfIntegrator>(seed);
        expectThatItGoesThrough<RadauIntegrator>(seed);
        expectThatItGoesThrough<GeneralizedAlphaIntegrator>(seed);
    }
}

/** A ball over one of Simbody's floors, with or without our subsystem. **/
struct Ball {
    enum class Subsystem { None, Flexible };
    explicit Ball(Subsystem subsystem, Real height) {
        Force::Gravity(forces, matter, -YAxis, 9.81);
        if (subsystem == Subsystem::Flexible)
            flexible = std::make_unique<FlexibleBodySubsystem>(system, matter);
        const ContactMaterial steel(1e7, 0.5, 0.5, 0.5, 0.1);
        matter.Ground().updBody().addContactSurface(
            Rotation(-Pi / 2, ZAxis), ContactSurface(ContactGeometry::HalfSpace(), steel));
        Body::Rigid body(MassProperties(0.02, Vec3(0), UnitInertia::sphere(0.02)));
        body.addContactSurface(Transform(), ContactSurface(ContactGeometry::Sphere(0.02), steel));
        ball = MobilizedBody::Free(matter.Ground(), body);
        state = system.realizeTopology();
        ball.setQToFitTransform(state, Transform(Rotation(1.2, ZAxis), Vec3(0, height, 0)));
    }
    Real calcEnergy(State at) const {
        system.realize(at, Stage::Dynamics);
        return system.calcEnergy(at);
    }
    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    ContactTrackerSubsystem tracker{system};
    CompliantContactSubsystem contact{system, tracker};
    std::unique_ptr<FlexibleBodySubsystem> flexible;
    MobilizedBody::Free ball;
    State state;
};

template <class Scheme>
void expectThatItBounces(Real height, Real time) {
    for (const auto subsystem : {Ball::Subsystem::None, Ball::Subsystem::Flexible})
        for (const Real accuracy : {1e-3, 1e-4, 1e-6})
            for (const bool hasJacobian : {false, true}) {
                const Ball model(subsystem, height);
                Scheme integrator(model.system);
                integrator.setAccuracy(accuracy);
                if (hasJacobian)
                    integrator.addForceJacobian({MobilizedBodyIndex(0), MobilizedBodyIndex(1)});
                integrator.initialize(model.state);
                const Real energy = model.calcEnergy(integrator.getState());
                integrator.stepTo(time);
                const State& end = integrator.getState();
                EXPECT_GT(model.ball.getBodyOriginLocation(end)[1], 0.019);
                EXPECT_LT(model.calcEnergy(end), 1.01 * energy)
                    << integrator.getMethodName() << ", accuracy " << accuracy;
            }
}

TEST(BouncingBall, GoesThroughWithEverySchemeAtEveryAccuracy) {
    expectThatItBounces<RadauIntegrator>(0.3, 0.4);
    expectThatItBounces<BdfIntegrator>(0.3, 0.4);
    expectThatItBounces<GeneralizedAlphaIntegrator>(0.3, 0.4);
}

TEST(BouncingBall, MayBeInContactAtTheStart) {
    // Contacts stored in a State and their forces stay consistent.
    expectThatItBounces<RadauIntegrator>(0.0199, 0.01);
    expectThatItBounces<BdfIntegrator>(0.0199, 0.01);
    expectThatItBounces<GeneralizedAlphaIntegrator>(0.0199, 0.01);
}

TEST(BouncingBall, ForcesFollowTheContactsThatAreTakenOver) {
    // A step starts with the contacts found at the end of the previous one, with unchanged ids.
    const Ball model(Ball::Subsystem::None, 0.0199);
    State known = model.state;
    model.system.realize(known, Stage::Acceleration);
    const Vector_<SpatialVec> forces = model.system.getRigidBodyForces(known, Stage::Dynamics);
    known.autoUpdateDiscreteVariables();
    State start = model.state;
    model.system.realize(start, Stage::Velocity);
    Evaluation equations(model.system, start);
    std::vector<double> q(7), u(6), uDot(6), r(6), later(6);
    equations.getBlocks().getFromState(start, q.data(), u.data());
    const auto evaluate = [&](std::vector<double>& residual) {
        equations.realize(0, q.data(), u.data());
        equations.calcResidual(q.data(), u.data(), uDot.data(), nullptr, residual.data());
    };
    evaluate(r);
    equations.takeVariables(listAutoUpdates(known), known);
    evaluate(later);
    EXPECT_EQ(r, later);
    EXPECT_NEAR(r[4], -forces[1][1][1], 1e-9 * std::abs(r[4]));
}

}  // namespace
}  // namespace simflex
