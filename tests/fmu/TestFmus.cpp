/** @file
Models as FMUs, run by simflex's importer, by a program independent of simflex, and by the
standard's reference importer if available. **/

#include <filesystem>
#include <sstream>
#include <thread>

#include "cli/run/RunTest.h"
#include "fmu/RunningFmus.h"
#include "simflex/base/ZipFile.h"
#include "simflex/fmi/FmuUnit.h"
#include "simflex/fmu/FmuExport.h"
#include "support/GermanLocale.h"

namespace simflex {
namespace {

using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Values = std::vector<double>;
namespace fs = std::filesystem;

/** A cart of 2 kg on a spring, pushed by an input. **/
const char* const kCart =
    "simflex: 1\n"
    "title: A cart <\"&\">\n"
    "parameters: {stiffness: 50, twice: 2*stiffness}\n"
    "bodies: {cart: {mass: 2, shape: {box: [0.1, 0.1, 0.1]}, mobilizer: {type: slider}}}\n"
    "inputs: {push: {start: 3, unit: N}}\n"
    "loads: {push: {on: cart, force: [\"push - stiffness*x - 0.5*v\", 0, 0]}}\n"
    "probes:\n"
    "  x: {position: cart, component: x}\n"
    "  v: {velocity: cart, component: x}\n"
    "  a: {acceleration: cart}\n"
    "  power: {expression: push*v, unit: W}\n"
    "  sum: {expression: x + v}\n"
    "analyses: {run: {type: transient, duration: 0.5, interval: 0.01}}\n";

class FmuTest : public RunTest {
protected:
    /** @returns path of the FMU **/
    std::string make(const std::string& text, int version, const std::string& name = "model") {
        writeModel(text);
        FmuExportOptions options;
        options.version = version;
        options.isThin = true;
        exportFmu(loadModelText(folder / "model.yaml"), folder / (name + ".fmu"), options);
        return folder / (name + ".fmu");
    }

    static std::unique_ptr<FmuSlave> begin(const std::string& path, double start = 0) {
        auto slave = std::make_unique<FmuSlave>(std::make_shared<const FmuUnit>(path), "instance",
                                                inThisProcess());
        slave->enterInitialization(start);
        slave->exitInitialization();
        return slave;
    }

    /** Sets k % 3 − 0.7 for each hundredth of a second. **/
    static Values drive(FmuSlave& slave, int from, int to) {
        Values xs;
        for (int k = from; k < to; ++k) {
            slave.set("push", k % 3 - 0.7);
            EXPECT_TRUE(slave.doStep(0.01 * k, 0.01));
            xs.push_back(slave.get("x"));
        }
        return xs;
    }
};

TEST_F(FmuTest, AnglesAreWholeHoweverLongACommunicationStepIs) {
    const std::string path = make(
        "simflex: 1\n"
        "bodies:\n"
        "  wheel: {mass: 1, inertia: [0.1, 0.1, 0.1]}\n"
        "  drum: {mass: 1, inertia: [0.1, 0.1, 0.1]}\n"
        "joints:\n"
        "  free: {type: pin, between: [ground, wheel]}\n"
        "  led: {type: pin, between: [ground, drum]}\n"
        "initial: {rates: {free: 50}}\n"
        "motions: {drive: {joint: led, position: 30*sin(10*t)}}\n"
        "probes: {free: {coordinate: free}, led: {coordinate: led}}\n",
        2);
    auto slave = begin(path);
    const auto expectAngles = [&](double t) {
        EXPECT_NEAR(slave->get("free"), 50 * t, 1e-6) << t;
        EXPECT_NEAR(slave->get("led"), 30 * std::sin(10 * t), 1e-6) << t;
    };
    for (int k = 0; k < 5; ++k) {
        expectAngles(0.2 * k);
        EXPECT_TRUE(slave->doStep(0.2 * k, 0.2));
    }
    const std::string bytes = slave->save();
    slave = begin(path);
    slave->restore(bytes);
    expectAngles(1);
    EXPECT_TRUE(slave->doStep(1, 0.3));
    expectAngles(1.3);
}

TEST_F(FmuTest, AUnitMovesAsTheSession) {
    for (const int version : {2, 3}) {
        const auto slave = begin(make(kCart, version));
        EXPECT_EQ(slave->get("push"), 3);
        EXPECT_EQ(slave->get("parameters.twice"), 100);
        EXPECT_NEAR(slave->get("a.x"), 1.5, 1e-12);
        const Values xs = drive(*slave, 0, 50);
        Session session(loadModelText(folder / "model.yaml"));
        for (int k = 0; k < 50; ++k) {
            session.setInputs({{"push", k % 3 - 0.7}});
            session.runTo(0.01 * k + 0.01, 0.01);
            ASSERT_EQ(session.get("x")[0], xs[size_t(k)]) << k;
        }
        EXPECT_EQ(slave->get("time"), session.getTime());
        EXPECT_EQ(slave->get("power"), session.get("power")[0]);
    }
}

TEST_F(FmuTest, ParametersAndInputsAreThoseThatWereSetBeforeTheStart) {
    for (const int version : {2, 3}) {
        const std::string path = make(kCart, version);
        FmuSlave slave(std::make_shared<const FmuUnit>(path), "instance", inThisProcess());
        slave.set("parameters.stiffness", 1. / 3);
        slave.enterInitialization(0.25);
        slave.set("push", 0.1);
        slave.exitInitialization();
        EXPECT_EQ(slave.get("time"), 0.25);
        EXPECT_EQ(slave.get("parameters.twice"), 2. / 3);
        EXPECT_NEAR(slave.get("a.x"), 0.05, 1e-12);
        slave.doStep(0.25, 0.5);
        // x = p/k (1 − …): compared with a Session with the same numbers.
        Session session(
            loadModelText(folder / "model.yaml",
                          {"parameters.stiffness=0.33333333333333331", "inputs.push=0.1"}));
        session.runTo(0.5, 0.5);
        EXPECT_NEAR(slave.get("x"), session.get("x")[0], 1e-9);
        try {
            slave.set("parameters.stiffness", 1);
            FAIL();
        } catch (const std::runtime_error& error) {
            EXPECT_THAT(error.what(), HasSubstr("'stiffness' is fixed"));
        }
        slave.reset();
        slave.enterInitialization(0);
        slave.exitInitialization();
        EXPECT_NEAR(slave.get("a.x"), 1.5, 1e-12);
    }
}

TEST_F(FmuTest, WhatIsDoneAgainFromAKeptStateHasTheSameBits) {
    for (const int version : {2, 3}) {
        const std::string path = make(kCart, version);
        const auto slave = begin(path);
        drive(*slave, 0, 20);
        slave->set("push", 5);  // must be restored
        const std::string kept = slave->save();
        const auto goOn = [](FmuSlave& one) {
            one.doStep(0.2, 0.01);
            return drive(one, 21, 60);
        };
        const Values first = goOn(*slave);
        slave->restore(kept);
        EXPECT_EQ(slave->get("push"), 5);
        EXPECT_EQ(goOn(*slave), first);
        // In another instance, and in one with other parameters.
        const auto other = begin(path);
        other->restore(kept);
        EXPECT_EQ(goOn(*other), first);
        FmuSlave soft(std::make_shared<const FmuUnit>(path), "soft", inThisProcess());
        soft.set("parameters.stiffness", 1);
        soft.enterInitialization(0);
        soft.exitInitialization();
        soft.restore(kept);
        EXPECT_EQ(soft.get("parameters.stiffness"), 50);
        EXPECT_EQ(goOn(soft), first);
        // Corrupt states are refused, and the instance continues.
        std::string damaged = kept;
        damaged.resize(kept.size() / 2);
        EXPECT_THROW(other->restore(damaged), std::runtime_error);
        EXPECT_TRUE(other->doStep(0.6, 0.01));
    }
}

TEST_F(FmuTest, ABodyThatBendsGoesAlongReduced) {
    const std::string model =
        "simflex: 1\n"
        "parameters: {modes: 16, load: 0.2}\n"
        "gravity: [0, -9.81, 0]\n"
        "parts: {bar: {deck: brick.inp, interfaces: {left: LEFT, right: RIGHT}, modes: modes}}\n"
        "bodies: {bar: {part: bar}, load: {mass: load, shape: {sphere: 0.01}, place: {at: "
        "bar.right}}}\n"
        "joints: {hinge: {type: pin, between: [ground, bar.left], axis: z},\n"
        "  glue: {type: weld, between: [bar.right, load]}}\n"
        "inputs: {torque: {unit: N m}}\n"
        "connectors: {motor: {type: motor, joint: hinge, law: torque}}\n"
        "probes: {tip: {position: bar.right}, bend: {displacement: bar.right, relative_to: "
        "bar.left, component: y}}\n";
    setenv("SIMFLEX_CACHE", (folder / "cache").c_str(), 1);
    const std::string path = make(model, 2);
    unlink((folder / "brick.inp").c_str());
    fs::remove_all(folder / "cache");
    const auto slave = begin(path);
    unsetenv("SIMFLEX_CACHE");
    const auto& description = slave->getUnit().getDescription();
    EXPECT_FALSE(description.find("parameters.modes"));  // the part is reduced
    EXPECT_TRUE(description.find("parameters.load"));
    slave->set("torque", 3);
    EXPECT_TRUE(slave->doStep(0, 0.02));
    const std::string kept = slave->save();
    slave->set("torque", -1);
    EXPECT_TRUE(slave->doStep(0.02, 0.02));
    const double tip = slave->get("tip.y"), bend = slave->get("bend");
    EXPECT_NE(bend, 0);
    slave->restore(kept);
    slave->set("torque", -1);
    EXPECT_TRUE(slave->doStep(0.02, 0.02));
    EXPECT_EQ(slave->get("tip.y"), tip);
    EXPECT_EQ(slave->get("bend"), bend);
    EXPECT_FALSE(fs::exists(folder / "cache"));
}

TEST_F(FmuTest, InstancesInThreadsHaveTheBitsOfOneAlone) {
    const auto unit = std::make_shared<const FmuUnit>(make(kCart, 3));
    const auto run = [&] {
        FmuSlave slave(unit, "instance", inThisProcess());
        slave.enterInitialization(0);
        slave.exitInitialization();
        return drive(slave, 0, 100);
    };
    const Values alone = run();
    std::vector<Values> together(4);
    std::vector<std::thread> threads;
    for (Values& values : together) threads.emplace_back([&] { values = run(); });
    for (std::thread& thread : threads) thread.join();
    EXPECT_THAT(together, Each(alone));
}

TEST_F(FmuTest, ErrorsAreToldAndTheInstanceGoesOn) {
    for (const int version : {2, 3}) {
        const auto slave = begin(make(kCart, version));
        const auto fail = [&](const std::function<void()>& work) {
            try {
                work();
            } catch (const std::runtime_error& error) {
                return std::string(error.what());
            }
            return std::string("nothing");
        };
        EXPECT_THAT(fail([&] { slave->doStep(0.1, 0.01); }), HasSubstr("a step from t = 0.1"));
        EXPECT_THAT(fail([&] { slave->doStep(0, -1); }), HasSubstr("a step of -1 s"));
        EXPECT_THAT(fail([&] { slave->set("push", SimTK::NaN); }), HasSubstr("finite number"));
        EXPECT_THAT(fail([&] { slave->set("x", 1); }), HasSubstr("cannot be set"));
        EXPECT_TRUE(slave->doStep(0, 0.01));
        FmuSlave early(std::make_shared<const FmuUnit>(folder / "model.fmu"), "early",
                       inThisProcess());
        EXPECT_THAT(fail([&] { early.doStep(0, 0.01); }),
                    HasSubstr("before the unit is initialized"));
        EXPECT_NO_THROW(early.reset());
    }
}

TEST_F(FmuTest, AnEventThatEndsTheMotionEndsTheSimulation) {
    for (const int version : {2, 3}) {
        const auto slave = begin(make(
            std::string(kCart) + "events: {far: {when: x > 0.05, do: [{stop: true}]}}\n", version));
        EXPECT_TRUE(slave->doStep(0, 0.1));
        EXPECT_FALSE(slave->doStep(0.1, 1));
        EXPECT_NEAR(slave->get("x"), 0.05, 1e-6);
        EXPECT_LT(slave->get("time"), 1);
        EXPECT_THROW(slave->doStep(slave->get("time"), 0.1), std::runtime_error);
    }
}

TEST_F(FmuTest, NumbersAreThoseOfAnyLanguage) {
    const std::string before = make(kCart, 2);
    const Values expected = drive(*begin(before), 0, 10);
    const test::GermanLocale german(folder.makeFolder("locale"));
    const std::string path = make(kCart, 2, "german");
    FmuSlave slave(std::make_shared<const FmuUnit>(path), "instance", inThisProcess());
    slave.set("parameters.stiffness", 50.000000000000001);
    slave.enterInitialization(0);
    slave.exitInitialization();
    EXPECT_EQ(drive(slave, 0, 10), expected);
    EXPECT_EQ(testing::readText(path), testing::readText(before));
}

/** Plant and controller in co-simulation, each with the other's outputs at the start of the step:
the error is first order in the step. **/
TEST_F(FmuTest, PlantAndControllerAgreeWithTheWholeToTheCouplingsOrder) {
    const std::string arm =
        "simflex: 1\ngravity: [0, -9.81, 0]\n"
        "bodies: {rod: {mass: 2, inertia: [1/6, 0.001, 1/6], place: {position: [0, -0.5, 0]}}}\n"
        "joints: {pivot: {type: pin, between: [ground, {on: rod, position: [0, 0.5, 0]}], axis: "
        "z}}\n"
        "probes: {angle: {coordinate: pivot}}\nsolver: {accuracy: 1e-8}\n";
    const std::string law =
        "pid: {input: 0.5 - angle, proportional: 80, integral: 30, derivative: "
        "12, filter: 0.02}";
    const std::string whole = arm + "states: {loop: {" + law +
                              "}}\nconnectors: {motor: {type: motor, "
                              "joint: pivot, law: loop}}\n";
    const std::string plant = arm +
                              "inputs: {torque: {unit: N m}}\nconnectors: {motor: {type: "
                              "motor, joint: pivot, law: torque}}\n";
    const std::string controller =
        "simflex: 1\nbodies: {still: {mass: 1, shape: {sphere: 0.1}, mobilizer: {type: slider}}}\n"
        "inputs: {angle: {unit: rad}}\nstates: {loop: {" +
        law + "}}\nprobes: {torque: {state: loop, unit: N m}}\nsolver: {accuracy: 1e-8}\n";
    writeModel(whole);
    Session session(loadModelText(folder / "model.yaml"));
    session.runTo(0.5, 2e-3);
    const ProbeRecord& expected = session.getRecord();
    const std::string plantFile = make(plant, 2, "plant"),
                      controllerFile = make(controller, 3, "controller");
    // Returns the largest error over all common times.
    const auto calcError = [&](int stepsEach) {
        const auto body = begin(plantFile), brain = begin(controllerFile);
        double largest = 0;
        for (int k = 0; k < 250 * stepsEach; ++k) {
            const double t = 2e-3 * k / stepsEach, angle = body->get("angle"),
                         torque = brain->get("torque");
            if (k % stepsEach == 0)
                largest =
                    std::max(largest, std::abs(angle - expected.rows[size_t(k / stepsEach)][0]));
            body->set("torque", torque);
            brain->set("angle", angle);
            body->doStep(t, 2e-3 / stepsEach);
            brain->doStep(t, 2e-3 / stepsEach);
        }
        return largest;
    };
    const double coarse = calcError(1), fine = calcError(2), finer = calcError(4);  // of 2 ms
    EXPECT_NEAR(coarse / fine, 2, 0.2);
    EXPECT_NEAR(fine / finer, 2, 0.1);
}

#ifdef SIMFLEX_DRIVER
/** Uses the copies of all libraries in the unpacked FMU. **/
TEST_F(FmuTest, AProgramThatKnowsNothingOfSimflexMovesTheUnit) {
    writeModel(kCart);
    ASSERT_EQ(runProgram("'" SIMFLEX_PROGRAM "'", "fmu model.yaml -o model.fmu -q"), 0) << err;
    EXPECT_THAT(out, HasSubstr("model.fmu: FMI 2.0 for co-simulation"));
    EXPECT_THAT(out, HasSubstr("parameters  stiffness, twice\n"));
    EXPECT_THAT(out, HasSubstr("inputs      push\n"));
    const fs::path unpacked = folder.makeFolder("unpacked");
    unpackZip(folder / "model.fmu", unpacked);
    const FmuDescription description = readFmuDescription(unpacked / "modelDescription.xml");
    const std::string library = unpacked / "binaries/linux64/model.so";
    const std::string tail = "'" + library + "' '" + (unpacked / "resources").string() + "' '" +
                             description.token + "' " +
                             std::to_string(description.find("push")->reference) + ' ' +
                             std::to_string(description.find("x")->reference) + " 100";
    std::string others;
    for (const char* output : {"a.x", "x", "power"})
        others += ' ' + std::to_string(description.find(output)->reference);
    ASSERT_EQ(runProgram("'" SIMFLEX_DRIVER "'", tail + others), 0) << out << err;
    std::istringstream lines(out);
    std::string first, second, line;
    // By 2·push: a = push/m − …, power = push·v. The queried instance moves like the other.
    Values derivatives(3);
    for (double& derivative : derivatives) {
        std::getline(lines, line);
        derivative = std::atof(line.c_str());
    }
    EXPECT_NEAR(derivatives[0], 2 / 2.0, 1e-6);
    EXPECT_NEAR(derivatives[1], 0, 1e-12);
    std::getline(lines, first);
    std::getline(lines, second);
    EXPECT_EQ(first, second);
    const auto slave = begin(folder / "model.fmu");
    drive(*slave, 0, 99);
    EXPECT_NEAR(derivatives[2], 2 * slave->get("v"), 1e-6);
    const Values xs = drive(*slave, 99, 100);
    char expected[64];
    std::snprintf(expected, sizeof expected, "%a", xs.back());
    EXPECT_EQ(first, expected);
    int numOwn = 0;
    while (std::getline(lines, line)) {
        const bool isOfSystem =
            line.find("/libc.so") != line.npos || line.find("/libm.so") != line.npos ||
            line.find("/libresolv") != line.npos || line.find("/libstdc++") != line.npos ||
            line.find("/libgcc_s") != line.npos || line.find("/ld-") != line.npos;
        if (!isOfSystem) {
            EXPECT_THAT(line, HasSubstr(unpacked.string())) << "is not the unit's own";
        }
        numOwn += line.find(unpacked.string()) != line.npos;
    }
    EXPECT_GT(numOwn, 10);

#ifdef SIMFLEX_REFERENCE
    for (const char* version : {"2", "3"}) {
        if (*version == '3') make(kCart, 3);
        const fs::path place = folder.makeFolder(std::string("reference") + version);
        unpackZip(folder / "model.fmu", place);
        const std::string token = readFmuDescription(place / "modelDescription.xml").token;
        setenv("LD_LIBRARY_PATH", SIMFLEX_BINARY_DIR "/lib", 1);
        EXPECT_EQ(runProgram("'" SIMFLEX_REFERENCE "'",
                             std::string(version) + " '" +
                                 (place / "binaries" /
                                  (*version == '3' ? "x86_64-linux" : "linux64") / "model.so")
                                     .string() +
                                 "' '" + (place / "resources").string() + "' '" + token + "' " +
                                 std::to_string(description.find("push")->reference) + ' ' +
                                 std::to_string(description.find("x")->reference) + " 100"),
                  0)
            << err;
        unsetenv("LD_LIBRARY_PATH");
        EXPECT_EQ(out, std::string(expected) + '\n') << "FMI " << version;
    }
#endif
}
#endif

}  // namespace
}  // namespace simflex
