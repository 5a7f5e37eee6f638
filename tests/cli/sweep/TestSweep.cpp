/** @file
Sweeps: each case runs once in a separate process, however many sweeps share them. **/

#include <gmock/gmock.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>
#include <sstream>

#include "cli/CliTest.h"
#include "simflex/base/Interruption.h"
#include "simflex/cli/ProgressBar.h"
#include "simflex/model/sweep/SweepResults.h"
#include "simflex/model/sweep/SweepRunner.h"
#include "simflex/model/sweep/SweepTable.h"
#include "simflex/part/Hdf5.h"

namespace simflex {
namespace {

using namespace model;
namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::DoubleNear;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Status = SweepOutcome::Status;

/** Sweeps of a stub for `simflex run`. **/
class SweepRunnerTest : public ::testing::Test {
protected:
    SweepPlan makePlan(const std::string& speeds) {
        testing::writeText(folder / "m.yaml", "simflex: 1\nparameters: {speed: 1}\n");
        SweepPlan plan;
        plan.model = loadModelText(folder / "m.yaml");
        plan.keys = {parseSweptKey("speed=" + speeds)};
        makeSweepCases(plan, SweepOrder::Grid);
        checkSweepCases(plan);
        return plan;
    }
    SweepOptions makeOptions() {
        SweepOptions options;
        options.folder = folder / "sweep";
        options.program = SWING_PROGRAM;
        options.numJobs = 2;
        options.listener.progress = [](const std::string&, double, const auto&) {
            return !wasInterrupted();
        };
        return options;
    }
    std::vector<Status> run(const SweepPlan& plan) {
        std::vector<Status> status;
        for (const SweepOutcome& outcome : runSweep(plan, makeOptions()))
            status.push_back(outcome.status);
        return status;
    }
    /** Lines of runs.txt, sorted. **/
    std::vector<std::string> listRuns() {
        std::istringstream in(testing::readText(folder / "sweep/runs.txt"));
        std::vector<std::string> lines;
        for (std::string line; std::getline(in, line);) lines.push_back(line);
        std::sort(lines.begin(), lines.end());
        return lines;
    }

    testing::TestFolder folder;
};

TEST_F(SweepRunnerTest, WhatIsCompleteIsNotDoneAgainAndWhatFailedStopsNobody) {
    const SweepPlan plan = makePlan("1,-2,3");
    EXPECT_THAT(run(plan), ElementsAre(Status::Complete, Status::Failed, Status::Complete));
    EXPECT_THAT(listRuns(), ElementsAre("-2", "1", "3"));
    EXPECT_EQ(readSweepOutcomes(plan, folder / "sweep")[1].error, "the speed is negative");
    EXPECT_THAT(run(makePlan("1,-2,3,4")),
                ElementsAre(Status::Complete, Status::Failed, Status::Complete, Status::Complete));
    EXPECT_THAT(listRuns(), ElementsAre("-2", "-2", "1", "3", "4"));  // failed cases are retried
    SweepPlan other = plan;
    other.model.settings = {"solver.accuracy=1e-5"};  // changes all cases
    EXPECT_THAT(run(other), ElementsAre(Status::Complete, Status::Failed, Status::Complete));
    EXPECT_EQ(listRuns().size(), 8u);
    EXPECT_TRUE(fs::exists(folder / "sweep/speed=1/results.h5.before-1/results.h5"));
}

TEST_F(SweepRunnerTest, CtrlCStopsTheCasesAndTheSameSweepGoesOn) {
    const SweepPlan plan = makePlan("1,2,7");
    const pid_t child = testing::startChild([&] {
        catchInterrupts();
        const auto outcomes = runSweep(plan, makeOptions());
        return outcomes[2].status == Status::Interrupted ? 0 : 1;
    });
    testing::await("two cases and the begin of the third", [&] {
        const auto outcomes = readSweepOutcomes(plan, folder / "sweep");
        return (outcomes[0].status == Status::Complete && outcomes[1].status == Status::Complete &&
                listRuns().size() == 3) ||
               testing::hasEnded(child);
    });
    kill(child, SIGINT);
    int status = 0;
    waitpid(child, &status, 0);
    EXPECT_EQ(status, 0);
    EXPECT_EQ(readSweepOutcomes(plan, folder / "sweep")[2].status, Status::Interrupted);
    EXPECT_THAT(run(plan), ElementsAre(Status::Complete, Status::Complete, Status::Complete));
    EXPECT_THAT(listRuns(), ElementsAre("1", "2", "7", "7 on"));
}

TEST_F(SweepRunnerTest, ProcessesThatShareAFolderDoEachCaseOnce) {
    const SweepPlan plan = makePlan("10:29:20");
    std::vector<pid_t> children;
    for (int rank = 0; rank < 3; ++rank) {
        children.push_back(testing::startChild([&] {
            SweepOptions options = makeOptions();
            options.share = {SweepShare::Kind::Rank, rank, 3};
            const auto outcomes = runSweep(plan, options);
            const bool isWhole =
                std::all_of(outcomes.begin(), outcomes.end(),
                            [](const auto& outcome) { return outcome.status == Status::Complete; });
            return rank > 0 || isWhole ? 0 : 1;  // the first rank waits for the others
        }));
    }
    for (const pid_t child : children) {
        int status = 0;
        waitpid(child, &status, 0);
        EXPECT_EQ(status, 0);
    }
    std::vector<std::string> expected;
    for (int speed = 10; speed < 30; ++speed) expected.push_back(std::to_string(speed));
    EXPECT_EQ(listRuns(), expected);
}

TEST_F(SweepRunnerTest, LongTablesKeepTheNamesOfAllCases) {
    SweepPlan plan = makePlan("1,2");
    std::vector<std::string> folders, values;
    plan.cases.clear();
    for (int k = 0; k < 3000; ++k) {
        values.push_back(std::to_string(k) + "*(a value that is given as quite a long formula)");
        folders.push_back("case_" + std::to_string(k) + std::string(k == 7 ? 300 : 20, 'x'));
        plan.cases.push_back({{values.back()}, folders.back(), "not now"});
    }
    fs::create_directories(folder / "sweep");
    writeSweepTable(plan, folder / "sweep");
    const hdf5::Handle file = hdf5::openFile(folder / "sweep/sweep.h5");
    EXPECT_EQ(hdf5::readTexts(file, "folders"), folders);
    EXPECT_EQ(hdf5::readTexts(hdf5::openGroup(file, "texts"), "speed"), values);
}

TEST_F(SweepRunnerTest, TheTableHasTheStatisticsOfEachCase) {
    SweepPlan plan = makePlan("1,-2,3");
    run(plan);
    plan.of = {"turn.maximum", "turn.mean", "turn.rms"};
    const std::string path = writeSweepTable(plan, folder / "sweep");
    const std::string csv = testing::readText(path);
    EXPECT_THAT(csv, HasSubstr("case,speed,status,turn.maximum [rad],turn.mean [rad],turn.rms "
                               "[rad],error\nspeed=1,1,complete,1,0.5"));
    EXPECT_THAT(csv, HasSubstr("\nspeed=-2,-2,failed,,,,the speed is negative\n"));
    const SweepTable table =
        makeSweepTable(plan, readSweepOutcomes(plan, folder / "sweep"), folder / "sweep");
    ASSERT_EQ(table.columns.size(), 3u);
    EXPECT_NEAR(table.columns[0].values[2], 3, 1e-15);
    EXPECT_TRUE(std::isnan(table.columns[0].values[1]));
    EXPECT_NEAR(table.columns[1].values[2], 1.5, 1e-14);
    // Of 3 t over 1 s: 3/sqrt(3), and h²/2 of the trapezoidal rule's error.
    EXPECT_NEAR(table.columns[2].values[2], std::sqrt(3.0 + 9 * 0.01 / 6), 1e-14);
    plan.of = {"trun.maximum"};
    EXPECT_THROW(writeSweepTable(plan, folder / "sweep"), std::runtime_error);
}

/** The built program on a rigid pendulum: a rod of 1 m and 2 kg, I = 2/3 kg m² about its pin. **/
class SweepTest : public CliTest {
protected:
    void SetUp() override {
        CliTest::SetUp();
        setenv("OMPI_ALLOW_RUN_AS_ROOT", "1", 1);
        setenv("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1", 1);
        setenv("OMPI_MCA_rmaps_base_oversubscribe", "1", 1);
        testing::writeText(folder / "model.yaml",
                           "simflex: 1\n"
                           "gravity: [0, -9.81, 0]\n"
                           "parameters: {mass: 2}\n"
                           "bodies: {rod: {mass: mass, inertia: [1/6, 0.001, 1/6], place: "
                           "{position: [0, -0.5, 0]}}}\n"
                           "joints: {pin: {type: pin, between: [ground, {on: rod, position: [0, "
                           "0.5, 0]}], axis: z}}\n"
                           "analyses: {modes: {type: eigen, count: 1}}\n");
    }

    /** Returns the frequency in a case's row of the table [Hz]. **/
    double findFrequency(const std::string& name) {
        const std::string csv = testing::readText(folder / "out/sweep.csv");
        const size_t line = csv.find("\n" + name), status = csv.find("complete,", line);
        if (line == std::string::npos || status == std::string::npos) return NAN;
        return std::atof(csv.c_str() + status + 9);
    }

    static double calcFrequency(double mass, double gravity) {
        return std::sqrt(mass * gravity * 0.5 / (1.0 / 6 + mass * 0.25)) / (2 * M_PI);
    }
};

TEST_F(SweepTest, FrequenciesOfAPendulumAreThoseOfItsFormula) {
    ASSERT_EQ(run("sweep model.yaml --vary mass=1:3:2 --vary 'gravity=[0,-1.62,0],[0,-9.81,0]' -o "
                  "out -q"),
              0)
        << err;
    EXPECT_THAT(out, HasSubstr("out/sweep.csv: 4 of 4 cases are complete"));
    for (const double mass : {1.0, 3.0})
        for (const double gravity : {1.62, 9.81}) {
            char name[60];
            std::snprintf(name, sizeof name, "mass=%g_gravity=-0--%g-0-", mass, gravity);
            EXPECT_NEAR(findFrequency(name) / calcFrequency(mass, gravity), 1, 1e-6) << name;
        }
    EXPECT_EQ(run("sweep model.yaml --vary mass=1:3:2 --vary 'gravity=[0,-1.62,0],[0,-9.81,0]' -o "
                  "out -q"),
              0);
    EXPECT_THAT(out, HasSubstr("4 of 4 cases are complete (4 were before)"));
}

TEST_F(SweepTest, CasesAreDoneAnewWhereAnIncludedFileHasChanged) {
    testing::Brick bar;
    testing::writeText(folder / "all.inp", "*INCLUDE, INPUT=bar.inp\n");
    testing::writeText(folder / "bar.inp", bar.text());
    testing::writeText(folder / "bar.yaml", R"(simflex: 1
parameters: {k: 1}
gravity: [0, -9.81*k, 0]
parts: {bar: {deck: all.inp, interfaces: {root: LEFT, tip: RIGHT}, modes: 14}}
bodies: {bar: {part: bar}}
joints: {hold: {type: weld, between: [ground, bar.root]}}
probes: {force: {reaction: hold, component: y}}
analyses: {rest: {type: static}}
)");
    const char sweep[] = "sweep bar.yaml --vary k=1,2 -o bars -q";
    ASSERT_EQ(run(sweep), 0) << err;
    ASSERT_EQ(run(sweep), 0) << err;
    EXPECT_THAT(out, HasSubstr("2 of 2 cases are complete (2 were before)"));
    bar.rho = 9000;
    testing::writeText(folder / "bar.inp", bar.text());
    ASSERT_EQ(run(sweep), 0) << err;
    EXPECT_THAT(out, HasSubstr("2 of 2 cases are complete"));
    EXPECT_THAT(out, ::testing::Not(HasSubstr("were before")));
    EXPECT_THAT(
        err,
        AllOf(
            HasSubstr("simflex: warning: the results of 2 cases are out of date (k=1: the file '"),
            HasSubstr("/all.inp' or one that it includes has changed since) and done anew")));
    EXPECT_FALSE(fs::exists(folder / "bars/k=1/results.h5.before-1"));

    // Cases that cannot be rerun are kept.
    const std::string old = testing::readText(folder / "bars/k=1/results.h5");
    testing::writeText(folder / "bar.inp", "*NODE\n1, 0, 0\n");
    EXPECT_EQ(run(sweep), 1);
    EXPECT_THAT(out, HasSubstr("0 of 2 cases are complete, 2 failed"));
    EXPECT_TRUE(testing::readText(folder / "bars/k=1/results.h5.before-1/results.h5") == old);
    testing::writeText(folder / "bar.inp", bar.text());
    ASSERT_EQ(run(sweep), 0) << err;
    EXPECT_FALSE(fs::exists(folder / "bars/k=1/results.h5.before-1"));
    // Cases from an unknown version of simflex are not reused.
    testing::writeText(folder / "bars/k=1/case.txt", "model m.yaml\nfiles 12\ncomplete\n");
    ASSERT_EQ(run(sweep), 0) << err;
    EXPECT_THAT(
        err,
        HasSubstr("the results of 1 case are out of date (k=1: another simflex has made them)"));
    EXPECT_THAT(out, HasSubstr("2 of 2 cases are complete (1 were before)"));
}

TEST_F(SweepTest, ACaseWithAWrongValueFailsAloneAndIsNamed) {
    EXPECT_EQ(run("sweep model.yaml --vary mass=1,-2,3 -o out -q"), 1);
    EXPECT_THAT(err, AllOf(HasSubstr("1 of 3 cases failed, first mass=-2: "),
                           HasSubstr("model.yaml:"), HasSubstr("-2")));
    EXPECT_NEAR(findFrequency("mass=3") / calcFrequency(3, 9.81), 1, 1e-6);
    EXPECT_THAT(testing::readText(folder / "out/sweep.csv"), HasSubstr("\nmass=-2,-2,failed,"));
    EXPECT_THAT(testing::readText(folder / "out/mass=-2/log.txt"), HasSubstr("model.yaml:"));

    EXPECT_EQ(run("sweep model.yaml --vary mass=-1,-2 -o none -q"), 1);
    EXPECT_THAT(err, HasSubstr("case mass=-1: "));
    EXPECT_FALSE(std::filesystem::exists(folder / "none"));
    EXPECT_EQ(run("sweep model.yaml --vary mass=1,-2 --dry-run"), 0);
    EXPECT_THAT(out, AllOf(HasSubstr("mass=1\n"), HasSubstr("mass=-2: ")));
}

TEST_F(SweepTest, TheTableHasCriticalSpeedsOfCampbellDiagrams) {
    std::string text = testing::readText(folder / "model.yaml");
    text.replace(text.find("-9.81"), 5, "-pull");
    text.replace(text.find("{mass: 2}"), 9, "{mass: 2, speed: 1, pull: 9.81}");
    text.replace(text.find("{modes:"), 1,
                 "{whirl: {type: campbell, speeds: [0, 2, 4, 8], count: 1}, ");
    testing::writeText(folder / "model.yaml", text);
    ASSERT_EQ(run("sweep model.yaml --vary pull=1.62,9.81,98.1 --only whirl -o out -q"), 0) << err;
    const SweepResults sweep = readSweepTable(folder / "out/sweep.h5", "pull");
    const auto find = [&](const std::string& name, size_t k) {
        for (const Results::Series& series : sweep.results.at(0).analyses.at(0).probes)
            if (series.column.name == name) return series.rows.at(k).at(0);
        ADD_FAILURE() << "there is no column " << name;
        return 0.0;
    };
    const std::vector<double> gravities = {1.62, 9.81, 98.1};
    for (size_t k = 0; k < 3; ++k) {
        const double frequency = calcFrequency(2, gravities[k]);
        EXPECT_NEAR(find("frequency 1 at first speed", k) / frequency, 1, 1e-6);
        EXPECT_NEAR(find("frequency 1 at last speed", k) / frequency, 1, 1e-6);
        EXPECT_NEAR(find("damping ratio 1 at last speed", k), 0, 1e-6);
        const double critical = find("critical speed 1", k);
        if (k < 2)
            EXPECT_NEAR(critical / (2 * M_PI * frequency), 1, 1e-6);
        else
            EXPECT_TRUE(std::isnan(critical));  // 12 rad/s, beyond all speeds
    }
}

TEST_F(SweepTest, AColumnIsOneModeThoughFrequenciesCross) {
    testing::writeText(folder / "model.yaml", R"(simflex: 1
parameters: {k: 50}
bodies:
  one: {mass: 1, inertia: [0.01, 0.01, 0.01], mobilizer: {type: slider, parent: ground}}
  two: {mass: 1, inertia: [0.01, 0.01, 0.01], mobilizer: {type: slider, parent: ground}}
probes: {x: {position: one, component: x}, y: {position: two, component: x}}
loads:
  fixed: {on: one, force: ["-100*x", 0, 0]}
  varied: {on: two, force: ["-k*y + x", 0, 0]}
analyses: {modes: {type: eigen}}
)");
    ASSERT_EQ(run("sweep model.yaml --vary k=50,90,110,200 -o crossing -q"), 0) << err;
    const SweepResults sweep = readSweepTable(folder / "crossing/sweep.h5", "k");
    for (const Results::Series& series : sweep.results.at(0).analyses.at(0).probes)
        for (size_t k = 0; k < 4; ++k) {
            const double varied = std::vector<double>{50, 90, 110, 200}[k];
            if (series.column.name == "frequency 1") {
                EXPECT_NEAR(series.rows[k][0], std::sqrt(varied) / (2 * M_PI), 1e-6);
            }
            if (series.column.name == "frequency 2") {
                EXPECT_NEAR(series.rows[k][0], 10 / (2 * M_PI), 1e-6);
            }
        }
}

TEST_F(SweepTest, AMotionThatDoesNotOscillateHasNoFrequency) {
    testing::writeText(folder / "model.yaml", R"(simflex: 1
parameters: {d: 1}
bodies: {one: {mass: 1, inertia: [0.01, 0.01, 0.01], mobilizer: {type: slider, parent: ground}}}
probes: {x: {position: one, component: x}, v: {velocity: one, component: x}}
loads: {all: {on: one, force: ["-100*x - d*v", 0, 0]}}
analyses: {modes: {type: eigen}}
)");
    ASSERT_EQ(run("sweep model.yaml --vary d=12,50 -o out -q"), 0) << err;
    const SweepResults sweep = readSweepTable(folder / "out/sweep.h5", "d");
    int numFound = 0;
    for (const Results::Series& series : sweep.results.at(0).analyses.at(0).probes) {
        if (series.column.name == "frequency 1") {
            EXPECT_NEAR(series.rows.at(0)[0], 10 / (2 * M_PI), 1e-6);
            EXPECT_TRUE(std::isnan(series.rows.at(1)[0]));
            ++numFound;
        }
        if (series.column.name == "damping ratio 1") {
            EXPECT_NEAR(series.rows.at(0)[0], 0.6, 1e-6);
            EXPECT_NEAR(series.rows.at(1)[0], 1, 1e-6);
            ++numFound;
        }
    }
    EXPECT_EQ(numFound, 2);
}

TEST_F(SweepTest, TheTableIsDrawnOverAParameter) {
    ASSERT_EQ(run("sweep model.yaml --vary mass=3,1,2 --vary 'gravity=[0,-1.62,0],[0,-9.81,0]' -o "
                  "out -q"),
              0)
        << err;
    const SweepResults sweep = readSweepTable(folder / "out/sweep.h5", "");
    EXPECT_EQ(sweep.key, "mass");
    EXPECT_THAT(sweep.labels, ElementsAre("gravity=[0,-1.62,0]", "gravity=[0,-9.81,0]"));
    for (size_t g = 0; g < 2; ++g) {
        const Results::Analysis& analysis = sweep.results.at(g).analyses.at(0);
        EXPECT_EQ(analysis.time, (std::vector<double>{1, 2, 3}));
        const auto frequency =
            std::find_if(analysis.probes.begin(), analysis.probes.end(),
                         [](const auto& series) { return series.column.name == "frequency 1"; });
        ASSERT_NE(frequency, analysis.probes.end());
        for (size_t k = 0; k < 3; ++k)
            EXPECT_NEAR(frequency->rows[k][0], calcFrequency(double(k) + 1, g ? 9.81 : 1.62), 1e-6);
    }
    ASSERT_EQ(run("plot out/sweep.h5 'frequency*' -o map.svg"), 0) << err;
    EXPECT_THAT(testing::readText(folder / "map.svg"),
                AllOf(HasSubstr("\nmass\n"), HasSubstr("frequency 1 [Hz]")));
    EXPECT_EQ(run("plot out --x mas"), 1);
    EXPECT_THAT(err, HasSubstr("it has gravity, mass"));
    EXPECT_EQ(run("plot out/sweep.h5 --x gravity"), 1);
    EXPECT_THAT(err, HasSubstr("no numbers"));
}

TEST_F(SweepTest, TheTableOfAMapHasTheCasesOwnValues) {
    ASSERT_EQ(run("sweep model.yaml --vary mass=1,2,5 --only shake -o out -q "
                  "--set 'loads={push: {on: rod, force: [0, 0, 0]}}' "
                  "--set 'probes={x: {position: rod, component: x}}' "
                  "--set 'analyses={shake: {type: frequency_response, inputs: "
                  "[loads.push.force.x], outputs: [x], frequencies: [0.1, 0.25, 0.3, 0.4]}}'"),
              0)
        << err;
    ASSERT_EQ(run("plot out x --map --to 0.36 -o map.png --csv map.csv"), 0) << err;
    std::istringstream csv(testing::readText(folder / "map.csv"));
    std::string line;
    // Between 0.3 and 0.4 Hz the analysis adds 0.35 Hz, since the resonances are near.
    std::set<std::pair<double, double>> places[2];
    size_t panel = 0;
    ASSERT_TRUE(std::getline(csv, line));
    EXPECT_THAT(line, HasSubstr("mass,frequency [Hz],x"));
    while (std::getline(csv, line)) {
        if (line.rfind("mass", 0) == 0) {
            EXPECT_THAT(line, HasSubstr("mass,frequency [Hz],phase of x"));
            ASSERT_EQ(++panel, 1u);
            continue;
        }
        double mass = NAN, hertz = NAN, value = NAN;
        ASSERT_EQ(std::sscanf(line.c_str(), "%lf,%lf,%lf", &mass, &hertz, &value), 3) << line;
        EXPECT_TRUE(places[panel].insert({mass, hertz}).second) << line;
        const double w = 2 * M_PI * hertz,
                     turned = mass * 9.81 * 0.5 - (1.0 / 6 + mass * 0.25) * w * w;
        EXPECT_NEAR(value, panel == 0 ? 0.25 / turned : 0, 1e-6) << line;
    }
    EXPECT_EQ(places[0], places[1]);
    std::set<double> masses, frequencies;
    for (const auto& [mass, hertz] : places[0]) masses.insert(mass), frequencies.insert(hertz);
    EXPECT_THAT(masses, ElementsAre(1, 2, 5));
    EXPECT_THAT(frequencies, ElementsAre(0.1, 0.25, 0.3, DoubleNear(0.35, 1e-12)));
}

TEST_F(SweepTest, SeveralSweepsOfAModelHaveFoldersOfTheirOwn) {
    const std::string fall = "--set 'analyses.fall={type: transient, duration: 0.1}' ",
                      light =
                          "--set 'analyses.light={type: sweep, analysis: fall, parameters: "
                          "{mass: [1, 2]}}' ",
                      heavy =
                          "--set 'analyses.heavy={type: sweep, analysis: fall, parameters: "
                          "{mass: [5, 6, 7]}}' ";
    ASSERT_EQ(run("sweep model.yaml -q " + fall + light), 0) << err;
    EXPECT_THAT(out, HasSubstr("model.sweep/sweep.csv: 2 of 2"));
    EXPECT_EQ(run("sweep model.yaml -q " + fall + light + heavy), 1);
    EXPECT_THAT(err, HasSubstr("choose by --analysis light, heavy"));
    for (const std::string name : {"light", "heavy"}) {
        ASSERT_EQ(run("sweep model.yaml -q --analysis " + name + " " + fall + light + heavy), 0)
            << err;
        EXPECT_THAT(out, HasSubstr("model." + name + ".sweep/sweep.csv: "));
    }
    EXPECT_EQ(readSweepTable(folder / "model.light.sweep/sweep.h5", "").results[0].analyses[0].time,
              (std::vector<double>{1, 2}));
    EXPECT_EQ(readSweepTable(folder / "model.heavy.sweep/sweep.h5", "").results[0].analyses[0].time,
              (std::vector<double>{5, 6, 7}));
}

TEST_F(SweepTest, ASweepDoesNotReplaceTheTableOfAnother) {
    const auto sweep = [&](const std::string& vary) {
        return run(
            "sweep model.yaml -q -o out --set 'analyses={fall: {type: transient, duration: "
            "0.1}}' --vary " +
            vary);
    };
    ASSERT_EQ(sweep("mass=1,2"), 0) << err;
    EXPECT_EQ(sweep("gravity.1=-9,-10"), 1);
    EXPECT_THAT(err, HasSubstr("the folder 'out' has the table of another sweep"));
    EXPECT_THAT(err, HasSubstr("choose another folder with -o"));
    EXPECT_EQ(readSweepTable(folder / "out/sweep.h5", "").results[0].analyses[0].time,
              (std::vector<double>{1, 2}));
    ASSERT_EQ(sweep("mass=1,2,5"), 0) << err;
    EXPECT_THAT(out, HasSubstr("3 of 3 cases are complete (2 were before)"));
}

TEST_F(SweepTest, CasesDrawPicturesOnlyIfAsked) {
    const auto countPictures = [&](const std::string& where) {
        int count = 0;
        for (const auto& entry : std::filesystem::recursive_directory_iterator(folder / where))
            count += entry.path().extension() == ".png";
        return count;
    };
    const std::string command =
        "sweep model.yaml --vary mass=1,2 -q --set 'analyses={fall: {type: transient, duration: "
        "0.1}}' --set 'pictures={size: [64, 48], rate: 20}' -o ";
    ASSERT_EQ(run(command + "plain"), 0) << err;
    EXPECT_EQ(countPictures("plain"), 0);
    ASSERT_EQ(run(command + "drawn --pictures"), 0) << err;
    EXPECT_EQ(countPictures("drawn"), 2 * 3);  // at 0, 0.05, 0.1 s
    ASSERT_EQ(run(command + "plain --pictures"), 0) << err;
    EXPECT_EQ(countPictures("plain"), 2 * 3);
    EXPECT_THAT(err, HasSubstr("the wish for pictures has changed since"));
    ASSERT_EQ(run(command + "plain"), 0) << err;
    EXPECT_THAT(out, HasSubstr("(2 were before)"));
}

TEST_F(SweepTest, MistakesAreFoundBeforeAnythingRuns) {
    EXPECT_EQ(run("sweep model.yaml --vary mas=1,2"), 1);
    EXPECT_THAT(err, AllOf(HasSubstr("model.yaml"), HasSubstr("'mas'"), HasSubstr("mass")));
    EXPECT_EQ(run("sweep model.yaml --vary mass=y,x"), 1);
    EXPECT_THAT(err, HasSubstr("mass"));
    EXPECT_EQ(run("sweep model.yaml"), 1);
    EXPECT_THAT(err, HasSubstr("--vary"));
    EXPECT_EQ(access((folder / "model.sweep").c_str(), F_OK), -1);
}

TEST_F(SweepTest, RanksOfMpirunShareASweep) {
    ASSERT_EQ(runProgram("mpirun -n 2 '" SIMFLEX_PROGRAM "'",
                         "sweep model.yaml --vary mass=1,2,3,4 -o out --jobs 1"),
              0)
        << err;
    EXPECT_THAT(out, HasSubstr("4 of 4 cases are complete"));
    EXPECT_THAT(err, AllOf(HasSubstr("rank 0 of 2"), HasSubstr("rank 1 of 2")));
    EXPECT_NEAR(findFrequency("mass=4") / calcFrequency(4, 9.81), 1, 1e-6);
}

TEST_F(SweepTest, TasksOfAJobArrayDoTheirSharesAndTheLastCompletesTheTable) {
    for (int task = 1; task <= 2; ++task) {
        const std::string environment = "SLURM_ARRAY_TASK_ID=" + std::to_string(task) +
                                        " SLURM_ARRAY_TASK_MIN=1 SLURM_ARRAY_TASK_COUNT=2 ";
        ASSERT_EQ(runProgram(environment + "'" SIMFLEX_PROGRAM "'",
                             "sweep model.yaml --vary mass=1,2,3 -o out -q"),
                  0)
            << err;
        const std::string csv = testing::readText(folder / "out/sweep.csv");
        EXPECT_THAT(csv, HasSubstr("\nmass=3,3,complete,"));
        EXPECT_THAT(csv, HasSubstr(task == 1 ? "\nmass=2,2,waiting," : "\nmass=2,2,complete,"));
    }
}

}  // namespace
}  // namespace simflex
