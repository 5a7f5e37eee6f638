/** @file
Models built from text against the same systems built in C++. **/

#include "BuiltModel.h"
#include "simflex/forces/AttachmentForce.h"
#include "simflex/forces/Bushing.h"
#include "simflex/forces/ContactStop.h"
#include "simflex/forces/DistributedLoad.h"
#include "simflex/forces/ModalDamping.h"
#include "simflex/forces/TorsionSpring.h"
#include "simflex/forces/TwoPointSpringDamper.h"
#include "simflex/model/builders/MotionBuilder.h"

namespace simflex::test {
namespace {

using namespace SimTK;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr double RoundOff = 1e-10;  // relative; of the solution for multipliers too

class ModelSystems : public BuiltModelTest {
protected:
    /** The same in C++. **/
    struct ByHand {
        ByHand() : matter(system), forces(system), flexible(system, matter) {}
        MultibodySystem system;
        SimbodyMatterSubsystem matter;
        GeneralForceSubsystem forces;
        FlexibleBodySubsystem flexible;
    };

    /** Converts a pose in the part's own coordinates to frame B. **/
    static Transform toFrame(const Transform& X_GP, const ReducedBody& part) {
        return X_GP *
               Transform(Vec3(part.centerOfMass[0], part.centerOfMass[1], part.centerOfMass[2]));
    }
};

TEST_F(ModelSystems, BodiesJointsLoadsAndConnectorsAreThoseBuiltByHand) {
    const auto model = build(R"(
gravity: [0.5, -9.81, 1]
parameters: {k: 2e4}
bodies:
  boom: {part: bar, damping: 0.02, place: {position: [0.1, 0.2, 0], rotation: {axis: z, angle: 90*deg}}}
  blade: {part: stiffened, damping: {rayleigh: [2, 1e-4]}, place: {position: [0.5, 0, 0]}}
  weight:
    mass: 3
    center_of_mass: [0.01, 0.02, -0.01]
    inertia: [0.02, 0.03, 0.04, 0.001, -0.002, 0.003]
    place: {position: [0.3, 0.3, 0.1], rotation: [0.1, 0.2, 0.3]}
frames:
  tip: {on: boom.B, position: [0.01, 0, 0], rotation: [0, 0.2, 0]}
  corner: {on: weight, position: [0.05, 0, 0]}
  knob: {on: blade, node: 3}
  anchor: {on: ground, position: [1, 1, 0]}
joints:
  root: {type: pin, between: [ground, boom.A]}
  knee: {type: ball, between: [tip, corner]}
  elbow: {type: universal, between: [weight, blade.A]}
loads:
  push: {on: tip, force: [0, 10*t, 3], torque: [sin(t), 0, 0], axes: frame}
  pull: {on: corner, force: [1, 2, 3*t]}
  gas: {body: boom, nodes: END, pressure: 1e4*t}
  shear: {body: boom, nodes: END, traction: [1e3, 0, 2e3], scale: cos(t)}
  drag: {body: blade, nodes: END, total_force: [0, 5, 0]}
  shake: {body: blade, modes: {2: 1.5, 7: -1}, scale: 3*t}
connectors:
  strut: {type: spring, between: [anchor, knob], stiffness: k, damping: 5}
  mount: {type: bushing, between: [ground, corner], stiffness: [1, 2, 3, 100, 200, 300], damping: [0.1, 0.1, 0.2, 1, 1, 2]}
  wind: {type: torsion_spring, between: [ground, boom.A], stiffness: 12, damping: 0.1, free_angle: 0.2}
  bump: {type: stop, between: [{on: ground, position: [0, 0, 5]}, corner], stiffness: 1e4, dissipation: 0.5}
)");

    ByHand hand;
    Force::Gravity(hand.forces, hand.matter, Vec3(0.5, -9.81, 1));
    const FlexibleBody boom(hand.flexible, makeBar(), "boom");
    ModalDamping(hand.flexible, boom, 0.02);
    const FlexibleBody blade(hand.flexible, makeStiffenedBar(), "blade");
    ModalDamping::rayleigh(hand.flexible, blade, 2, 1e-4);
    const Vec3 c(0.01, 0.02, -0.01);
    const Inertia central(Vec3(0.02, 0.03, 0.04), Vec3(0.001, -0.002, 0.003));
    MobilizedBody::Free weight(
        hand.matter.updGround(),
        Body::Rigid(MassProperties(3, c, central.shiftFromMassCenter(c, 3))));
    const Attachment ground(hand.matter.getGround());
    const Attachment tip = boom.interface("B", Transform(Rotation(0.2, YAxis), Vec3(0.01, 0, 0)));
    const Attachment corner(weight, Vec3(0.05, 0, 0));
    Joint::Pin(hand.flexible, ground, boom.interface("A"));
    Joint::Ball(hand.flexible, tip, corner);
    Joint::Universal(hand.flexible, weight, blade.interface("A"));
    AttachmentForce(
        hand.flexible, tip,
        [](Real t) { return SpatialVec(Vec3(std::sin(t), 0, 0), Vec3(0, 10 * t, 3)); },
        AttachmentForce::Axes::Attachment);
    AttachmentForce(hand.flexible, corner,
                    [](Real t) { return SpatialVec(Vec3(0), Vec3(1, 2, 3 * t)); });
    DistributedLoad(hand.flexible, boom, LoadShape::pressure(*makeBar(), "END"),
                    [](Real t) { return 1e4 * t; });
    DistributedLoad(hand.flexible, boom, LoadShape::traction(*makeBar(), "END", Vec3(1e3, 0, 2e3)),
                    [](Real t) { return std::cos(t); });
    DistributedLoad(hand.flexible, blade,
                    LoadShape::nodeSetForce(*makeStiffenedBar(), "END", Vec3(0, 5, 0)));
    Vector modal(7, 0.0);
    modal[1] = 1.5, modal[6] = -1;
    DistributedLoad(hand.flexible, blade, LoadShape::fromModalForces(modal),
                    [](Real t) { return 3 * t; });

    // Positions of interfaces and nodes directly from the part, at the placement.
    const Transform X_boom =
        toFrame(Transform(Rotation(Pi / 2, ZAxis), Vec3(0.1, 0.2, 0)), *makeBar());
    const Transform X_blade = toFrame(Vec3(0.5, 0, 0), *makeStiffenedBar());
    Rotation turn;
    turn.setRotationToBodyFixedXYZ(Vec3(0.1, 0.2, 0.3));
    const Transform X_weight(turn, Vec3(0.3, 0.3, 0.1));
    const auto& s = makeStiffenedBar()->mesh.positions;  // node 3 is the third
    const double length = (X_blade * Vec3(s[6], s[7], s[8]) - Vec3(1, 1, 0)).norm();
    TwoPointSpringDamper(hand.flexible, Attachment(hand.matter.getGround(), Vec3(1, 1, 0)),
                         blade.node(3), 2e4, 5, length);
    Bushing(hand.flexible, ground, corner, Bushing::diagonal(Vec6(1, 2, 3, 100, 200, 300)),
            Bushing::diagonal(Vec6(0.1, 0.1, 0.2, 1, 1, 2)));
    TorsionSpring(hand.flexible, ground, boom.interface("A"), 12, 0.1, 0.2);
    ContactStop(hand.flexible, Attachment(hand.matter.getGround(), Vec3(0, 0, 5)), corner, 1e4,
                0.5);
    State state = hand.system.realizeTopology();
    boom.setFramePose(state, X_boom);
    blade.setFramePose(state, X_blade);
    weight.setQToFitTransform(state, X_weight);

    const State built = model->makeInitialState();
    EXPECT_LT((built.getQ() - state.getQ()).normInf(), 1e-14);
    EXPECT_EQ(built.getU().normInf(), 0);
    EXPECT_LT(compareAccelerations(model->getSystem(), built, hand.system, state), RoundOff);
    EXPECT_TRUE(model->getBodies()[1].flexible->isStiffeningEnabled(built));
    ASSERT_EQ(model->getJoints().size(), 3u);
    EXPECT_EQ(model->getJoints()[1].name, "knee");
    EXPECT_EQ(model->getJoints()[1].joint.getName(), "knee");
}

TEST_F(ModelSystems, MobilizersAreSimbodys) {
    const auto model = build(R"(
gravity: [0, -9.81, 0]
bodies:
  rod: {mass: 1, inertia: [0.01, 0.02, 0.02], mobilizer: {type: ball, parent: arm, inboard: {position: [0.4, 0, 0]}}}
  arm:
    mass: 2
    inertia: [0.1, 0.2, 0.3]
    mobilizer: {type: pin, inboard: {position: [0, 1, 0], rotation: [0.3, 0, 0]}, outboard: {position: [-0.4, 0, 0]}}
  nut: {mass: 1, inertia: [0.01, 0.02, 0.02], mobilizer: {type: screw, parent: arm, pitch: 0.01}}
  shuttle: {mass: 1, inertia: [0.01, 0.02, 0.02], mobilizer: {type: cylinder}}
  wedge: {mass: 1, inertia: [0.01, 0.02, 0.02], mobilizer: {type: planar}}
  block: {mass: 1, inertia: [0.01, 0.02, 0.02], mobilizer: {type: slider, parent: wedge}}
  fork: {mass: 1, inertia: [0.01, 0.02, 0.02], mobilizer: {type: universal, parent: block}}
  cap: {mass: 1, inertia: [0.01, 0.02, 0.02], mobilizer: {type: weld, parent: fork, inboard: {position: [0, 0, 0.2]}}}
  cart: {mass: 1, inertia: [0.01, 0.02, 0.02], mobilizer: {type: translation}}
initial:
  bodies:
    arm: {coordinates: 0.3, rates: [2]}
    wedge: {coordinates: [0.1, 0.2, 0.3]}
)");
    ByHand hand;
    Force::Gravity(hand.forces, hand.matter, Vec3(0, -9.81, 0));
    const Body::Rigid small(MassProperties(1, Vec3(0), Inertia(0.01, 0.02, 0.02)));
    MobilizedBody::Pin arm(hand.matter.updGround(), Transform(Rotation(0.3, XAxis), Vec3(0, 1, 0)),
                           Body::Rigid(MassProperties(2, Vec3(0), Inertia(0.1, 0.2, 0.3))),
                           Vec3(-0.4, 0, 0));
    MobilizedBody::Ball rod(arm, Vec3(0.4, 0, 0), small, Vec3(0));
    MobilizedBody::Screw nut(arm, Transform(), small, Transform(), 0.01);
    MobilizedBody::Cylinder shuttle(hand.matter.updGround(), small);
    MobilizedBody::Planar wedge(hand.matter.updGround(), small);
    MobilizedBody::Slider block(wedge, small);
    MobilizedBody::Universal fork(block, small);
    MobilizedBody::Weld cap(fork, Vec3(0, 0, 0.2), small, Vec3(0));
    MobilizedBody::Translation cart(hand.matter.updGround(), small);
    State state = hand.system.realizeTopology();
    arm.setOneQ(state, 0, 0.3);
    arm.setOneU(state, 0, 2);
    wedge.setQFromVector(state, Vector(Vec3(0.1, 0.2, 0.3)));
    const State built = model->makeInitialState();
    EXPECT_EQ((built.getQ() - state.getQ()).normInf(), 0);
    EXPECT_EQ((built.getU() - state.getU()).normInf(), 0);
    EXPECT_LT(compareAccelerations(model->getSystem(), built, hand.system, state), RoundOff);
    EXPECT_EQ(model->getBodies()[0].name, "rod");  // the file's order, although its parent is below
}

TEST_F(ModelSystems, MotionsGearsAndCouplersAreThoseBuiltByHand) {
    const std::string disc = "{mass: 1, inertia: [0.01, 0.01, 0.02]}";
    const auto model =
        build("bodies: {a: " + disc + ", b: " + disc + ", c: " + disc + ", d: " + disc + "}\n" + R"(
joints:
  train: {type: coupler, terms: [{joint: third, coordinate: 1, coefficient: 2}, {joint: first, coefficient: 0.1}], constant: 0.05}
  first: {type: pin, between: [ground, a]}
  mesh: {type: gear, wheels: [first, {joint: second, coordinate: 0}], teeth: [17, 43], phase: 0.1}
  second: {type: pin, between: [{on: ground, position: [1, 0, 0]}, b]}
  third: {type: cylinder, between: [{on: ground, position: [2, 0, 0]}, c]}
motions:
  drive: {joint: first, position: 0.2*sin(3*t)}
  lift: {joint: third, coordinate: 0, position: t^2}
  shake: {between: [ground, d], axis: y, position: 0.1*t}
  turn: {between: [ground, d], angle: 0.3*t}
)");
    ByHand hand;
    const Body::Rigid body(MassProperties(1, Vec3(0), Inertia(0.01, 0.01, 0.02)));
    MobilizedBody::Free a(hand.matter.updGround(), body), b(hand.matter.updGround(), body),
        c(hand.matter.updGround(), body), d(hand.matter.updGround(), body);
    const MobilizedBody& ground = hand.matter.getGround();
    Joint::Pin first(hand.flexible, ground, a);
    Joint::Pin second(hand.flexible, Attachment(ground, Vec3(1, 0, 0)), b);
    Joint::Cylinder third(hand.flexible, Attachment(ground, Vec3(2, 0, 0)), c);
    Joint::Coupler(hand.flexible, {{Joint::Coordinate(third, 1), 2}, {first, 0.1}}, 0.05);
    Joint::Gear(hand.flexible, first, 17, second, 43, 0.1);
    Joint::PrescribedRotation(hand.flexible, ground, a, [](Real t) {
        return Vec3(0.2 * std::sin(3 * t), 0.6 * std::cos(3 * t), -1.8 * std::sin(3 * t));
    });
    Joint::PrescribedRotation(hand.flexible, Attachment(ground, Vec3(2, 0, 0)), c,
                              [](Real t) { return Vec3(t * t, 2 * t, 2); });
    Joint::PrescribedTranslation(hand.flexible, ground, d, YAxis,
                                 [](Real t) { return Vec3(0.1 * t, 0.1, 0); });
    Joint::PrescribedRotation(hand.flexible, ground, d,
                              [](Real t) { return Vec3(0.3 * t, 0.3, 0); });
    const State state = hand.system.realizeTopology();
    // Second derivatives of the functions are differences.
    EXPECT_LT(
        compareAccelerations(model->getSystem(), model->makeInitialState(), hand.system, state),
        1e-7);
    ASSERT_EQ(model->getJoints().size(), 5u);
    EXPECT_EQ(model->getJoints()[0].name, "train");  // in the file's order
    ASSERT_EQ(model->getMotions().size(), 4u);
    EXPECT_EQ(model->getMotions()[2].name, "shake");
    EXPECT_NEAR(model->getMotions()[0].position.calcValue(0.5), 0.2 * std::sin(1.5), 1e-15);
}

TEST_F(ModelSystems, RigidOptionHoldsEveryModeAndKeepsTheRest) {
    const std::string text = R"(
bodies:
  boom: {part: bar, damping: by_frequency}
  blade: {part: stiffened, rigid: true, stiffening: false, place: {position: [1, 0, 0]}}
joints: {root: {type: ball, between: [ground, boom.A]}}
initial: {bodies: {boom: {modes: {1: 1e-3}, modal_speeds: {2: 1}}}}
)";
    const auto flexible = build(text);
    const State state = flexible->makeInitialState();
    const FlexibleBody boom = *flexible->getBodies()[0].flexible,
                       blade = *flexible->getBodies()[1].flexible;
    EXPECT_FALSE(boom.isRigid(state));
    EXPECT_TRUE(blade.isRigid(state));
    EXPECT_FALSE(blade.isStiffeningEnabled(state));
    EXPECT_EQ(boom.getModalCoordinates(state)[0], 1e-3);
    EXPECT_EQ(boom.getModalSpeeds(state)[1], 1);
    options.bodies = ModelOptions::Bodies::Rigid;
    const auto rigid = build(text);
    const State held = rigid->makeInitialState();
    EXPECT_TRUE(rigid->getBodies()[0].flexible->isRigid(held));
    EXPECT_EQ(rigid->getBodies()[0].flexible->getModalCoordinates(held).norm(), 0);
    EXPECT_EQ(held.getNU(), state.getNU());
}

TEST_F(ModelSystems, DampingRatiosMayBeGivenForEachMode) {
    const auto model = build("bodies: {a: {part: bar, damping: [0, 0.1, 0.2, 0.3, 0.4, 0.5, 1]}}");
    ByHand hand;
    const FlexibleBody a(hand.flexible, makeBar(), "a");
    const Real ratios[] = {0, 0.1, 0.2, 0.3, 0.4, 0.5, 1};
    ModalDamping(hand.flexible, a, Vector(7, ratios));
    State state = hand.system.realizeTopology();
    a.setFramePose(state, toFrame(Transform(), *makeBar()));
    EXPECT_LT(
        compareAccelerations(model->getSystem(), model->makeInitialState(), hand.system, state),
        RoundOff);
}

TEST_F(ModelSystems, PartsKeepTheModesAskedFor) {
    const auto count = [&](const std::string& keep) {
        const auto model =
            build("parts: {bar: {file: bar.h5, keep: " + keep + "}}\nbodies: {a: {part: bar}}");
        return model->getBodies()[0].flexible->getPart().omegaSquared;
    };
    const std::vector<double> all = makeBar()->omegaSquared;
    EXPECT_EQ(count("all"), all);
    EXPECT_THAT(count("{lowest: 2}"), ElementsAre(all[0], all[1]));
    EXPECT_THAT(count("[3, 1]"), ElementsAre(all[0], all[2]));
    const double between = (std::sqrt(all[3]) + std::sqrt(all[4])) / (4 * Pi);
    EXPECT_THAT(count("{below: " + std::to_string(between) + "}"),
                ElementsAre(all[0], all[1], all[2], all[3]));
    EXPECT_THAT(messageOf("parts: {bar: {file: bar.h5, keep: [8]}}\n"),
                HasSubstr("numbered from 1 to 7"));
}

}  // namespace
}  // namespace simflex::test
