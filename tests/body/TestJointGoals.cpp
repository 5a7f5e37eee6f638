/** @file
Setting joint coordinates to goals, against closed forms. **/

#include <gmock/gmock.h>

#include <functional>

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/JointGoals.h"
#include "simflex/forces/TorsionSpring.h"
#include "support/PointMassPart.h"

namespace simflex::test {
namespace {

using namespace SimTK;
using ::testing::AllOf;
using ::testing::HasSubstr;

/** A slider-crank in the xy plane of free rigid bodies, straight: crank r, rod l. **/
struct SliderCrank {
    static constexpr Real r = 0.3, l = 0.8;
    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    FlexibleBodySubsystem bodies{system, matter};
    MobilizedBody::Free crank = addBody(), rod = addBody(), slider = addBody();
    Joint::Pin bearing{bodies, matter.Ground(), crank, "bearing"};
    Joint::Pin crankPin{bodies, {crank, Vec3(r, 0, 0)}, rod, "crank pin"};
    Joint::Pin sliderPin{bodies, {rod, Vec3(l, 0, 0)}, slider, "slider pin"};
    Joint::Slider guide{bodies, matter.Ground(), slider, "guide"};
    State state;

    MobilizedBody::Free addBody() {
        return {matter.Ground(), Body::Rigid(MassProperties(1, Vec3(0), UnitInertia(0.1)))};
    }
    SliderCrank() {
        state = system.realizeTopology();
        system.realizeModel(state);
        rod.setQToFitTranslation(state, Vec3(r, 0, 0));
        slider.setQToFitTranslation(state, Vec3(r + l, 0, 0));
        system.realize(state, Stage::Velocity);
    }
};

/** Three bodies in free flight, on a ball and a slider, with initial speeds that violate the
joints. **/
struct FlyingChain {
    Real unit;  ///< of a length [m]
    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    FlexibleBodySubsystem bodies{system, matter};
    std::vector<MobilizedBody::Free> links;
    State state;

    FlyingChain(Real unit_, const Rotation& axes) : unit(unit_) {
        for (int i = 0; i < 3; ++i)
            links.emplace_back(matter.Ground(),
                               Body::Rigid(MassProperties(1 + i, Vec3(0.1, 0.2, -0.1) * unit,
                                                          Inertia(2, 2.5, 3) * square(unit))));
        Joint::Ball(bodies, {links[0], Vec3(1, 0, 0) * unit}, links[1], "ball");
        Joint::Slider(bodies, {links[1], Transform(Rotation(0.4, YAxis), Vec3(0, unit, 0))},
                      {links[2], Transform(Rotation(0.4, YAxis))}, "slide");
        state = system.realizeTopology();
        system.realizeModel(state);
        const Vec3 places[] = {Vec3(0), Vec3(1, 0, 0), Vec3(1, 1, 0)};
        for (int i = 0; i < 3; ++i) {
            links[size_t(i)].setQToFitTransform(state, Transform(axes, axes * places[i] * unit));
            links[size_t(i)].setUToFitVelocity(
                state, SpatialVec(axes * Vec3(0.3 * i, 1 - i, 0.5),
                                  axes * Vec3(i - 0.2, 0.7, 0.1 * i) * unit));
        }
        system.realize(state, Stage::Velocity);
    }
    SpatialVec calcMomentum() const { return matter.calcSystemMomentumAboutGroundOrigin(state); }
};

TEST(JointGoals, RatesAreMetByAnImpulseThatKeepsMomentumWhateverAxesAndUnits) {
    const FlyingChain given(1, Rotation());
    Real energy = NaN;
    for (const Real unit : {1.0, 1e-3, 250.0})
        for (const Rotation& axes : {Rotation(), Rotation(0.9, UnitVec3(1, -2, 0.5))}) {
            FlyingChain chain(unit, axes);
            const SpatialVec before = chain.calcMomentum();
            setJointRates(chain.bodies, chain.state,
                          {{chain.bodies.getJoint(JointIndex(1)), 0, 2 * unit}});
            const SpatialVec after = chain.calcMomentum();
            EXPECT_LT((after[0] - before[0]).norm(), 1e-10 * before[0].norm());
            EXPECT_LT((after[1] - before[1]).norm(), 1e-10 * before[1].norm());
            const Real now = chain.matter.calcKineticEnergy(chain.state) / square(unit);
            if (isNaN(energy)) energy = now;
            EXPECT_NEAR(now, energy, 1e-9 * energy);
        }
    EXPECT_GT(std::abs(energy - given.matter.calcKineticEnergy(given.state)), 0.1);
}

TEST(JointGoals, ASliderCranksSlideFollowsItsCrank) {
    SliderCrank model;
    const Real phi = 2.2, omega = 7, s = model.r * std::sin(phi), c = model.r * std::cos(phi),
               reach = std::sqrt(model.l * model.l - s * s);
    setJointCoordinates(model.bodies, model.state, {{model.bearing, 0, phi}});
    EXPECT_NEAR(model.guide.calcCoordinates(model.state)[0], c + reach, 1e-10);
    setJointRates(model.bodies, model.state, {{model.bearing, 0, omega}});
    EXPECT_NEAR(model.guide.calcCoordinateDots(model.state)[0], -omega * s * (1 + c / reach), 1e-8);
    EXPECT_NEAR(model.bearing.calcCoordinates(model.state)[0], phi, 1e-10);
    // Back by the slide; angles take the shorter way.
    setJointCoordinates(model.bodies, model.state, {{model.guide, 0, 0.9}});
    const Real x = 0.9;
    EXPECT_NEAR(std::cos(model.bearing.calcCoordinates(model.state)[0]),
                (x * x + model.r * model.r - model.l * model.l) / (2 * x * model.r), 1e-10);
    setJointCoordinates(model.bodies, model.state, {{model.bearing, 0, 0.5 + 4 * Pi}});
    EXPECT_NEAR(model.bearing.calcCoordinates(model.state)[0], 0.5, 1e-10);
}

TEST(JointGoals, WhatCountsTurnsGoesAlong) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    FlexibleBodySubsystem bodies(system, matter);
    const MobilizedBody::Free wheel(matter.Ground(),
                                    Body::Rigid(MassProperties(1, Vec3(0), UnitInertia(0.1))));
    const Joint::Pin pin(bodies, matter.Ground(), wheel, "pin");
    const Real k = 3;
    TorsionSpring(bodies, matter.Ground(), wheel, k, 0, 0);
    State state = system.realizeTopology();
    system.realize(state, Stage::Velocity);
    const auto expectTwist = [&](Real twist) {
        EXPECT_NEAR(system.calcPotentialEnergy(state), 0.5 * k * twist * twist, 1e-7);
    };
    setJointCoordinates(bodies, state, {{pin, 0, 7}}, AngleWay::Whole);
    EXPECT_NEAR(pin.calcCoordinates(state)[0], 7 - 2 * Pi, 1e-10);
    expectTwist(7);
    setJointCoordinates(bodies, state, {{pin, 0, -4 - 2 * Pi}}, AngleWay::Whole);
    expectTwist(-4);
    setJointCoordinates(bodies, state, {{pin, 0, 2 * Pi - 3}}, AngleWay::Shorter);
    expectTwist(-3);
}

TEST(JointGoals, WhatTheJointsDoNotAllowIsRefusedAndChangesNothing) {
    SliderCrank model;
    const Vector before = model.state.getY();
    try {
        setJointCoordinates(model.bodies, model.state, {{model.guide, 0, 1.2}});
        FAIL() << "the slide is further away than crank and rod are long";
    } catch (const std::runtime_error& error) {
        EXPECT_THAT(error.what(), HasSubstr("does not allow it"));
    }
    EXPECT_EQ((model.state.getY() - before).normInf(), 0);
    // Two contradictory goals.
    EXPECT_THROW(setJointCoordinates(model.bodies, model.state,
                                     {{model.bearing, 0, 0.5}, {model.guide, 0, 0.6}}),
                 std::runtime_error);
    setJointCoordinates(model.bodies, model.state, {{model.bearing, 0, 0.5}});
    EXPECT_THROW(
        setJointRates(model.bodies, model.state, {{model.bearing, 0, 1}, {model.guide, 0, 1}}),
        std::runtime_error);
}

template <class Act>
std::string refusalOf(const Act& act) {
    try {
        act();
    } catch (const std::exception& error) {
        return error.what();
    }
    return "accepted";
}

TEST(JointGoals, EveryGoalIsANumberOfOneCoordinateThatThereIs) {
    SliderCrank model, other;
    const auto ofValues = [&](const std::vector<JointGoal>& goals) {
        return refusalOf([&] { setJointCoordinates(model.bodies, model.state, goals); });
    };
    const auto ofRates = [&](const std::vector<JointGoal>& goals) {
        return refusalOf([&] { setJointRates(model.bodies, model.state, goals); });
    };
    const Vector before = model.state.getY();
    for (const Real bad : {NaN, Infinity}) {
        EXPECT_THAT(ofValues({{model.bearing, 0, bad}}),
                    HasSubstr("value of coordinate 0 of joint 'bearing'"));
        EXPECT_THAT(ofRates({{model.bearing, 0, bad}}),
                    HasSubstr("rate of coordinate 0 of joint 'bearing'"));
    }
    for (const int number : {-1, 1, 3}) {
        EXPECT_THAT(ofValues({{model.bearing, number, 1}}), HasSubstr("'bearing'"));
        EXPECT_THAT(ofRates({{model.bearing, number, 1}}), HasSubstr("'bearing'"));
    }
    EXPECT_THAT(ofValues({{model.bearing, 0, 1.2}, {model.bearing, 0, 0.2}}),
                AllOf(HasSubstr("'bearing' does not allow it"), HasSubstr("two values")));
    EXPECT_THAT(ofRates({{model.bearing, 0, 1}, {model.bearing, 0, 2}}),
                HasSubstr("'bearing' does not allow it"));
    EXPECT_THAT(ofValues({{other.bearing, 0, 1}}), HasSubstr("another system"));
    EXPECT_EQ((model.state.getY() - before).normInf(), 0);
    // A joint's own setters do the same.
    EXPECT_THAT(refusalOf([&] { model.bearing.setAngle(model.state, NaN); }),
                HasSubstr("'bearing'"));
    model.bearing.setAngle(model.state, 0.5);
    model.bearing.setRate(model.state, 3);
    EXPECT_NEAR(model.bearing.getAngle(model.state), 0.5, 1e-10);
    EXPECT_NEAR(model.bearing.getRate(model.state), 3, 1e-9);
    model.guide.setLength(model.state, 1);
    EXPECT_NEAR(model.guide.getLength(model.state), 1, 1e-10);
}

/** A flexible link between a pin and a rigid one that hangs from it. **/
struct FlexibleLink {
    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    FlexibleBodySubsystem bodies{system, matter};
    FlexibleBody link{bodies, makePointMassPart().body, "link"};
    MobilizedBody::Free end{matter.Ground(),
                            Body::Rigid(MassProperties(1, Vec3(0), UnitInertia(1)))};
    Joint::Pin hip{bodies, matter.Ground(), link.interface("A"), "hip"},
        knee{bodies, link.interface("B"), end, "knee"};
};

// Bodies keep their shapes; a goal reachable only by bending is rejected.
TEST(JointGoals, NoBodyIsBentBeyondItsLinearRangeToReachThem) {
    const auto expectRefused = [](FlexibleLink& model, State& state,
                                  const std::vector<JointGoal>& goals) {
        const Vector before = state.getY();
        EXPECT_THAT(refusalOf([&] { setJointCoordinates(model.bodies, state, goals); }),
                    AllOf(HasSubstr("does not allow it"),
                          testing::AnyOf(HasSubstr("'hip'"), HasSubstr("'knee'"))));
        EXPECT_EQ((state.getY() - before).normInf(), 0);
    };
    {
        FlexibleLink model;
        State state = model.system.realizeTopology();
        setJointCoordinates(model.bodies, state, {{model.hip, 0, 0}});
        model.end.lock(state);
        expectRefused(model, state, {{model.hip, 0, 0.8}});
        expectRefused(model, state, {{model.hip, 0, -2}});
    }
    FlexibleLink model;
    Constraint::Rod rod(model.matter.Ground(), Vec3(0.6, 0.1, 0), model.end, Vec3(0, -0.2, 0), 0.3);
    State state = model.system.realizeTopology();
    setJointCoordinates(model.bodies, state, {});
    expectRefused(model, state, {{model.hip, 0, 2.4}, {model.knee, 0, 1}});
    // Goals within the mechanism's freedom cause no bending.
    const Real now = model.hip.calcCoordinates(state)[0];
    setJointCoordinates(model.bodies, state, {{model.hip, 0, now + 0.01}});
    EXPECT_LT(model.link.calcLargestDisplacement(state), 1e-9);
}

TEST(JointGoals, ClosingJointsThatNeedABodyBeyondItsRangeIsRefusedByName) {
    FlexibleLink model;
    Joint::Weld anchor(model.bodies, Attachment(model.matter.Ground(), Vec3(0, -3, 0)),
                       model.link.interface("B"), "anchor in the wrong place");
    State state = model.system.realizeTopology();
    model.link.setPoseByInterface(state, "A", Transform());
    const Vector before = state.getY();
    for (const std::function<void()>& close :
         {std::function<void()>([&] { model.bodies.closeJoints(state); }),
          std::function<void()>([&] { model.bodies.initializeNative(state); }),
          std::function<void()>([&] { setJointCoordinates(model.bodies, state, {}); })}) {
        EXPECT_THAT(refusalOf(close), AllOf(HasSubstr("'link'"), HasSubstr("linear range"),
                                            HasSubstr("'anchor in the wrong place'")));
        EXPECT_EQ((state.getY() - before).normInf(), 0);
    }
}

TEST(JointGoals, SeveralCoordinatesAreLedTogetherAndBodiesKeepTheirShapes) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    FlexibleBodySubsystem bodies(system, matter);
    const PointMassPart part = makePointMassPart();
    FlexibleBody one(bodies, part.body), two(bodies, part.body);
    Joint::Pin first(bodies, matter.Ground(), one.interface("A"), "first"),
        second(bodies, one.interface("B"), two.interface("A"), "second");
    State state = system.realizeTopology();
    system.realizeModel(state);
    bodies.closeJoints(state);
    const Vector before[] = {one.getModalCoordinates(state), two.getModalCoordinates(state)};
    setJointCoordinates(bodies, state, {{first, 0, 0.7}, {second, 0, -2.5}});
    EXPECT_NEAR(first.calcCoordinates(state)[0], 0.7, 1e-10);
    EXPECT_NEAR(second.calcCoordinates(state)[0], -2.5, 1e-10);
    EXPECT_LT((one.getModalCoordinates(state) - before[0]).normInf(), 1e-15);
    EXPECT_LT((two.getModalCoordinates(state) - before[1]).normInf(), 1e-15);
    setJointRates(bodies, state, {{first, 0, 3}, {second, 0, -4}});
    EXPECT_NEAR(first.calcCoordinateDots(state)[0], 3, 1e-9);
    EXPECT_NEAR(second.calcCoordinateDots(state)[0], -4, 1e-9);
    for (const Joint& joint : {Joint(first), Joint(second)})
        EXPECT_LT(joint.calcPositionErrors(state).normInf(), 1e-10);
}

TEST(JointGoals, AllCoordinatesOfAJointCanBeGiven) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    FlexibleBodySubsystem bodies(system, matter);
    MobilizedBody::Free tool(matter.Ground(),
                             Body::Rigid(MassProperties(1, Vec3(0), UnitInertia(0.1))));
    Joint::Planar table(bodies, matter.Ground(), tool, "table");
    State state = system.realizeTopology();
    setJointCoordinates(bodies, state, {{table, 0, 0.4}, {table, 1, -2}, {table, 2, 3}});
    EXPECT_LT((table.calcCoordinates(state) - Vector(Vec3(0.4, -2, 3))).normInf(), 1e-10);
    setJointRates(bodies, state, {{table, 2, 5}});
    EXPECT_LT((table.calcCoordinateDots(state) - Vector(Vec3(0, 0, 5))).normInf(), 1e-9);
}

}  // namespace
}  // namespace simflex::test
