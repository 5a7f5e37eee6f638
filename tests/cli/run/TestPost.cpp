/** @file
Post-processing of results without running the model again. **/

#include <algorithm>
#include <cstdio>
#include <filesystem>

#include "cli/run/RunTest.h"
#include "support/VtuReader.h"

namespace simflex {
namespace {

using ::testing::HasSubstr;

class PostTest : public RunTest {
protected:
    /** Returns a bar rotating about a pin at its end; row times have no round-off. **/
    static std::string makeBar(const std::string& probes, const std::string& pictures = "") {
        return R"(simflex: 1
gravity: [0, -9.81, 0]
parts: {bar: {deck: bar.inp, interfaces: {root: LEFT, tip: RIGHT}, modes: 14}}
bodies: {bar: {part: bar, damping: 0.1}}
joints: {pivot: {type: pin, between: [ground, bar.root], axis: z}}
solver: {accuracy: 1e-7}
initial: {rates: {pivot: 40}}
analyses:
  run: {type: transient, duration: 0.625, interval: 1/64}
  more: {type: transient, from: run, duration: 0.125, interval: 1/64}
)" + (pictures.empty() ? "" : "pictures: {size: [160, 120], shadows: false, " + pictures + "}\n") +
               "probes: {" + probes + "}\n";
    }
    int post(const std::string& arguments) {
        return runProgram("SIMFLEX_CACHE=cache '" SIMFLEX_PROGRAM "'", "post --quiet " + arguments);
    }

    void SetUp() override {
        RunTest::SetUp();
        testing::writeText(folder / "bar.inp", testing::Brick().text());
    }

    const std::string few = "tip: {position: bar.tip}, force: {reaction: pivot}";
    const std::string many =
        "tip: {position: bar.tip}, force: {reaction: pivot}, angle: {coordinate: pivot}, "
        "speed: {velocity: bar.tip, component: norm}, bend: {largest_displacement: bar}, "
        "kinetic: {energy: kinetic}, twice: {expression: \"2*angle + tip.x^2\"}, "
        "push: {acceleration: bar.tip}, balance: {energy: balance}, hand: {reaction: pivot, part: "
        "torque, on: F}";
};

TEST_F(PostTest, NewProbesAreWhatTheRunWouldHaveRecordedToTheBit) {
    writeModel(makeBar(few));
    ASSERT_EQ(runModel("-o first.h5"), 0) << err;
    writeModel(makeBar(many));
    ASSERT_EQ(post("first.h5 model.yaml"), 0) << err;
    EXPECT_THAT(out, HasSubstr("run: 41 rows, 10 probes\n"));
    EXPECT_THAT(out, HasSubstr("results: first.post.h5\n"));
    ASSERT_EQ(runModel("-o again.h5"), 0) << err;
    EXPECT_TRUE(readWithoutSeconds("first.post.h5") == readWithoutSeconds("again.h5"));
    // The angle exceeds a turn and continues in the second analysis.
    EXPECT_GT(find(read("more", "first.post.h5"), "angle").rows.back()[0], 6.3);
}

TEST_F(PostTest, PicturesAreThoseOfTheRun) {
    const std::string settings = "rate: 8, slow_motion: 2, folder: shots, exaggeration: 50";
    writeModel(makeBar(few));
    ASSERT_EQ(runModel("-o first.h5 --only run"), 0) << err;
    ASSERT_EQ(post("first.h5 --set pictures.rate=8 --set pictures.slow_motion=2 "
                   "--set pictures.folder=shots --set pictures.exaggeration=50 "
                   "--set 'pictures.size=[160,120]' --set pictures.shadows=false"),
              0)
        << err;
    const std::vector<std::string> files = testing::listFiles(folder / "shots_run");
    ASSERT_EQ(files.size(), 11u);
    std::vector<std::string> bytes;
    for (const std::string& file : files)
        bytes.push_back(testing::readText(folder / ("shots_run/" + file)));
    std::filesystem::remove_all(std::string(folder / "shots_run"));
    writeModel(makeBar(few, settings));
    ASSERT_EQ(runModel("-o again.h5 --only run"), 0) << err;
    for (size_t k = 0; k < files.size(); ++k)
        EXPECT_TRUE(bytes[k] == testing::readText(folder / ("shots_run/" + files[k]))) << k;
}

TEST_F(PostTest, ParaViewGetsNodesWhereTheProbesHaveThem) {
    writeModel(makeBar("corner: {position: {on: bar, node: 1}}"));
    ASSERT_EQ(runModel("--only run"), 0) << err;
    EXPECT_NE(post("model.results.h5 --vtk run.vtk"), 0);
    EXPECT_THAT(err, HasSubstr("'run.vtk' is not a list for ParaView: name it .pvd"));
    ASSERT_EQ(runModel("--only modes -o modes.h5 --set 'gravity=[0, 0, 0]' "
                       "--set 'analyses.modes={type: eigen, count: 1}'"),
              0)
        << err;
    EXPECT_NE(post("modes.h5 --vtk modes.pvd"), 0);
    EXPECT_THAT(err, HasSubstr("--vtk needs a transient or static analysis with States, which none "
                               "of 'modes' (eigen)"));
    ASSERT_EQ(post("model.results.h5 --vtk run.pvd"), 0) << err;
    const Results::Analysis run = read("run");
    const auto& corner = find(run, "corner").rows;
    ASSERT_EQ(corner.size(), 41u);
    for (const size_t row : {size_t(0), size_t(17), size_t(40)}) {
        char name[40];
        std::snprintf(name, sizeof name, "run/bar_%05d.vtu", int(row));
        const test::VtuContent frame = test::readVtu(folder / name);
        const std::vector<double>& numbers = frame["node number"].values;
        const size_t node =
            size_t(std::find(numbers.begin(), numbers.end(), 1.0) - numbers.begin());
        ASSERT_LT(node, numbers.size());
        for (size_t k = 0; k < 3; ++k)
            EXPECT_NEAR(frame["Points"].values.at(3 * node + k), corner[row][k], 1e-12);
    }
}

TEST_F(PostTest, AnAnimationHasNodesWhereParaViewHasThem) {
    testing::Brick soft;
    soft.E = 2e6;
    testing::writeText(folder / "bar.inp", soft.text());
    writeModel(makeBar("tip: {position: bar.tip}", "exaggeration: 1, slow_motion: 4"));
    ASSERT_EQ(runModel("--only run --no-pictures --animation run.glb"), 0) << err;
    EXPECT_THAT(out, HasSubstr("animation: run_run.glb, 41 times, "));
    ASSERT_EQ(post("model.results.h5 --no-pictures --vtk run.pvd --animation again.glb"), 0) << err;
    EXPECT_TRUE(testing::readText(folder / "run_run.glb") ==
                testing::readText(folder / "again_run.glb"));
    const std::string command = "cd '" + (folder / "") + "' && /usr/bin/python3 '" +
                                SIMFLEX_SOURCE_DIR +
                                "/tests/cli/run/check_animation.py' run_run.glb run bar >out 2>&1";
    EXPECT_EQ(std::system(command.c_str()), 0) << testing::readText(folder / "out");
    EXPECT_THAT(testing::readText(folder / "out"), HasSubstr(" nodes at 41 times, "));

    EXPECT_NE(post("model.results.h5 --no-pictures --animation run.gltf"), 0);
    EXPECT_THAT(err, HasSubstr("'run.gltf' is not an animation that can be written: name it .glb"));
    EXPECT_NE(runModel("--animation run.glb --set output.states=none"), 0);
    EXPECT_THAT(err, HasSubstr("output.states: an animation is made of States"));
}

/** A bar hanging from a spring, at rest, with modes about it. **/
class PostAtRestTest : public PostTest {
protected:
    static std::string makeHanging(const std::string& probes, const std::string& pictures) {
        return R"(simflex: 1
gravity: [0, -9.81, 0]
parts: {bar: {deck: bar.inp, interfaces: {root: LEFT, tip: RIGHT}, modes: 14}}
bodies: {bar: {part: bar}}
joints: {pivot: {type: pin, between: [ground, bar.root], axis: z}}
connectors: {coil: {type: torsion_spring, between: [ground, bar.root], stiffness: 300}}
analyses:
  rest: {type: static}
  modes: {type: eigen, about: rest, matrices: true, count: 3}
)" + (pictures.empty() ? "" : "pictures: {" + pictures + "}\n") +
               "probes: {" + probes + "}\n";
    }
};

TEST_F(PostAtRestTest, EquilibriaAreToldAndDrawnAsTheRunDoes) {
    const std::string shown = "size: [160, 120], exaggeration: 20, folder: shots";
    writeModel(makeHanging(few, ""));
    ASSERT_EQ(runModel("-o first.h5"), 0) << err;
    writeModel(makeHanging(many, shown));
    ASSERT_EQ(post("first.h5 model.yaml --vtk rest.pvd"), 0) << err;
    EXPECT_TRUE(std::filesystem::exists(std::string(folder / "rest.pvd")));
    std::vector<std::string> files = testing::listFiles(folder / "shots"), bytes;
    EXPECT_THAT(files, ::testing::IsSupersetOf({"rest.png", "modes_mode_1.gif"}));
    for (const std::string& file : files)
        bytes.push_back(testing::readText(folder / ("shots/" + file)));
    std::filesystem::remove_all(std::string(folder / "shots"));
    ASSERT_EQ(runModel("-o again.h5 --set analyses.modes.pictures=true"), 0) << err;
    for (size_t k = 0; k < files.size(); ++k)
        EXPECT_TRUE(bytes[k] == testing::readText(folder / ("shots/" + files[k]))) << files[k];
    const Results::Analysis now = read("rest", "first.post.h5"), anew = read("rest", "again.h5");
    ASSERT_EQ(now.probes.size(), 10u);
    for (size_t k = 0; k < now.probes.size(); ++k)
        EXPECT_EQ(now.probes[k].rows, anew.probes[k].rows) << now.probes[k].column.name;
}

TEST_F(PostAtRestTest, ModesAreKeptWithTheirMatrices) {
    writeModel(makeHanging(few, ""));
    ASSERT_EQ(runModel("-o first.h5"), 0) << err;
    const Results::Analysis modes = read("modes", "first.h5");
    const auto &M = modes.matrices.at("M"), &K = modes.matrices.at("K"),
               &G = modes.matrices.at("G"), &shapes = modes.matrices.at("mode_real");
    EXPECT_EQ(modes.stateColumns.at("u").size(), M.size());
    ASSERT_EQ(shapes.size(), 3u);
    const auto multiply = [](const std::vector<double>& x,
                             const std::vector<std::vector<double>>& A,
                             const std::vector<double>& y) {
        double sum = 0;
        for (size_t i = 0; i < A.size(); ++i)
            for (size_t k = 0; k < A[i].size(); ++k) sum += x[i] * A[i][k] * y[k];
        return sum;
    };
    const double stiffest = std::pow(2 * SimTK::Pi * modes.frequency[0].back(), 2);
    for (size_t i = 0; i < shapes.size(); ++i)
        for (size_t k = 0; k < shapes.size(); ++k) {
            const double omega = 2 * SimTK::Pi * modes.frequency[0][i];
            EXPECT_NEAR(multiply(shapes[i], M, shapes[k]), i == k ? 1 : 0, 1e-9);
            EXPECT_NEAR(multiply(shapes[i], K, shapes[k]), i == k ? omega * omega : 0,
                        1e-8 * stiffest);
        }
    for (const std::vector<double>& row : G) EXPECT_NEAR(multiply({1}, {row}, shapes[0]), 0, 1e-9);
}

/** A joint released by an event, and a filter: neither follows from coordinates and speeds. **/
TEST_F(PostTest, WhatEventsReleaseAndFiltersKnowIsToldToTheBitToo) {
    const std::string more =
        "states: {slow: {low_pass: {input: bar_speed, time_constant: 0.03}}}\n"
        "events: {drop: {when: t > 0.3, do: [{release: pivot}]}}\n";
    const std::string first = "bar_speed: {velocity: bar.tip, component: norm}";
    writeModel(makeBar(first) + more);
    ASSERT_EQ(runModel("-o first.h5"), 0) << err;
    const Results::Analysis kept = read("run", "first.h5");
    EXPECT_THAT(kept.stateColumns.at("z"), ::testing::Contains("slow"));
    EXPECT_THAT(kept.stateColumns.at("q"),
                ::testing::IsSupersetOf({"bar.quaternion.w", "bar.x", "bar.mode 1", "bar.mode 2"}));
    EXPECT_THAT(kept.stateColumns.at("u"), ::testing::Contains("bar.angular_velocity.z"));
    EXPECT_EQ(kept.stateColumns.at("multipliers")[0], "pivot.0");
    EXPECT_NE(kept.multipliers.front()[0], 0);
    EXPECT_EQ(kept.multipliers.back(), std::vector<double>(kept.multipliers[0].size(), 0));
    const std::string now = first +
                            ", force: {reaction: pivot}, push: {acceleration: bar.tip}, "
                            "filtered: {expression: 2*slow}, work: {energy: balance}";
    writeModel(makeBar(now) + more);
    ASSERT_EQ(post("first.h5 model.yaml"), 0) << err;
    ASSERT_EQ(runModel("-o again.h5"), 0) << err;
    EXPECT_TRUE(readWithoutSeconds("first.post.h5") == readWithoutSeconds("again.h5"));
    const Results::Analysis told = read("run", "first.post.h5");
    const auto& force = find(told, "force").rows;
    EXPECT_GT(std::abs(force[10][1]), 0);
    EXPECT_EQ(force.back(), (std::vector<double>{0, 0, 0}));
}

TEST_F(PostTest, WhatIsNotOfTheRunIsRefused) {
    writeModel(makeBar("tip: {position: bar.tip}"));
    ASSERT_EQ(runModel("--only run"), 0) << err;
    EXPECT_NE(post("model.results.h5 --set gravity='[0,-1,0]'"), 0);
    EXPECT_THAT(err, HasSubstr("'gravity' differs from the run"));
    EXPECT_NE(post("model.results.h5 --only walk"), 0);
    EXPECT_THAT(err, HasSubstr("there is no analysis 'walk'"));
    EXPECT_NE(post("model.results.h5 -o model.results.h5"), 0);
    EXPECT_THAT(err, HasSubstr("is the file that is read"));
    EXPECT_NE(access((folder / "model.results.post.h5").c_str(), F_OK), 0);
}

TEST_F(PostTest, ProbesThatAreMadeOfOthersChangeWithThem) {
    const std::string law = "connectors: {motor: {type: motor, joint: pivot, law: 2*pull}}\n";
    const std::string probes =
        "angle: {coordinate: pivot}, base: {expression: -angle}, pull: {expression: base/2}, "
        "beside: {expression: t}, twice: {expression: 2*beside}";
    writeModel(makeBar(probes) + law);
    ASSERT_EQ(runModel("--only run"), 0) << err;
    EXPECT_NE(post("model.results.h5 --set 'probes.base={expression: angle}'"), 0);
    EXPECT_THAT(err, HasSubstr("probe 'base', which 'connectors' uses by way of 'pull', differs"));
    ASSERT_EQ(post("model.results.h5 --set 'probes.beside={expression: 3*t}'"), 0) << err;
    const auto analysis = read("run", "model.results.post.h5");
    EXPECT_DOUBLE_EQ(find(analysis, "twice").rows.back()[0], 6 * analysis.time.back());
}

TEST_F(PostTest, PartsThatHaveChangedAreNoticed) {
    writeModel(makeBar("bend: {largest_displacement: bar}"));
    ASSERT_EQ(runModel("--only run"), 0) << err;
    std::string deck = testing::readText(folder / "bar.inp");
    const size_t at = deck.find("*DENSITY");
    ASSERT_NE(at, std::string::npos);
    const size_t line = deck.find('\n', at) + 1;
    deck.replace(line, deck.find('\n', line) - line, "1000");
    testing::writeText(folder / "bar.inp", deck);
    EXPECT_NE(post("model.results.h5"), 0);
    EXPECT_THAT(err, HasSubstr("the part of body 'bar' has changed since"));
}

TEST_F(PostTest, WithoutStatesThereIsNothingToGoBackTo) {
    writeModel(makeBar("tip: {position: bar.tip}") + "output: {states: none}\n");
    ASSERT_EQ(runModel("--only run"), 0) << err;
    EXPECT_NE(post("model.results.h5"), 0);
    EXPECT_THAT(err, HasSubstr("has kept no States (output.states: none)"));
}

}  // namespace
}  // namespace simflex
