/** @file
`simflex run` on models with known answers. **/

#include <filesystem>
#include <map>
#include <sstream>
#include <tuple>

#include "cli/run/RunTest.h"
#include "simflex/base/NumberText.h"
#include "simflex/cli/ProgressBar.h"
#include "simflex/part/ReducedBodyFile.h"
#include "support/PointMassPart.h"

namespace simflex {
namespace {

constexpr double kPi = 3.14159265358979323846, kGravity = 9.81;

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::readText;
using ::testing::StartsWith;

TEST_F(RunTest, PendulumReturnsAfterItsPeriod) {
    // Elliptic integral by the arithmetic-geometric mean.
    const double amplitude = 0.5, omega = std::sqrt(2 * kGravity * 0.5 / (2.0 / 3));
    double a = 1, b = std::cos(amplitude / 2);
    for (int k = 0; k < 6; ++k) {
        const double mean = (a + b) / 2;
        b = std::sqrt(a * b);
        a = mean;
    }
    const double period = 2 * kPi / (omega * a);
    char duration[40];
    std::snprintf(duration, sizeof duration, "%.17g", period);
    writeModel(makePendulum("0.5", std::string("probes: {tip: {position: {on: rod, position: [0, "
                                               "-0.5, 0]}}, swing: {coordinate: pivot}}\n"
                                               "solver: {accuracy: 1e-9}\n"
                                               "analyses: {run: {type: transient, duration: ") +
                                       duration + "}}\n"));
    ASSERT_EQ(runModel(), 0) << err;
    const Results::Analysis run = read("run");
    ASSERT_EQ(run.time.size(), 201u);
    EXPECT_TRUE(run.isComplete);
    EXPECT_DOUBLE_EQ(run.time.back(), period);
    const Results::Series &tip = find(run, "tip"), &swing = find(run, "swing");
    EXPECT_EQ(tip.column.unit, "m");
    EXPECT_EQ(tip.column.columns, (std::vector<std::string>{"x", "y", "z"}));
    // Slope 2/3 of a second-order method: errors of about 1e-9^(2/3).
    EXPECT_NEAR(tip.rows.back()[0], std::sin(amplitude), 2e-6);
    EXPECT_NEAR(tip.rows[100][0], -std::sin(amplitude), 2e-6);
    // A joint's angle is relative to the placement.
    EXPECT_NEAR(swing.rows[100][0], -2 * amplitude, 4e-6);
    EXPECT_NEAR(swing.rows[50][0], -amplitude, 4e-6);
    EXPECT_THAT(out, HasSubstr("run: transient, t = 0 to 1.6"));
    EXPECT_THAT(out, HasSubstr("tip.x [m]"));
    EXPECT_THAT(out, HasSubstr("results: model.results.h5"));
}

TEST_F(RunTest, SliderCrankFollowsItsKinematics) {
    writeModel(R"(simflex: 1
parameters: {r: 0.06, l: 0.18, speed: 20}
bodies:
  crank: {mass: 0.3, inertia: [1e-4, 1e-4, 1e-4], place: {position: [r/2, 0, 0]}}
  rod: {mass: 0.5, inertia: [1e-5, 1e-3, 1e-3], place: {position: [r+l/2, 0, 0]}}
  slider: {mass: 0.2, inertia: [1e-4, 1e-4, 1e-4], place: {position: [r+l, 0, 0]}}
joints:
  bearing: {type: pin, between: [ground, {on: crank, position: [-r/2, 0, 0]}], axis: z}
  pin: {type: point_on_line, between: [{on: crank, position: [r/2, 0, 0]}, {on: rod, position: [-l/2, 0, 0]}], axis: z}
  gudgeon: {type: pin, between: [slider, {on: rod, position: [l/2, 0, 0]}], axis: z}
  guide: {type: slider, between: [ground, slider], axis: x}
motions:
  drive: {joint: bearing, position: speed*t}
probes:
  x: {position: slider, component: x}
  v: {velocity: slider, component: x}
  a: {acceleration: slider, component: x}
  torque: {driving: drive}
  kinetic: {energy: kinetic}
  work: {energy: work}
solver: {accuracy: 1e-8}
analyses:
  run: {type: transient, duration: 0.3, interval: 0.01}
)");
    ASSERT_EQ(runModel("--csv"), 0) << err;
    const Results::Analysis run = read("run");
    const double r = 0.06, l = 0.18, speed = 20;
    for (size_t i = 0; i < run.time.size(); ++i) {
        const double angle = speed * run.time[i],
                     root = std::sqrt(l * l - std::pow(r * std::sin(angle), 2));
        const double slope =
            -r * std::sin(angle) - r * r * std::sin(angle) * std::cos(angle) / root;
        EXPECT_NEAR(find(run, "x").rows[i][0], r * std::cos(angle) + root, 1e-8);
        EXPECT_NEAR(find(run, "v").rows[i][0], speed * slope, 1e-6);
        // The drive's work is the only energy source.
        EXPECT_NEAR(find(run, "kinetic").rows[i][0] - find(run, "kinetic").rows[0][0],
                    find(run, "work").rows[i][0], 1e-4);
    }
    const std::string csv = testing::readText(folder / "model.results.run.csv");
    EXPECT_THAT(csv, HasSubstr("x [m]"));
    EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 32);
}

TEST_F(RunTest, SettingsChangeTheModelAndAreKept) {
    writeModel(makePendulum("0.1",
                            "probes: {tip: {position: rod, component: x}}\n"
                            "analyses: {run: {type: transient, duration: 0.1}}\n"));
    ASSERT_EQ(runModel("--set parameters.angle=0.2 --set analyses.run.duration=0.05 -o other.h5"),
              0)
        << err;
    const Results::Analysis run = read("run", "other.h5");
    EXPECT_NEAR(find(run, "tip").rows[0][0], 0.5 * std::sin(0.2), 1e-9);
    ASSERT_EQ(run.time.size(), 201u);
    for (int k = 0; k < 200; ++k) EXPECT_EQ(run.time[size_t(k)], k * (0.05 / 200));
    EXPECT_EQ(run.time.back(), 0.05);
    EXPECT_EQ(readResults(folder / "other.h5").header.settings,
              (std::vector<std::string>{"parameters.angle=0.2", "analyses.run.duration=0.05"}));
    EXPECT_NE(access((folder / "model.results.h5").c_str(), F_OK), 0);
    EXPECT_EQ(runModel("--set solver.acuracy=1"), 1);
    EXPECT_THAT(err, HasSubstr("did you mean 'accuracy'?\n"));
}

TEST_F(RunTest, PartsResultsAndPicturesAreTheSameInEveryLocale) {
    const std::string locale = folder / "de_DE.UTF-8";
    if (std::system(("localedef -i de_DE -f UTF-8 '" + locale + "' >/dev/null 2>&1").c_str()) != 0)
        GTEST_SKIP() << "there is no German locale";
    const std::string german = "LOCPATH='" + folder.path() + "' LC_ALL=de_DE.UTF-8 ";
    ASSERT_EQ(runProgram(german + "env printf", "%.1f 0,5"), 0) << err;
    ASSERT_EQ(out, "0,5");
    testing::writeText(folder / "bar.geo",
                       "SetFactory(\"OpenCASCADE\");\n"
                       "Box(1) = {0, -0.005, -0.01, 0.2, 0.01, 0.02};\n"
                       "Physical Volume(\"BODY\") = {1};\n"
                       "Physical Surface(\"HELD\") = {1};\nPhysical Surface(\"FREE\") = {2};\n");
    writeModel(R"(simflex: 1
gravity: [0, -9.81, 0]
parts: {bar: {file: bar.h5}}
bodies: {bar: {part: bar, damping: 0.015}}
joints: {wall: {type: pin, between: [ground, bar.held]}}
probes:
  tip: {displacement: bar.free, relative_to: bar.held}
  height: {position: bar.free, component: y}
analyses:
  run: {type: transient, duration: 0.05, interval: 2.5e-3}
  modes: {type: eigen, about: static, count: 1, pictures: true}
pictures: {size: [320, 240], rate: 40, shadows: false, folder: shots, contour: displacement_y,
           plots: [{probes: [height], title: Height}]}
)");
    const std::vector<std::string> files = {
        "bar.h5",  "model.results.h5",      "model.results.run.csv",
        "tip.svg", "shots/frame_00000.png", "shots/modes_mode_1.gif"};
    std::map<std::string, std::string> expected;
    for (const std::string& environment : {std::string("LC_ALL=C "), german}) {
        const std::string program = environment + "'" SIMFLEX_PROGRAM "'";
        ASSERT_EQ(runProgram(program,
                             "reduce bar.geo --material E=210e9,nu=0.3,rho=7850.5 "
                             "--mesh-size 0.02 -i held=HELD --master held=0,0,0 "
                             "-i free=FREE --modes 16 -o bar.h5"),
                  0)
            << err;
        ASSERT_EQ(runProgram(program, "run model.yaml --quiet --csv"), 0) << err;
        ASSERT_EQ(runProgram(program, "plot model.results.h5 tip height -o tip.svg"), 0) << err;
        for (const std::string& file : files) {
            const std::string bytes = file == "model.results.h5" ? readWithoutSeconds(file)
                                                                 : testing::readText(folder / file);
            EXPECT_FALSE(bytes.empty()) << file;
            const auto [first, isNew] = expected.emplace(file, bytes);
            EXPECT_TRUE(first->second == bytes) << file;
            std::filesystem::remove(folder / file);
        }
    }
    EXPECT_THAT(expected["model.results.run.csv"], HasSubstr("\n0.0025000"));
}

TEST_F(RunTest, SameRunGivesTheSameBytesAndWords) {
    writeModel(makePendulum("1", "analyses: {run: {type: transient, duration: 0.5}}\n"));
    ASSERT_EQ(runModel(), 0) << err;
    const std::string bytes = readWithoutSeconds("model.results.h5"), words = out;
    ASSERT_EQ(runModel("--threads 2"), 0) << err;
    EXPECT_TRUE(bytes == readWithoutSeconds("model.results.h5"));
    EXPECT_EQ(words, out);
    EXPECT_EQ(err, "");
}

TEST_F(RunTest, MasslessSpringsVibrateWithTheirFrequencies) {
    writeModel(R"(simflex: 1
parameters: {k: 100, m: 2}
gravity: [0, -9.81, 0]
bodies:
  block: {mass: m, inertia: [0.1, 0.1, 0.1], place: {position: [0, -1, 0]}}
joints:
  guide: {type: slider, between: [ground, block], axis: y}
connectors:
  spring: {type: spring, between: [ground, block], stiffness: k, free_length: 1}
probes:
  y: {position: block, component: y}
  guide_force: {reaction: guide}
  free_fall: {expression: "y + 1 - k*0"}
analyses:
  rest: {type: static}
  modes: {type: eigen, about: rest, count: 3}
  stay: {type: transient, duration: 0.2, interval: 0.1, from: rest}
  stiffness: {type: campbell, parameter: k, speeds: [100, 400], count: 1}
)");
    ASSERT_EQ(runModel(), 0) << err;
    const double sag = 2 * kGravity / 100;
    EXPECT_NEAR(find(read("rest"), "y").rows[0][0], -1 - sag, 1e-9);
    EXPECT_NEAR(find(read("rest"), "free_fall").rows[0][0], -sag, 1e-9);
    const Results::Analysis modes = read("modes");
    ASSERT_EQ(modes.frequency.at(0).size(), 1u);
    EXPECT_NEAR(modes.frequency[0][0], std::sqrt(100.0 / 2) / (2 * kPi), 1e-7);
    const Results::Analysis stay = read("stay");
    for (const std::vector<double>& row : find(stay, "y").rows) EXPECT_NEAR(row[0], -1 - sag, 1e-9);
    const Results::Analysis stiffness = read("stiffness");
    EXPECT_EQ(stiffness.speeds, (std::vector<double>{100, 400}));
    EXPECT_NEAR(stiffness.frequency.at(1).at(0), std::sqrt(400.0 / 2) / (2 * kPi), 1e-7);
    EXPECT_THAT(out, HasSubstr("rest: static equilibrium"));
    EXPECT_THAT(out, HasSubstr("modes: natural modes"));
}

TEST_F(RunTest, ASpeedThatFailsLosesNoOtherOfACampbellDiagram) {
    writeModel(R"(simflex: 1
parameters: {m: 2}
bodies:
  block: {mass: m, inertia: [0.1, 0.1, 0.1], place: {position: [0, -1, 0]}}
joints:
  guide: {type: slider, between: [ground, block], axis: y}
connectors:
  spring: {type: spring, between: [ground, block], stiffness: 100, free_length: 1}
analyses:
  over_mass: {type: campbell, parameter: m, speeds: [1, -1, 4], count: 1}
  modes: {type: eigen, about: placed, count: 1}
)");
    EXPECT_EQ(runModel("--csv"), 1);
    EXPECT_THAT(
        err, AllOf(HasSubstr("simflex: warning: over_mass: no modes at m = -1: "),
                   HasSubstr("bodies.block.mass"),
                   ::testing::EndsWith("simflex: analysis 'over_mass' has no modes at 1 of its 3 "
                                       "speeds\n")));
    EXPECT_THAT(out, AllOf(HasSubstr("\n            -1:           -\n"),
                           HasSubstr("\n  warning: no modes at m = -1: ")));
    const Results::Analysis diagram = read("over_mass");
    EXPECT_TRUE(diagram.isComplete);
    EXPECT_EQ(diagram.speeds, (std::vector<double>{1, -1, 4}));
    EXPECT_NEAR(diagram.frequency.at(0).at(0), 10 / (2 * kPi), 1e-7);
    EXPECT_TRUE(std::isnan(diagram.frequency.at(1).at(0)));
    EXPECT_NEAR(diagram.frequency.at(2).at(0), 5 / (2 * kPi), 1e-7);
    // The analyses after it still run.
    EXPECT_NEAR(read("modes").frequency.at(0).at(0), std::sqrt(50.0) / (2 * kPi), 1e-7);
    // With no modes at any speed: an error.
    EXPECT_EQ(runModel("--set analyses.over_mass.speeds=[-1,-2]"), 1);
    EXPECT_THAT(err, HasSubstr("there are no modes at any of the 2 speeds; at the first, "));
}

/** Returns a hub on a bushing with a spinning disc made of two welded pieces. **/
std::string makeRotor(const std::string& analyses) {
    return R"(simflex: 1
parameters: {speed: 300, out_of_round: 0}
bodies:
  hub: {mass: 1, inertia: [0.01, 0.01, 0.01]}
  first: {mass: 1, center_of_mass: [0, 0.05, 0], inertia: [0.0175, 0.01, 0.0075 + out_of_round]}
  second: {mass: 1, center_of_mass: [0, -0.05, 0], inertia: [0.0175, 0.01, 0.0075]}
joints:
  bearing: {type: pin, between: [hub, first], axis: x}
  glue: {type: weld, between: [first, second]}
connectors:
  mount: {type: bushing, between: [ground, hub], stiffness: [50, 80, 80, 1e4, 2e4, 3e4]}
initial:
  bodies:
    first: {angular_velocity: [speed, 0, 0]}
    second: {angular_velocity: [speed, 0, 0]}
analyses:
)" + analyses;
}

/** Returns its frequencies [Hz], ascending: of the hub alone about the axis, of all along three
axes, and, with I = 0.03, I3 = 0.04 kg m^2, those of backward and forward whirl, I w^2 -+ I3 speed w
= 80 N m.
**/
std::vector<double> calcRotorFrequencies(double speed) {
    const double turn = 0.04 * speed, root = std::sqrt(turn * turn + 4 * 0.03 * 80);
    std::vector<double> rates{std::sqrt(50 / 0.01),       std::sqrt(1e4 / 3),
                              std::sqrt(2e4 / 3),         std::sqrt(3e4 / 3),
                              (root - turn) / (2 * 0.03), (root + turn) / (2 * 0.03)};
    std::sort(rates.begin(), rates.end());
    for (double& rate : rates) rate /= 2 * kPi;
    return rates;
}

TEST_F(RunTest, ARotorOfPiecesWhirlsAsInClosedForm) {
    writeModel(makeRotor(
        "  over_speed: {type: campbell, parameter: speed, speeds: [0, 100, 300], count: 6}\n"
        "  modes: {type: eigen, about: start, count: 6}\n"));
    ASSERT_EQ(runModel(), 0) << err;
    const Results::Analysis diagram = read("over_speed");
    const auto expectRotor = [](std::vector<double> found, double speed) {
        std::sort(found.begin(), found.end());
        const std::vector<double> expected = calcRotorFrequencies(speed);
        ASSERT_EQ(found.size(), expected.size());
        for (size_t k = 0; k < expected.size(); ++k)
            EXPECT_NEAR(found[k], expected[k], 1e-7 * expected[k]) << k << " at " << speed;
    };
    for (size_t k = 0; k < diagram.speeds.size(); ++k)
        expectRotor(diagram.frequency.at(k), diagram.speeds[k]);
    expectRotor(read("modes").frequency.at(0), 300);
}

TEST_F(RunTest, ARotorThatAMotionDrivesTurnsAtItsSpeedInACampbellDiagram) {
    std::string model = makeRotor(
        "  over_speed: {type: campbell, parameter: speed, speeds: [0, 100, 300], count: 6}\n"
        "  modes: {type: eigen, about: start, count: 6}\n");
    const size_t initial = model.find("initial:\n"), analyses = model.find("analyses:\n");
    model.replace(initial, analyses - initial,
                  "initial: {start: steady}\n"
                  "motions: {drive: {joint: bearing, position: speed*t}}\n");
    writeModel(model);
    ASSERT_EQ(runModel(), 0) << err;
    // A disc driven at a given rate rotates with the hub: 0.01 + 0.04 kg m^2 on 50 N m.
    const auto expectDriven = [](std::vector<double> found, double speed) {
        std::vector<double> expected = calcRotorFrequencies(speed);
        *std::min_element(expected.begin(), expected.end(), [](double a, double b) {
            const double alone = std::sqrt(50 / 0.01) / (2 * kPi);
            return std::abs(a - alone) < std::abs(b - alone);
        }) = std::sqrt(50 / 0.05) / (2 * kPi);
        std::sort(expected.begin(), expected.end());
        std::sort(found.begin(), found.end());
        ASSERT_EQ(found.size(), expected.size());
        for (size_t k = 0; k < expected.size(); ++k)
            EXPECT_NEAR(found[k], expected[k], 1e-7 * expected[k]) << k << " at " << speed;
    };
    const Results::Analysis diagram = read("over_speed");
    for (size_t k = 0; k < diagram.speeds.size(); ++k)
        expectDriven(diagram.frequency.at(k), diagram.speeds[k]);
    expectDriven(read("modes").frequency.at(0), 300);
}

TEST_F(RunTest, AMotionThatDivergesInACampbellDiagramIsNoFrequency) {
    // On a rotating guide λ² = Ω² − k/m.
    writeModel(R"(simflex: 1
parameters: {speed: 0}
bodies:
  hub: {mass: 1, inertia: [1, 1, 1]}
  block: {mass: 1, inertia: [1, 1, 1]}
joints:
  bearing: {type: pin, axis: z, between: [ground, hub]}
  guide: {type: slider, axis: x, between: [hub, block]}
motions: {drive: {joint: bearing, position: speed*t}}
connectors:
  one: {type: spring, between: [{on: hub, position: [1, 0, 0]}, block], stiffness: 50, free_length: 1}
  other: {type: spring, between: [{on: hub, position: [-1, 0, 0]}, block], stiffness: 50, free_length: 1}
initial: {start: steady}
analyses: {over_speed: {type: campbell, parameter: speed, speeds: [0, 6, 8, 12], count: 1}}
)");
    ASSERT_EQ(runModel("-q"), 0) << err;
    EXPECT_THAT(err, HasSubstr("over_speed: the motion is unstable at speed = 12: a motion that "
                               "does not oscillate grows by a factor of e in 0.151 s"));
    const Results::Analysis diagram = read("over_speed");
    for (const size_t k : {0, 1, 2})
        EXPECT_NEAR(diagram.frequency.at(k).at(0),
                    std::sqrt(100 - diagram.speeds[k] * diagram.speeds[k]) / (2 * kPi), 1e-7);
    EXPECT_NEAR(2 * kPi * diagram.frequency.at(3).at(0), std::sqrt(44), 1e-6);
    EXPECT_NEAR(diagram.dampingRatio.at(3).at(0), -1, 1e-9);
    ASSERT_EQ(runModel(), 0) << err;
    EXPECT_THAT(out, ::testing::ContainsRegex("12: +unstable"));
    ASSERT_EQ(runModel("--set analyses.over_speed.speeds=[0,6,8]"), 0) << err;
    EXPECT_THAT(err, Not(HasSubstr("unstable")));
    ASSERT_EQ(runModel("--set analyses.over_speed.speeds=[0,6,8] "
                       "--set analyses.over_speed.count=5"),
              0)
        << err;
    EXPECT_EQ(read("over_speed").frequency.at(0).size(), 1u);
    EXPECT_THAT(err + out, HasSubstr("count: 5 branches are asked for, there are 1"));
}

TEST_F(RunTest, AnUnstableEquilibriumIsWarnedOf) {
    writeModel(makePendulum("pi", "analyses: {rest: {type: static}}\n"));
    ASSERT_EQ(runModel(), 0) << err;
    EXPECT_THAT(err, HasSubstr("simflex: warning: rest: the equilibrium is unstable: 'rod' falls "
                               "away from it at the least disturbance; begin elsewhere"));
    ASSERT_EQ(runModel("--set parameters.angle=3"), 0) << err;
    EXPECT_THAT(err, Not(HasSubstr("unstable")));
}

TEST_F(RunTest, AnalysesThatBeginAtAnUnstableEquilibriumSayIt) {
    const std::string said =
        ": where it begins, the equilibrium is unstable: 'rod' falls away from it";
    writeModel(makePendulum("pi",
                            "analyses:\n"
                            "  rest: {type: static}\n"
                            "  run: {type: transient, duration: 0.01, from: static}\n"
                            "  modes: {type: eigen, about: static}\n"));
    ASSERT_EQ(runModel("-q"), 0) << err;
    EXPECT_THAT(err, HasSubstr("warning: run" + said));
    EXPECT_THAT(err, HasSubstr("warning: modes" + said));
    EXPECT_THAT(read("run").warnings, ::testing::Contains(HasSubstr("is unstable")));
    // The warning belongs to the analysis itself if it runs; if it is left out, the dependent one
    // reports it.
    ASSERT_EQ(runModel("-q --set analyses.run.from=rest --set analyses.modes.about=rest"), 0)
        << err;
    EXPECT_THAT(err, HasSubstr("warning: rest: the equilibrium is unstable"));
    EXPECT_THAT(err, Not(HasSubstr("where it begins")));
    ASSERT_EQ(runModel("-q --only run --set analyses.run.from=rest -o run.h5"), 0) << err;
    EXPECT_THAT(err, HasSubstr("warning: run" + said));
    ASSERT_EQ(
        runModel(
            "-q --only run --set analyses.run.from=start --set initial.start=static -o start.h5"),
        0)
        << err;
    EXPECT_THAT(err, HasSubstr("warning: run" + said));
    ASSERT_EQ(runModel("-q --set parameters.angle=3"), 0) << err;
    EXPECT_THAT(err, Not(HasSubstr("unstable")));
}

TEST_F(RunTest, FreePlayHasNoFrequencyAndWhatJustTouchesIsRefused) {
    writeModel(R"(simflex: 1
parameters: {gap: 2e-4, k: 1e6}
bodies:
  mass: {mass: 1, inertia: [0.01, 0.01, 0.01], mobilizer: {type: slider, parent: ground}}
probes: {x: {position: mass, component: x}}
loads:
  stops: {on: mass, force: ["-k*(max(x - gap, 0) + min(x + gap, 0)) - 100*x", 0, 0]}
analyses:
  modes: {type: eigen}
  linear: {type: linear, inputs: [parameters.k]}
)");
    for (const char* gap : {"1e-8", "2e-4", "4e-4", "0.05"}) {
        ASSERT_EQ(runModel(std::string("--only modes --set parameters.gap=") + gap), 0) << err;
        EXPECT_NEAR(read("modes").frequency.at(0).at(0), 10 / (2 * M_PI), 1e-6) << gap;
    }
    EXPECT_EQ(runModel("--only modes --set parameters.gap=0 -o stiff.h5"), 0) << err;
    EXPECT_NEAR(readResults(folder / "stiff.h5").analyses.at(0).frequency.at(0).at(0),
                std::sqrt(1e6 + 100) / (2 * M_PI), 1e-3);
    writeModel(R"yaml(simflex: 1
bodies:
  mass: {mass: 1, inertia: [0.01, 0.01, 0.01], mobilizer: {type: slider, parent: ground}}
probes: {x: {position: mass, component: x}}
loads:
  push: {on: mass, force: [0, 0, 0]}
  stop: {on: mass, force: ["-1e6*max(x, 0)", 0, 0]}
analyses:
  modes: {type: eigen}
  linear: {type: linear, inputs: [loads.push.force.x]}
  response: {type: frequency_response, inputs: [loads.push.force.x], frequencies: [1, 2]}
)yaml");
    ;
    for (const char* analysis : {"modes", "linear", "response"}) {
        EXPECT_EQ(runModel(std::string("--only ") + analysis), 1) << analysis;
        EXPECT_THAT(err, HasSubstr("(0 N/m one way, 1e+06 N/m the other) has a kink exactly here"))
            << analysis;
    }
}

TEST_F(RunTest, ASpeedWithoutSteadyMotionIsRefusedWithTheReason) {
    writeModel(makeRotor(
        "  over_speed: {type: campbell, parameter: speed, speeds: [0, 300], count: 6}\n"));
    EXPECT_EQ(runModel("--set parameters.out_of_round=0.008"), 1);
    EXPECT_THAT(err,
                HasSubstr("simflex: warning: over_speed: no modes at speed = 300: there are no "
                          "natural modes about this motion: the equations of small motions "
                          "change as the motion goes on: a natural frequency of "));
    EXPECT_GT(read("over_speed").frequency.at(0).at(0), 1);  // modes exist at rest
}

TEST_F(RunTest, WhatDoesNotOscillateIsNoFrequency) {
    // Upside down: lambda^2 = mgl/J = 14.715 1/s^2, both signs.
    writeModel(makePendulum("pi", "analyses: {modes: {type: eigen, about: placed}}\n"));
    ASSERT_EQ(runModel(), 0) << err;
    EXPECT_THAT(out, AllOf(HasSubstr("UNSTABLE, grows by a factor of e in 0.2607 s"),
                           HasSubstr("decays by a factor of e in 0.2607 s")));
    // Almost weightless, next to a vibration of 10 kHz.
    writeModel(makePendulum("pi", R"(connectors:
  spring: {type: spring, between: [ground, block], stiffness: 4e9, free_length: 1}
analyses: {modes: {type: eigen, about: placed}}
)"));
    std::string model = readText(folder / "model.yaml");
    model.replace(model.find("-9.81"), 5, "-9.81e-9");
    model.replace(model.find("joints:\n"), 8,
                  "  block: {mass: 1, inertia: [1, 1, 1], place: {position: [0, -1, 0]}}\n"
                  "joints:\n  guide: {type: slider, between: [ground, block], axis: y}\n");
    writeModel(model);
    ASSERT_EQ(runModel(), 0) << err;
    EXPECT_THAT(out, AllOf(HasSubstr(" 1-2 "), HasSubstr("rigid-body mode"),
                           Not(HasSubstr("oscillation"))));
    EXPECT_EQ(read("modes").frequency.at(0).size(), 3u);
}

TEST_F(RunTest, AnalysesBeginWhereOthersEnd) {
    writeModel(makePendulum("1", R"(probes: {tip: {position: rod}, rate: {rate: pivot}}
solver: {accuracy: 1e-9}
analyses:
  whole: {type: transient, duration: 0.4}
  first: {type: transient, duration: 0.3}
  second: {type: transient, duration: 0.1, from: first}
  rest: {type: static, from: second}
  modes: {type: eigen, about: rest, count: 1}
)"));
    ASSERT_EQ(runModel(), 0) << err;
    const Results::Analysis whole = read("whole"), second = read("second");
    EXPECT_DOUBLE_EQ(second.time.front(), 0.3);
    EXPECT_DOUBLE_EQ(second.time.back(), 0.4);
    for (size_t k = 0; k < 2; ++k)
        EXPECT_NEAR(find(whole, "tip").rows.back()[k], find(second, "tip").rows.back()[k], 2e-6);
    EXPECT_NEAR(read("modes").frequency.at(0).at(0),
                std::sqrt(2 * kGravity * 0.5 / (2.0 / 3)) / (2 * kPi), 1e-7);
    writeModel(makePendulum("1",
                            "analyses: {a: {type: transient, duration: 1, from: b}, b: {type: "
                            "static, from: a}}\n"));
    EXPECT_EQ(runModel(), 1);
    EXPECT_THAT(err, HasSubstr("analysis 'b' is not above 'a'"));
}

TEST_F(RunTest, MessagesNameTheModelsBodies) {
    // Two contradictory motions.
    writeModel(makePendulum("1", R"(motions:
  drive: {joint: pivot, position: 0.1*t}
  shake: {between: [ground, {on: rod, position: [0, -0.5, 0]}], axis: x, position: 1 + t}
analyses: {run: {type: transient, duration: 1}}
)"));
    EXPECT_EQ(runModel(), 1);
    EXPECT_THAT(err, StartsWith("simflex: the joints cannot be assembled at t = 0 s: joint 'pivot' "
                                "keeps an error of "));
    EXPECT_THAT(err, HasSubstr("equation 1 of 'drive' follows from 'pivot', 'shake'. Leave one of "
                               "these joints or motions out, or make their frames agree\n"));
}

TEST_F(RunTest, CheckListsTheModelAndRunsNothing) {
    writeModel(makePendulum("1", "analyses: {run: {type: transient, duration: 0.5}}\n"));
    ASSERT_EQ(runModel("--check"), 0) << err;
    EXPECT_THAT(out, HasSubstr("body rod: rigid, 2 kg"));
    EXPECT_THAT(out, HasSubstr("joint pivot: Pin of ground and rod, 5 equations"));
    EXPECT_THAT(out, HasSubstr("analysis run: transient"));
    EXPECT_THAT(out, HasSubstr("model.results.h5"));
    EXPECT_NE(access((folder / "model.results.h5").c_str(), F_OK), 0);
}

TEST_F(RunTest, AModelWithoutAnalysesSaysWhatToAdd) {
    writeModel(makePendulum("1", ""));
    EXPECT_EQ(runModel(), 1);
    EXPECT_THAT(err, HasSubstr("analyses:\n  run: {type: transient, duration: 1}"));
}

TEST_F(RunTest, OnlyChoosesAnalyses) {
    writeModel(makePendulum("1",
                            "analyses:\n"
                            "  first: {type: transient, duration: 0.1}\n"
                            "  second: {type: transient, duration: 0.1}\n"));
    ASSERT_EQ(runModel("--only second"), 0) << err;
    ASSERT_EQ(readResults(folder / "model.results.h5").analyses.size(), 1u);
    EXPECT_EQ(runModel("--only secund"), 1);
    EXPECT_THAT(err, HasSubstr("there is no analysis 'secund'; did you mean 'second'?\n"));
}

TEST_F(RunTest, FilesThatAreNoResultsAreNotReplaced) {
    writeModel(makePendulum("1", "analyses: {run: {type: transient, duration: 0.1}}\n"));
    testing::writeText(folder / "precious.h5", "years of work");
    EXPECT_EQ(runModel("-o precious.h5"), 1);
    EXPECT_THAT(err, HasSubstr("not replaced"));
    EXPECT_EQ(testing::readText(folder / "precious.h5"), "years of work");
    ASSERT_EQ(runModel(), 0) << err;
    EXPECT_EQ(runModel(), 0) << "a result file is replaced: " << err;
}

TEST_F(RunTest, AFailingAnalysisNamesItselfAndKeepsItsRows) {
    // The load is NaN from t = 0.05 s on.
    writeModel(
        makePendulum("1",
                     "loads: {push: {on: rod, force: ['if(t < 0.05, 1, 1e300*1e300)', 0, 0]}}\n"
                     "analyses: {run: {type: transient, duration: 0.1, interval: 0.01}}\n"));
    EXPECT_EQ(runModel(), 1);
    EXPECT_THAT(err, StartsWith("simflex: analysis 'run': model.yaml:11:34: loads.push.force.0: "
                                "'if(t < 0.05, 1, 1e300*1e300)' has no finite value at t = 0.05"));
    EXPECT_THAT(err, HasSubstr("; the rows before stay in 'model.results.h5'\n"));
    const Results::Analysis run = read("run");
    EXPECT_FALSE(run.isComplete);
    EXPECT_GE(run.time.size(), 5u);
    EXPECT_LE(run.time.size(), 6u);
}

/** Returns a bar of 0.2 m on a wall, with its free end on a ball joint at a different position. **/
std::string makeStretchedBar(const std::string& end) {
    return R"(simflex: 1
parts: {bar: {deck: bar.inp, interfaces: {root: LEFT, tip: RIGHT}, modes: 14}}
bodies: {bar: {part: bar}}
joints:
  wall: {type: weld, between: [ground, bar.root]}
  knot: {type: ball, between: [{on: ground, position: )" +
           end + R"(}, bar.tip]}
solver: {accuracy: 1e-3}
analyses:
  rest: {type: static}
  run: {type: transient, duration: 1e-5}
)";
}

TEST_F(RunTest, BodiesBentBeyondWhatModesDescribeAreNamed) {
    testing::Brick brick;
    brick.type = "C3D20R";
    testing::writeText(folder / "bar.inp", brick.text());
    writeModel(makeStretchedBar("[0.2, 0, 0]"));
    ASSERT_EQ(runModel(), 0) << err;
    EXPECT_EQ(err, "");
    EXPECT_THAT(out, Not(HasSubstr("warning")));

    // Ends that are 0.1 m too far apart: 0.05 m each, for a part of 0.2 m. No assembly may stretch
    // it so far.
    writeModel(makeStretchedBar("[0.3, 0, 0]"));
    for (const char* arguments : {"--check", ""}) {
        EXPECT_EQ(runModel(arguments), 1);
        EXPECT_THAT(err,
                    AllOf(HasSubstr("'bar' beyond its linear range: node "),
                          HasSubstr("is displaced by 0.05"), HasSubstr(" % of the part's size"),
                          HasSubstr("up to 10 %"), HasSubstr("joint 'knot' is furthest")));
    }

    // Loads may, with a warning.
    std::string pulled = makeStretchedBar("[0.2, 0, 0]");
    const size_t knot = pulled.find("  knot"), next = pulled.find("solver");
    pulled.replace(knot, next - knot, "loads: {pull: {on: bar.tip, force: [\"FORCE\", 0, 0]}}\n");
    const size_t force = pulled.find("\"FORCE\"");
    writeModel(pulled.replace(force, 7, "2e7"));
    ASSERT_EQ(runModel("--only rest"), 0) << err;
    const auto named = AllOf(HasSubstr("'bar' at t = 0 s: node "), HasSubstr("is displaced by "),
                             HasSubstr(" % of the part's size"), HasSubstr("up to 10 %"));
    EXPECT_THAT(err, AllOf(HasSubstr("warning: rest: 'bar'"), named));
    EXPECT_THAT(out, AllOf(HasSubstr("  warning: "), named));
}

TEST_F(RunTest, WishesAreCheckedBeforePartsAreReduced) {
    testing::writeText(folder / "bar.inp", testing::Brick().text());
    writeModel(makeStretchedBar("[0.2, 0, 0]"));
    const auto isReduced = [&] { return access((folder / "cache").c_str(), F_OK) == 0; };
    EXPECT_EQ(runModel("--only rset"), 1);
    EXPECT_THAT(err, AllOf(HasSubstr("no analysis 'rset'"), HasSubstr("'rest'")));
    EXPECT_EQ(runModel("-o nested/x.h5"), 1);
    EXPECT_THAT(err, HasSubstr("no folder 'nested'"));
    EXPECT_EQ(runModel("-o ."), 1);
    EXPECT_THAT(err, HasSubstr("is a folder"));
    EXPECT_EQ(runModel("-o run.csv"), 1);
    EXPECT_THAT(err, AllOf(HasSubstr("name it .h5"), HasSubstr("--csv")));
    testing::writeText(folder / "letter.h5", "Dear Sir");
    EXPECT_EQ(runModel("-o letter.h5"), 1);
    EXPECT_THAT(err, HasSubstr("letter.h5"));
    EXPECT_EQ(testing::readText(folder / "letter.h5"), "Dear Sir");
    EXPECT_FALSE(isReduced());
    EXPECT_EQ(runModel(), 0) << err;
    EXPECT_TRUE(isReduced());
}

TEST_F(RunTest, FormulasWithoutValueAreNamedOnce) {
    writeModel(makePendulum("0.5", R"(probes:
  swing: {coordinate: pivot}
  root: {expression: sqrt(swing + 0.5)}
analyses: {run: {type: transient, duration: 1.6}}
)"));
    ASSERT_EQ(runModel("--csv"), 0) << err;
    const std::string what = "probe 'root' is nan at t = ";
    ASSERT_THAT(err, HasSubstr(what));
    EXPECT_EQ(err.find(what), err.rfind(what));
    // It is zero where the rod hangs straight, a quarter period after the start.
    const double time = std::stod(err.substr(err.find(what) + what.size()));
    const Results::Analysis run = read("run");
    size_t first = 0;
    while (find(run, "swing").rows[first][0] >= -0.5) ++first;
    EXPECT_NEAR(time, run.time[first], 1e-5);
    EXPECT_THAT(out, Not(HasSubstr("-nan")));
    EXPECT_THAT(testing::readText(folder / "model.results.run.csv"), Not(HasSubstr("-nan")));
}

TEST_F(RunTest, IntervalsLongerThanTheRunAreRefused) {
    // The extremes of two rows are not those of the motion.
    writeModel(
        makePendulum("0", "analyses: {run: {type: transient, duration: 0.1, interval: 1}}\n"));
    ASSERT_EQ(runProgram("'" SIMFLEX_PROGRAM "'", "run model.yaml -q"), 1);
    EXPECT_THAT(err, HasSubstr("analyses.run.interval: 1 s is longer than the duration, 0.1 s"));
}

TEST_F(RunTest, SweepsAreRefusedBeforeResultsAreReplaced) {
    writeModel(makePendulum("0.5", R"(analyses:
  run: {type: transient, duration: 0.1}
  rest: {type: static}
  sweep: {type: sweep, analysis: run, parameters: {angle: [0.1, 0.2]}}
)"));
    ASSERT_EQ(runModel(), 0) << err;
    const std::string bytes = testing::readText(folder / "model.results.h5");
    EXPECT_EQ(runModel("--only sweep"), 1);
    EXPECT_THAT(err, AllOf(HasSubstr("model.yaml:14:"), HasSubstr("simflex sweep model.yaml")));
    EXPECT_TRUE(bytes == testing::readText(folder / "model.results.h5"));
}

TEST_F(RunTest, OnlyKeepsTheResultsOfOtherAnalyses) {
    const std::string analyses = R"(analyses:
  rest: {type: static}
  run: {type: transient, duration: 0.1, interval: 0.01}
  modes: {type: eigen, about: static}
  swing: {type: transient, from: run, duration: 0.1}
)";
    writeModel(makePendulum("0.5", analyses));
    ASSERT_EQ(runModel(), 0) << err;
    const Results before = readResults(folder / "model.results.h5");
    ASSERT_EQ(runModel("--only modes"), 0) << err;
    EXPECT_THAT(out, AllOf(HasSubstr("modes: natural modes"), Not(HasSubstr("transient"))));
    const auto check = [&](const std::string& again) {
        const Results after = readResults(folder / "model.results.h5");
        ASSERT_EQ(after.analyses.size(), 4u);
        for (const Results::Analysis& analysis : before.analyses) {
            const Results::Analysis kept = read(analysis.name);
            EXPECT_TRUE(kept.isComplete);
            EXPECT_EQ(kept.time, analysis.time);
            EXPECT_EQ(kept.q, analysis.q);
            EXPECT_EQ(kept.u, analysis.u);
            EXPECT_EQ(kept.frequency, analysis.frequency);
            if (analysis.name != again) {
                EXPECT_EQ(kept.statistics, analysis.statistics);
            }
            ASSERT_EQ(kept.probes.size(), analysis.probes.size());
            for (size_t k = 0; k < kept.probes.size(); ++k)
                EXPECT_EQ(kept.probes[k].rows, analysis.probes[k].rows);
        }
    };
    check("modes");
    // Other analyses continue from the stored one.
    ASSERT_EQ(runModel("--only swing"), 0) << err;
    check("swing");

    // Results of a different model must not go into the same file.
    const std::string bytes = testing::readText(folder / "model.results.h5");
    EXPECT_EQ(runModel("--only modes --set angle=0.6 "), 1);
    EXPECT_TRUE(bytes == testing::readText(folder / "model.results.h5"));
    ASSERT_EQ(runModel("--only swing --set parameters.angle=0.6"), 0) << err;
    EXPECT_EQ(err,
              "simflex: warning: the results of rest, run, modes in 'model.results.h5' are out of "
              "date: it was run with other settings (then: none; now: "
              "parameters.angle=0.6). They stay in 'model.results.h5.before-1' until they have "
              "been done anew; this run does run\n");
    EXPECT_TRUE(bytes == testing::readText(folder / "model.results.h5.before-1/model.results.h5"));
    EXPECT_EQ(readResults(folder / "model.results.h5").analyses.size(), 2u);
    // The analysis that provides the start runs wherever its results are missing.
    ASSERT_EQ(runModel("--only swing --set parameters.angle=0.6 -o other.h5"), 0) << err;
    EXPECT_EQ(read("swing").q, read("swing", "other.h5").q);
    EXPECT_EQ(read("run").q, read("run", "other.h5").q);
    EXPECT_NE(read("run").q, before.findAnalysis("run").q);
}

TEST_F(RunTest, WarningsAreToldWithQuietAndKeptWithTheResults) {
    writeModel(makePendulum("0.5", R"(
probes: {root: {expression: sqrt(0.05 - t)}}
analyses:
  rest: {type: static}
  run: {type: transient, from: rest, duration: 0.1, interval: 0.01}
initial: {rates: {pivot: 3}}
)"));
    ASSERT_EQ(runModel(), 0) << err;
    const std::string lost =
        "begins at static equilibrium, where everything is at rest: the model's initial velocities "
        "have no effect";
    const std::vector<std::string> warnings = read("run").warnings;
    ASSERT_EQ(warnings.size(), 2u);
    EXPECT_EQ(warnings[0], lost);
    EXPECT_THAT(warnings[1], HasSubstr("probe 'root' is "));
    EXPECT_EQ(err, "simflex: warning: run: " + warnings[0] +
                       "\nsimflex: warning: run: " + warnings[1] + "\n");
    EXPECT_THAT(out, HasSubstr("  warning: " + lost + "\n"));
    // Warnings persist when the file is resumed or kept.
    ASSERT_EQ(runModel("--resume"), 0) << err;
    EXPECT_EQ(read("run").warnings, warnings);
    EXPECT_THAT(out, HasSubstr("  warning: " + lost + "\n"));
    ASSERT_EQ(runModel("--only rest"), 0) << err;
    EXPECT_EQ(read("run").warnings, warnings);

    // Without velocities there is nothing to warn of; at the start they take effect.
    writeModel(makePendulum("0.5", R"(
analyses: {run: {type: transient, duration: 0.1}}
initial: {rates: {pivot: 3}}
)"));
    ASSERT_EQ(runModel(), 0) << err;
    EXPECT_EQ(err, "");
}

TEST_F(RunTest, WeldsThatFindTheirBodiesTurnedAreWarnedOfOrTakeThemSo) {
    const auto write = [&](const char* more) {
        writeModel(std::string(R"(simflex: 1
bodies: {post: {mass: 1, inertia: [1, 1, 1], place: {rotation: [0, 0, 30*deg]}}}
probes: {turned: {orientation: post, component: z}}
analyses: {run: {type: transient, duration: 0.1}}
joints: {base: {type: weld, between: [ground, post])") +
                   more + "}}\n");
    };
    write("");
    ASSERT_EQ(runModel(), 0) << err;
    const std::vector<std::string> warnings = readResults(folder / "model.results.h5").warnings;
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_EQ(warnings[0],
              "joint 'base' is not closed as placed: its error is 0.5, its frames are 0 m apart "
              "and rotated relative to each other by 30 degrees; assembly will move the bodies; "
              "'as_placed: true' takes them as they are");
    EXPECT_EQ(err, "simflex: warning: " + warnings[0] + "\n");
    const Results::Analysis moved = read("run");
    EXPECT_NEAR(find(moved, "turned").rows[0][0], 0, 1e-9);
    write(", as_placed: true");
    ASSERT_EQ(runModel(), 0) << err;
    EXPECT_EQ(err, "");
    const Results::Analysis kept = read("run");
    for (const auto& row : find(kept, "turned").rows)
        EXPECT_NEAR(row[0], 30 * 3.14159265358979323846 / 180, 1e-9);
}

TEST_F(RunTest, BodiesThatNothingHoldsAreNamed) {
    writeModel(R"(simflex: 1
bodies: {block: {mass: 1, inertia: [1, 1, 1]}}
analyses: {rest: {type: static}}
)");
    ASSERT_EQ(runModel(), 0) << err;
    EXPECT_THAT(out, HasSubstr("  'block' is free to move in 6 ways: nothing holds it\n"));
    writeModel(R"(simflex: 1
bodies: {block: {mass: 1, inertia: [1, 1, 1]}}
joints: {hinge: {type: pin, between: [ground, block]}}
analyses: {rest: {type: static}}
)");
    ASSERT_EQ(runModel(), 0) << err;
    EXPECT_THAT(out, HasSubstr("  'block' is free to move: nothing holds it\n"));
}

TEST_F(RunTest, AMassOnAStopRestsAndSwingsOnItsStiffness) {
    // Pressed in by 10 µm and 0.1 µm, far less than a difference step.
    for (const double stiffness : {1e4, 1e6, 1e8}) {
        SCOPED_TRACE(stiffness);
        char number[20];
        std::snprintf(number, sizeof number, "%g", stiffness);
        writeModel(
            std::string("simflex: 1\ngravity: [0, 0, -9.81]\n"
                        "bodies: {block: {mass: 1, inertia: [1, 1, 1]}}\n"
                        "joints: {guide: {type: slider, between: [ground, block], axis: z}}\n"
                        "connectors: {floor: {type: stop, between: [ground, block], "
                        "stiffness: ") +
            number +
            "}}\nprobes: {z: {coordinate: guide}}\n"
            "analyses:\n  rest: {type: static}\n  modes: {type: eigen, about: rest}\n");
        ASSERT_EQ(runModel(), 0) << err;
        const double depth = 9.81 / stiffness;
        EXPECT_NEAR(find(read("rest"), "z").rows[0][0] / -depth, 1, 1e-5);
        EXPECT_NEAR(read("modes").frequency[0][0] / (std::sqrt(stiffness) / (2 * kPi)), 1, 1e-5);
    }
}

TEST_F(RunTest, WhatAnAnalysisBeginsFromIsCheckedFirst) {
    writeModel(makePendulum(
        "0.5", "analyses:\n  modes: {type: eigen, about: rest}\n  rest: {type: static}\n"));
    EXPECT_EQ(runModel("--check"), 1);
    EXPECT_THAT(err, AllOf(HasSubstr("model.yaml:12:31: analyses.modes.about: "),
                           HasSubstr("'rest' is not above 'modes'"), HasSubstr("move it up")));
    writeModel(makePendulum(
        "0.5", "analyses:\n  rest: {type: static}\n  modes: {type: eigen, about: rset}\n"));
    EXPECT_EQ(runModel("--check"), 1);
    EXPECT_THAT(err, AllOf(HasSubstr("model.yaml:13:"), HasSubstr("did you mean 'rest'?")));
    EXPECT_NE(access((folder / "model.results.h5").c_str(), F_OK), 0);
}

TEST_F(RunTest, AModelThatCannotBendIsRunOnceWithRigid) {
    writeModel(makePendulum("0.5", "analyses: {run: {type: transient, duration: 0.1}}\n"));
    ASSERT_EQ(runModel("--rigid"), 0) << err;
    EXPECT_THAT(err, HasSubstr("--rigid changes nothing and it is run once"));
    EXPECT_THAT(out, Not(HasSubstr("flexible against rigid")));
    EXPECT_EQ(access((folder / "model.results.h5").c_str(), F_OK), 0);
    EXPECT_NE(access((folder / "model.results.rigid.h5").c_str(), F_OK), 0);
}

TEST_F(RunTest, WhatARigidModelCannotDoIsLeftOutOfItByName) {
    writeModel(R"(simflex: 1
parts:
  bar: {deck: brick.inp, interfaces: {left: LEFT, right: RIGHT}, modes: 16}
bodies:
  bar: {part: bar}
joints:
  hinge: {type: pin, between: [ground, bar.left], axis: z}
motions: {drive: {joint: hinge, position: 0.1*t}}
probes: {tip: {position: bar.right}}
analyses:
  modes: {type: eigen, count: 3, pictures: true}
  whirl: {type: campbell, parameter: speed, speeds: [0, 10], count: 2}
  run: {type: transient, duration: 0.01}
parameters: {speed: 1}
)");
    ASSERT_EQ(runProgram("SIMFLEX_CACHE=cache '" SIMFLEX_PROGRAM "'",
                         "run model.yaml --rigid --no-pictures"),
              0)
        << err;
    EXPECT_THAT(err, AllOf(HasSubstr("note: analysis 'modes' is left out of the rigid model: "
                                     "nothing in it vibrates"),
                           HasSubstr("note: analysis 'whirl' is left out of the rigid model: ")));
    EXPECT_THAT(out, HasSubstr("run: flexible against rigid"));
    const Results rigid = readResults(folder / "model.results.rigid.h5");
    ASSERT_EQ(rigid.analyses.size(), 1u);
    EXPECT_TRUE(rigid.analyses[0].isComplete);
}

TEST_F(RunTest, VerifyEstimatesTheError) {
    const auto write = [&](const std::string& solver) {
        writeModel(makePendulum("2.5",
                                "probes: {swing: {coordinate: pivot}, gap: {joint_error: pivot}}\n"
                                "analyses: {run: {type: transient, duration: 4}}\n"
                                "solver: {" +
                                    solver + "}\n"));
    };
    const auto measure = [&](const std::string& file, const std::string& reference) {
        const auto a = find(read("run", file), "swing"), b = find(read("run", reference), "swing");
        double largest = 0;
        for (size_t i = 0; i < a.rows.size(); ++i)
            largest = std::max(largest, std::abs(a.rows[i][0] - b.rows[i][0]));
        return largest;
    };
    write("accuracy: 1e-4");
    ASSERT_EQ(runModel("-o exact.h5 --set solver.accuracy=1e-11"), 0);
    const auto verify = [&](const std::string& solver) {
        write(solver);
        EXPECT_EQ(runModel("--verify"), 0) << err;
        EXPECT_THAT(out, HasSubstr("run: changes with solver.accuracy="));
        EXPECT_THAT(out, HasSubstr("results of the finer run: model.results.fine.h5"));
        const double estimate = measure("model.results.h5", "model.results.fine.h5");
        EXPECT_THAT(out, HasSubstr(writeGeneral(estimate, 6)));
        return std::make_pair(measure("model.results.h5", "exact.h5"), estimate);
    };
    // Steps limited by the accuracy, by the interval, or by a maximum step.
    for (const char* solver :
         {"accuracy: 1e-6", "accuracy: 1e-3", "accuracy: 1e-5, maximum_step: 5e-3"}) {
        const auto [error, estimate] = verify(std::string("method: bdf, ") + solver);
        EXPECT_GT(estimate, 0.5 * error) << solver;
        EXPECT_LT(estimate, 1.5 * error) << solver;
    }
    // Radau's error is not a power of the accuracy: the finer run's error is below ten times its
    // own accuracy.
    for (const auto& [solver, accuracy] : {std::pair<const char*, double>{"accuracy: 1e-6", 1e-6},
                                           {"accuracy: 1e-3", 1e-3},
                                           {"accuracy: 1e-5, maximum_step: 5e-3", 1e-5}}) {
        const auto [error, estimate] = verify(solver);
        EXPECT_NEAR(estimate, error, accuracy) << solver;
        EXPECT_LT(error, 10 * accuracy) << solver;
    }

    write("method: bdf, maximum_order: 1, accuracy: 1e-2");
    ASSERT_EQ(runModel("--verify -q"), 0) << err;
    EXPECT_THAT(out, ::testing::ContainsRegex(
                         "warning: probe 'swing' changes by [0-9.]+ % of its range between "
                         "accuracy 0.01 and 0.001; try solver.accuracy=(0.001|0.0001|1e-05), or "
                         "more damping of the parts, if this vibration is of no interest"));
    // Joint errors are round-off that finer steps would not change.
    EXPECT_THAT(out, AllOf(HasSubstr("\n  gap.0 "), Not(HasSubstr("warning: probe 'gap"))));
    write("accuracy: 1e-8");
    ASSERT_EQ(runModel("--verify --only run"), 0) << err;
    EXPECT_THAT(out, Not(HasSubstr("warning")));
    write("fixed_step: 0.01");
    ASSERT_EQ(runModel("--verify"), 0) << err;
    EXPECT_THAT(out, HasSubstr("run: changes with solver.fixed_step=0.005"));
}

TEST_F(RunTest, TheEnergyBalanceOfAModelWithoutProbesStaysWhatItWas) {
    writeModel(makePendulum("0.5",
                            "loads: {push: {on: rod, force: [3*t, 0, 0]}}\n"
                            "analyses: {run: {type: transient, duration: 0.2}}\n"));
    ASSERT_EQ(runModel("-q"), 0) << err;
    EXPECT_THAT(out, AllOf(HasSubstr("energy_balance [J]"), HasSubstr("kinetic_energy [J]"),
                           Not(HasSubstr("balance_energy"))));
    // At rest, 0.5 m cos(0.5) below the pin.
    const double start = -2 * kGravity * 0.5 * std::cos(0.5);
    const Results::Analysis run = read("run");
    for (const auto& row : find(run, "energy_balance").rows) EXPECT_NEAR(row[0], start, 1e-4);
}

TEST(ProgressBar, TimeLeftCountsWhatWasDoneSinceTheBarBegan) {
    using cli::ProgressBar;
    EXPECT_DOUBLE_EQ(ProgressBar::calcTimeLeft(10, 0, 0.25), 30);
    // Resumed at 80 %: 5 % took 10 s, 15 % remain.
    EXPECT_NEAR(ProgressBar::calcTimeLeft(10, 0.8, 0.85), 30, 1e-9);
    EXPECT_DOUBLE_EQ(ProgressBar::calcTimeLeft(10, 0.8, 1), 0);
    EXPECT_TRUE(std::isnan(ProgressBar::calcTimeLeft(1, 0, 0.01)));
    EXPECT_TRUE(std::isnan(ProgressBar::calcTimeLeft(1, 0.9, 0.901)));
    EXPECT_TRUE(std::isnan(ProgressBar::calcTimeLeft(1, 1, 1)));
}

TEST_F(RunTest, AnEnergyBalanceThatDoesNotCloseIsWarnedOfThoughQuiet) {
    const auto write = [this](const std::string& accuracy) {
        writeModel(
            makePendulum("1.5", "solver: {method: bdf, maximum_order: 2, accuracy: " + accuracy +
                                    "}\nanalyses: {run: {type: transient, duration: 10}}\n"));
    };
    write("0.1");
    ASSERT_EQ(runModel(), 0) << err;
    const Results::Analysis coarse = read("run");
    const double error = coarse.statistics.at("largest_energy_error");
    EXPECT_GT(error, 0.1 * coarse.statistics.at("largest_kinetic_energy"));
    EXPECT_THAT(err,
                ::testing::ContainsRegex(
                    "simflex: warning: run: the energy balance is off by [0-9.]+ J, at t = "
                    "[0-9.]+ s, where no more than [0-9.]+ J was ever exchanged .kinetic "
                    "energy up to [0-9.]+ J, potential and strain energy changed by up to "
                    "[0-9.]+ J, work of loads, motions and dampers up to 0 J.: the results are "
                    "wrong by as much. Try a finer solver.accuracy .now 0.1 m. or a shorter "
                    "solver.maximum_step until it closes\n"));
    EXPECT_THAT(out, HasSubstr("warning: the energy balance is off by"));

    // A few hundredths are enough.
    write("2e-4");
    ASSERT_EQ(runModel(), 0) << err;
    const double fine = read("run").statistics.at("largest_energy_error") /
                        read("run").statistics.at("largest_kinetic_energy");
    EXPECT_GT(fine, 0.02);
    EXPECT_LT(fine, 0.05);
    EXPECT_THAT(err, HasSubstr("warning: run: the energy balance is off by"));

    write("1e-6");
    ASSERT_EQ(runModel(), 0) << err;
    EXPECT_EQ(err, "");
}

/** Returns a flexible bar of 0.4 m along x with the given supports and drives. **/
std::string makeBarModel(const std::string& body, const std::string& more) {
    return "simflex: 1\n"
           "parts: {bar: {file: bar.h5}}\n"
           "bodies: {bar: {part: bar, damping: 0.05" +
           body + "}}\n" + more;
}

TEST_F(RunTest, APartThatTurnsFastWithoutStiffeningIsWarnedOfThoughQuiet) {
    test::PointMassPartOptions options;
    options.numModes = 7;
    options.lowestFrequency = 40;
    const auto run = [&](double stiffening, const std::string& body, const std::string& speed,
                         const char* axis = "z") {
        options.stiffening = stiffening;
        writeReducedBody(folder / "bar.h5", *makePointMassPart(options).body);
        writeModel(makeBarModel(
            body, std::string("joints: {pin: {type: pin, between: [ground, bar.A], axis: ") + axis +
                      "}}\nmotions: {turn: {joint: pin, position: " + speed +
                      "*t^2/2}}\nanalyses: {run: {type: transient, duration: 1}}\n"));
        ASSERT_EQ(runModel(), 0) << err;
    };
    const auto expectWarning = [&](const char* remedy) {
        const std::string warning =
            std::string(
                "'bar' turns at [0-9.]+ rad/s at t = [0-9.]+ s without geometric "
                "stiffening, which would change the stiffness of its lowest mode by about "
                "3[.0-9]* %: ") +
            remedy;
        EXPECT_THAT(err, ::testing::ContainsRegex("simflex: warning: run: " + warning));
        EXPECT_THAT(out, ::testing::ContainsRegex("  warning: " + warning));
    };
    run(0, "", "120");
    expectWarning("set 'stiffening: true' of its part, or 'simflex reduce --stiffening'");
    run(1e-6, ", stiffening: false", "120");
    expectWarning("set 'stiffening: true' of the body");
    for (const auto& [stiffening, speed, axis] :
         {std::make_tuple(1e-6, "120", "z"), std::make_tuple(0.0, "20", "z"),
          // About its own axis the centrifugal forces are small.
          std::make_tuple(0.0, "120", "x")}) {
        run(stiffening, "", speed, axis);
        EXPECT_THAT(out, Not(HasSubstr("turns at"))) << stiffening << ' ' << speed << ' ' << axis;
    }
}

TEST_F(RunTest, APartThatBendsTooFarIsWarnedOfThoughQuiet) {
    test::PointMassPartOptions options;
    options.numModes = 7;
    writeReducedBody(folder / "bar.h5", *makePointMassPart(options).body);
    const auto run = [&](const std::string& force) {
        writeModel(makeBarModel(
            "",
            "joints: {clamp: {type: weld, between: [ground, bar.A], as_placed: true}}\n"
            "loads: {push: {on: bar.B, force: [0, \"" +
                force + "*t\", 0]}}\nanalyses: {run: {type: transient, duration: 0.2}}\n"));
        ASSERT_EQ(runModel(), 0) << err;
    };
    run("1");
    EXPECT_EQ(err, "");
    run("2e5");
    const std::string warning = "'bar' at t = [0-9.]+ s: node [0-9]+ is displaced by [0-9.]+ m, ";
    EXPECT_THAT(err, ::testing::ContainsRegex("simflex: warning: run: " + warning));
    EXPECT_THAT(out, ::testing::ContainsRegex("  warning: " + warning));
}

TEST_F(RunTest, EveryAnalysisWarnsOfAxialLoadsThatItsBodiesDoNotFeel) {
    // A steel bar of 1 m by 10 mm by 10 mm, which buckles on hinges at 1.6 kN.
    constexpr int Elements = 20;
    std::ostringstream deck;
    deck << "*NODE\n";
    for (int i = 0; i <= Elements; ++i)
        for (int k = 0; k < 4; ++k)
            deck << 4 * i + k + 1 << ", " << double(i) / Elements << ", "
                 << (k == 1 || k == 2 ? 0.005 : -0.005) << ", " << (k > 1 ? 0.005 : -0.005) << '\n';
    deck << "*ELEMENT, TYPE=C3D8I, ELSET=ALL\n";
    for (int i = 0; i < Elements; ++i) {
        deck << i + 1;
        for (const int k : {1, 2, 3, 4, 5, 6, 7, 8}) deck << ", " << 4 * i + k;
        deck << '\n';
    }
    deck << "*NSET, NSET=A\n1, 2, 3, 4\n*NSET, NSET=B\n81, 82, 83, 84\n"
            "*MATERIAL, NAME=STEEL\n*ELASTIC\n2e11, 0.3\n*DENSITY\n7800\n"
            "*SOLID SECTION, ELSET=ALL, MATERIAL=STEEL\n";
    testing::writeText(folder / "bar.inp", deck.str());
    ASSERT_EQ(
        runProgram("'" SIMFLEX_PROGRAM "'", "reduce bar.inp -i A=A -i B=B --modes 20 -o bar.h5 -q"),
        0)
        << err;
    const auto run = [&](const std::string& force) {
        writeModel(R"yaml(simflex: 1
gravity: [0, 0, 0]
parts: {bar: {file: bar.h5}}
bodies: {bar: {part: bar}}
parameters: {rate: 0, force: )yaml" +
                   force +
                   R"yaml(}
joints: {clamp: {type: weld, between: [ground, bar.A]}}
loads: {pull: {on: bar.B, force: [force, 0, 0]}}
probes: {tip: {position: bar.B}}
analyses:
  rest: {type: static}
  modes: {type: eigen, count: 3}
  line: {type: linear, inputs: [loads.pull.force.y], outputs: [tip]}
  response: {type: frequency_response, inputs: [loads.pull.force.y], outputs: [tip], frequencies: [1, 2]}
  swept: {type: frequency_response, speed: rate, inputs: [loads.pull.force.y], outputs: [tip], frequencies: [1, 2]}
  diagram: {type: campbell, parameter: rate, speeds: [0, 1]}
)yaml");
        ASSERT_EQ(runModel(), 0) << err;
    };
    run("1");
    EXPECT_EQ(err, "");
    for (const auto& [force, what] :
         {std::make_pair("5000", "pulled apart"), std::make_pair("-300", "compressed")}) {
        run(force);
        for (const char* name : {"rest", "modes", "line", "response", "swept", "diagram"})
            EXPECT_THAT(err, ::testing::ContainsRegex(
                                 std::string("simflex: warning: ") + name +
                                 ": (at rate = [0-9.]+, )?'bar' at t = 0 s: without geometric "
                                 "stiffening it is " +
                                 what + " between"));
    }
}

TEST_F(RunTest, TimesOfIntegrationAndOutputAreToldAndKept) {
    writeModel(makePendulum("1", "analyses: {run: {type: transient, duration: 1}}\n"));
    ASSERT_EQ(runProgram("'" SIMFLEX_PROGRAM "'", "run model.yaml"), 0) << err;
    EXPECT_THAT(
        err, ::testing::ContainsRegex("[0-9.]+ s: integration [0-9.e-]+ s, output [0-9.e-]+ s\n"));
    const Results::Analysis run = read("run");
    EXPECT_GT(run.statistics.at("integration_seconds"), 0);
    EXPECT_GT(run.statistics.at("output_seconds"), 0);
}

TEST_F(RunTest, AModelAtRestHasNothingToBalance) {
    writeModel(makePendulum("0", "analyses: {run: {type: transient, duration: 1}}\n"));
    ASSERT_EQ(runModel(), 0) << err;
    EXPECT_EQ(err, "");
}

TEST_F(RunTest, ALoadOnASystemAtRestIsMet) {
    writeModel(R"yaml(simflex: 1
bodies:
  mass: {mass: 1, inertia: [0.01, 0.01, 0.01]}
joints:
  guide: {type: slider, between: [ground, mass], axis: x}
loads:
  push: {on: mass, force: ["if(t >= 0.5 && t < 0.6, 20, 0)", 0, 0]}
probes:
  v: {velocity: mass, component: x}
analyses:
  run: {type: transient, duration: 10, interval: 0.05}
)yaml");
    ASSERT_EQ(runModel(), 0) << err;
    EXPECT_NEAR(find(read("run"), "v").rows.back()[0], 2, 5e-3);
}

TEST_F(RunTest, TextsThatATerminalWouldObeyAreRefusedOrChanged) {
    writeModel("simflex: 1\n\"\\e]0;title\\a\\e[31mkey\": 1\n");
    EXPECT_NE(runModel(), 0);
    EXPECT_THAT(err, HasSubstr("model.yaml:2:1: this text holds control characters"));
    EXPECT_NE(runModel("--set 'bodies.\x1b[31mx=1'"), 0);
    EXPECT_EQ(err.find('\x1b'), std::string::npos);
    testing::writeText(folder / "m\x1b[31m\u202E.yaml",
                       "simflex: 1\nbodies: {ball: {mass: 1, inertia: [1, 1, 1]}}\n"
                       "analyses: {fall: {type: transient, duration: 0.1}}\n");
    for (const char* more : {"--check", ""}) {
        EXPECT_EQ(
            runProgram("'" SIMFLEX_PROGRAM "'", "run 'm\x1b[31m\u202E.yaml' " + std::string(more)),
            0);
        EXPECT_THAT(out, HasSubstr("m?[31m?."));
        for (const std::string& text : {out, err})
            EXPECT_TRUE(text.find('\x1b') == text.npos && text.find("\u202E") == text.npos) << text;
    }
}

TEST_F(RunTest, FramesMayBeOnManyOthersInEitherOrder) {
    const int numFrames = 3000;
    const auto write = [&](bool isForward) {
        std::string frames;
        for (int k = 0; k < numFrames; ++k) {
            const int at = isForward ? k : numFrames - 1 - k;
            frames += "  f" + std::to_string(at) +
                      ": {on: " + (at ? "f" + std::to_string(at - 1) : "ball") +
                      ", position: [1, 0, 0]}\n";
        }
        writeModel("simflex: 1\nbodies: {ball: {mass: 1, inertia: [1, 1, 1]}}\nframes:\n" + frames +
                   "probes: {x: {position: f2999, component: x}}\n"
                   "analyses: {fall: {type: transient, duration: 0.1}}\n");
    };
    for (const bool isForward : {true, false}) {
        write(isForward);
        ASSERT_EQ(runModel(), 0) << err;
        EXPECT_EQ(find(read("fall"), "x").rows.at(0).at(0), numFrames);
    }
}

/** Each adds 1 to the one before it; 999 of them and the time are 1000 entries. **/
TEST_F(RunTest, ChainsOfProbesHaveOneLimitInEitherOrder) {
    const auto write = [&](int numProbes, bool isForward, const std::string& more = "") {
        std::string probes;
        for (int k = 0; k < numProbes; ++k) {
            const int at = isForward ? k : numProbes - 1 - k;
            probes += "  p" + std::to_string(at) +
                      ": {expression: " + (at ? "1 + p" + std::to_string(at - 1) : "t") + "}\n";
        }
        writeModel("simflex: 1\nbodies: {ball: {mass: 1, inertia: [1, 1, 1]}}\nprobes:\n" + probes +
                   more + "analyses: {fall: {type: transient, duration: 0.1}}\n");
    };
    for (const bool isForward : {true, false}) {
        write(1000, isForward);
        ASSERT_EQ(runModel(), 0) << err;
        EXPECT_EQ(find(read("fall"), "p999").rows.at(0).at(0), 999);
        write(1001, isForward);
        EXPECT_EQ(runModel("--check"), 1);
        EXPECT_THAT(err, AllOf(::testing::ContainsRegex("model.yaml:[0-9]+:"),
                               HasSubstr("more than 1000 probes refer to each other in a row: "
                                         "'p1000' → 'p999' → 'p998' → 'p997' → …")));
        write(30000, isForward);
        EXPECT_EQ(runModel("--check"), 1);
        EXPECT_THAT(err, HasSubstr("more than 1000 probes refer to each other in a row"));
        write(1000, isForward, "loads: {push: {on: ball, force: [p999, 0, 0]}}\n");
        EXPECT_EQ(runModel("--check"), 0) << err;
        write(1001, isForward, "loads: {push: {on: ball, force: [p1000, 0, 0]}}\n");
        EXPECT_EQ(runModel("--check"), 1);
        EXPECT_THAT(err, HasSubstr("more than 1000 probes and states refer to each other"));
    }
}

}  // namespace
}  // namespace simflex
