/** @file
Untrusted FMUs: none runs without permission, and a failing one does not crash the run. **/

#include <chrono>
#include <filesystem>

#include "cli/run/RunTest.h"
#include "fmu/RunningFmus.h"
#include "simflex/base/SecondsSince.h"
#include "simflex/base/ZipFile.h"
#include "simflex/fmi/FmuUnit.h"

namespace simflex {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

const char* const kHeldRod =
    "controllers:\n"
    "  pid: {fmu: x.fmu, inputs: {angle: turned}, outputs: [torque], period: 1e-2}\n"
    "connectors: {motor: {type: motor, joint: pivot, law: pid.torque}}\n"
    "probes: {turned: {coordinate: pivot}, torque: {expression: pid.torque, unit: N m}}\n"
    "analyses:\n"
    "  early: {type: transient, duration: 0.04, interval: 0.01}\n"
    "  late: {type: transient, duration: 0.2, interval: 0.01}\n";

const char* const kUnruly =
    "<fmiModelDescription fmiVersion=\"2.0\" modelName=\"unruly\" guid=\"{1}\">"
    "<CoSimulation modelIdentifier=\"unruly\" canGetAndSetFMUstate=\"true\" "
    "canSerializeFMUstate=\"true\"/>"
    "<ModelVariables><ScalarVariable name=\"angle\" valueReference=\"0\" causality=\"input\">"
    "<Real/></ScalarVariable><ScalarVariable name=\"torque\" valueReference=\"1\" "
    "causality=\"output\"><Real/></ScalarVariable></ModelVariables></fmiModelDescription>";

class UnrulyFmuTest : public RunTest {
protected:
    void SetUp() override {
        RunTest::SetUp();
        writeModel(makePendulum("0.3", kHeldRod));
        pack("none");
    }

    void pack(const std::string& fault, const std::string& xml = kUnruly,
              const std::string& library = testing::readText(SIMFLEX_UNRULY_UNIT)) {
        ZipWriter zip(folder / "x.fmu");
        zip.add("modelDescription.xml", xml);
        zip.add("resources/fault.txt", fault);
        zip.add("binaries/linux64/unruly.so", library);
        zip.finish();
    }

    int call(const std::string& arguments) {
        return runProgram("SIMFLEX_CACHE=cache '" SIMFLEX_PROGRAM "'", arguments);
    }

    /** Whether it was loaded since the last call. **/
    bool wasLoaded() { return std::filesystem::remove(folder / "library_was_loaded"); }
};

TEST_F(UnrulyFmuTest, NoCommandLoadsAnFmuUnasked) {
    for (const char* command :
         {"run model.yaml", "run model.yaml --allow-scripts --rigid", "shell model.yaml -c list",
          "fmu model.yaml", "sweep model.yaml --vary parameters.angle=0.1,0.2"}) {
        EXPECT_NE(call(command), 0) << command;
        EXPECT_THAT(err + out, HasSubstr("FMU 'x.fmu' is a program")) << command;
        EXPECT_THAT(err + out, HasSubstr("--allow-fmus")) << command;
        EXPECT_FALSE(wasLoaded()) << command;
    }
    EXPECT_THROW(Session(loadModelText(folder / "model.yaml")), std::runtime_error);
    for (const char* more : {"", " --allow-fmus", " --fmus-in-process"}) {
        EXPECT_EQ(call(std::string("run model.yaml --check") + more), 0) << err;
        EXPECT_FALSE(wasLoaded()) << more;
    }
    ASSERT_EQ(runModel("--allow-fmus"), 0) << err;
    EXPECT_TRUE(wasLoaded());
    EXPECT_THAT(out, Not(HasSubstr("own words")));
    EXPECT_EQ(call("report model.results.h5"), 0) << err;
    EXPECT_EQ(call("post model.results.h5 --set probes.half='{expression: pid.torque/2}'"), 0)
        << err;
    EXPECT_FALSE(wasLoaded());
    EXPECT_THAT(testing::readText(folder / "model.results.html"), Not(HasSubstr("no motion")));
    const auto before = read("late"), after = read("late", "model.results.post.h5");
    EXPECT_EQ(find(after, "torque").rows, find(before, "torque").rows);
    for (size_t i = 0; i < before.time.size(); ++i)
        EXPECT_EQ(2 * find(after, "half").rows[i][0], find(before, "torque").rows[i][0]);
    EXPECT_GT(std::abs(find(before, "torque").rows.back()[0]), 0.1);
}

TEST_F(UnrulyFmuTest, AProcessOfItsOwnChangesNoBit) {
    ASSERT_EQ(runModel("--allow-fmus -o child.h5"), 0) << err;
    ASSERT_EQ(runModel("--fmus-in-process -o here.h5"), 0) << err;
    EXPECT_EQ(readWithoutSeconds("child.h5"), readWithoutSeconds("here.h5"));
    const auto& statistics = read("late", "child.h5").statistics;
    // One for each of 20 samples, three for the start.
    EXPECT_EQ(statistics.at("fmu_exchanges"), 23);
    EXPECT_GT(statistics.at("fmu_seconds"), statistics.at("fmu_library_seconds"));
}

TEST_F(UnrulyFmuTest, WhateverAnFmuDoesTheRunEndsAndKeepsWhatWasFinished) {
    const std::pair<const char*, const char*> faults[] = {
        {"crash", "its process was ended by signal 11"},
        {"abort", "its process was ended by signal 6"},
        {"exit", "its process left with exit status 0; it had been asked for a step"},
        {"close", ""},  // harmless
        {"loop", "a step has taken longer than 0.5 s; --fmu-timeout"},
        {"nan", "controller 'pid' gives no finite 'torque' at t = 0.0"},
        {"discard", "instance 'pid': a step has failed"},
        {"fail", "instance 'pid': a step has failed"},
        {"fatal", "instance 'pid': a step has failed"}};
    for (const auto& [fault, message] : faults) {
        pack(fault);
        const bool isHarmless = message == std::string();
        EXPECT_EQ(runModel("--allow-fmus --fmu-timeout 0.5"), isHarmless ? 0 : 1) << fault << err;
        EXPECT_THAT(err, HasSubstr(message)) << fault;
        if (!isHarmless && fault != std::string("nan")) {
            EXPECT_THAT(err, HasSubstr("x.fmu': instance 'pid': ")) << fault;
        }
        const auto early = read("early"), late = read("late");
        EXPECT_TRUE(early.isComplete) << fault;
        EXPECT_EQ(early.time.size(), 5u) << fault;
        EXPECT_EQ(late.isComplete, isHarmless) << fault;
        // Up to the failed sample.
        ASSERT_GE(late.time.size(), 5u) << fault;
        EXPECT_EQ(late.time.size() == 21, isHarmless) << fault;
        EXPECT_EQ(find(late, "turned").rows[4], find(early, "turned").rows[4]) << fault;
    }
    for (const char* fault : {"no_instance", "no_start"}) {
        pack(fault);
        EXPECT_EQ(runModel("--allow-fmus"), 1) << fault;
        EXPECT_THAT(err, HasSubstr(fault == std::string("no_start")
                                       ? "instance 'pid': initialization has failed"
                                       : "instance 'pid': it gives no instance"));
    }
    for (const char* fault : {"exit", "fatal"}) {  // in this process
        pack(fault);
        EXPECT_EQ(runModel("--fmus-in-process"), 1) << fault;
        EXPECT_TRUE(read("early").isComplete) << fault;
    }
}

TEST_F(UnrulyFmuTest, ASweepNamesTheCaseWhoseFmuCrashes) {
    pack("crash");
    EXPECT_NE(call("sweep model.yaml --vary parameters.angle=0.1,0.2 --jobs 1 --allow-fmus"), 0);
    EXPECT_THAT(err + out, HasSubstr("ended by signal 11"));
}

TEST_F(UnrulyFmuTest, ASweepFindsOutCasesThatTheirFmuHasEnded) {
    pack("leave");
    EXPECT_NE(call("sweep model.yaml --vary parameters.angle=0.1,0.2 --jobs 1 --fmus-in-process"),
              0);
    EXPECT_THAT(err + out, HasSubstr("has ended it: analysis 'late' is not complete"));
    EXPECT_THAT(err + out, HasSubstr("2 of 2 cases failed"));
}

TEST_F(UnrulyFmuTest, CtrlCEndsARunWhoseFmuDoesNotAnswer) {
    pack("loop");
    const auto start = std::chrono::steady_clock::now();
    EXPECT_EQ(runProgram("timeout --preserve-status -s INT 2 '" SIMFLEX_PROGRAM "'",
                         "run model.yaml --quiet --allow-fmus"),
              130)
        << err;
    EXPECT_LT(secondsSince(start), 20);
    EXPECT_TRUE(read("early").isComplete);
}

TEST_F(UnrulyFmuTest, ASessionGoesBackBehindACrash) {
    pack("crash");
    Session session(loadModelText(folder / "model.yaml"), allow(inChildProcess()));
    session.runTo(0.035, 0.1);
    const SavedState saved = session.save();
    const double there = session.get("turned")[0];
    EXPECT_THROW(session.runTo(0.2, 0.1), std::runtime_error);
    session.restore(saved);
    EXPECT_EQ(session.get("turned")[0], there);
    session.runTo(0.045, 0.1);
    pack("none");
    Session other(loadModelText(folder / "model.yaml"), allow(inChildProcess()));
    other.runTo(0.035, 0.1);
    other.runTo(0.045, 0.1);
    EXPECT_EQ(session.get("turned")[0], other.get("turned")[0]);
}

TEST_F(UnrulyFmuTest, WhatWouldCrashReadersIsRefused) {
    std::string deep = kUnruly;
    const int numLevels = 200000;
    std::string open, closed;
    for (int i = 0; i < numLevels; ++i) open += "<a>", closed += "</a>";
    deep.insert(deep.find("<ModelVariables>"), open + closed);
    pack("none", deep);
    EXPECT_EQ(call("run model.yaml --check"), 1);
    EXPECT_THAT(err, HasSubstr("modelDescription.xml has more than 100 elements in one another"));
    std::string wide = "<a";
    for (int i = 0; i < 100000; ++i) wide += " a" + std::to_string(i) + "='='";
    deep = kUnruly;
    deep.insert(deep.find("<ModelVariables>"), wide + "/>");
    pack("none", deep);
    EXPECT_EQ(call("run model.yaml --check"), 1);
    EXPECT_THAT(err, HasSubstr("an element with more than 1000 attributes"));
    for (const char* trick : {"<!-- </a> -->", "<![CDATA[</a>]]>", "<b c='</a>'/>"}) {
        deep = kUnruly;
        std::string tricked;
        for (int i = 0; i < numLevels; ++i) tricked += std::string("<a>") + trick;
        deep.insert(deep.find("<ModelVariables>"), tricked);
        pack("none", deep);
        EXPECT_EQ(call("run model.yaml --check"), 1) << trick;
    }
    // Breadth is not limited.
    deep = kUnruly;
    std::string flat;
    for (int i = 0; i < 2000; ++i) flat += "<a b=\"</\"><!-- <c> --></a>";
    deep.insert(deep.find("<ModelVariables>"), flat);
    pack("none", deep);
    EXPECT_EQ(call("run model.yaml --check"), 0) << err;

    const std::string whole = testing::readText(SIMFLEX_UNRULY_UNIT);
    for (size_t size = 0; size < whole.size(); size += whole.size() / 7) {
        pack("none", kUnruly, whole.substr(0, size));
        EXPECT_EQ(runModel("--fmus-in-process"), 1) << size;
        EXPECT_THAT(err, HasSubstr("its library linux64/unruly.so is damaged or cut off")) << size;
    }
    std::string damaged = whole;
    for (size_t i = damaged.size() / 3; i < damaged.size(); ++i) damaged[i] = char(~damaged[i]);
    pack("none", kUnruly, damaged);
    EXPECT_EQ(runModel("--allow-fmus"), 1);
    EXPECT_THAT(err, HasSubstr("x.fmu'"));
}

}  // namespace
}  // namespace simflex
