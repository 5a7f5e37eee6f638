/** @file
Springs, bushings and stops between attachment frames: energy, Jacobian, comparison with Simbody's
elements, closed forms, and their stiff limit, the joint. **/

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>
#include <random>

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/FlexibleBodySubsystemGuts.h"
#include "simflex/body/ForceElement.h"
#include "simflex/body/Joint.h"
#include "simflex/forces/Bushing.h"
#include "simflex/forces/ContactStop.h"
#include "simflex/forces/CoordinateSpring.h"
#include "simflex/forces/TorsionSpring.h"
#include "simflex/forces/TwoPointSpringDamper.h"
#include "simflex/solver/BdfIntegrator.h"
#include "simflex/solver/Eigenmodes.h"
#include "simflex/solver/Linearization.h"
#include "support/NativeReference.h"
#include "support/PointMassPart.h"

namespace simflex::test {
namespace {

using namespace SimTK;
using ::testing::HasSubstr;

Mat66 makeCoupledMatrix(Real scale) {
    // LLᵀ with every entry of L's lower triangle filled.
    Mat66 L(0);
    for (int i = 0; i < 6; ++i)
        for (int j = 0; j <= i; ++j) L(i, j) = i == j ? 1 : 0.1 * (i - 2 * j + 1);
    return scale * (L * ~L);
}

using Maker = std::function<void(FlexibleBodySubsystem&, const Attachment&, const Attachment&,
                                 Real dampingFactor)>;

/** Time 0, and a torsion spring without counted turns. **/
const Real noTurns = 0;
const ElementInputs unturned(0, &noTurns);

struct Connector {
    const char* name;
    Maker make;
};
void PrintTo(const Connector& connector, std::ostream* stream) {
    *stream << connector.name;
}

enum class Place { GroundToInterface, BodyToBody, OneBody, NodeToRigid };

const Connector connectors[] = {
    {"TwoPointSpringDamper",
     [](FlexibleBodySubsystem& subsystem, const Attachment& a, const Attachment& b, Real factor) {
         TwoPointSpringDamper(subsystem, a, b, 300, 40 * factor, 0.3);
     }},
    {"Bushing",
     [](FlexibleBodySubsystem& subsystem, const Attachment& a, const Attachment& b, Real factor) {
         Bushing(subsystem, a, b, makeCoupledMatrix(200), makeCoupledMatrix(30 * factor));
     }},
    {"TorsionSpring", [](FlexibleBodySubsystem& subsystem, const Attachment& a, const Attachment& b,
                         Real factor) { TorsionSpring(subsystem, a, b, 70, 8 * factor, 0.4); }},
    {"ContactStop", [](FlexibleBodySubsystem& subsystem, const Attachment& a, const Attachment& b,
                       Real factor) { ContactStop(subsystem, a, b, 500, 0.02 * factor); }},
};

class ConnectorTest : public ::testing::TestWithParam<std::tuple<Connector, Place>> {
protected:
    ConnectorTest()
        : first(flexible, makePointMassPart().body, "first"),
          second(flexible, makePointMassPart().body, "second"),
          rigid(matter.Ground(), Body::Rigid(MassProperties(1, Vec3(0), Inertia(1)))) {}

    std::pair<Attachment, Attachment> makeAttachments() {
        const Transform X(Rotation(0.6, UnitVec3(1, -2, 1)), Vec3(0.1, 0.2, -0.3));
        const Transform Y(Rotation(-0.4, UnitVec3(0, 1, 1)), Vec3(-0.1, 0.1, 0.05));
        switch (std::get<1>(GetParam())) {
            case Place::GroundToInterface:
                return {Attachment(matter.Ground(), X), first.interface("A", Y)};
            case Place::BodyToBody:
                return {first.interface("B", X), second.interface("A", Y)};
            case Place::OneBody:
                return {first.interface("A", X), first.interface("B", Y)};
            case Place::NodeToRigid:
                return {second.node(7, X), Attachment(rigid, Y)};
        }
        throw std::logic_error("no such place");
    }

    State makeState() {
        State state = system.realizeTopology();
        std::mt19937 random(5);
        std::uniform_real_distribution<double> unit(-1, 1);
        for (int i = 0; i < state.getNQ(); ++i) state.updQ()[i] = 0.4 * unit(random);
        for (int i = 0; i < state.getNU(); ++i) state.updU()[i] = unit(random);
        for (const FlexibleBody& body : {first, second})
            body.setModalCoordinates(state, 0.05 * body.getModalCoordinates(state));
        system.realize(state, Stage::Position);
        matter.normalizeQuaternions(state);
        system.realize(state, Stage::Dynamics);
        return state;
    }

    /** Returns the rate of a function of the State along q̇. **/
    Real differentiate(const State& state, const std::function<Real(const State&)>& function) {
        const Vector q = state.getQ(), qDot = state.getQDot();
        const auto at = [&](Real t) {
            State moved = state;
            moved.updQ() = q + t * qDot;
            system.realize(moved, Stage::Dynamics);
            return function(moved);
        };
        const Real h = 2e-4;
        return (8 * (at(h) - at(-h)) - (at(2 * h) - at(-2 * h))) / (12 * h);
    }

    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    FlexibleBodySubsystem flexible{system, matter};
    FlexibleBody first, second;
    MobilizedBody::Free rigid;
};

std::string nameOf(const ::testing::TestParamInfo<std::tuple<Connector, Place>>& test) {
    const char* places[] = {"GroundToInterface", "BodyToBody", "OneBody", "NodeToRigid"};
    return std::string(std::get<0>(test.param).name) + places[int(std::get<1>(test.param))];
}

INSTANTIATE_TEST_SUITE_P(Connectors, ConnectorTest,
                         ::testing::Combine(::testing::ValuesIn(connectors),
                                            ::testing::Values(Place::GroundToInterface,
                                                              Place::BodyToBody, Place::OneBody,
                                                              Place::NodeToRigid)),
                         nameOf);

TEST_P(ConnectorTest, UndampedPowerIsWhatTheEnergyLoses) {
    State bare = makeState();
    const Real others = calcPowerOfForces(flexible, bare);
    const auto [F, M] = makeAttachments();
    std::get<0>(GetParam()).make(flexible, F, M, 0);
    State state = makeState();
    const ForceElement& element = *flexible.getGuts().forceElements().front();
    const Real loss = -differentiate(state, [&](const State& moved) {
        return element.calcPotentialEnergy(
            unturned, flexible.getGuts().calcMotions(moved, element.getAttachments()));
    });
    EXPECT_NEAR(calcPowerOfForces(flexible, state) - others, loss,
                1e-7 * std::max(1.0, std::abs(loss)));
}

TEST_P(ConnectorTest, DampersOnlyTakeEnergyAndTheirPowerIsReported) {
    const auto [F, M] = makeAttachments();
    std::get<0>(GetParam()).make(flexible, F, M, 1);
    const State state = makeState();
    const ForceElement& element = *flexible.getGuts().forceElements().front();
    const Array_<FrameMotion> frames =
        flexible.getGuts().calcMotions(state, element.getAttachments());
    Array_<SpatialVec> forces(2, SpatialVec(Vec3(0), Vec3(0)));
    element.addInForces(unturned, frames, forces);
    Real power = 0;
    for (unsigned k = 0; k < 2; ++k)
        power += ~forces[k][0] * frames[k].V[0] + ~forces[k][1] * frames[k].V[1];
    const Real rate = differentiate(state, [&](const State& moved) {
        return element.calcPotentialEnergy(
            unturned, flexible.getGuts().calcMotions(moved, element.getAttachments()));
    });
    const Real lost = element.calcPower(unturned, frames, forces);
    EXPECT_LE(lost, 0);
    EXPECT_NEAR(power + rate, lost, 1e-7 * std::max(1.0, std::abs(power)));
    // Action and reaction: zero total force and torque about the origin.
    Vec3 force(0), torque(0);
    for (unsigned k = 0; k < 2; ++k) {
        force += forces[k][1];
        torque += forces[k][0] + frames[k].X.p() % forces[k][1];
    }
    EXPECT_LT(force.norm() + torque.norm(), 1e-11 * (1 + forces[0].norm()));
}

//-------------------------------------------------------------------------------------------------
// Jacobians

struct JacobianCase {
    const char* name;
    Maker make;
    /** Frame motions that exercise every term. **/
    FrameMotion F, M;
    /** Twists for which the Jacobian is exact here: F's rotation, F's translation, M's … **/
    bool isExact[4];
};
void PrintTo(const JacobianCase& jacobian, std::ostream* stream) {
    *stream << jacobian.name;
}

FrameMotion makeMotion(const Transform& X, const SpatialVec& V) {
    FrameMotion motion;
    motion.X = X;
    motion.V = V;
    return motion;
}

const SpatialVec atRest(Vec3(0), Vec3(0));
const Rotation someAxes(0.7, UnitVec3(1, 2, -1));
const Rotation turned(someAxes* Rotation(0.4, ZAxis));  // the spring's free angle

const JacobianCase jacobianCases[] = {
    // A taut spring, stretching along its line.
    {"StretchedSpring",
     connectors[0].make,
     makeMotion(Transform(Vec3(1, 2, 3)), atRest),
     makeMotion(Transform(Vec3(1.4, 2.2, 3.1)), {Vec3(0), Vec3(0.8, 0.4, 0.2)}),
     {true, true, true, true}},
    // The same under compression: the line's transverse stiffness is negative.
    {"CompressedSpring",
     connectors[0].make,
     makeMotion(Transform(Vec3(1, 2, 3)), atRest),
     makeMotion(Transform(Vec3(1.04, 2.02, 3.01)), {Vec3(0), Vec3(-0.8, -0.4, -0.2)}),
     {true, true, true, true}},
    // A bushing at rest with coincident frames.
    {"BushingAtRest",
     connectors[1].make,
     makeMotion(Transform(someAxes, Vec3(1, 2, 3)), atRest),
     makeMotion(Transform(someAxes, Vec3(1, 2, 3)), atRest),
     {true, true, true, true}},
    {"TorsionSpringAtRest",
     connectors[2].make,
     makeMotion(Transform(someAxes, Vec3(1, 2, 3)), atRest),
     makeMotion(Transform(turned, Vec3(1, 2, 3)), atRest),
     {true, true, true, true}},
    {"ContactStop",
     connectors[3].make,
     makeMotion(Transform(someAxes, Vec3(1, 2, 3)), atRest),
     makeMotion(Transform(someAxes, Vec3(1, 2, 3) - 0.02 * Vec3(someAxes.z())),
                {Vec3(0), Vec3(0.1, -0.2, 0.3)}),
     {false, true, true, true}},
};

class ConnectorJacobianTest : public ::testing::TestWithParam<JacobianCase> {};
INSTANTIATE_TEST_SUITE_P(Cases, ConnectorJacobianTest, ::testing::ValuesIn(jacobianCases),
                         [](const auto& test) { return std::string(test.param.name); });

TEST_P(ConnectorJacobianTest, TermsAddUpToTheDerivativeOfTheForces) {
    const JacobianCase& test = GetParam();
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    FlexibleBodySubsystem flexible(system, matter);
    test.make(flexible, Attachment(matter.Ground()), Attachment(matter.Ground()), 1);
    const ForceElement& element = *flexible.getGuts().forceElements().front();
    const Real gamma = 0.03;
    const unsigned terms = unsigned(element.getNumJacobianTerms());
    Array_<Real> signs(terms, Real(1));
    Array_<SpatialVec> directions(2 * terms);
    Array_<FrameMotion> frames{test.F, test.M};
    element.calcJacobian(unturned, frames, gamma, signs, directions);
    const auto entry = [](const SpatialVec* twists, int i) {
        return twists[i / 6][i % 6 / 3][i % 3];
    };

    // The displacement γδ and the speed δ of one twist component together.
    const auto forcesAt = [&](int j, Real delta) {
        Array_<FrameMotion> moved = frames;
        FrameMotion& frame = moved[unsigned(j / 6)];
        Vec3 axis(0);
        axis[j % 3] = 1;
        if (j % 6 < 3) {
            frame.X.updR() = Rotation(gamma * delta, UnitVec3(axis)) * frame.X.R();
            frame.V[0] += delta * axis;
        } else {
            frame.X.updP() += gamma * delta * axis;
            frame.V[1] += delta * axis;
        }
        Array_<SpatialVec> forces(2, SpatialVec(Vec3(0), Vec3(0)));
        element.addInForces(unturned, moved, forces);
        return forces;
    };
    Real largest = 0;
    for (int j = 0; j < 12; ++j) {
        if (!test.isExact[j / 3]) continue;
        const Real h = 1e-4;
        const Array_<SpatialVec> plus = forcesAt(j, h), minus = forcesAt(j, -h);
        for (int i = 0; i < 12; ++i) {
            if (!test.isExact[i / 3]) continue;
            Real sum = 0;
            for (unsigned k = 0; k < terms; ++k)
                sum += signs[k] * entry(&directions[2 * k], i) * entry(&directions[2 * k], j);
            const Real difference = -(entry(&plus[0], i) - entry(&minus[0], i)) / (2 * h);
            EXPECT_NEAR(sum, difference, 1e-5) << i << ", " << j;
            largest = std::max(largest, std::abs(difference));
        }
    }
    EXPECT_GT(largest, 0.5);
}

// -------------------------------------------------------------------------------------------------
// comparison with Simbody's elements on rigid bodies

class RigidPair {
public:
    RigidPair() {
        const Body::Rigid body(MassProperties(2, Vec3(0.1, 0, -0.2), Inertia(1, 2, 1.5)));
        first = MobilizedBody::Free(matter.Ground(), body);
        second = MobilizedBody::Free(matter.Ground(), body);
    }

    Vector calcUDot() {
        State state = system.realizeTopology();
        first.setQToFitTransform(state, Transform(Rotation(0.3, UnitVec3(1, 1, 0)), Vec3(0.1)));
        second.setQToFitTransform(state,
                                  Transform(Rotation(0.3, UnitVec3(1, 1, 0)) * Rotation(0.8, YAxis),
                                            Vec3(0.5, 0.3, -0.2)));
        first.setUToFitVelocity(state, SpatialVec(Vec3(0.1, 0.2, 0.3), Vec3(1, -1, 0.5)));
        second.setUToFitVelocity(state, SpatialVec(Vec3(-0.2, 0.1, 0), Vec3(0.2, 0.3, -1)));
        system.realize(state, Stage::Acceleration);
        return state.getUDot();
    }

    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    MobilizedBody::Free first, second;
};

TEST(TwoPointSpringDamper, AgreesWithSimbodysSpringAndDamper) {
    const Vec3 station(0.1, -0.2, 0.3), other(0, 0.2, 0.1);
    RigidPair simbody;
    Force::TwoPointLinearSpring(simbody.forces, simbody.first, station, simbody.second, other, 400,
                                0.25);
    Force::TwoPointLinearDamper(simbody.forces, simbody.first, station, simbody.second, other, 30);
    RigidPair own;
    FlexibleBodySubsystem flexible(own.system, own.matter);
    TwoPointSpringDamper(flexible, Attachment(own.first, station), Attachment(own.second, other),
                         400, 30, 0.25);
    const Vector expected = simbody.calcUDot();
    EXPECT_LT((own.calcUDot() - expected).normInf(), 1e-12 * expected.normInf());
}

/** For rotation about one axis, the rotation vector equals Simbody's body-fixed angles. **/
TEST(Bushing, AgreesWithSimbodysLinearBushingTurnedAboutOneAxis) {
    const Vec6 stiffness(10, 20, 30, 400, 500, 600);
    const Transform X(Vec3(0.1, 0.2, 0)), Y(Vec3(0, 0.1, -0.1));
    RigidPair simbody;
    Force::LinearBushing(simbody.forces, simbody.first, X, simbody.second, Y, stiffness, Vec6(0));
    RigidPair own;
    FlexibleBodySubsystem flexible(own.system, own.matter);
    Bushing(flexible, Attachment(own.first, X), Attachment(own.second, Y),
            Bushing::diagonal(stiffness));
    const Vector expected = simbody.calcUDot();
    EXPECT_LT((own.calcUDot() - expected).normInf(), 1e-11 * expected.normInf());
}

/** On a mobilizer's coordinate Simbody has the same elements under other names. **/
TEST(CoordinateForces, AgreeWithSimbodysOnMobilities) {
    const Real k = 40, c = 3, rest = 0.2, low = -0.5, high = 0.7, a = 0.4;
    for (const bool turns : {true, false}) {
        const auto calcUDot = [&](bool own, Real q, Real u) {
            MultibodySystem system;
            SimbodyMatterSubsystem matter(system);
            GeneralForceSubsystem forces(system);
            FlexibleBodySubsystem flexible(system, matter);
            const Body::Rigid body(MassProperties(2, Vec3(0.1, 0, -0.2), Inertia(1, 2, 1.5)));
            MobilizedBody moving =
                turns ? MobilizedBody(MobilizedBody::Pin(matter.Ground(), body))
                      : MobilizedBody(MobilizedBody::Slider(matter.Ground(), body));
            if (own) {
                const Joint::Coordinate coordinate =
                    turns ? Joint::Coordinate::makeAngle(matter.Ground(), moving)
                          : Joint::Coordinate::makeDisplacement(matter.Ground(), moving, XAxis);
                CoordinateSpring(flexible, coordinate, k, rest);
                CoordinateDamper(flexible, coordinate, c);
                CoordinateStop(flexible, coordinate, low, high, 10 * k, a);
            } else {
                Force::MobilityLinearSpring(forces, moving, MobilizerQIndex(0), k, rest);
                Force::MobilityLinearDamper(forces, moving, MobilizerUIndex(0), c);
                Force::MobilityLinearStop(forces, moving, MobilizerQIndex(0), 10 * k, a, low, high);
            }
            State state = system.realizeTopology();
            moving.setOneQ(state, 0, q);
            moving.setOneU(state, 0, u);
            system.realize(state, Stage::Velocity);
            flexible.initializeNative(state);
            system.realize(state, Stage::Acceleration);
            return std::pair<Real, Real>(moving.getOneUDot(state, 0),
                                         system.calcPotentialEnergy(state));
        };
        for (const Real q : {-0.9, -0.3, 0.0, 0.5, 1.1})
            for (const Real u : {-8.0, 0.0, 1.0}) {
                const auto expected = calcUDot(false, q, u), found = calcUDot(true, q, u);
                EXPECT_NEAR(found.first, expected.first, 1e-12 * (1 + std::abs(expected.first)));
                EXPECT_NEAR(found.second, expected.second, 1e-12 * (1 + expected.second));
            }
    }
}

/** Wound up over several turns, the energy is that of the whole angle; the damper dissipates. **/
TEST(CoordinateForces, KeepTheEnergyOverTurnsAndAtStops) {
    for (const bool damped : {false, true}) {
        MultibodySystem system;
        SimbodyMatterSubsystem matter(system);
        FlexibleBodySubsystem flexible(system, matter);
        MobilizedBody::Free wheel(matter.Ground(),
                                  Body::Rigid(MassProperties(1, Vec3(0), UnitInertia(0.1))));
        Joint::Pin pin(flexible, matter.Ground(), wheel, "pin");
        CoordinateSpring(flexible, pin, 0.5);
        CoordinateStop(flexible, pin, -1, 9, 20);
        if (damped) CoordinateDamper(flexible, pin, 0.02);
        State state = system.realizeTopology();
        wheel.setUToFitAngularVelocity(state, Vec3(0, 0, 30));
        BdfIntegrator integrator(system);
        integrator.setAccuracy(1e-8);
        integrator.initialize(state);
        Real largest = 0;
        for (int i = 1; i <= 40; ++i) {
            integrator.stepTo(0.05 * i);
            largest = std::max(largest, flexible.calcPotentialEnergy(integrator.getState()));
            const Real energy = flexible.calcEnergy(integrator.getState());
            EXPECT_NEAR(energy - integrator.getWork(), 45, 1e-3);
            if (damped && i == 40) {
                EXPECT_LT(energy, 40);
            }
        }
        EXPECT_GT(largest, 0.5 * 0.5 * 81);  // beyond 9 rad
    }
}

std::string messageOf(const std::function<void()>& action) {
    try {
        action();
    } catch (const std::invalid_argument& error) {
        return error.what();
    }
    return "";
}

TEST(CoordinateForces, WrongParametersAreNamed) {
    RigidPair pair;
    FlexibleBodySubsystem flexible(pair.system, pair.matter);
    Joint::Pin pin(flexible, pair.first, pair.second, "pin");
    EXPECT_THAT(messageOf([&] { CoordinateSpring(flexible, pin, -1, 0, "return"); }),
                HasSubstr("'return': stiffness is -1"));
    EXPECT_THAT(messageOf([&] { CoordinateDamper(flexible, pin, NaN); }), HasSubstr("damping"));
    EXPECT_THAT(messageOf([&] { CoordinateStop(flexible, pin, 1, -1, 100); }), HasSubstr("limits"));
    EXPECT_THAT(messageOf([&] { CoordinateStop(flexible, pin, 0, 1, 0); }), HasSubstr("stiffness"));
}

//-------------------------------------------------------------------------------------------------
// in time

/** Returns x(t) of a damped oscillator released at x₀. **/
Real dampedOscillation(Real x0, Real omega, Real ratio, Real t) {
    const Real slower = omega * std::sqrt(1 - ratio * ratio), rate = ratio * omega;
    return x0 * std::exp(-rate * t) * (std::cos(slower * t) + rate / slower * std::sin(slower * t));
}

/** Compares the errors of one coordinate at accuracies 1e-6 and 1e-8. **/
void expectConvergence(const MultibodySystem& system, const State& state,
                       const MobilizedBody& mobod, Real time, Real expected, Real scale) {
    Real errors[2];
    for (int k = 0; k < 2; ++k) {
        BdfIntegrator integrator(system);
        integrator.setAccuracy(k ? 1e-8 : 1e-6);
        integrator.initialize(state);
        integrator.stepTo(time);
        errors[k] = std::abs(mobod.getOneQ(integrator.getState(), 0) - expected) / scale;
    }
    // Order 2: accuracy^(2/3), a factor of 21.
    EXPECT_LT(errors[1], errors[0] / 10);
    EXPECT_LT(errors[1], 1e-3);
}

TEST(TwoPointSpringDamper, MassOnASpringSwingsAsInClosedForm) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    FlexibleBodySubsystem flexible(system, matter);
    const Real mass = 2, stiffness = 800, ratio = 0.05, omega = std::sqrt(stiffness / mass);
    MobilizedBody::Slider slider(matter.Ground(),
                                 Body::Rigid(MassProperties(mass, Vec3(0), Inertia(1))));
    TwoPointSpringDamper(flexible, Attachment(matter.Ground(), Vec3(-1, 0, 0)), Attachment(slider),
                         stiffness, 2 * ratio * mass * omega, 1);
    State state = system.realizeTopology();
    slider.setOneQ(state, 0, 0.1);
    expectConvergence(system, state, slider, 0.7, dampedOscillation(0.1, omega, ratio, 0.7), 0.1);
}

/** A spring has no direction where its points coincide: thrown from there, a mass swings as v/ω sin
ωt; dropped, as g/ω² (1 − cos ωt), on either side. **/
TEST(TwoPointSpringDamper, WithoutLengthSwingsThroughCoincidingPoints) {
    const Real mass = 2, stiffness = 800, omega = std::sqrt(stiffness / mass), time = 0.7;
    const Real speed = 3, gravity = 9.81, fall = gravity / (omega * omega);
    for (const bool thrown : {true, false}) {
        MultibodySystem system;
        SimbodyMatterSubsystem matter(system);
        GeneralForceSubsystem forces(system);
        if (!thrown) Force::Gravity(forces, matter, Vec3(gravity, 0, 0));
        FlexibleBodySubsystem flexible(system, matter);
        MobilizedBody::Slider slider(matter.Ground(),
                                     Body::Rigid(MassProperties(mass, Vec3(0), Inertia(1))));
        TwoPointSpringDamper(flexible, Attachment(matter.Ground()), Attachment(slider), stiffness,
                             0, 0);
        State state = system.realizeTopology();
        system.realize(state, Stage::Acceleration);
        EXPECT_NEAR(slider.getOneUDot(state, 0), thrown ? 0 : gravity, 1e-12);
        if (thrown) {
            slider.setOneU(state, 0, speed);
            expectConvergence(system, state, slider, time, speed / omega * std::sin(omega * time),
                              speed / omega);
        } else {
            expectConvergence(system, state, slider, time, fall * (1 - std::cos(omega * time)),
                              fall);
        }
    }
}

/** Its pull is −k times the displacement, so it is equally stiff in all directions. **/
TEST(TwoPointSpringDamper, WithoutLengthIsAsStiffInEveryDirection) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    FlexibleBodySubsystem flexible(system, matter);
    const Real mass = 2, stiffness = 800;
    MobilizedBody::Cartesian point(matter.Ground(),
                                   Body::Rigid(MassProperties(mass, Vec3(0), Inertia(1))));
    TwoPointSpringDamper(flexible, Attachment(matter.Ground()), Attachment(point), stiffness, 0, 0);
    State state = system.realizeTopology();
    for (const Vec3& place : {Vec3(0), Vec3(0.1, -0.2, 0.3)}) {
        point.setQ(state, place);
        const std::vector<Eigenmode> modes = calcEigenmodes(calcLinearization(system, state));
        ASSERT_EQ(modes.size(), 3u);
        for (const Eigenmode& mode : modes)
            EXPECT_NEAR(2 * Pi * mode.frequency, std::sqrt(stiffness / mass), 1e-6);
    }
    // It also stays at rest there.
    point.setQ(state, Vec3(0));
    BdfIntegrator integrator(system);
    integrator.initialize(state);
    integrator.stepTo(0.5);
    EXPECT_EQ(point.getQ(integrator.getState()), Vec3(0));
}

TEST(TorsionSpring, LidOnAPinSwingsAsInClosedForm) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    FlexibleBodySubsystem flexible(system, matter);
    const Real inertia = 0.5, stiffness = 50, ratio = 0.02, omega = std::sqrt(stiffness / inertia);
    MobilizedBody::Pin lid(matter.Ground(),
                           Body::Rigid(MassProperties(1, Vec3(0), Inertia(inertia))));
    TorsionSpring(flexible, Attachment(matter.Ground()), Attachment(lid), stiffness,
                  2 * ratio * inertia * omega, 0.3);
    State state = system.realizeTopology();
    lid.setOneQ(state, 0, 0.3 + 2.5);
    expectConvergence(system, state, lid, 0.9, 0.3 + dampedOscillation(2.5, omega, ratio, 0.9),
                      2.5);
}

/** A ball dropped on a stop: without dissipation it returns to the same height, with dissipation it
loses energy. **/
TEST(ContactStop, UndampedBallComesBackAndEnergyIsKept) {
    for (const Real dissipation : {0.0, 0.1}) {
        MultibodySystem system;
        SimbodyMatterSubsystem matter(system);
        GeneralForceSubsystem forces(system);
        Force::Gravity(forces, matter, Vec3(0, 0, -10));
        FlexibleBodySubsystem flexible(system, matter);
        MobilizedBody::Cartesian ball(matter.Ground(),
                                      Body::Rigid(MassProperties(1, Vec3(0), Inertia(1))));
        ContactStop(flexible, Attachment(matter.Ground()), Attachment(ball), 1e5, dissipation);
        State state = system.realizeTopology();
        ball.setQ(state, Vec3(0, 0, 0.2));
        BdfIntegrator integrator(system);
        integrator.setAccuracy(1e-8);
        integrator.initialize(state);
        // Fall 0.2 s, touch for about π √(m/k), rise 0.2 s.
        Real highest = 0;
        for (int k = 1; k <= 60; ++k) {
            integrator.stepTo(0.3 + 0.005 * k);
            highest = std::max(highest, ball.getQ(integrator.getState())[2]);
        }
        if (dissipation == 0)
            EXPECT_NEAR(highest, 0.2, 1e-4);
        else  // restitution e = 1 − 2av/3, first order in av = 0.2; half of the next order left
            EXPECT_NEAR(std::sqrt(highest / 0.2), 1 - 2 * dissipation * 2 / 3, 0.02);
        const Real energy = flexible.calcEnergy(integrator.getState());
        EXPECT_NEAR(energy - integrator.getWork(), 1 * 10 * 0.2, 1e-3);  // of 2 J
    }
}

/** Two flexible bodies connected by an ever stiffer bushing move as if by a joint; Newton's
iteration uses the stiffness. **/
TEST(Bushing, StiffOnesTendToTheBallJoint) {
    const auto endOf = [](Real stiffness, long* iterations = nullptr) {
        MultibodySystem system;
        SimbodyMatterSubsystem matter(system);
        GeneralForceSubsystem forces(system);
        Force::Gravity(forces, matter, Vec3(0, -9.81, 0));
        FlexibleBodySubsystem flexible(system, matter);
        const auto part = makePointMassPart().body;
        const FlexibleBody first(flexible, part, "first"), second(flexible, part, "second");
        Joint::Ball(flexible, matter.Ground(), first.interface("A"));
        if (stiffness > 0)
            Bushing(flexible, first.interface("B"), second.interface("A"),
                    Bushing::diagonal(Vec6(0, 0, 0, stiffness, stiffness, stiffness)));
        else
            Joint::Ball(flexible, first.interface("B"), second.interface("A"));
        State state = system.realizeTopology();
        first.setPoseByInterface(state, "A", Transform());
        system.realize(state, Stage::Velocity);
        second.setPoseByInterface(state, "A", first.interface("B").calcMotion(state).X);
        BdfIntegrator integrator(system);
        // Without projection, to match the stiff limit of a force.
        integrator.setFormulation(BdfIntegrator::Formulation::Index3);
        integrator.setFixedStep(1e-3);
        integrator.initialize(state);
        integrator.stepTo(0.2);
        if (iterations) *iterations = integrator.getStatistics().newtonIterations;
        return second.interface("B").calcMotion(integrator.getState()).X.p();
    };
    long iterations[2];
    const Vec3 joint = endOf(0);
    const Real soft = (endOf(1e6, &iterations[0]) - joint).norm();
    const Real stiff = (endOf(1e8, &iterations[1]) - joint).norm();
    EXPECT_GT(soft, 1e-6);
    EXPECT_LT(stiff, 0.04 * soft);  // 1/k is 0.01; both swing about their gap, up to twice it
    // 200 steps, which would be impossible without the stiffness in the matrix.
    for (const long count : iterations) EXPECT_LT(count, 3 * 200);
}

TEST(Connectors, BadParametersAreNamed) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    FlexibleBodySubsystem flexible(system, matter);
    const Attachment ground(matter.Ground());
    EXPECT_THAT(messageOf([&] { TwoPointSpringDamper(flexible, ground, ground, -1, 0, 0); }),
                HasSubstr("TwoPointSpringDamper between ground and ground: stiffness is -1"));
    EXPECT_THAT(messageOf([&] { TorsionSpring(flexible, ground, ground, 1, NaN); }),
                HasSubstr("damping is nan"));
    EXPECT_THAT(messageOf([&] { ContactStop(flexible, ground, ground, 0); }),
                HasSubstr("stiffness is zero"));
    Mat66 unsymmetric(1);
    unsymmetric(0, 1) = 0.5;
    EXPECT_THAT(messageOf([&] { Bushing(flexible, ground, ground, unsymmetric); }),
                HasSubstr("stiffness matrix is not symmetric"));
    EXPECT_THAT(messageOf([&] {
                    Bushing(flexible, ground, ground, Mat66(1),
                            Bushing::diagonal(Vec6(1, 1, 1, 1, 1, -2)));
                }),
                HasSubstr("damping matrix has the eigenvalue -2"));
}

/** Connectors between Ground and a free body. **/
class ElementRange : public ::testing::Test {
protected:
    /** Returns the messages of all elements for a body pose. **/
    std::map<int, std::string> find(const Transform& X, const Vec3& omega = Vec3(0),
                                    Real elapsed = 0) {
        state = system.realizeTopology();
        system.realizeModel(state);
        body.setQToFitTransform(state, X);
        body.setUToFitAngularVelocity(state, omega);
        system.realize(state, Stage::Velocity);
        return flexible.describeElementsOutOfRange(state, elapsed);
    }
    const State& accelerate() {
        flexible.initializeNative(state);
        system.realize(state, Stage::Acceleration);
        return state;
    }

    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    FlexibleBodySubsystem flexible{system, matter};
    MobilizedBody::Free body{matter.Ground(), Body::Rigid(MassProperties(1, Vec3(0), Inertia(1)))};
    State state;
};

TEST_F(ElementRange, OfABushingEndsBeforeHalfATurnAboutAnyAxis) {
    const Mat66 turning = Bushing::diagonal(Vec6(1, 1, 1, 1, 1, 1)),
                shifting = Bushing::diagonal(Vec6(0, 0, 0, 1, 1, 1));
    EXPECT_FALSE(flexible.hasElementsWithRange());
    Bushing(flexible, matter.Ground(), body, shifting, shifting, "slide");
    EXPECT_FALSE(flexible.hasElementsWithRange());
    Bushing(flexible, matter.Ground(), body, turning, Mat66(0), "mount");
    Bushing(flexible, matter.Ground(), body, shifting, turning);
    EXPECT_TRUE(flexible.hasElementsWithRange());
    for (const Vec3& axis : {Vec3(1, 0, 0), Vec3(0, 0, -1), Vec3(1, -2, 3)})
        for (const Real angle : {0.0, 0.5, 2.3, 2.4, 3.1, 3.2, 3.8, 4.0, 6.0}) {
            const auto found =
                find(Transform(Rotation(angle, UnitVec3(axis)), Vec3(0.1, 0.2, 0.3)));
            const bool isOutside = angle > 2.36 && angle < 2 * Pi - 2.36;
            EXPECT_EQ(found.size(), isOutside ? 1u : 0u) << angle;
            if (isOutside) {
                EXPECT_THAT(found.at(1), HasSubstr("force 'mount' is turned by "));
            }
        }
}

TEST_F(ElementRange, OfABushingsDampingDependsOnHowItTurns) {
    const Vec6 damping(2, 3, 4, 1, 1, 1);
    Bushing(flexible, matter.Ground(), body, Mat66(0), Bushing::diagonal(damping), "damper");
    for (const Real angle : {0.5, 2.3, 2.4, 3.1, 3.2, 4.0}) {
        const bool isOutside = angle > 2.36 && angle < 2 * Pi - 2.36;
        const Transform X(Rotation(angle, ZAxis));
        // About the axis it is a damper at any angle.
        EXPECT_TRUE(find(X, Vec3(0, 0, 7)).empty()) << angle;
        const Vec3 torque = body.getBodyAngularAcceleration(accelerate());
        EXPECT_NEAR(torque[2], -4 * 7., 1e-9) << angle;
        EXPECT_EQ(find(X, Vec3(7, 0, 0)).size(), isOutside ? 1u : 0u) << angle;
    }
}

TEST_F(ElementRange, OfABushingIsLeftWithinAStepThatEndsAfterWholeTurns) {
    Bushing(flexible, matter.Ground(), body, Bushing::diagonal(Vec6(1, 1, 1, 1, 1, 1)), Mat66(0),
            "mount");
    const Vec3 fast(0, 0, 2 * Pi / 1e-3);
    EXPECT_TRUE(find(Transform(), fast).empty());
    EXPECT_TRUE(find(Transform(), fast, 1e-4).empty());
    const auto found = find(Transform(), fast, 1e-3);
    ASSERT_EQ(found.size(), 1u);
    EXPECT_THAT(found.at(0), HasSubstr("'mount' turns by 6.28 rad within 0.001 s"));
}

TEST_F(ElementRange, OfATorsionSpringEndsWhereItsAxesMeet) {
    TorsionSpring(flexible, matter.Ground(), body, 1, 0, 0, "clock");
    for (const Real turn : {0.0, 2.0, 3.1})
        EXPECT_TRUE(find(Transform(Rotation(turn, ZAxis))).empty()) << turn;
    EXPECT_TRUE(find(Transform(Rotation(1.4, YAxis))).empty());
    EXPECT_THAT(find(Transform(Rotation(1.5, YAxis))).at(0), HasSubstr("'clock' is tilted"));
}

TEST_F(ElementRange, OfASpringEndsWhereItsPointsMeet) {
    TwoPointSpringDamper(flexible, matter.Ground(), body, 1, 0, 0.2, "strut");
    TwoPointSpringDamper(flexible, matter.Ground(), body, 1, 0, 0, "rubber");
    EXPECT_TRUE(find(Transform(Vec3(1e-3, 0, 0))).empty());
    const auto found = find(Transform());
    ASSERT_EQ(found.size(), 1u);
    EXPECT_THAT(found.at(0), HasSubstr("'strut' has both ends in one place"));
}

TEST(Connectors, AreCalledByTheirNames) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    FlexibleBodySubsystem flexible(system, matter);
    const Attachment ground(matter.Ground());
    EXPECT_THAT(messageOf([&] { TwoPointSpringDamper(flexible, ground, ground, -1, 0, 0, "a"); }),
                ::testing::StartsWith("'a': stiffness is -1"));
    EXPECT_THAT(messageOf([&] { TorsionSpring(flexible, ground, ground, -1, 0, 0, "b"); }),
                ::testing::StartsWith("'b': stiffness is -1"));
    EXPECT_THAT(messageOf([&] { ContactStop(flexible, ground, ground, -1, 0, "c"); }),
                ::testing::StartsWith("'c': stiffness is -1"));
    EXPECT_THAT(messageOf([&] { Bushing(flexible, ground, ground, Mat66(-1), Mat66(0), "d"); }),
                ::testing::StartsWith("'d': the stiffness matrix has the eigenvalue -1"));
}

}  // namespace
}  // namespace simflex::test
