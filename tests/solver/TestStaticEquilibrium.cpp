// Equilibria against closed forms; free motions are named.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"
#include "simflex/body/JointGoals.h"
#include "simflex/forces/AttachmentForce.h"
#include "simflex/forces/Bushing.h"
#include "simflex/forces/TorsionSpring.h"
#include "simflex/solver/BdfIntegrator.h"
#include "simflex/solver/Eigenmodes.h"
#include "simflex/solver/StaticEquilibrium.h"
#include "support/PointMassPart.h"

namespace simflex {
namespace {

using namespace SimTK;

constexpr Real Gravity = 9.81;

Real calcLargestAcceleration(const MultibodySystem& system, const State& state) {
    BdfIntegrator integrator(system);
    integrator.setProjectInitialState(false);
    integrator.initialize(state);
    return integrator.getUDot().normInf();
}

/** A flexible part hanging on a joint at its interface "A". **/
template <class Hinge>
struct Hanging {
    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    FlexibleBodySubsystem flexible{system, matter};
    FlexibleBody body{flexible, test::makePointMassPart().body, "pendulum"};
    Hinge hinge{flexible, matter.Ground(), body.interface("A"), "hinge"};
    State state;

    Hanging() {
        Force::Gravity(forces, matter, -YAxis, Gravity);
        state = system.realizeTopology();
        body.setPoseByInterface(state, "A", Transform());
    }
};

TEST(StaticEquilibrium, PendulumStartedLevelOrNearlyUprightHangsAtRest) {
    for (const Real angle : {0.0, 1.4, -2.0}) {
        Hanging<Joint::Pin> model;
        model.body.setPoseByInterface(model.state, "A", Transform(Rotation(angle, ZAxis)));
        StaticEquilibrium equilibrium(model.system);
        equilibrium.solve(model.state);
        const State& state = equilibrium.getState();
        // The centre of mass lies below the pin.
        const Vec3 center = model.body.getFramePose(state).p();
        EXPECT_LT(center[1], -0.1) << angle;
        EXPECT_NEAR(center[0], 0, 1e-9) << angle;
        const Vector lambda = equilibrium.getMultipliers(model.hinge);
        const Vec3 force = model.hinge.calcForceOnM(state, lambda)[1];
        EXPECT_NEAR(force[1], model.body.getPart().mass * Gravity, 1e-9 * Gravity) << angle;
        EXPECT_LT(calcLargestAcceleration(model.system, state), 1e-5) << angle;
    }
}

TEST(StaticEquilibrium, WhatHangsAsPlacedIsBentByItsWeightBeforeItIsLinearised) {
    Hanging<Joint::Pin> model;
    const auto place = [&](Real angle) {  // angle of the centre of mass, from below
        model.body.setPoseByInterface(model.state, "A", Transform());
        model.system.realize(model.state, Stage::Position);
        const Vec3 p = model.body.getFramePose(model.state).p();
        const Real turn = -Pi / 2 + angle - std::atan2(p[1], p[0]);
        model.body.setPoseByInterface(model.state, "A", Transform(Rotation(turn, ZAxis)));
    };
    const auto calcFrequency = [&](const State& about) {
        return calcSlowestEigenmodes(model.system, about, 1).at(0).frequency;
    };
    place(0);
    const Real frequency = calcFrequency(findEquilibriumNearby(model.system, model.state));
    StaticEquilibrium equilibrium(model.system);
    equilibrium.solve(model.state);
    EXPECT_NEAR(frequency, calcFrequency(equilibrium.getState()), 1e-6 * frequency);
    const auto& part = model.body.getPart();
    model.system.realize(model.state, Stage::Position);
    const Vec3 p = model.body.getFramePose(model.state).p();
    const Real d2 = p[0] * p[0] + p[1] * p[1];
    const Real rigid =
        std::sqrt(part.mass * Gravity * std::sqrt(d2) / (part.inertia[2] + part.mass * d2)) /
        (2 * Pi);
    EXPECT_NEAR(frequency, rigid, 0.02 * rigid);

    // A State that is not an equilibrium is left unchanged.
    place(0.3);
    const State tilted = findEquilibriumNearby(model.system, model.state);
    EXPECT_EQ((tilted.getQ() - model.state.getQ()).normInf(), 0);
    EXPECT_THROW(calcFrequency(tilted), NoEquilibrium);
    place(0);
    model.body.getFrame().setUFromVector(model.state, Vector(6, 0.1));
    EXPECT_FALSE(equilibrium.solveNearby(model.state));
}

TEST(StaticEquilibrium, BodyThatNothingHoldsIsNamed) {
    Hanging<Joint::Pin> model;
    FlexibleBody loose(model.flexible, test::makePointMassPart().body, "loose casing");
    const State state = model.system.realizeTopology();
    StaticEquilibrium equilibrium(model.system);
    try {
        equilibrium.solve(state);
        FAIL() << "no exception";
    } catch (const std::runtime_error& error) {
        EXPECT_NE(std::string(error.what()).find("'loose casing' is free to move"),
                  std::string::npos)
            << error.what();
    }
}

TEST(StaticEquilibrium, FreeMotionWithoutLoadStaysAndIsReported) {
    Hanging<Joint::Ball> model;  // free to turn about the vertical
    StaticEquilibrium equilibrium(model.system);
    equilibrium.solve(model.state);
    ASSERT_EQ(equilibrium.getFreeMotions().size(), 1u);
    EXPECT_EQ(equilibrium.getFreeMotions()[0], "'pendulum' is free to move");
    EXPECT_LT(calcLargestAcceleration(model.system, equilibrium.getState()), 1e-5);
}

TEST(StaticEquilibrium, SpringCarriesAMass) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    Force::Gravity gravity(forces, matter, -XAxis, Gravity);
    const Real m = 3, k = 500;
    MobilizedBody::Slider mass(matter.Ground(), Transform(),
                               Body::Rigid(MassProperties(m, Vec3(0), Inertia(1))), Transform());
    Force::MobilityLinearSpring spring(forces, mass, MobilizerQIndex(0), k, 0.1);
    const State state = system.realizeTopology();
    StaticEquilibrium equilibrium(system);
    equilibrium.solve(state);
    EXPECT_NEAR(mass.getOneQ(equilibrium.getState(), 0), 0.1 - m * Gravity / k, 1e-12);
    EXPECT_TRUE(equilibrium.getFreeMotions().empty());
}

/** Two rigid links, pinned to each other and to Ground; the end of the second is on a slider. **/
struct Arch {
    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    MobilizedBody::Pin left, middle;
    MobilizedBody::Slider end;
    State state;

    explicit Arch(Real gravity) {
        Force::Gravity(forces, matter, -YAxis, gravity);
        const Body::Rigid link(MassProperties(1, Vec3(0.3, 0, 0), Inertia(1)));
        left = MobilizedBody::Pin(matter.Ground(), Transform(), link, Transform());
        middle = MobilizedBody::Pin(left, Transform(Vec3(0.6, 0, 0)), link, Transform());
        end =
            MobilizedBody::Slider(matter.Ground(), Transform(),
                                  Body::Rigid(MassProperties(1, Vec3(0), Inertia(1))), Transform());
        Constraint::Ball(end, Vec3(0), middle, Vec3(0.6, 0, 0));
        state = system.realizeTopology();
        left.setOneQ(state, 0, -0.5);
        middle.setOneQ(state, 0, 0.5);
        end.setOneQ(state, 0, 0.9);
    }
};

TEST(StaticEquilibrium, LockedMobilizersStay) {
    Arch arch(Gravity);
    arch.left.lock(arch.state);
    StaticEquilibrium equilibrium(arch.system);
    equilibrium.solve(arch.state);
    EXPECT_EQ(arch.left.getOneQ(equilibrium.getState(), 0), -0.5);
    EXPECT_NEAR(arch.end.getOneQ(equilibrium.getState(), 0), 1.2 * std::cos(0.5), 1e-9);
    // With the end fixed, both links hang as far as it allows.
    arch.left.unlock(arch.state);
    arch.end.lockAt(arch.state, 0.9);
    equilibrium.solve(arch.state);
    EXPECT_EQ(arch.end.getOneQ(equilibrium.getState(), 0), 0.9);
    EXPECT_NEAR(arch.left.getOneQ(equilibrium.getState(), 0), -std::acos(0.45 / 0.6), 1e-9);
}

TEST(StaticEquilibrium, HeldMobilizersStayWhileJointsAreAssembled) {
    Arch arch(0);  // without load it stays as assembled
    StaticEquilibrium equilibrium(arch.system);
    equilibrium.solve(arch.state);
    EXPECT_GT(std::abs(arch.left.getOneQ(equilibrium.getState(), 0) + 0.5), 1e-2);
    equilibrium.holdDuringAssembly(arch.left);
    equilibrium.solve(arch.state);
    EXPECT_NEAR(arch.left.getOneQ(equilibrium.getState(), 0), -0.5, 1e-9);
    EXPECT_NEAR(arch.end.getOneQ(equilibrium.getState(), 0), 1.2 * std::cos(0.5), 1e-9);
    EXPECT_FALSE(arch.left.isLocked(equilibrium.getState()));
    ASSERT_EQ(equilibrium.getFreeMotions().size(), 1u);
    // Impossible: 1.2 cos 0.5 is not 0.9.
    arch.end.lock(arch.state);
    EXPECT_THROW(equilibrium.solve(arch.state), std::runtime_error);
}

TEST(StaticEquilibrium, LoadsAreRaisedInPartsWhereOneStepIsTooLong) {
    // kθ = FL cos θ for a bar on a pin with a torsion spring, far beyond small angles.
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    FlexibleBodySubsystem flexible(system, matter);
    const auto part = std::make_shared<ReducedBody>(*test::makePointMassPart().body);
    for (auto& interface : part->interfaces) interface.position[1] = interface.position[2] = 0;
    const FlexibleBody bar(flexible, part, "bar");
    Joint::Pin pin(flexible, matter.Ground(), bar.interface("A"), "pin");
    const Real L = part->interfaces[1].position[0] - part->interfaces[0].position[0];
    const Real k = 2, F = 4.86 * k / L;
    TorsionSpring spring(flexible, matter.Ground(), bar.interface("A"), k);
    AttachmentForce push(flexible, bar.interface("B"), SpatialVec(Vec3(0), Vec3(0, F, 0)));
    State state = system.realizeTopology();
    for (int i = 0; i < bar.getNumModalMobilizers(); ++i) bar.getModalMobilizer(i).lock(state);
    bar.setPoseByInterface(state, "A", Transform());
    StaticEquilibrium equilibrium(system);
    equilibrium.setMaximumIterations(5);
    equilibrium.solve(state);
    EXPECT_GT(equilibrium.getNumLoadSteps(), 1);
    const Vec3 x = bar.getFramePose(equilibrium.getState()).R().x();
    const Real angle = std::atan2(x[1], x[0]);
    EXPECT_NEAR(angle, 1.3, 1e-3);
    EXPECT_NEAR(k * angle, F * L * std::cos(angle), 1e-8 * k);
}

TEST(StaticEquilibrium, JointsThatCannotBeAssembledAreNamed) {
    Hanging<Joint::Ball> model;
    const Joint::Ball far(model.flexible, model.matter.Ground(),
                          model.body.interface("A", Transform(Vec3(0.3, 0, 0))), "far support");
    const State state = model.system.realizeTopology();
    StaticEquilibrium equilibrium(model.system);
    try {
        equilibrium.solve(state);
        FAIL() << "no exception";
    } catch (const std::runtime_error& error) {
        EXPECT_NE(std::string(error.what()).find("cannot be assembled"), std::string::npos)
            << error.what();
    }
}

TEST(StaticEquilibrium, SpeedsThatAreNoSteadyMotionAreRefused) {
    Hanging<Joint::Pin> model;
    model.system.realize(model.state, Stage::Position);
    setSteadyRotation(model.system, model.state, Vec3(0, 0, 3),
                      Vec3(1, 0, 0));  // not the axis of the pin
    StaticEquilibrium equilibrium(model.system);
    try {
        equilibrium.solveSteadyMotion(model.state);
        FAIL() << "no exception";
    } catch (const std::runtime_error& error) {
        EXPECT_NE(std::string(error.what()).find("hinge"), std::string::npos) << error.what();
    }
}

TEST(StaticEquilibrium, ConicalPendulumTurnsSteadily) {
    // cos θ = g/(Ω² l) for a bob; a rigid link on a rotating Universal joint.
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    Force::Gravity gravity(forces, matter, -YAxis, Gravity);
    const Real l = 0.5, Omega = 6;
    const Rotation zToY(-Pi / 2, XAxis);
    MobilizedBody::Pin turn(matter.Ground(), Transform(zToY),
                            Body::Rigid(MassProperties(1, Vec3(0), Inertia(1))), Transform(zToY));
    const Body::Rigid bob(MassProperties(1, Vec3(0, -l, 0), Inertia(Vec3(l * l, 0, l * l))));
    MobilizedBody::Pin swing(turn, Transform(), bob, Transform());
    State state = system.realizeTopology();
    turn.setOneU(state, 0, Omega);
    swing.setOneQ(state, 0, 0.3);
    StaticEquilibrium equilibrium(system);
    equilibrium.solveSteadyMotion(state);
    EXPECT_NEAR(std::cos(swing.getOneQ(equilibrium.getState(), 0)), Gravity / (Omega * Omega * l),
                1e-9);
    EXPECT_EQ(turn.getOneU(equilibrium.getState(), 0), Omega);
}

/** Links of one part, one below the other or side by side, held at one end. **/
template <class Hinge>
struct Row {
    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    FlexibleBodySubsystem flexible{system, matter};
    std::vector<FlexibleBody> links;
    State state;

    /** @param direction  initial direction of all links **/
    Row(int count, const Rotation& direction) {
        Force::Gravity(forces, matter, -YAxis, Gravity);
        const auto part = test::makePointMassPart().body;
        for (int k = 0; k < count; ++k) {
            links.emplace_back(flexible, part);
            const Attachment before =
                k == 0 ? Attachment(matter.Ground()) : links[size_t(k) - 1].interface("B");
            Hinge(flexible, before, links.back().interface("A"));
        }
        state = system.realizeTopology();
        Vec3 at(0);
        const auto &from = part->getInterface("A").position, &to = part->getInterface("B").position;
        const Vec3 pitch(to[0] - from[0], to[1] - from[1], to[2] - from[2]);
        for (const FlexibleBody& link : links) {
            link.setPoseByInterface(state, "A", Transform(direction, at));
            at += direction * pitch;
        }
    }
};

TEST(StaticEquilibrium, ChainStartedLevelHangsInAsManyStepsHoweverLongItIs) {
    std::vector<int> iterations;
    for (const int count : {4, 16, 64}) {
        Row<Joint::Pin> chain(count, Rotation(0.02, ZAxis));
        StaticEquilibrium equilibrium(chain.system);
        equilibrium.solve(chain.state);
        EXPECT_EQ(equilibrium.getNumLoadSteps(), 1);
        EXPECT_TRUE(equilibrium.getUnstableMotions().empty()) << count;
        for (const FlexibleBody& link : chain.links)
            EXPECT_LT(link.getFramePose(equilibrium.getState()).p()[1], 0) << count;
        EXPECT_LT(calcLargestAcceleration(chain.system, equilibrium.getState()), 1e-4) << count;
        iterations.push_back(equilibrium.getNumIterations());
    }
    EXPECT_LE(*std::max_element(iterations.begin(), iterations.end()), 25)
        << ::testing::PrintToString(iterations);
}

TEST(StaticEquilibrium, CoordinatesOfJointsBendBodiesAsStaticsDoes) {
    // One end is welded, the other displaced sideways: on a carriage, by its coordinate, and at a
    // fixed point.
    struct Bent {
        MultibodySystem system;
        SimbodyMatterSubsystem matter{system};
        FlexibleBodySubsystem flexible{system, matter};
        FlexibleBody link{flexible, test::makePointMassPart().body, "link"};
        Joint::Weld clamp{flexible, matter.Ground(), link.interface("A"), "clamp"};
    };
    const auto part = test::makePointMassPart().body;
    const auto placeOf = [&](const std::string& name) {
        for (const ReducedBody::Interface& interface : part->interfaces)
            if (interface.name == name) return Vec3::getAs(interface.position.data());
        throw std::logic_error(name);
    };
    const Vec3 end = placeOf("B") - placeOf("A");
    for (const Vec3& way : {Vec3(0, 2e-3, 0), Vec3(0, 0, 2e-3), Vec3(1e-4, 1e-3, -1e-3)}) {
        const Transform rail(Rotation(UnitVec3(way), XAxis), end);
        Bent led;
        MobilizedBody::Free carriage(led.matter.Ground(), Transform(),
                                     Body::Rigid(MassProperties(1, Vec3(0), Inertia(1))),
                                     Transform());
        Joint::Slider guide(led.flexible, Attachment(led.matter.Ground(), rail), carriage, "guide");
        Joint::Ball tip(led.flexible, carriage, led.link.interface("B"), "tip");
        State state = led.system.realizeTopology();
        led.link.setPoseByInterface(state, "A", Transform());
        carriage.setQToFitTransform(state, rail);
        setJointCoordinates(led.flexible, state, {{guide, 0, way.norm()}});
        EXPECT_NEAR(guide.calcCoordinates(state)[0], way.norm(), 1e-10);

        Bent held;
        Joint::Ball(held.flexible, Attachment(held.matter.Ground(), end + way),
                    held.link.interface("B"), "tip");
        State start = held.system.realizeTopology();
        held.link.setPoseByInterface(start, "A", Transform());
        StaticEquilibrium equilibrium(held.system);
        equilibrium.solve(start);
        const Real energy = held.flexible.calcPotentialEnergy(equilibrium.getState());
        EXPECT_GT(energy, 0);
        EXPECT_NEAR(led.flexible.calcPotentialEnergy(state), energy, 1e-6 * energy) << way;
    }
}

TEST(StaticEquilibrium, ElementsThatHaveLeftTheirRangeAreNamedWhereThereIsNone) {
    // A bushing of 100 N m/rad balances at most 100 pi N m.
    const auto findFailure = [](Real torque) -> std::string {
        MultibodySystem system;
        SimbodyMatterSubsystem matter(system);
        FlexibleBodySubsystem flexible(system, matter);
        MobilizedBody::Free body(matter.Ground(), Transform(),
                                 Body::Rigid(MassProperties(1, Vec3(0), Inertia(1))), Transform());
        Bushing(flexible, matter.Ground(), body,
                Bushing::diagonal(Vec6(100, 100, 100, 1e4, 1e4, 1e4)), Mat66(0), "mount");
        AttachmentForce(flexible, body, SpatialVec(Vec3(0, 0, torque), Vec3(0)));
        StaticEquilibrium equilibrium(system);
        try {
            equilibrium.solve(system.realizeTopology());
        } catch (const std::runtime_error& error) {
            return error.what();
        }
        return "";
    };
    EXPECT_EQ(findFailure(200), "");
    for (const Real torque : {330., 1000.})
        EXPECT_THAT(findFailure(torque), ::testing::HasSubstr("force 'mount' is turned by "));
}

TEST(StaticEquilibrium, ChainThatABushingPullsTogetherComesToRest) {
    for (const Real strength : {1e2, 1e4, 1e6}) {
        SCOPED_TRACE(strength);
        Row<Joint::Pin> chain(6, Rotation(0.02, ZAxis));
        const auto bushing = Bushing::diagonal(Vec6(0, 0, 0, strength, strength, strength));
        Bushing(chain.flexible, Attachment(chain.matter.Ground()),
                chain.links.back().interface("B"), bushing, Mat66(0));
        State level = chain.system.realizeTopology();
        level.updQ() = chain.state.getQ();
        StaticEquilibrium equilibrium(chain.system);
        equilibrium.solve(level);
        EXPECT_EQ(equilibrium.isByDampedMotion(), strength > 1e3);
        EXPECT_TRUE(equilibrium.getUnstableMotions().empty());
        EXPECT_LT(calcLargestAcceleration(chain.system, equilibrium.getState()), 1e-3);
    }
}

TEST(StaticEquilibrium, HundredsOfLinksThatMaySpinStayAsTheyAre) {
    constexpr int Count = 120;
    Row<Joint::Ball> chain(Count, Rotation(-0.5 * Pi + 0.1, ZAxis));
    StaticEquilibrium equilibrium(chain.system);
    equilibrium.solve(chain.state);
    EXPECT_FALSE(equilibrium.getFreeMotions().empty());
    EXPECT_TRUE(equilibrium.getUnstableMotions().empty());
    EXPECT_LT(calcLargestAcceleration(chain.system, equilibrium.getState()), 1e-4);
}

TEST(StaticEquilibrium, UprightPendulumIsNamedUnstable) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    Force::Gravity(forces, matter, -YAxis, Gravity);
    MobilizedBody::Pin pendulum(matter.Ground(), Transform(),
                                Body::Rigid(MassProperties(2, Vec3(0), Inertia(0.01))),
                                Vec3(0, -0.5, 0));
    State state = system.realizeTopology();
    for (const bool isUpright : {true, false}) {
        pendulum.setOneQ(state, 0, isUpright ? 0 : Pi);
        StaticEquilibrium equilibrium(system);
        equilibrium.solve(state);
        EXPECT_EQ(pendulum.getOneQ(equilibrium.getState(), 0), pendulum.getOneQ(state, 0));
        EXPECT_TRUE(equilibrium.getFreeMotions().empty());
        ASSERT_EQ(equilibrium.getUnstableMotions().size(), isUpright ? 1u : 0u);
        if (isUpright) {
            EXPECT_THAT(equilibrium.getUnstableMotions()[0],
                        ::testing::EndsWith("falls away from it"));
        }
    }
}

TEST(StaticEquilibrium, APendulumOnATurntableIsNamedUnstableWhereItFallsAway) {
    // A bob on a massless rod of length l that swings on a table's radius, at r from its axis:
    // V/m = −g l cos θ − Ω² (r + l sin θ)²/2.
    const Real l = 0.5;
    for (const Real r : {0.0, 0.3, -1.0})
        for (const Real Omega : {0.001, 1.0, 5.0}) {
            MultibodySystem system;
            SimbodyMatterSubsystem matter(system);
            GeneralForceSubsystem forces(system);
            Force::Gravity(forces, matter, -YAxis, Gravity);
            const Rotation zToY(-Pi / 2, XAxis);
            MobilizedBody::Pin turn(matter.Ground(), Transform(zToY),
                                    Body::Rigid(MassProperties(1, Vec3(0), Inertia(1))),
                                    Transform(zToY));
            Motion::Steady(turn, Omega);
            MobilizedBody::Pin swing(
                turn, Vec3(r, 0, 0),
                Body::Rigid(MassProperties(1, Vec3(0, -l, 0), Inertia(Vec3(l * l, 0, l * l)))),
                Transform());
            State state = system.realizeTopology();
            for (const Real start : {0.5, 1.0, 1.4, 1.7, 2.1, 2.6, 3.0, 3.12, -0.5, -2.0, -3.0}) {
                SCOPED_TRACE(std::to_string(r) + " " + std::to_string(Omega) + " " +
                             std::to_string(start));
                swing.setOneQ(state, 0, start);
                StaticEquilibrium equilibrium(system);
                equilibrium.solveSteadyMotion(state);
                const Real theta = swing.getOneQ(equilibrium.getState(), 0),
                           x = r + l * std::sin(theta);
                EXPECT_NEAR(Gravity * std::sin(theta), square(Omega) * x * std::cos(theta), 1e-7);
                const Real stiffness =
                    Gravity * std::cos(theta) -
                    square(Omega) * (l * square(std::cos(theta)) - x * std::sin(theta));
                EXPECT_EQ(equilibrium.getUnstableMotions().size(), stiffness > 0 ? 0u : 1u)
                    << theta << ", " << stiffness;
            }
        }
}

}  // namespace
}  // namespace simflex
