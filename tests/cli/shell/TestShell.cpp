/** @file
simflex shell with commands from a pipe, a file or the command line: output against closed
forms. **/

#include <algorithm>
#include <fstream>

#include "ShellTest.h"
#include "simflex/render/Image.h"

namespace simflex {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

constexpr double kPi = 3.14159265358979323846, kGravity = 9.81;
constexpr double kPivotInertia = 2.0 / 3;  // of the pendulum: mL²/3
constexpr double kPrinted = 1e-6;          // six digits, for values below 1

TEST_F(ShellTest, AHangingPendulumSwingsAtItsNaturalFrequency) {
    writePendulum();
    ASSERT_EQ(shell("eigen\n"), 0) << err;
    EXPECT_NEAR(std::stod(readRow("1")[1]),
                std::sqrt(2 * kGravity * 0.5 / kPivotInertia) / (2 * kPi), kPrinted);
    EXPECT_EQ(readRow("1")[3], "rod");
    EXPECT_THAT(err, IsEmpty());
}

TEST_F(ShellTest, APendulumLetGoIsOnTheOtherSideAfterHalfAPeriod) {
    writePendulum();
    const double omega = std::sqrt(2 * kGravity * 0.5 / kPivotInertia);
    const double period = 4 * std::comp_ellint_1(std::sin(15 * kPi / 180)) / omega;
    ASSERT_EQ(shell("drag pivot 30*deg\nget bodies.rod.position\nget joint.pivot.angle\nrun " +
                    std::to_string(period / 2) + "\nget time\nget joint.pivot.angle\nenergy\n"),
              0)
        << err;
    const std::vector<double> place = read("bodies.rod.position");
    EXPECT_NEAR(place[0], 0.5 * std::sin(kPi / 6), kPrinted);
    EXPECT_NEAR(place[1], -0.5 * std::cos(kPi / 6), kPrinted);
    EXPECT_NEAR(readNumber("joints.pivot.angle"), -kPi / 6, 1e-4);
    EXPECT_NEAR(readNumber("time"), period / 2, 2 * kPrinted);
    EXPECT_NEAR(std::stod(readRow("total")[1]), -2 * kGravity * 0.5 * std::cos(kPi / 6), 1e-4);
    EXPECT_NEAR(std::stod(readRow("kinetic")[1]), 0, 1e-6);
}

TEST_F(ShellTest, SpeedsThatAreSetAreTheJoints) {
    writePendulum();
    ASSERT_EQ(
        shell("set joint.pivot.rate = 2\nget bodies.rod.velocity\nenergy; get joint.pivot.rate\n"),
        0)
        << err;
    EXPECT_NEAR(readNumber("joints.pivot.angle_rate"), 2, 1e-9);
    EXPECT_NEAR(read("bodies.rod.velocity")[0], 2 * 0.5, 1e-9);
    EXPECT_NEAR(std::stod(readRow("kinetic")[1]), kPivotInertia * 2 * 2 / 2, 10 * kPrinted);
    ASSERT_EQ(shell("set body.rod.angular_velocity.z 3; get joint.pivot.rate"), 0) << err;
    // The pin reduces 3 rad/s when the mass centre's velocity starts at zero.
    EXPECT_GT(readNumber("joints.pivot.angle_rate"), 0.5);
}

TEST_F(ShellTest, StaticFindsThePendulumHangingAndResetTheStart) {
    writePendulum();
    ASSERT_EQ(shell("drag pivot 1; run 0.3; static; get joint.pivot.angle\n"), 0) << err;
    EXPECT_NEAR(readNumber("joints.pivot.angle"), 0, 1e-8);
    EXPECT_THAT(out, HasSubstr("at rest after "));
    ASSERT_EQ(shell("drag pivot 1; run 0.3; reset; get joint.pivot.angle joint.pivot.rate time\n"),
              0)
        << err;
    EXPECT_NEAR(readNumber("joints.pivot.angle"), 0, 1e-12);
    EXPECT_EQ(readNumber("time"), 0);
}

TEST_F(ShellTest, StatesAreListedAndSetAndEventsTold) {
    writeModel(R"(simflex: 1
bodies: {mass: {mass: 1, inertia: [1, 1, 1]}}
states: {charge: {rate: 2, initial: 1}, smooth: {low_pass: {input: charge, time_constant: 1}}}
events: {full: {when: charge > 5, do: [{stop: true}]}}
)");
    ASSERT_EQ(shell("list states; set state.charge 4; run 1; get states.charge states.full\n"), 0)
        << err;
    EXPECT_EQ(readRow("charge")[1], "1");
    EXPECT_EQ(readRow("smooth")[1], "1") << "filters begin at their input";
    EXPECT_THAT(out, AllOf(HasSubstr("event 'full' at t = 0.5 s\n"),
                           HasSubstr("the model ended its motion at t = 0.5 s")));
    EXPECT_NEAR(readNumber("states.charge"), 5, 1e-5);
    EXPECT_EQ(readNumber("states.full"), 1);
    EXPECT_EQ(shell("set states.smooth 3\n"), 1);
    EXPECT_THAT(err, HasSubstr("states.smooth"));
}

TEST_F(ShellTest, AParameterThatIsSetBuildsTheModelAnew) {
    writePendulum();
    ASSERT_EQ(
        shell("get mass\nset parameters.L 4\neigen\nget parameters.L\nset mass 3; list bodies"), 0)
        << err;
    EXPECT_NEAR(std::stod(readRow("1")[1]), std::sqrt(1.5 * kGravity / 4) / (2 * kPi), kPrinted);
    EXPECT_THAT(out, HasSubstr("built anew with parameters.L = 4"));
    EXPECT_EQ(readNumber("parameters.L"), 4);
    EXPECT_EQ(readRow("rod")[2], "3");
    // The previous model stays if the new one is invalid.
    ASSERT_EQ(shell("set parameters.L 2\nset bodies.rod.mass -1\nget parameters.L\n",
                    "model.yaml -q --keep-going"),
              1);
    EXPECT_THAT(err, AllOf(HasSubstr("standard input:2: set: "), HasSubstr("mass")));
    EXPECT_EQ(readNumber("parameters.L"), 2);
    // The same on one line.
    ASSERT_EQ(
        shell("nonsense; set parameters.L 3; get parameters.L\n", "model.yaml -q --keep-going"), 1);
    EXPECT_EQ(readNumber("parameters.L"), 3);
}

constexpr const char* kHingedBar = R"(simflex: 1
gravity: [0, -9.81, 0]
parts:
  bar: {deck: brick.inp, interfaces: {left: LEFT, right: RIGHT}, modes: 16}
bodies:
  bar: {part: bar, damping: 0.01}
  load: {mass: 0.5, inertia: [1e-4, 1e-4, 1e-4], place: {at: bar.right}}
joints:
  hinge: {type: pin, between: [ground, bar.left], axis: z}
  grip: {type: weld, between: [bar.right, load]}
probes: {tip: {position: bar.right}}
)";

TEST_F(ShellTest, WhatDoesNotChangeTheMotionLeavesItWhereItIs) {
    writePendulum();
    ASSERT_EQ(shell("set pivot 0.5\nrun 0.3\nget time pivot joint.pivot.rate\n"
                    "set bodies.rod.color red\nget time pivot joint.pivot.rate\n"
                    "run 0.6\nget time pivot\n"),
              0)
        << err;
    EXPECT_THAT(out, HasSubstr("the model was built anew with bodies.rod.color = red; it stays "
                               "where it is, t = 0.3 s\n"));
    const double turned = readNumber("joints.pivot.angle");
    // A start may move coordinates within the constraint tolerance, 1e-10.
    out.resize(out.rfind("t = 0.6 s"));
    const double after = readNumber("pivot"), rateAfter = readNumber("joints.pivot.angle_rate");
    EXPECT_EQ(readNumber("time"), 0.3);
    out.resize(out.find("the model was built"));
    EXPECT_NEAR(readNumber("pivot"), after, kPrinted);
    EXPECT_NEAR(readNumber("joints.pivot.angle_rate"), rateAfter, 10 * kPrinted);
    ASSERT_EQ(shell("set pivot 0.5\nrun 0.6\nget pivot\n"), 0) << err;
    EXPECT_NEAR(turned, readNumber("joints.pivot.angle"), 1e-6);
    // A moving model starts anew.
    ASSERT_EQ(shell("set pivot 0.5\nrun 0.3\nset parameters.mass 3\nget time\n"), 0) << err;
    EXPECT_EQ(readNumber("time"), 0);
}

TEST_F(ShellTest, WarningsOfTheMotionAreTold) {
    writePendulum("probes: {root: {expression: sqrt(0.15 - t)}}\n");
    ASSERT_EQ(shell("run 0.1\n"), 0);
    EXPECT_EQ(err, "");
    ASSERT_EQ(shell("run 0.2 every 0.1\nrun 0.3 every 0.1\n"), 0);
    EXPECT_THAT(err,
                ::testing::MatchesRegex("simflex: warning: probe 'root' is -?nan at t = 0.2 s: "
                                        "its formula, or what it is made of, has no finite "
                                        "value there\n"));
}

TEST_F(ShellTest, DraggingTurnsFlexibleBodiesAndKeepsTheirShapes) {
    writeModel(kHingedBar);
    for (const double angle : {1., 3.}) {
        ASSERT_EQ(shell("drag hinge " + std::to_string(angle) + "\nprobe tip\nenergy\n"), 0) << err;
        EXPECT_NEAR(read("tip")[0], 0.2 * std::cos(angle), kPrinted);
        EXPECT_NEAR(read("tip")[1], 0.2 * std::sin(angle), kPrinted);
        EXPECT_LT(std::stod(readRow("strain")[1]), 1e-20);
    }
    ASSERT_EQ(shell("set hinge.rate 3; drag hinge 1; get hinge.rate bar.modal_speeds\n"), 0) << err;
    EXPECT_NEAR(readNumber("joints.hinge.angle_rate"), 3, 1e-8);
    for (const double speed : read("bodies.bar.modal_speeds")) EXPECT_NEAR(speed, 0, 1e-12);
}

TEST_F(ShellTest, DraggingDeformsWhatTheJointsHold) {
    writeModel(R"(simflex: 1
parts:
  bar: {deck: brick.inp, interfaces: {left: LEFT, right: RIGHT}, modes: 16}
bodies:
  bar: {part: bar}
joints:
  clamp: {type: weld, between: [ground, bar.left]}
  guide: {type: slider, between: [{on: ground, position: [0.2, 0, 0]}, bar.right], axis: y}
)");
    ASSERT_EQ(shell("drag guide 1e-5; list joints; energy\n"), 0) << err;
    EXPECT_NEAR(readNumber("joints.guide.displacement"), 1e-5, 1e-10);
    EXPECT_LT(std::stod(readRow("guide").back()), 1e-9);
    const double bent = std::stod(readRow("strain")[1]);
    // Half the stiffness of a beam, 12EI/L³, reduced by shear.
    const double beam = 6 * 70e9 * 0.02 * std::pow(0.03, 3) / 12 / std::pow(0.2, 3) * 1e-10;
    EXPECT_GT(bent, 0.5 * beam);
    ASSERT_EQ(shell("drag guide 1e-5; drag guide 0; energy\n"), 0) << err;
    EXPECT_LT(std::stod(readRow("strain")[1]), 1e-6 * bent);
}

TEST_F(ShellTest, FreeMotionsAreOneRowAndFallsAreNamed) {
    std::string weightless = kHingedBar;
    weightless.replace(weightless.find("-9.81"), 5, "0");
    writeModel(kHingedBar);  // level: it would fall
    EXPECT_NE(shell("eigen\n"), 0);
    EXPECT_THAT(err, HasSubstr("equilibrium: forces of up to"));
    writeModel(weightless);
    ASSERT_EQ(shell("eigen\n"), 0) << err;
    EXPECT_EQ(readRow("1")[1], "0");
    const size_t first = out.find("rigid-body mode");
    EXPECT_NE(first, std::string::npos);
    EXPECT_EQ(out.find("rigid-body mode", first + 1), std::string::npos) << out;
    EXPECT_THAT(out, Not(HasSubstr("grows")));
    writePendulum();
    ASSERT_EQ(shell("drag pivot pi\neigen\n"), 0) << err;  // upside down
    const double rate = std::sqrt(2 * kGravity * 0.5 / kPivotInertia) / (2 * kPi);
    for (const char* row : {"1", "2"}) EXPECT_NEAR(std::stod(readRow(row)[1]), rate, kPrinted);
    EXPECT_THAT(out, AllOf(HasSubstr("decays"), HasSubstr("grows")));
}

constexpr const char* kSliderCrank = R"(simflex: 1
parameters: {r: 0.06, l: 0.18}
bodies:
  crank: {mass: 0.3, inertia: [1e-4, 1e-4, 1e-4], place: {position: [r/2, 0, 0]}}
  rod: {mass: 0.5, inertia: [1e-5, 1e-3, 1e-3], place: {position: [r+l/2, 0, 0]}}
  slider: {mass: 0.2, inertia: [1e-4, 1e-4, 1e-4], place: {position: [r+l, 0, 0]}}
joints:
  bearing: {type: pin, between: [ground, {on: crank, position: [-r/2, 0, 0]}], axis: z}
  pin: {type: pin, between: [{on: crank, position: [r/2, 0, 0]}, {on: rod, position: [-l/2, 0, 0]}], axis: z}
  gudgeon: {type: pin, between: [slider, {on: rod, position: [l/2, 0, 0]}], axis: z}
  guide: {type: slider, between: [ground, slider], axis: x}
)";

TEST_F(ShellTest, DraggingTheCrankTakesTheSliderAlong) {
    writeModel(kSliderCrank);
    const double r = 0.06, l = 0.18;
    for (const double angle : {90., -150., 30.}) {
        ASSERT_EQ(shell("drag bearing " + std::to_string(angle) +
                        "*deg\nget bodies.slider.position\nlist joints\n"),
                  0)
            << err;
        const double a = angle * kPi / 180;
        EXPECT_NEAR(read("bodies.slider.position")[0],
                    r * std::cos(a) + std::sqrt(l * l - std::pow(r * std::sin(a), 2)), kPrinted);
        for (const char* joint : {"bearing", "pin", "gudgeon", "guide"})
            EXPECT_LT(std::stod(readRow(joint).back()), 1e-9) << joint;
        // Pins in one plane: three constrain each other's tilt redundantly.
        EXPECT_THAT(out, HasSubstr(" follows from "));
    }
    ASSERT_EQ(shell("drag guide 0.06\n"), 1);  // beyond its reach
    EXPECT_THAT(err,
                AllOf(HasSubstr("drag: the displacement of 'guide' cannot be brought to 0.06 m"),
                      HasSubstr("it stays at 0 m")));
}

TEST_F(ShellTest, ADrivenJointCannotBeDragged) {
    writeModel(kSliderCrank + std::string("motions: {drive: {joint: bearing, position: 20*t}}\n"));
    ASSERT_EQ(
        shell("run 0.01; drag bearing 1\nget joint.bearing.angle\n", "model.yaml -q --keep-going"),
        1);
    EXPECT_THAT(err, AllOf(HasSubstr("drag: the angle of 'bearing' cannot be brought to 1 rad"),
                           HasSubstr("motion 'drive' drives it (set motions.drive.position"),
                           HasSubstr("it stays at 0.2 rad")));
    EXPECT_NEAR(readNumber("joints.bearing.angle"), 0.2, 1e-8);
}

TEST_F(ShellTest, ModalCoordinatesThatAreSetSwing) {
    writeModel(R"(simflex: 1
parts:
  bar: {deck: brick.inp, interfaces: {left: LEFT, right: RIGHT}, modes: 16}
bodies:
  bar: {part: bar}
solver: {accuracy: 1e-9}
)");
    const std::string set = "set bodies.bar.modes.1 1e-5\n";
    ASSERT_EQ(shell(set + "list modes bar\nenergy\n"), 0) << err;
    const double omega = 2 * kPi * std::stod(readRow("1")[1]);
    EXPECT_EQ(readRow("1")[2], "1e-05");
    EXPECT_NEAR(std::stod(readRow("strain")[1]), omega * omega * 1e-10 / 2,
                1e-5 * omega * omega * 1e-10);
    ASSERT_EQ(shell(set + "run " + std::to_string(kPi / omega) +
                    " every 1\nget bodies.bar.modes.1\nset body.bar.rigid true\nlist bodies\n"),
              0)
        << err;
    EXPECT_NEAR(readNumber("bodies.bar.modes.1"), -1e-5, 2e-7);
    EXPECT_THAT(out, HasSubstr("held rigid"));
}

TEST_F(ShellTest, ErrorsNameTheLineAndProposeWhatWasMeant) {
    writePendulum("probes: {x: {position: rod, component: x}}\n");
    const std::pair<const char*, const char*> mistakes[] = {
        {"drg pivot 1", "there is no command 'drg'; did you mean 'drag'?"},
        {"drag pivto 1", "drag: there is no joint 'pivto'; did you mean 'pivot'?"},
        {"get joint.pivto.angle", "did you mean 'pivot'?"},
        {"get joint.pivot.angel", "did you mean 'joints.pivot.angle'?"},
        {"set bodies.rot.position [0, 0, 0]", "there is no body 'rot'; did you mean 'rod'?"},
        {"set bodies.rod.position [0, 0]", "'bodies.rod.position' has 3 values"},
        {"set solver.acuracy 1", "accuracy"},
        {"set mass 3kg", "mass"},
        {"set time 1", "'time' cannot be set"},
        {"probe y", "there is no probe 'y'"},
        {"probe 2*y", "'y' is not a parameter, table or function"},
        {"probe 2*", "formula"},
        {"plot x", "nothing is recorded there yet"},
        {"run -1", "has passed"},
        {"run", "no transient analysis"},
        {"drag pivot", "an argument is missing; write: drag JOINT VALUE"},
        {"list", "write: list bodies | joints | motions | modes BODY | probes"},
        {"camera", "write: camera view | orbit | zoom | follow"},
        {"reset now", "'now' is too much"},
        {"drag pivot 1 2", "'2' is too much"},
        {"drag pivot abc", "'abc' is not a number"},
        {"list modes rod", "'rod' is rigid"},
        {"list bodis", "did you mean 'bodies'?"},
        {"camera view font", "did you mean 'front'?"},
        {"contour stress", "there is no contour 'stress'"},
        {"save picture.jpg", "write NAME.png"},
        {"save /no/such/folder/a.png", "/no/such/folder/a.png"},
        {"show", "the output is no terminal: write the picture by 'save NAME.png'"},
        {"source nothing", "'nothing' cannot be read"},
        {"open nothing.yaml", "nothing.yaml"},
        {"step 0", "'0' is not a whole number from 1"},
        {"save 'a", "a quote ' is not closed"}};
    std::string commands;
    for (const auto& [command, message] : mistakes) {
        // The first error ends the session: the previous command has run, the next one has not.
        ASSERT_EQ(shell(std::string("get time\n") + command + "\nhelp quit\n"), 1) << command;
        EXPECT_THAT(err, StartsWith("simflex: standard input:2: ")) << command;
        EXPECT_THAT(err, HasSubstr(message));
        EXPECT_EQ(out, "time = 0 s\n") << command;
        commands += std::string(command) + "\n";
    }
    ASSERT_EQ(shell(commands + "get time\n", "model.yaml -q --keep-going"), 1);
    EXPECT_EQ(size_t(std::count(err.begin(), err.end(), '\n')), std::size(mistakes)) << err;
    EXPECT_THAT(out, ::testing::EndsWith("time = 0 s\n"));
}

TEST_F(ShellTest, ProbesAreReckonedWith) {
    writePendulum("probes: {at: {position: rod}, turn: {coordinate: pivot}}\n");
    ASSERT_EQ(shell("set pivot 0.5\nprobe mass*turn+t 'hypot(at.x, at.y)/at.y' turn\n"), 0) << err;
    EXPECT_THAT(out, HasSubstr("mass*turn+t = 1\n"));
    EXPECT_THAT(out, HasSubstr("turn = 0.5 rad\n"));
}

TEST_F(ShellTest, AFailedRunKeepsTheLastGoodState) {
    writePendulum(
        "tables: {ends: {x: [0, 1], y: [0, 0.1], interpolation: linear, extrapolation: refuse}}\n"
        "loads: {push: {on: rod, force: [ends(t), 0, 0]}}\n");
    ASSERT_EQ(shell("run 2\nget time\nreset\nrun 0.5\nget time\n", "model.yaml -q --keep-going"),
              1);
    EXPECT_THAT(err, StartsWith("simflex: standard input:1: run: "));
    EXPECT_EQ(std::count(err.begin(), err.end(), '\n'), 1) << err;
    const double reached = std::stod(out.substr(out.find("time = ") + 7));
    EXPECT_GT(reached, 0.5);
    EXPECT_LE(reached, 1);
    EXPECT_EQ(readNumber("time"), 0.5);
}

TEST_F(ShellTest, ScriptsCommandsAndPipesDoTheSame) {
    writePendulum("probes: {x: {position: rod, component: x}}\n");
    const std::string commands = "drag pivot 0.5\nrun 0.2\nstep 3\nprobe\nenergy\n";
    ASSERT_EQ(shell(commands), 0) << err;
    const std::string piped = out;
    EXPECT_THAT(piped, HasSubstr("x = "));
    testing::writeText(folder / "steps", "# a comment\n" + commands);
    ASSERT_EQ(shell("", "model.yaml -q --script steps"), 0) << err;
    EXPECT_EQ(out, piped);
    ASSERT_EQ(shell("", "model.yaml -q -c 'drag pivot 0.5; run 0.2; step 3; probe; energy'"), 0)
        << err;
    EXPECT_EQ(out, piped);
    ASSERT_EQ(shell("source steps\n"), 0) << err;
    EXPECT_EQ(out, piped);
    ASSERT_EQ(shell("open model.yaml\nsource steps; quit\nget time\n", "-q"), 0) << err;
    EXPECT_EQ(out.substr(out.find('\n') + 1), piped);
    ASSERT_EQ(shell("set parameters.L 2; get mass", "model.yaml -q --set parameters.mass=7"), 0)
        << err;
    EXPECT_EQ(readNumber("parameters.mass"), 7);

    testing::writeText(folder / "wrong", "get time\n\nget tim\n");
    ASSERT_EQ(shell("", "model.yaml -q --script wrong"), 1);
    EXPECT_THAT(err, StartsWith("simflex: wrong:3: get: "));
    ASSERT_EQ(shell("source wrong\n"), 1);
    EXPECT_THAT(err, StartsWith("simflex: standard input:1: source: wrong:3: get: "));
    testing::writeText(folder / "loop", "source loop\n");
    ASSERT_EQ(shell("source loop\n"), 1);
    EXPECT_THAT(err, HasSubstr("remove one of the 'source' commands"));
}

TEST_F(ShellTest, WithoutAModelItSaysHowToOpenOne) {
    ASSERT_EQ(shell("run 1\n", "-q"), 1);
    EXPECT_THAT(err, HasSubstr("there is no model yet: open MODEL.yaml"));
    ASSERT_EQ(shell("help --markdown\n", ""), 0);
    EXPECT_THAT(out, HasSubstr("| `drag JOINT VALUE` |"));
    ASSERT_NE(shell("", "nothing.yaml"), 0);
    EXPECT_THAT(err, HasSubstr("nothing.yaml"));
    EXPECT_EQ(shell("", "-q --script nothing"), 1);
    EXPECT_EQ(shell("", "--no-such-option"), 2);
}

TEST_F(ShellTest, PlotsGoToTheTerminalAndToFiles) {
    writePendulum("probes: {at: {position: rod}, turn: {coordinate: pivot}}\n");
    ASSERT_EQ(shell("drag pivot 0.5\nrun 2\nplot at.x turn from 0.5 to 1.5\nplot at into a.png\n"),
              0)
        << err;
    EXPECT_THAT(out, AllOf(HasSubstr("at.x [m]\n"), HasSubstr("turn [rad]\n"), HasSubstr("1.5 s\n"),
                           HasSubstr("\na.png\n")));
    EXPECT_THAT(out, Not(HasSubstr("\033")));
    const Image plot = Image::readPng(folder / "a.png");
    EXPECT_GT(plot.getWidth(), 300);
    ASSERT_EQ(shell("set pivot 0.5\nget pivot\nrun 2\nplot turn into turn.svg\n"), 0) << err;
    EXPECT_EQ(readNumber("joints.pivot.angle"), 0.5);
    std::ifstream drawing(folder / "turn.svg");
    const std::string text{std::istreambuf_iterator<char>(drawing), {}};
    EXPECT_THAT(text, AllOf(HasSubstr("turn [rad]"), HasSubstr("time [s]"), HasSubstr("Pendulum")));
}

TEST_F(ShellTest, PicturesFollowTheCamera) {
    writePendulum("pictures: {size: [160, 90]}\n");
    ASSERT_EQ(
        shell("save start.png\nsave again.png\ndrag pivot 1\nsave turned.png\n"
              "camera view left; camera zoom 2; exaggerate 3; contour none\nsave left.png\n"
              "camera follow rod 0.5; camera orbit 30*deg; camera orthographic\nsave near.png\n"
              "camera reset\nsave turned_again.png\n"),
        0)
        << err;
    const Image start = Image::readPng(folder / "start.png");
    EXPECT_EQ(start.getWidth(), 160);
    EXPECT_EQ(start.getHeight(), 90);
    EXPECT_TRUE(start == Image::readPng(folder / "again.png"));
    const Image turned = Image::readPng(folder / "turned.png");
    EXPECT_FALSE(start == turned);
    EXPECT_FALSE(turned == Image::readPng(folder / "left.png"));
    EXPECT_FALSE(turned == Image::readPng(folder / "near.png"));
    EXPECT_TRUE(turned == Image::readPng(folder / "turned_again.png"));
}

TEST_F(ShellTest, AngularPositionsOfTheCameraAreRefusedInDegrees) {
    writePendulum("pictures: {size: [160, 90]}\n");
    EXPECT_EQ(shell("camera view 30 0\n"), 1);
    EXPECT_THAT(err, HasSubstr("30*deg"));
    EXPECT_EQ(shell("camera orbit 90\n"), 1);
    EXPECT_THAT(err, HasSubstr("90*deg"));
    ASSERT_EQ(shell("camera view 90*deg 0\nsave a.png\ncamera view side\nsave b.png\n"), 0) << err;
    EXPECT_TRUE(Image::readPng(folder / "a.png") == Image::readPng(folder / "b.png"));
    EXPECT_EQ(shell("camera follow nobody\n"), 1);
    EXPECT_THAT(err, HasSubstr("nobody"));
}

TEST_F(ShellTest, WhatIsDrawnCanBeChosen) {
    writePendulum(
        "connectors: {pull: {type: spring, between: [{on: ground, position: [0.5, -1, 0]}, {on: "
        "rod, position: [0, -L/2, 0]}], stiffness: 10}}\n"
        "loads: {push: {on: rod, force: [0, 0, 3]}}\n"
        "pictures: {size: [160, 90]}\n");
    ASSERT_EQ(shell("save with.png\ndraw connectors off\nsave less.png\ndraw loads off; save "
                    "none.png\ndraw connectors; draw loads on\nsave again.png\ndraw "
                    "ambient_occlusion\nsave dark.png\n"),
              0)
        << err;
    const auto read = [&](const char* name) { return Image::readPng(folder / name); };
    EXPECT_FALSE(read("with.png") == read("less.png"));
    EXPECT_FALSE(read("less.png") == read("none.png"));
    EXPECT_TRUE(read("with.png") == read("again.png"));
    EXPECT_FALSE(read("with.png") == read("dark.png"));
    EXPECT_EQ(shell("draw joint\n"), 1);
    EXPECT_THAT(err, HasSubstr("did you mean 'joints'"));
}

TEST_F(ShellTest, AVideoRunsOnAndShowsTheWayThere) {
    writePendulum("pictures: {size: [160, 90], rate: 10, shadows: false}\n");
    ASSERT_EQ(
        shell("set pivot 0.5\nrun 0.1\nvideo swing.gif 0.5\nget time\nvideo slow.gif 0.2 4\n"), 0)
        << err;
    EXPECT_THAT(out, AllOf(HasSubstr("swing.gif: 6 pictures, t = 0.6 s"),
                           HasSubstr("slow.gif: 9 pictures, t = 0.8 s")));
    EXPECT_EQ(testing::readText(folder / "swing.gif").substr(0, 3), "GIF");
    EXPECT_NEAR(readNumber("time"), 0.6, 1e-12);
    // Invalid videos are refused before the run.
    EXPECT_EQ(shell("run 0.1\nvideo swing.avi 0.5\n"), 1);
    EXPECT_THAT(err, HasSubstr(".avi"));
    EXPECT_EQ(shell("video a.gif -1\n"), 1);
    EXPECT_THAT(err, HasSubstr("positive"));
}

TEST_F(ShellTest, AStateThatWasKeptIsTheSameAgain) {
    writeModel(R"(simflex: 1
gravity: [0, -9.81, 0]
bodies:
  rod: {mass: 2, inertia: [1/6, 0.001, 1/6], place: {position: [0, -0.5, 0]}}
  disk: {mass: 1, inertia: [0.01, 0.01, 0.01]}
joints:
  pivot: {type: pin, between: [ground, {on: rod, position: [0, 0.5, 0]}], axis: z}
  wheel: {type: pin, between: [ground, disk], axis: z}
initial: {rates: {wheel: 50}}
probes: {turned: {coordinate: wheel}}
solver: {accuracy: 1e-8}
)");
    ASSERT_EQ(shell("set pivot 0.5\nrun 0.3\nkeep here.state\nprobe\nrun 0.4\nget "
                    "joints.pivot.angle\nprobe\n"),
              0)
        << err;
    const double later = readNumber("joints.pivot.angle"), turnedLater = readNumber("turned");
    // Another session restores the same state and continues identically.
    ASSERT_EQ(shell("run 0.9\nrestore here.state\nget time\nprobe\nkeep same.state\n"), 0) << err;
    EXPECT_EQ(readNumber("time"), 0.3);
    EXPECT_NEAR(readNumber("turned"), 15, 1e-3);
    // Quaternions are renormalized.
    const std::vector<double> here = readNumbers("here.state"), same = readNumbers("same.state");
    ASSERT_EQ(same.size(), here.size());
    // The turn counters of both joints are reset to their angles, of which they count the turns.
    int numCounts = 0;
    for (size_t i = 0; i < here.size(); ++i) {
        if (std::abs(same[i] - here[i]) <= 1e-15 * (1 + std::abs(here[i]))) continue;
        EXPECT_NEAR(same[i], here[i], 1e-7);
        ++numCounts;
    }
    EXPECT_LE(numCounts, 2);
    ASSERT_EQ(shell("restore here.state\nrun 0.4\nget joints.pivot.angle\nprobe\n"), 0) << err;
    EXPECT_NEAR(readNumber("joints.pivot.angle"), later, 2 * kPrinted);
    EXPECT_NEAR(readNumber("turned"), turnedLater, 1e-4);

    const std::string text = testing::readText(folder / "here.state");
    const auto damage = [&](const std::string& from, const std::string& to) {
        std::string changed = text;
        changed.replace(changed.find(from), from.size(), to);
        testing::writeText(folder / "bad.state", changed);
        EXPECT_EQ(shell("restore bad.state\n"), 1);
        return err;
    };
    EXPECT_THAT(damage("simflex state 4", "simflex state 7"), HasSubstr("format 7"));
    EXPECT_THAT(damage("rod", "bar"), HasSubstr("another model"));
    EXPECT_THAT(damage("\nq ", "\nq 1 "), HasSubstr("another model"));
    EXPECT_THAT(damage("end\n", ""), HasSubstr("damaged"));
    EXPECT_THAT(damage("time 0", "time nan"), HasSubstr("time"));
    EXPECT_EQ(shell("restore none.state\n"), 1);
    EXPECT_THAT(err, HasSubstr("none.state"));
}

TEST_F(ShellTest, WhatIsOfAnotherKindIsNotReplaced) {
    writePendulum();
    testing::writeText(folder / "notes.txt", "mine");
    testing::writeText(folder / "notes.png", "mine");
    for (const std::string command : {"keep notes.txt", "save notes.png"}) {
        EXPECT_EQ(shell(command + "\n"), 1);
        EXPECT_THAT(err, HasSubstr("is there and is no "));
    }
    EXPECT_EQ(testing::readText(folder / "notes.txt"), "mine");
    EXPECT_EQ(testing::readText(folder / "notes.png"), "mine");
    ASSERT_EQ(shell("keep a.state\nkeep a.state\n"), 0) << err;
}

TEST_F(ShellTest, ListsNameWhatTheModelHas) {
    writePendulum(
        "frames: {tip: {on: rod, position: [0, -L/2, 0]}}\n"
        "probes: {x: {position: tip}}\n"
        "analyses: {swing: {type: transient, duration: 0.5, interval: 0.1}}\n");
    ASSERT_EQ(shell("list bodies; list joints; list probes; list parameters; list frames\nrun\nget "
                    "time solver.accuracy solver.method\nhistory 1\n"),
              0)
        << err;
    EXPECT_EQ(readRow("rod")[1], "rigid");
    EXPECT_EQ(readRow("pivot")[1], "Pin");
    EXPECT_EQ(readRow("pivot")[3], "rod");
    EXPECT_EQ(readRow("mass")[1], "2");
    EXPECT_EQ(readRow("tip")[1], "rod");
    EXPECT_EQ(readNumber("time"), 0.5);
    EXPECT_EQ(readNumber("solver.accuracy"), 1e-8);
    EXPECT_THAT(out, AllOf(HasSubstr("solver.method = radau (default)"), HasSubstr("history 1\n")));
}

}  // namespace
}  // namespace simflex
