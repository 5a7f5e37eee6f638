/** @file
Every kind of probe against independent results. **/

#include <sstream>

#include "cli/run/RunTest.h"
#include "simflex/body/StressRecovery.h"

namespace simflex {
namespace {

constexpr double kGravity = 9.81;

using ::testing::HasSubstr;

TEST_F(RunTest, RatesAreDerivativesOfPositionsInAnyFrame) {
    writeModel(makePendulum("1.5", R"(frames:
  tip: {on: rod, position: [0.1, -0.5, 0], rotation: [0, 0, 0.3]}
probes:
  p: {position: tip}
  v: {velocity: tip}
  a: {acceleration: tip}
  distance: {position: tip, component: norm}
  angles: {orientation: tip}
  spin: {angular_velocity: tip}
  spin_up: {angular_acceleration: tip}
  ground_from_rod: {position: {on: ground, position: [0.2, 0.1, 0.3]}, relative_to: tip}
  ground_rate: {velocity: {on: ground, position: [0.2, 0.1, 0.3]}, relative_to: tip}
  ground_acceleration: {acceleration: {on: ground, position: [0.2, 0.1, 0.3]}, relative_to: tip}
  ground_spin: {angular_velocity: ground, relative_to: tip}
  fixed: {velocity: rod, relative_to: tip}
  swing: {coordinate: pivot}
  swing_rate: {rate: pivot}
  error: {joint_error: pivot}
solver: {accuracy: 1e-9}
analyses: {run: {type: transient, duration: 0.2, interval: 0.005}}
)"));
    ASSERT_EQ(runModel(), 0) << err;
    const Results::Analysis run = read("run");
    const double h = 0.005;
    // Differences of rows have errors of h⁴/30 of fifth derivatives (below 1e3 here) and the rows'
    // errors over h.
    const double allowed = 1e-4, allowedAcceleration = 2e-3;
    const auto& p = find(run, "p");
    for (size_t i = 2; i + 2 < run.time.size(); ++i) {
        for (size_t k = 0; k < 3; ++k) {
            EXPECT_NEAR(find(run, "v").rows[i][k], differentiate(p, i, k, h), allowed);
            EXPECT_NEAR(find(run, "a").rows[i][k], differentiate(find(run, "v"), i, k, h),
                        allowedAcceleration);
            EXPECT_NEAR(find(run, "ground_rate").rows[i][k],
                        differentiate(find(run, "ground_from_rod"), i, k, h), allowed);
            EXPECT_NEAR(find(run, "ground_acceleration").rows[i][k],
                        differentiate(find(run, "ground_rate"), i, k, h), allowedAcceleration);
            EXPECT_NEAR(find(run, "fixed").rows[i][k], 0, 1e-12);
        }
        const double rate = find(run, "swing_rate").rows[i][0];
        EXPECT_NEAR(rate, differentiate(find(run, "swing"), i, 0, h), allowed);
        EXPECT_NEAR(find(run, "spin").rows[i][2], rate, 1e-9);
        EXPECT_NEAR(find(run, "ground_spin").rows[i][2], -rate, 1e-9);
        EXPECT_NEAR(find(run, "angles").rows[i][2], find(run, "swing").rows[i][0] + 1.8, 1e-9);
        EXPECT_NEAR(find(run, "spin_up").rows[i][2], differentiate(find(run, "spin"), i, 2, h),
                    allowedAcceleration);
        EXPECT_NEAR(find(run, "distance").rows[i][0], std::hypot(p.rows[i][0], p.rows[i][1]),
                    1e-12);
        for (const double error : find(run, "error").rows[i]) EXPECT_NEAR(error, 0, 1e-9);
    }
    EXPECT_EQ(find(run, "a").column.unit, "m/s^2");
    EXPECT_EQ(find(run, "swing").column.columns, std::vector<std::string>{""});
}

TEST_F(RunTest, ReactionsEnergiesAndMomentaFollowFromTheMotion) {
    writeModel(makePendulum("1.5", R"(loads:
  push: {on: rod, force: [3*t, 0, 0], torque: [0, 0, 0.5]}
probes:
  v: {velocity: rod}
  a: {acceleration: rod}
  middle: {position: rod}
  com: {center_of_mass: true}
  spin: {angular_velocity: rod, component: z}
  force: {reaction: pivot}
  force_on_ground: {reaction: pivot, on: F}
  force_in_rod: {reaction: pivot, axes: M}
  torque: {reaction: pivot, part: torque}
  momentum: {momentum: linear}
  momentum_of_rod: {momentum: linear, body: rod}
  swirl: {momentum: angular, component: z}
  swirl_of_rod: {momentum: angular, body: rod, component: z}
  kinetic: {energy: kinetic}
  kinetic_of_rod: {energy: kinetic, body: rod}
  potential: {energy: potential}
  total: {energy: total}
  work: {energy: work}
  balance: {energy: balance}
  pushed: {function: 3*t, unit: N}
  sum: {expression: 2*kinetic - middle.y + pushed*t}
solver: {accuracy: 1e-8}
analyses: {run: {type: transient, duration: 0.2, interval: 0.01}}
)"));
    ASSERT_EQ(runModel(), 0) << err;
    const Results::Analysis run = read("run");
    const auto value = [&](const char* probe, size_t i, size_t k = 0) {
        return find(run, probe).rows[i][k];
    };
    for (size_t i = 0; i < run.time.size(); ++i) {
        const double t = run.time[i], applied[3] = {3 * t, -2 * kGravity, 0};
        for (size_t k = 0; k < 3; ++k) {
            EXPECT_NEAR(value("force", i, k), 2 * value("a", i, k) - applied[k], 2e-3);
            EXPECT_NEAR(value("force_on_ground", i, k), -value("force", i, k), 1e-9);
            EXPECT_NEAR(value("momentum", i, k), 2 * value("v", i, k), 1e-12);
            EXPECT_NEAR(value("momentum_of_rod", i, k), 2 * value("v", i, k), 1e-12);
            EXPECT_NEAR(value("com", i, k), value("middle", i, k), 1e-12);
        }
        EXPECT_NEAR(value("torque", i, 2), 0, 1e-9);
        EXPECT_NEAR(std::hypot(value("force_in_rod", i, 0), value("force_in_rod", i, 1)),
                    std::hypot(value("force", i, 0), value("force", i, 1)), 1e-9);
        // About the pivot a rod has m L²/3.
        EXPECT_NEAR(value("swirl", i), 2.0 / 3 * value("spin", i), 1e-8);
        EXPECT_NEAR(value("swirl_of_rod", i), value("swirl", i), 1e-12);
        EXPECT_NEAR(value("kinetic", i), std::pow(value("spin", i), 2) / 3, 1e-8);
        EXPECT_NEAR(value("kinetic_of_rod", i), value("kinetic", i), 1e-12);
        EXPECT_NEAR(value("potential", i) - value("potential", 0),
                    2 * kGravity * (value("middle", i, 1) - value("middle", 0, 1)), 1e-9);
        EXPECT_NEAR(value("total", i), value("kinetic", i) + value("potential", i), 1e-12);
        EXPECT_NEAR(value("balance", i), value("total", i) - value("work", i), 1e-12);
        EXPECT_NEAR(value("balance", i), value("balance", 0), 1e-4);
        EXPECT_DOUBLE_EQ(value("pushed", i), 3 * t);
        EXPECT_NEAR(value("sum", i),
                    2 * value("kinetic", i) - value("middle", i, 1) + value("pushed", i) * t,
                    1e-12);
    }
    EXPECT_GT(std::abs(value("work", run.time.size() - 1)), 0.1);
    EXPECT_EQ(find(run, "pushed").column.unit, "N");
}

/** A cantilever of 200 × 30 × 20 mm, clamped at its root. **/
class CantileverTest : public RunTest {
protected:
    void SetUp() override {
        testing::Brick brick;
        brick.type = "C3D20R";
        testing::writeText(folder / "bar.inp", brick.text());
    }
};

TEST_F(CantileverTest, CantileverBendsAsBeamTheorySays) {
    // Node 247: the middle of the upper face.
    writeModel(R"(simflex: 1
parameters: {P: 100}
parts:
  bar: {deck: bar.inp, interfaces: {root: LEFT, tip: RIGHT}, modes: 20, stress: all}
bodies:
  bar: {part: bar}
joints:
  wall: {type: weld, between: [ground, bar.root]}
loads:
  push: {on: bar.tip, force: [0, -P, 0]}
probes:
  tip: {position: bar.tip}
  tip_in_bar: {position: bar.tip, relative_to: bar}
  bent: {displacement: bar.tip}
  top_in_bar: {position: {on: bar, node: 247}, relative_to: bar, component: y}
  top: {displacement: {body: bar, node: 247}, component: y}
  deflection: {displacement: bar.tip, relative_to: bar.root}
  top_deflection: {displacement: {body: bar, node: 247}, relative_to: bar.root, component: y}
  top_from_root: {position: {on: bar, node: 247}, relative_to: bar.root, component: y}
  largest: {largest_displacement: bar}
  stress: {stress: {body: bar, node: 247, what: xx}}
  mises: {stress: {body: bar, node: 247}}
  worst: {stress: {body: bar, worst: true, what: signed_von_mises}}
  strain: {strain: {body: bar, node: 247, what: xx}}
  sideways: {strain: {body: bar, node: 247, what: zz}}
  force: {reaction: wall}
  torque: {reaction: wall, part: torque}
  energy: {energy: strain}
  energy_of_bar: {energy: strain, body: bar}
  xi: {modes: bar, select: [1, 3]}
analyses:
  rest: {type: static}
  modes: {type: eigen, about: rest, count: 4}
)");
    ASSERT_EQ(runModel(), 0) << err;
    const Results::Analysis rest = read("rest");
    const auto value = [&](const char* probe, size_t k = 0) {
        return find(rest, probe).rows[0][k];
    };
    const double P = 100, L = 0.2, E = 70e9, I = 0.02 * std::pow(0.03, 3) / 12, A = 6e-4,
                 G = E / 2.6;
    const double bending = P * L * L * L / (3 * E * I), shear = P * L / (5.0 / 6 * G * A);
    // Relative to its support, not to the mean of a body whose support moves, too.
    EXPECT_NEAR(value("deflection", 1), value("tip", 1), 1e-12);
    EXPECT_NEAR(value("top_deflection"), value("top_from_root") - 0.015, 1e-12);
    EXPECT_GT(value("bent", 1), -0.5 * bending);
    // Rigid faces restrain lateral contraction near the ends: slightly stiffer than a beam.
    EXPECT_NEAR(value("tip", 1), -(bending + shear), 0.02 * bending);
    EXPECT_NEAR(value("deflection", 1), -(bending + shear), 0.02 * bending);
    EXPECT_NEAR(value("tip", 0), 0.2, 1e-3 * bending);
    // Displacements are relative to the frame that follows the bar's mean motion.
    for (size_t k = 0; k < 3; ++k)
        EXPECT_NEAR(value("bent", k), value("tip_in_bar", k) - (k == 0 ? 0.2 : 0), 1e-12);
    EXPECT_NEAR(value("top"), value("top_in_bar") - 0.015, 1e-12);
    EXPECT_GE(value("largest"), std::abs(value("top")));
    EXPECT_GE(value("largest"), std::abs(value("bent", 1)));
    EXPECT_LT(value("largest"), bending);
    const double upper = P * (L / 2) * 0.015 / I;
    EXPECT_NEAR(value("stress"), upper, 0.01 * upper);
    EXPECT_NEAR(value("mises"), upper, 0.01 * upper);
    EXPECT_GT(std::abs(value("worst")), 1.8 * upper);
    EXPECT_NEAR(value("strain"), upper / E, 0.01 * upper / E);
    EXPECT_NEAR(value("sideways"), -0.3 * upper / E, 0.01 * upper / E);
    EXPECT_NEAR(value("force", 1), P, 1e-6);
    EXPECT_NEAR(value("torque", 2), P * L, 1e-2);
    EXPECT_NEAR(value("energy"), 0.5 * P * -value("tip", 1), 1e-6 * P * bending);
    EXPECT_DOUBLE_EQ(value("energy"), value("energy_of_bar"));
    EXPECT_EQ(find(rest, "xi").column.columns, (std::vector<std::string>{"1", "3"}));
    // Euler-Bernoulli; shear reduces it by about 1 %.
    const double first = 3.5160 / (2 * 3.14159265 * L * L) *
                         std::sqrt(E * 0.03 * std::pow(0.02, 3) / 12 / (2700 * A));
    EXPECT_NEAR(read("modes").frequency.at(0).at(0), first, 0.02 * first);
    EXPECT_THAT(out, HasSubstr("stress [Pa]"));
    // The placement is next to an equilibrium, so modes are about that; under more load it is far
    // away.
    EXPECT_EQ(runModel("--set analyses.modes.about=placed"), 0) << err;
    EXPECT_NEAR(read("modes").frequency.at(0).at(0), first, 0.02 * first);
    EXPECT_NE(runModel("--set analyses.modes.about=placed --set parameters.P=2000"), 0);
    EXPECT_THAT(err, HasSubstr("equilibrium: forces of up to"));
    EXPECT_THAT(err, HasSubstr("about: static"));
    // Completed analyses are reported all the same.
    EXPECT_THAT(out, HasSubstr("stress [Pa]"));
    EXPECT_THAT(out, HasSubstr("results so far: "));
}

// A strip of shells, 200 × 30 × 5 mm, bent upwards and pulled.
TEST_F(RunTest, AShellsNodeHasStressOnBothSides) {
    for (const std::string type : {"S4", "S8R"}) {
        std::ostringstream deck;
        const bool isQuadratic = type == "S8R";
        const int n = isQuadratic ? 41 : 21, step = isQuadratic ? 2 : 1;
        deck << "*NODE\n";
        for (int j = 0; j < 5; ++j)
            for (int i = 0; i < n; ++i)
                deck << 1 + i + 100 * j << "," << 0.2 * i / (n - 1) << "," << 0.0075 * j << ",0\n";
        deck << "*ELEMENT,TYPE=" << type << ",ELSET=S\n";
        int number = 0;
        for (int j = 0; j + step < 5; j += step)
            for (int i = 0; i + step < n; i += step) {
                const int a = 1 + i + 100 * j, x = step, y = 100 * step;
                deck << ++number << "," << a << "," << a + x << "," << a + x + y << "," << a + y;
                if (isQuadratic)
                    deck << "," << a + 1 << "," << a + x + 100 << "," << a + y + 1 << ","
                         << a + 100;
                deck << "\n";
            }
        for (const auto& [name, i] : {std::pair("ROOT", 0), std::pair("TIP", n - 1)}) {
            deck << "*NSET,NSET=" << name << "\n";
            for (int j = 0; j < 5; ++j) deck << 1 + i + 100 * j << "\n";
        }
        deck << "*MATERIAL,NAME=M\n*ELASTIC\n70e9,0.3\n*DENSITY\n2700\n"
                "*SHELL SECTION,ELSET=S,MATERIAL=M\n0.005\n";
        testing::writeText(folder / "strip.inp", deck.str());
        const std::string middle = std::to_string(1 + (n - 1) / 2 + 200);
        const auto write = [&](const std::string& sides) {
            writeModel(
                "simflex: 1\nparts:\n  strip: {deck: strip.inp, interfaces: {root: ROOT, tip: "
                "TIP}, modes: 16, stress: all}\nbodies:\n  strip: {part: strip}\njoints:\n  wall: "
                "{type: weld, between: [ground, strip.root]}\nloads:\n  push: {on: strip.tip, "
                "force: [2, 0, 0.02]}\nprobes:\n" +
                sides + "analyses:\n  rest: {type: static}\n");
        };
        std::string sides;
        for (const char* side : {"top", "bottom", "middle"})
            sides += std::string("  ") + side + ": {stress: {body: strip, node: " + middle +
                     ", side: " + side + ", what: xx}}\n";
        write(sides);
        ASSERT_EQ(runModel(), 0) << err;
        const Results::Analysis rest = read("rest");
        const double bending = 0.02 * 0.1 * 6 / (0.03 * 0.005 * 0.005),
                     tension = 2 / (0.03 * 0.005);
        const auto value = [&](const char* probe) { return find(rest, probe).rows[0][0]; };
        EXPECT_NEAR(value("middle"), tension, 0.02 * tension) << type;
        EXPECT_NEAR(value("top"), tension - bending, 0.02 * bending) << type;
        EXPECT_NEAR(value("bottom"), tension + bending, 0.02 * bending) << type;
        write("  one: {stress: {body: strip, node: " + middle + "}}\n");
        EXPECT_NE(runModel(), 0);
        EXPECT_THAT(err, HasSubstr("is a shell's, which has stress on its sides"));
        write("  one: {stress: {body: strip, node: 9999, side: top}}\n");
        EXPECT_NE(runModel(), 0);
        EXPECT_THAT(err, HasSubstr("is no node of a shell"));
    }
}

// Under random forces the mean of the square of von Mises's stress is that of its samples in time.
TEST_F(CantileverTest, RandomForcesGiveAnEffectiveStressOfVonMises) {
    writeModel(R"(simflex: 1
parts:
  bar: {deck: bar.inp, interfaces: {root: LEFT, tip: RIGHT}, modes: 20, stress: all}
bodies:
  bar: {part: bar, damping: 0.02}
joints:
  wall: {type: weld, between: [ground, bar.root]}
loads:
  push: {on: bar.tip, force: [0, 0, 0], torque: [0, 0, 0]}
probes:
  mises: {stress: {body: bar, node: 247}}
  xx: {stress: {body: bar, node: 247, what: xx}}
  xy: {stress: {body: bar, node: 247, what: xy}}
  zx: {stress: {body: bar, node: 247, what: zx}}
analyses:
  shake:
    type: frequency_response
    inputs: [loads.push.force.y, loads.push.torque.x]
    frequencies: {from: 5, to: 2000, count: 20}
    spectra: {loads.push.force.y: 4, loads.push.torque.x: 0.5}
)");
    ASSERT_EQ(runModel("--only shake"), 0) << err;
    const Results::Analysis shake = read("shake");
    EXPECT_THAT(out, HasSubstr("mises [Pa]"));
    const std::vector<std::string> components = {"xx", "yy", "zz", "xy", "yz", "zx"};
    for (size_t k = 0; k < 6; ++k) EXPECT_EQ(shake.outputs[k], "mises." + components[k]);
    // Components that have their own probes are identical.
    const auto &magnitude = shake.matrices.at("magnitude"), &phase = shake.matrices.at("phase");
    for (const size_t other : {6, 7, 8}) {
        const size_t own = other == 6 ? 0 : other == 7 ? 3 : 5;
        EXPECT_NEAR(magnitude[7][2 * own], magnitude[7][2 * other], 1e-6 * magnitude[7][0]);
    }
    double sum = 0, before = 0;
    for (size_t n = 0; n < magnitude.size(); ++n) {
        double density = 0;
        for (size_t input = 0; input < 2; ++input) {
            double mean = 0;
            for (int sample = 0; sample < 64; ++sample) {
                double s[6];
                for (size_t k = 0; k < 6; ++k)
                    s[k] = magnitude[n][2 * k + input] *
                           std::cos(SimTK::Pi * (phase[n][2 * k + input] / 180 + sample / 32.0));
                const SimTK::SymMat33 tensor(s[0], s[3], s[1], s[5], s[4], s[2]);
                mean += SimTK::square(calcVonMises(tensor)) / 64;
            }
            density += 2 * mean * (input == 0 ? 4 : 0.5);
        }
        if (n > 0)
            sum += 0.5 * (density + before) * (shake.frequency[0][n] - shake.frequency[0][n - 1]);
        before = density;
    }
    const double found = shake.statistics.at("rms of mises");
    EXPECT_NEAR(found, std::sqrt(sum), 2e-3 * found);
    EXPECT_GT(found, 1.0005 * shake.statistics.at("rms of xx"));
}

TEST_F(CantileverTest, RigidTooPrintsWhatBendingChanges) {
    writeModel(R"(simflex: 1
parts:
  bar: {deck: bar.inp, interfaces: {root: LEFT, tip: RIGHT}, modes: 14}
bodies:
  bar: {part: bar}
joints:
  wall: {type: weld, between: [ground, bar.root]}
loads:
  push: {on: bar.tip, force: [0, -100, 0]}
probes:
  tip: {position: bar.tip, component: y}
  whole: {position: bar.tip}
  side: {position: bar.tip, component: z}
  force: {reaction: wall, component: y}
analyses:
  rest: {type: static}
)");
    ASSERT_EQ(runModel("--rigid"), 0) << err;
    EXPECT_THAT(out, HasSubstr("* less than the accuracy of the simulation, 1e-06 m"));
    EXPECT_NEAR(find(read("rest", "model.results.rigid.h5"), "tip").rows[0][0], 0, 1e-12);
    EXPECT_TRUE(readResults(folder / "model.results.rigid.h5").header.isRigid);
    EXPECT_NEAR(find(read("rest", "model.results.rigid.h5"), "force").rows[0][0], 100, 1e-6);
    EXPECT_THAT(out, HasSubstr("rest: flexible against rigid"));
    EXPECT_THAT(out, ::testing::ContainsRegex("tip \\[m\\] +8[.]5[0-9]*e-05 "));
    EXPECT_THAT(out, HasSubstr("model.results.rigid.h5"));
}

TEST_F(CantileverTest, AccelerationsHoldTheVibrationOfTheBody) {
    testing::Brick soft;
    soft.type = "C3D20R";
    soft.E = 2e8;
    testing::writeText(folder / "bar.inp", soft.text());
    writeModel(R"(simflex: 1
gravity: [0, -9.81, 0]
parts:
  bar: {deck: bar.inp, interfaces: {root: LEFT, tip: RIGHT}, modes: 14}
bodies:
  bar: {part: bar}
joints:
  pivot: {type: pin, between: [ground, bar.root], axis: z}
probes:
  p: {position: bar.tip}
  v: {velocity: bar.tip}
  a: {acceleration: bar.tip}
  spin: {angular_velocity: bar.tip}
  spin_up: {angular_acceleration: bar.tip}
solver: {fixed_step: 1e-5}
analyses: {run: {type: transient, duration: 4e-3, interval: 2e-5}}
)");
    ASSERT_EQ(runModel(), 0) << err;
    const Results::Analysis run = read("run");
    const double h = 2e-5;
    const auto compare = [&](const char* rate, const char* of, size_t k) {
        double largest = 0, difference = 0;
        for (size_t i = 2; i + 2 < run.time.size(); ++i) {
            largest = std::max(largest, std::abs(find(run, rate).rows[i][k]));
            difference = std::max(difference, std::abs(find(run, rate).rows[i][k] -
                                                       differentiate(find(run, of), i, k, h)));
        }
        // The scheme's error: (ωh)²/3 of vibrations of about 1 kHz.
        EXPECT_LT(difference, 0.02 * largest) << rate;
    };
    compare("v", "p", 1);
    compare("a", "v", 1);
    compare("spin_up", "spin", 2);
}

TEST_F(RunTest, ProbesThatMakeNoSenseAreRefusedWithTheirPlace) {
    const auto refuse = [&](const std::string& probe, const std::string& reason) {
        writeModel(makePendulum("1",
                                "analyses: {run: {type: transient, duration: 0.1}}\n"
                                "probes:\n  p: " +
                                    probe + "\n"));
        EXPECT_EQ(runModel(), 1) << probe;
        EXPECT_THAT(err, HasSubstr("model.yaml:13:"));
        EXPECT_THAT(err, HasSubstr(reason));
    };
    refuse("{position: rodd}", "rod");
    refuse("{largest_displacement: rod}", "no part");
    refuse("{stress: {body: rod, worst: true}}", "no part");
    refuse("{coordinate: pivott}", "pivot");
    refuse("{coordinate: {joint: pivot, coordinate: 3}}", "numbered from 0");
    refuse("{energy: potential, body: rod}", "kinetic, strain");
    refuse("{expression: q + 1}", "q");
    refuse("{expression: p + 1}", "p");
    refuse("{displacement: ground}", "does not deform");
}

TEST_F(CantileverTest, DisplacementsAreRelativeToPlacesOfTheSameBody) {
    for (const char* place : {"ground", "bar", "other.root"}) {
        writeModel(R"(simflex: 1
parts: {bar: {deck: bar.inp, interfaces: {root: LEFT, tip: RIGHT}, modes: 14}}
bodies: {bar: {part: bar}, other: {part: bar}}
joints: {wall: {type: weld, between: [ground, bar.root]}}
analyses: {rest: {type: static}}
probes: {p: {displacement: bar.tip, relative_to: )" +
                   std::string(place) + "}}\n");
        EXPECT_EQ(runModel(), 1) << place;
        EXPECT_THAT(err, HasSubstr("an interface or node of the same body, 'bar', not to "));
    }
}

TEST_F(RunTest, MobilizersTellTheirCoordinates) {
    writeModel(R"(simflex: 1
bodies:
  wheel: {mass: 1, inertia: [1, 1, 1], mobilizer: {type: pin}}
  cart: {mass: 1, inertia: [1, 1, 1], mobilizer: {type: planar}}
analyses: {run: {type: transient, duration: 0.5}}
)");
    ASSERT_EQ(
        runModel("--set 'probes={all: {coordinate: {body: cart}}, first: {coordinate: {body: "
                 "wheel}}, speed: {rate: {body: wheel}}, sum: {expression: all.0 + all.2}}' -o "
                 "chosen.h5"),
        0)
        << err;
    const Results::Analysis chosen = read("run", "chosen.h5");
    EXPECT_EQ(find(chosen, "all").column.columns, (std::vector<std::string>{"0", "1", "2"}));
    for (size_t i = 0; i < chosen.time.size(); ++i)
        EXPECT_EQ(find(chosen, "sum").rows[i][0],
                  find(chosen, "all").rows[i][0] + find(chosen, "all").rows[i][2]);
    EXPECT_EQ(find(chosen, "first").column.unit, "rad");
    EXPECT_EQ(find(chosen, "speed").column.unit, "rad/s");
    // Without probes, too.
    ASSERT_EQ(runModel(), 0) << err;
    EXPECT_EQ(find(read("run"), "wheel_coordinate").column.unit, "rad");
    EXPECT_EQ(find(read("run"), "cart_coordinate").column.columns.size(), 3u);
}

// The magnitude of a zero vector has a kink: no derivative for any request.
TEST_F(RunTest, ResponsesThatMeanNothingAreToldOrRefused) {
    const auto write = [this](const std::string& analysis, const std::string& place = "-0.5") {
        writeModel(
            "simflex: 1\ngravity: [0, -g, 0]\nbodies:\n"
            "  bob: {mass: 2, inertia: [1, 1, 1], place: {position: [0, " +
            place +
            ", 0]}}\n"
            "joints: {pivot: {type: pin, between: [ground, {on: bob, position: [0, -(" +
            place +
            "), 0]}]}}\n"
            "connectors: {damper: {type: torsion_spring, between: [ground, bob], stiffness: 0, "
            "damping: 0.2}}\n"
            "loads: {push: {on: bob, force: [0, 0, 0]}}\n"
            "probes: {angle: {coordinate: pivot}, energy: {energy: kinetic}}\n"
            "analyses: {shake: {type: frequency_response, inputs: [loads.push.force.x], " +
            analysis + "}}\n");
    };
    const std::string some = "frequencies: {from: 0.1, to: 2, count: 10}",
                      white = "spectra: {loads.push.force.x: 1}";
    write(some + ", outputs: [angle], " + white);
    ASSERT_EQ(runModel(), 0) << err;
    EXPECT_THAT(out + err, Not(HasSubstr("warning")));
    write(some + ", outputs: [angle], adaptive: false, " + white);
    ASSERT_EQ(runModel("-q"), 0) << err;
    EXPECT_THAT(out + err, HasSubstr("they hang on few frequencies"));
    write(some + ", " + white);
    ASSERT_EQ(runModel("-q"), 0) << err;
    EXPECT_THAT(out + err, HasSubstr("no input changes 'energy'"));
    const auto band = [](const char* frequencies) {
        return ", outputs: [angle], spectra: {loads.push.force.x: {frequencies: " +
               std::string(frequencies) + ", densities: [1, 1]}}";
    };
    write(some + band("[1, 5]"));
    ASSERT_EQ(runModel("-q"), 0) << err;
    EXPECT_THAT(out + err, HasSubstr("cut to 0.1 to 2 Hz"));
    write(some + band("[3, 5]"));
    EXPECT_NE(runModel(), 0);
    EXPECT_THAT(err, HasSubstr("none of it lies within"));
    // Upside down.
    write(some + ", outputs: [angle]", "0.5");
    ASSERT_EQ(runModel("-q"), 0) << err;
    EXPECT_THAT(out + err, HasSubstr("1 motion grows by itself"));
    write(some + ", outputs: [angle], " + white, "0.5");
    EXPECT_NE(runModel(), 0);
    EXPECT_THAT(err, HasSubstr("random loads have no effective values"));
}

TEST_F(RunTest, UndampedResonanceIsRefused) {
    writeModel(R"(simflex: 1
bodies: {mass: {mass: 1, inertia: [1, 1, 1], mobilizer: {type: slider}, place: {position: [0.5, 0, 0]}}}
connectors: {spring: {type: spring, between: [ground, mass], stiffness: "(2*pi)^2", free_length: 0.5}}
loads: {push: {on: mass, force: [0, 0, 0]}}
probes: {x: {position: mass, component: x}}
analyses: {shake: {type: frequency_response, inputs: [loads.push.force.x], frequencies: [0.5, 1, 2]}}
)");
    EXPECT_NE(runModel(), 0);
    EXPECT_THAT(err, HasSubstr("at 1 Hz"));
    EXPECT_THAT(err, HasSubstr("without damping"));
    ASSERT_EQ(runModel("--set connectors.spring.damping=1e-4"), 0) << err;
    // 1/(cω)
    EXPECT_THAT(out, HasSubstr("1591.55"));
}

TEST_F(CantileverTest, TheSizeOfWhatIsZeroIsNoLinearOutput) {
    const auto write = [&](const std::string& force, const std::string& outputs) {
        writeModel(R"(simflex: 1
parts:
  bar: {deck: bar.inp, interfaces: {root: LEFT, tip: RIGHT}, modes: 20, stress: all}
bodies:
  bar: {part: bar, damping: 0.02}
joints:
  wall: {type: weld, between: [ground, bar.root]}
loads:
  push: {on: bar.tip, force: [0, )" +
                   force +
                   R"(, 0]}
probes:
  mises: {stress: {body: bar, node: 247}}
  xx: {stress: {body: bar, node: 247, what: xx}}
  far: {displacement: {body: bar, node: 247}, relative_to: bar.root, component: norm}
  up: {displacement: {body: bar, node: 247}, relative_to: bar.root, component: y}
analyses:
  rest: {type: static}
  linear: {type: linear, about: rest, inputs: [loads.push.force.y])" +
                   outputs + R"(}
  shake: {type: frequency_response, about: rest, inputs: [loads.push.force.y], frequencies: [0.001], adaptive: false)" +
                   outputs + R"(}
  modes: {type: eigen, about: rest, outputs: [mises]}
)");
    };
    write("0", ", outputs: [mises, xx]");
    for (const char* analysis : {"linear", "shake", "modes"}) {
        EXPECT_NE(runModel(std::string("--only ") + analysis + " -o " + analysis + ".h5"), 0);
        EXPECT_THAT(err, HasSubstr("'mises' has no derivative here"));
        EXPECT_THAT(err, HasSubstr("what: xx"));
    }
    write("0", "");
    ASSERT_EQ(runModel("--only linear,shake"), 0) << err;
    EXPECT_THAT(err, HasSubstr("is without mises, far"));
    EXPECT_EQ(read("linear").outputs, (std::vector<std::string>{"xx", "up"}));
    EXPECT_EQ(read("shake").outputs, (std::vector<std::string>{"xx", "up"}));
    // Under any load, even a small one, both have a derivative: the slope of equilibria.
    for (const double force : {100.0, 3.0}) {
        const auto solve = [&](double f) {
            write(std::to_string(f), "");
            EXPECT_EQ(runModel("--only rest -o rest.h5"), 0) << err;
            const Results::Analysis rest = read("rest", "rest.h5");
            return std::pair(find(rest, "mises").rows[0][0], find(rest, "far").rows[0][0]);
        };
        const auto more = solve(1.01 * force), less = solve(0.99 * force);
        write(std::to_string(force), "");
        ASSERT_EQ(runModel("--only linear,shake"), 0) << err;
        const auto magnitude = read("shake").matrices.at("magnitude")[0];
        ASSERT_EQ(magnitude.size(), 4u);
        const double stress = (more.first - less.first) / (0.02 * force),
                     way = (more.second - less.second) / (0.02 * force);
        EXPECT_NEAR(magnitude[0], stress, 1e-5 * stress) << force;
        EXPECT_NEAR(magnitude[2], way, 1e-5 * way) << force;
    }
}

}  // namespace
}  // namespace simflex
