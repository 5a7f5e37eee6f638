/** @file
Joints, motions and initial values of models: they hold in the assembled system. **/

#include <sstream>

#include "BuiltModel.h"
#include "simflex/body/Joint.h"
#include "simflex/body/JointGoals.h"
#include "simflex/solver/BdfIntegrator.h"

namespace simflex::test {
namespace {

using namespace SimTK;
using ::testing::AllOf;
using ::testing::HasSubstr;

const char* const kBody =
    "{mass: 1, inertia: [0.01, 0.011, 0.012], place: {position: [0.2, 0.1, -0.3]}}";

struct JointKind {
    const char* type;
    const char* keys;
    int numCoordinates;
    CoordinateAxis axis;  ///< of F, the axis that `axis` rotates
};

void PrintTo(const JointKind& kind, std::ostream* out) {
    *out << kind.type;
}

class ModelJoints : public BuiltModelTest, public ::testing::WithParamInterface<JointKind> {
protected:
    std::string joint(const std::string& more = "") const {
        return std::string("joints: {j: {type: ") + GetParam().type + ", " + GetParam().keys +
               " between: [{on: ground, position: [0.2, 0.1, -0.3], rotation: [0.3, 0.2, 0.1]}, "
               "{on: b, rotation: [0.3, 0.2, 0.1]}]" +
               more + "}}\n";
    }
};

TEST_P(ModelJoints, EveryCoordinateFollowsItsMotion) {
    for (int i = 0; i < GetParam().numCoordinates; ++i) {
        const auto model = build(std::string("bodies: {b: ") + kBody + "}\n" + joint() +
                                 "motions: {m: {joint: j, coordinate: " + std::to_string(i) +
                                 ", position: 0.3 + 0.2*t}}\n");
        State state = model->makeInitialState();
        state.setTime(0.7);
        model->getFlexibleBodies().initializeNative(state);
        const Joint& j = model->getJoints()[0].joint;
        EXPECT_NEAR(j.calcCoordinates(state)[i], 0.44, 1e-9) << i;
        EXPECT_NEAR(j.calcCoordinateDots(state)[i], 0.2, 1e-9) << i;
        EXPECT_LT(j.calcPositionErrors(state).normInf(), 1e-9) << i;
        EXPECT_EQ(model->getMotions()[0].joint.getNumEquations(), 1);
    }
}

TEST_P(ModelJoints, CoordinatesBeyondTheLastAreRefused) {
    const std::string index = std::to_string(GetParam().numCoordinates);
    EXPECT_THAT(messageOf(std::string("bodies: {b: ") + kBody + "}\n" + joint() +
                          "motions: {m: {joint: j, coordinate: " + index + ", position: t}}\n"),
                AllOf(HasSubstr("model.yaml:5:"), HasSubstr("'j' has no coordinate " + index)));
}

TEST_P(ModelJoints, InitialCoordinatesAndRatesAreThoseGiven) {
    const int count = GetParam().numCoordinates;
    std::string values, rates;
    for (int i = 0; i < count; ++i) {
        values += (i ? ", " : "") + std::to_string(0.5 + 0.1 * i);
        rates += (i ? ", " : "") + std::to_string(2 - i);
    }
    const auto model =
        build(std::string("bodies: {b: ") + kBody + "}\n" + joint() + "initial: {joints: {j: [" +
              values + "]}, rates: {j: [" + rates + "]}}\n");
    const State state = model->makeInitialState();
    const Joint& j = model->getJoints()[0].joint;
    for (int i = 0; i < count; ++i) {
        EXPECT_NEAR(j.calcCoordinates(state)[i], 0.5 + 0.1 * i, 1e-9) << i;
        EXPECT_NEAR(j.calcCoordinateDots(state)[i], 2 - i, 1e-9) << i;
    }
    EXPECT_LT(j.calcPositionErrors(state).normInf(), 1e-9);
}

TEST_P(ModelJoints, AxisLiesAlongTheDirectionGivenAndTheJointIsClosedAsPlaced) {
    const auto model =
        build(std::string("bodies: {b: ") + kBody + "}\n" + joint(", axis: [1, 2, -0.5]"));
    State state = model->makeInitialState();
    const Joint& j = model->getJoints()[0].joint;
    EXPECT_LT(j.calcPositionErrors(state).normInf(), 1e-14);
    const Rotation F = j.getFrameF().calcMotion(state).X.R(),
                   M = j.getFrameM().calcMotion(state).X.R();
    EXPECT_LT((F(GetParam().axis) - UnitVec3(1, 2, -0.5)).norm(), 1e-14);
    EXPECT_LT((F.asMat33() - M.asMat33()).norm(), 1e-14);
    EXPECT_LT(j.calcCoordinates(state).normInf(), 1e-14);
}

// For any position of M along the joint's free directions, and any carrier.
TEST_P(ModelJoints, CoordinatesWithAnAxisAreZeroAsPlaced) {
    const Vec3 direction(UnitVec3(1, 2, -0.5));
    const Vec3 across(UnitVec3(direction % Vec3(0, 0, 1)));
    const std::string type = GetParam().type;
    Vec3 way(0);
    if (type == "planar" || type == "point_in_plane") way = 0.3 * across;
    if (type == "slider" || type == "cylinder" || type == "screw" || type == "point_on_line")
        way = 0.3 * direction;
    const auto print = [](const Vec3& p) {
        return "[" + std::to_string(p[0]) + ", " + std::to_string(p[1]) + ", " +
               std::to_string(p[2]) + "]";
    };
    const std::string rigid =
        "{mass: 1, inertia: [0.01, 0.011, 0.012], place: {position: " + print(way) +
        ", rotation: [0.4, -0.3, 0.2]}}";
    const std::string bar =
        "{part: bar, place: {frame: A, at: {on: ground, position: " + print(way) +
        ", rotation: [0.4, -0.3, 0.2]}}}";
    for (const bool isFlexible : {false, true}) {
        const auto model =
            build("bodies: {b: " + (isFlexible ? bar : rigid) + "}\njoints: {j: {type: " + type +
                  ", " + GetParam().keys + " axis: [1, 2, -0.5], between: [ground, " +
                  (isFlexible ? "b.A" : "b") + "]}}\n");
        State state = model->makeInitialState();
        const Joint& j = model->getJoints()[0].joint;
        EXPECT_LT(j.calcCoordinates(state).normInf(), 1e-6);
        EXPECT_LT(j.calcPositionErrors(state).normInf(), 1e-6);
        EXPECT_TRUE(warnings.empty()) << warnings[0];
        // Assembly moves nothing, and the coordinate starts there.
        const FlexibleBodySubsystem& flexible = model->getFlexibleBodies();
        const Vec3 before = j.getFrameM().calcMotion(state).X.p();
        flexible.closeJoints(state);
        EXPECT_LT((j.getFrameM().calcMotion(state).X.p() - before).norm(), 1e-6);
        setJointCoordinates(flexible, state, {{j, 0, 0.25}});
        EXPECT_NEAR(j.calcCoordinates(state)[0], 0.25, 1e-9);
        const Vec3 moved = j.getFrameM().calcMotion(state).X.p() - before;
        if (type == "slider" || type == "point_on_line") {
            EXPECT_LT((moved - 0.25 * direction).norm(), 1e-6);
        } else if (type == "screw") {
            EXPECT_LT((moved - 0.05 * 0.25 * direction).norm(), 1e-6);
        } else if (type == "pin") {
            EXPECT_LT(moved.norm(), 1e-6);
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Kinds, ModelJoints,
                         ::testing::Values(JointKind{"pin", "", 1, ZAxis},
                                           JointKind{"slider", "", 1, XAxis},
                                           JointKind{"cylinder", "", 2, ZAxis},
                                           JointKind{"universal", "", 2, XAxis},
                                           JointKind{"planar", "", 3, ZAxis},
                                           JointKind{"screw", "pitch: 0.05,", 1, ZAxis},
                                           JointKind{"point_on_line", "", 1, ZAxis},
                                           JointKind{"point_in_plane", "", 2, ZAxis}),
                         [](const auto& kind) { return kind.param.type; });

/** Mobilizers, too, count from the placement, and move as before. **/
TEST_F(BuiltModelTest, CoordinatesOfMobilizersAreZeroAsPlaced) {
    struct Kind {
        const char *type, *keys;
        Transform X;  ///< of M in F
        std::vector<double> coordinates;
        Transform moved;  ///< moved by these coordinates
    };
    const Rotation z3(0.3, ZAxis), z5(0.5, ZAxis), x3(0.3, XAxis), y4(0.4, YAxis);
    const std::vector<Kind> kinds{
        {"pin", "", z3, {0.2}, z5},
        {"slider", "", Vec3(0.5, 0, 0), {0.2}, Vec3(0.7, 0, 0)},
        {"cylinder",
         "",
         Transform(z3, Vec3(0, 0, 0.5)),
         {0.2, 0.1},
         Transform(z5, Vec3(0, 0, 0.6))},
        {"screw",
         ", pitch: 0.5",
         Transform(z3, Vec3(0, 0, 0.15)),
         {0.2},
         Transform(z5, Vec3(0, 0, 0.25))},
        {"planar",
         "",
         Transform(z3, Vec3(0.4, -0.2, 0)),
         {0.2, 0.1, 0.3},
         Transform(z5, Vec3(0.5, 0.1, 0))},
        {"universal", "", x3 * y4, {0.2, 0.1}, Rotation(0.5, XAxis) * Rotation(0.5, YAxis)},
        {"translation", "", Vec3(0.1, 0.2, 0.3), {0.2, 0.1, 0.3}, Vec3(0.3, 0.3, 0.6)}};
    // In a tree, with separate frames.
    const Transform X_PF(Rotation(0.4, UnitVec3(1, 1, 0)), Vec3(0.1, 0, 0.2)),
        X_BM(Rotation(-0.2, XAxis), Vec3(0, 0.3, 0));
    const auto print = [](const Transform& X) {
        const Vec3 angles = X.R().convertRotationToBodyFixedXYZ();
        std::ostringstream text;
        text.precision(17);
        text << "{position: [" << X.p()[0] << ", " << X.p()[1] << ", " << X.p()[2]
             << "], rotation: [" << angles[0] << ", " << angles[1] << ", " << angles[2] << "]}";
        return text.str();
    };
    const std::string mass = "mass: 1, inertia: [0.01, 0.011, 0.012]";
    for (const Kind& kind : kinds) {
        SCOPED_TRACE(kind.type);
        std::string numbers;
        for (const double number : kind.coordinates)
            numbers += (numbers.empty() ? "" : ", ") + std::to_string(number);
        const Transform X_GP(Rotation(0.7, YAxis), Vec3(1, 2, 3));
        const std::string bodies = "bodies:\n  a: {" + mass + ", place: " + print(X_GP) +
                                   "}\n  b: {" + mass + ", mobilizer: {type: " + kind.type +
                                   kind.keys + ", parent: a, inboard: " + print(X_PF) +
                                   ", outboard: " + print(X_BM) +
                                   "}, place: " + print(X_GP * X_PF * kind.X * ~X_BM) + "}\n";
        const auto poseOf = [&](const Model& model, const State& state) {
            return ~X_PF * ~X_GP * model.getBodies()[1].mobod.getBodyTransform(state) * X_BM;
        };
        const auto expectSame = [](const Transform& found, const Transform& expected) {
            EXPECT_LT((found.p() - expected.p()).norm(), 1e-13);
            EXPECT_LT((found.R().asMat33() - expected.R().asMat33()).norm(), 1e-13);
        };
        const auto model = build(bodies);
        const State state = model->makeInitialState();
        EXPECT_LT(model->getBodies()[1].mobod.getQAsVector(state).normInf(), 1e-14);
        expectSame(poseOf(*model, state), kind.X);
        const auto moved =
            build(bodies + "initial: {bodies: {b: {coordinates: [" + numbers + "]}}}\n");
        expectSame(poseOf(*moved, moved->makeInitialState()), kind.moved);
    }
}

TEST_F(BuiltModelTest, WhatIsNotClosedAsPlacedIsToldWhateverInitialValuesJointsHave) {
    const std::string rods = R"(
bodies:
  crank: {mass: 1, inertia: [0.01, 0.01, 0.01], place: {position: [0.05, 0, 0]}}
  rod: {mass: 1, inertia: [0.01, 0.01, 0.01], place: {position: [0.26, 0.02, 0]}}
joints:
  a: {type: pin, axis: z, between: [ground, {on: crank, position: [-0.05, 0, 0]}]}
  b: {type: pin, axis: z, between: [{on: crank, position: [0.05, 0, 0]}, {on: rod, position: [-0.15, 0, 0]}]}
)";
    for (const char* initial : {"", "initial: {rates: {a: 6}}\n", "initial: {joints: {a: 0.5}}\n",
                                "initial: {joints: {a: 0.5}, rates: {a: 6}}\n"}) {
        warnings.clear();
        build(rods + initial);
        ASSERT_EQ(warnings.size(), 1u) << initial;
        EXPECT_THAT(warnings[0], HasSubstr("joint 'b' is not closed as placed"));
    }
    const std::string rack = R"(
bodies:
  pinion: {mass: 1, inertia: [1, 1, 0.01]}
  rack: {mass: 2, inertia: [1, 1, 1], place: {position: [0.5, -0.05, 0]}}
joints:
  shaft: {type: pin, axis: z, between: [ground, pinion]}
  rail: {type: slider, axis: x, between: [{on: ground, position: [0, -0.05, 0]}, rack]}
  mesh: {type: coupler, terms: [{joint: rail, coefficient: 1}, {joint: shaft, coefficient: -0.05}])";
    warnings.clear();
    build(rack + "}\n");
    EXPECT_TRUE(warnings.empty()) << warnings[0];
    build(rack + ", constant: 0.1}\n");
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_THAT(warnings[0], AllOf(HasSubstr("coupler 'mesh'"), HasSubstr("0.1")));
    warnings.clear();
    build(rack + ", constant: 0.1}\ninitial: {joints: {rail: 0.1}}\n");
    EXPECT_TRUE(warnings.empty()) << warnings[0];
}

TEST_F(BuiltModelTest, RatesThatABodyCanOnlyMeetByBendingAreSaid) {
    const std::string hung =
        "bodies: {bar: {part: bar}}\n"
        "joints:\n"
        "  a: {type: pin, axis: z, as_placed: true, between: [bar.A, ground]}\n";
    const std::string held = "  b: {type: ball, as_placed: true, between: [bar.B, ground]}\n";
    // A pinned bar rotates rigidly; one held at both ends bends.
    build(hung + "initial: {rates: {a: 1}}\n");
    EXPECT_TRUE(warnings.empty()) << warnings[0];
    build(hung + held + "initial: {rates: {a: 0}}\n");
    EXPECT_TRUE(warnings.empty()) << warnings[0];
    const auto model = build(hung + held + "initial: {rates: {a: 1}}\n");
    const FlexibleBody& bar = *model->getBodies()[0].flexible;
    EXPECT_GT(bar.getModalSpeeds(model->makeInitialState()).normInf(), 1e-3);
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_THAT(warnings[0], AllOf(HasSubstr("'bar' vibrates from the start"), HasSubstr("m/s")));
}

class ModelMechanisms : public BuiltModelTest {
protected:
    static constexpr double r = 0.1, l = 0.3;
    /** Crank, connecting rod and slider along x. **/
    const std::string sliderCrank = R"(
parameters: {r: 0.1, l: 0.3}
bodies:
  crank: {mass: 1, inertia: [0.01, 0.01, 0.01]}
  rod: {mass: 1, inertia: [0.01, 0.01, 0.01], place: {position: [r, 0, 0]}}
  piston: {mass: 1, inertia: [0.01, 0.01, 0.01], place: {position: [r + l, 0, 0]}}
joints:
  main: {type: pin, between: [ground, crank]}
  crankpin: {type: pin, between: [{on: crank, position: [r, 0, 0]}, rod]}
  gudgeon: {type: pin, between: [{on: rod, position: [l, 0, 0]}, piston]}
  guide: {type: slider, between: [ground, piston]}
)";
};

TEST_F(ModelMechanisms, InitialAngleAndRateMoveTheWholeMechanism) {
    for (const double angle : {0.7, -2.5, 3.0}) {
        const auto model = build(sliderCrank + "initial: {joints: {main: " + std::to_string(angle) +
                                 "}, rates: {main: [5]}}\n");
        const State state = model->makeInitialState();
        const double root = std::sqrt(l * l - square(r * std::sin(angle)));
        const double x = r * std::cos(angle) + root;
        const double v = -5 * r * std::sin(angle) * (1 + r * std::cos(angle) / root);
        const MobilizedBody& piston = model->getBodies()[2].mobod;
        EXPECT_NEAR(piston.getBodyOriginLocation(state)[0], x, 1e-9) << angle;
        EXPECT_NEAR(piston.getBodyOriginVelocity(state)[0], v, 1e-8) << angle;
        EXPECT_NEAR(model->getBodies()[0].mobod.getBodyAngularVelocity(state)[2], 5, 1e-9);
    }
    EXPECT_TRUE(notes.empty()) << notes[0];
    EXPECT_TRUE(warnings.empty()) << warnings[0];
}

TEST_F(ModelMechanisms, RatesAloneKeepThePlacement) {
    const auto model = build(sliderCrank + "initial: {rates: {gudgeon: -2}}\n");
    const State state = model->makeInitialState();
    // When aligned, the rod rotates at r/l of the crank's rate in the opposite sense; the pin's
    // rate is that of M in F.
    const Vec3 rod = model->getBodies()[1].mobod.getBodyAngularVelocity(state);
    EXPECT_NEAR(rod[2], 2, 1e-9);
    EXPECT_NEAR(model->getBodies()[0].mobod.getBodyAngularVelocity(state)[2], -2 * l / r, 1e-8);
    EXPECT_NEAR(model->getBodies()[2].mobod.getBodyOriginLocation(state)[0], r + l, 1e-12);
}

TEST_F(ModelMechanisms, InitialValuesThatCannotBeAreRefusedWithTheirPlace) {
    EXPECT_THAT(messageOf(sliderCrank + "initial: {joints: {gudgeon: 1.5}}\n"),
                AllOf(HasSubstr("model.yaml:"), HasSubstr("initial.joints.gudgeon"),
                      HasSubstr("cannot be assembled")));
    // Names the joint that prevents it, not the first one; names none if a joint is open anyway.
    EXPECT_THAT(messageOf(sliderCrank + "initial: {joints: {main: 0.1, guide: 3}}\n"),
                HasSubstr("initial.joints.guide: the model cannot be assembled"));
    EXPECT_THAT(messageOf(sliderCrank +
                          "  stuck: {type: weld, between: [{on: ground, position: [0, 0, 1]}, "
                          "crank]}\ninitial: {joints: {main: 0.1}}\n"),
                AllOf(HasSubstr(": joints: the model cannot be assembled, whatever 'initial' asks"),
                      HasSubstr("'stuck'")));
    EXPECT_THAT(messageOf(sliderCrank + "initial: {joints: {mian: 1}}\n"),
                AllOf(HasSubstr("mian"), HasSubstr("main")));
    EXPECT_THAT(messageOf(sliderCrank + "initial: {joints: {main: [1, 2]}}\n"),
                HasSubstr("'main' has no coordinate 1; it has one, number 0"));
    EXPECT_THAT(messageOf(sliderCrank + "initial: {bodies: {crnk: {velocity: [1, 0, 0]}}}\n"),
                HasSubstr("crank"));
}

TEST_F(ModelMechanisms, InitialAngleWorksWithFlexibleBodiesToo) {
    const auto model = build(R"(
bodies:
  arm: {part: bar, place: {frame: A, at: ground}}
  fist: {part: bar, place: {frame: A, at: arm.B}}
joints:
  shoulder: {type: pin, between: [ground, arm.A]}
  elbow: {type: pin, between: [arm.B, fist.A]}
initial: {joints: {shoulder: 0.5, elbow: -1}, rates: {shoulder: 3, elbow: 4}}
)");
    const State state = model->makeInitialState();
    for (int i = 0; i < 2; ++i) {
        const Joint& joint = model->getJoints()[size_t(i)].joint;
        EXPECT_NEAR(joint.calcCoordinates(state)[0], i ? -1 : 0.5, 1e-9);
        EXPECT_NEAR(joint.calcCoordinateDots(state)[0], i ? 4 : 3, 1e-8);
        // Nothing bends: the mechanism moves like a rigid one.
        EXPECT_LT(model->getBodies()[size_t(i)].flexible->getModalCoordinates(state).norm(), 1e-9);
    }
}

TEST_F(ModelMechanisms, VelocityIsThatOfTheOriginOfThePartsOwnCoordinates) {
    const auto model = build(R"(
bodies:
  a: {part: bar, place: {position: [1, 2, 3], rotation: [0.1, 0.2, 0.3]}}
  b: {mass: 1, inertia: [0.1, 0.1, 0.1], mobilizer: {type: translation}}
initial:
  bodies:
    a: {velocity: [1, 0, 2], angular_velocity: [0, 5, 0]}
    b: {velocity: [0, 3, 0]}
)");
    const State state = model->makeInitialState();
    const FrameMotion origin = model->findFrame("a").calcMotion(state);
    EXPECT_LT((origin.X.p() - Vec3(1, 2, 3)).norm(), 1e-14);
    EXPECT_LT((origin.V[1] - Vec3(1, 0, 2)).norm(), 1e-13);
    EXPECT_LT((origin.V[0] - Vec3(0, 5, 0)).norm(), 1e-13);
    EXPECT_LT((model->getBodies()[1].mobod.getBodyOriginVelocity(state) - Vec3(0, 3, 0)).norm(),
              1e-14);
}

TEST_F(ModelMechanisms, RodsAreAsLongAsPlacedUnlessTold) {
    const std::string text = std::string("bodies: {b: ") + kBody +
                             "}\njoints: {j: {type: rod, between: [ground, b]LENGTH}}\n";
    const auto with = [&](const std::string& length) {
        std::string copy = text;
        return copy.replace(copy.find("LENGTH"), 6, length);
    };
    const auto model = build(with(""));
    EXPECT_LT(model->getJoints()[0].joint.calcPositionErrors(model->makeInitialState()).normInf(),
              1e-15);
    const auto longer = build(with(", length: 0.5"));
    State state = longer->makeInitialState();
    EXPECT_NEAR(longer->getJoints()[0].joint.calcPositionErrors(state)[0],
                Vec3(0.2, 0.1, -0.3).norm() - 0.5, 1e-15);
}

TEST_F(ModelMechanisms, ModelsRunBitForBitAsThoseBuiltByHand) {
    const auto model = build(
        "gravity: [0, -9.81, 0]\nbodies: {a: {part: bar, place: {frame: A, at: ground}}}\n"
        "joints: {j: {type: pin, between: [ground, a.A]}}\n"
        "initial: {bodies: {a: {modes: {1: 1e-3}}}}\n");
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    FlexibleBodySubsystem flexible(system, matter);
    Force::Gravity(forces, matter, Vec3(0, -9.81, 0));
    const FlexibleBody a(flexible, makeBar(), "a");
    Joint::Pin j(flexible, matter.Ground(), a.interface("A"));
    State state = system.realizeTopology();
    const State start = model->makeInitialState();
    a.setFramePose(state, model->getBodies()[0].flexible->getFramePose(start));
    Vector xi(7, 0.0);
    xi[0] = 1e-3;
    a.setModalCoordinates(state, xi);
    const auto run = [](const MultibodySystem& ofSystem, const State& from) {
        BdfIntegrator integrator(ofSystem);
        integrator.initialize(from);
        integrator.stepTo(0.1);
        const State& now = integrator.getState();
        Vector motion(now.getNQ() + now.getNU());  // a model counts turns as well
        motion(0, now.getNQ()) = now.getQ();
        motion(now.getNQ(), now.getNU()) = now.getU();
        return motion;
    };
    const Vector built = run(model->getSystem(), start), byHand = run(system, state);
    EXPECT_EQ((built - byHand).normInf(), 0);
    EXPECT_GT((byHand(state.getNQ(), state.getNU()) - state.getU()).normInf(), 0.1);
}

TEST_F(ModelMechanisms, OpenJointsAreWarnedOfAndLooseBodiesNoted) {
    build(std::string("bodies: {b: ") + kBody + ", loose: " + kBody +
          "}\njoints: {j: {type: ball, between: [ground, b]}}\n");
    EXPECT_EQ(notes, std::vector<std::string>{
                         "body 'loose' is held by no joint or connector: it is free"});
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_THAT(warnings[0], AllOf(HasSubstr("'j'"), HasSubstr("0.374 m")));
}

TEST_F(ModelMechanisms, JointsAsPlacedTakeThePlacesAsTheirZero) {
    const std::string bodies = R"(
bodies:
  post: {mass: 1, inertia: [1, 1, 1], place: {position: [1, 0, 0], rotation: [0, 0, 30*deg]}}
  arm: {mass: 1, inertia: [1, 1, 1], place: {position: [1, 0.5, 0], rotation: [10*deg, 20*deg, 0]}}
joints:
  base: {type: weld, between: [ground, post]MORE}
  hinge: {type: pin, between: [{on: post, position: [0.1, 0, 0]}, arm], axis: yMORE}
)";
    const auto make = [&](const std::string& more) {
        std::string text = bodies;
        for (size_t at; (at = text.find("MORE")) != std::string::npos;) text.replace(at, 4, more);
        return build(text);
    };
    make("");
    ASSERT_EQ(warnings.size(), 2u);
    EXPECT_EQ(warnings[0],
              "joint 'base' is not closed as placed: its error is 1, its frames are 1 m apart and "
              "rotated relative to each other by 30 degrees; assembly will move the bodies; "
              "'as_placed: true' takes them as they are");
    warnings.clear();

    const auto model = make(", as_placed: true");
    EXPECT_TRUE(warnings.empty()) << warnings[0];
    const State placed = model->makeInitialState();
    for (const Model::JointEntry& joint : model->getJoints())
        EXPECT_LT(joint.joint.calcPositionErrors(placed).normInf(), 1e-15) << joint.name;
    EXPECT_NEAR(model->getJoints()[1].joint.calcCoordinates(placed)[0], 0, 1e-15);
    // The assembled model has not moved, and the hinge rotates about y of Ground.
    BdfIntegrator integrator(model->getSystem());
    integrator.initialize(placed);
    for (const Model::BodyEntry& body : model->getBodies()) {
        const Transform off = ~body.mobod.getBodyTransform(placed) *
                              body.mobod.getBodyTransform(integrator.getState());
        EXPECT_LT(off.p().norm() + std::abs(off.R().convertRotationToAngleAxis()[0]), 1e-12);
    }
    const auto moved = build([&] {
        std::string text = bodies;
        for (size_t at; (at = text.find("MORE")) != std::string::npos;)
            text.replace(at, 4, ", as_placed: true");
        return text + "initial: {joints: {hinge: 0.4}}\n";
    }());
    const State led = moved->makeInitialState();
    const auto poseOf = [&](const State& state) {
        return moved->getBodies()[1].mobod.getBodyRotation(state);
    };
    const Rotation turn = poseOf(led) * ~poseOf(placed);
    EXPECT_NEAR(std::abs(turn.convertRotationToAngleAxis()[0]), 0.4, 1e-9);
    EXPECT_NEAR(std::abs(turn.convertRotationToAngleAxis()[2]), 1, 1e-9);
}

}  // namespace
}  // namespace simflex::test
