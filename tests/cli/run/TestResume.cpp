/** @file
Runs that are interrupted in various ways, and resumed. **/

#include <fcntl.h>
#include <sys/wait.h>
#include <csignal>

#include <chrono>
#include <filesystem>
#include <set>
#include <thread>

#include "cli/run/RunTest.h"
#include "simflex/model/analyses/Provenance.h"
#include "simflex/model/analyses/RunCheckpoint.h"
#include "simflex/model/results/ResultWriter.h"

namespace simflex {
namespace {

using ::testing::HasSubstr;

/** Two pendulums, the second on the first: runs that differ by one bit diverge. A wheel makes many
turns, is braked through a filter state, and is driven by the number of times the tip has passed a
position. **/
const char kModel[] = R"(simflex: 1
gravity: [0, -9.81, 0]
bodies:
  upper: {mass: 1, inertia: [0.1, 0.01, 0.1], place: {position: [0.5, 0, 0], rotation: [0, 0, 90*deg]}}
  lower: {mass: 1, inertia: [0.1, 0.01, 0.1], place: {position: [1.5, 0, 0], rotation: [0, 0, 90*deg]}}
  wheel: {mass: 1, inertia: [0.1, 0.1, 0.1]}
joints:
  bearing: {type: pin, between: [ground, wheel], axis: z}
  first: {type: pin, between: [ground, {on: upper, position: [0, 0.5, 0]}], axis: z}
  second: {type: ball, between: [{on: upper, position: [0, -0.5, 0]}, {on: lower, position: [0, 0.5, 0]}]}
probes:
  tip: {position: {on: lower, position: [0, -0.5, 0]}}
  balance: {energy: balance}
  turned: {coordinate: bearing}
  spin: {rate: bearing}
  root: {expression: sqrt(0.03 - t)}
states: {lag: {low_pass: {input: spin, time_constant: 0.3}}}
connectors: {drive: {type: motor, joint: bearing, law: 0.02*passed - 0.1*lag}}
events: {passed: {when: tip.x > 0.3 && t > 0.1}}
initial: {rates: {bearing: 7}}
solver: {accuracy: 1e-8}
output: {checkpoint: 0.02}
analyses:
  short: {type: transient, duration: 0.2}
  long: {type: transient, duration: 10, interval: 0.01}
)";

class ResumeTest : public RunTest {
protected:
    /** Starts a run of model.yaml in the background. **/
    pid_t start(const std::vector<std::string>& more) {
        const pid_t child = fork();
        if (child != 0) return child;
        std::vector<std::string> words{SIMFLEX_PROGRAM, "run", "model.yaml", "--quiet"};
        words.insert(words.end(), more.begin(), more.end());
        std::vector<char*> arguments;
        for (std::string& word : words) arguments.push_back(word.data());
        arguments.push_back(nullptr);
        if (chdir(folder.path().c_str()) != 0) _exit(99);
        const int log = open("child.log", O_WRONLY | O_CREAT | O_TRUNC, 0666);
        dup2(log, STDOUT_FILENO);
        dup2(log, STDERR_FILENO);
        execv(arguments[0], arguments.data());
        _exit(98);
    }

    /** Waits until the run has written a checkpoint, or has ended. **/
    void awaitCheckpoint(pid_t child) {
        testing::await("a checkpoint", [&] {
            return access((folder / "model.results.h5.checkpoint").c_str(), F_OK) == 0 ||
                   testing::hasEnded(child);
        });
    }

    static int await(pid_t child) {
        int status = 0;
        waitpid(child, &status, 0);
        return status;
    }
};

TEST_F(ResumeTest, SaysWhereItGoesOn) {
    writeModel(kModel);
    // Between two analyses there is no checkpoint.
    const pid_t child = start({"--only", "long"});
    awaitCheckpoint(child);
    kill(child, SIGKILL);
    await(child);
    EXPECT_EQ(runProgram("'" SIMFLEX_PROGRAM "'", "run model.yaml --only long --resume"), 0) << err;
    EXPECT_THAT(
        err, ::testing::ContainsRegex(
                 "simflex: note: analysis '(short|long)' continues at t = [0-9.]+ of [0-9.]+ s"));
}

TEST_F(ResumeTest, KilledRunsGoOnToTheSameBytes) {
    writeModel(kModel);
    ASSERT_EQ(runModel("-o whole.h5"), 0) << err;
    const std::string summary = out;
    int numKilled = 0;
    std::vector<std::string> arguments;
    for (int kill_ = 0; kill_ < 4; ++kill_) {
        const pid_t child = start(arguments);
        awaitCheckpoint(child);
        std::this_thread::sleep_for(std::chrono::milliseconds(7 * kill_));
        kill(child, SIGKILL);
        numKilled += WIFSIGNALED(await(child));
        arguments = {"--resume"};
        if (kill_ == 0) {
            // Recorded rows can be read at once.
            EXPECT_FALSE(readResults(folder / "model.results.h5").analyses.empty());
        }
    }
    EXPECT_GT(numKilled, 0);
    ASSERT_EQ(runModel("--resume"), 0) << err;
    EXPECT_TRUE(readWithoutSeconds("whole.h5") == readWithoutSeconds("model.results.h5"));
    EXPECT_EQ(summary.substr(0, summary.find("results:")), out.substr(0, out.find("results:")));
    EXPECT_NE(access((folder / "model.results.h5.checkpoint").c_str(), F_OK), 0);
}

TEST_F(ResumeTest, CtrlCFinishesTheStepAndSaysHowToGoOn) {
    writeModel(kModel);
    ASSERT_EQ(runModel("-o whole.h5"), 0) << err;
    const pid_t child = start({});
    awaitCheckpoint(child);
    kill(child, SIGINT);
    const int status = await(child);
    ASSERT_TRUE(WIFEXITED(status));
    ASSERT_EQ(WEXITSTATUS(status), 130) << testing::readText(folder / "child.log");
    const std::string log = testing::readText(folder / "child.log");
    EXPECT_THAT(log, HasSubstr("stopped"));
    EXPECT_THAT(log, HasSubstr("simflex run model.yaml --resume"));
    const Results kept = readResults(folder / "model.results.h5");
    // The run may have been stopped between the two.
    EXPECT_TRUE(kept.analyses.size() == 1 || !kept.analyses.back().isComplete);
    ASSERT_EQ(runModel("--resume --threads 2"), 0) << err;
    EXPECT_TRUE(readWithoutSeconds("whole.h5") == readWithoutSeconds("model.results.h5"));
    // Nothing is left to do.
    ASSERT_EQ(runModel("--resume"), 0) << err;
}

TEST_F(ResumeTest, CtrlCStopsAnalysesWithoutTimeAndKeepsWhatIsComplete) {
    // A hanging chain, whose stiffness takes many evaluations.
    std::string text = "simflex: 1\ngravity: [0, -9.81, 0]\nbodies:\n", joints = "joints:\n";
    for (int k = 0; k < 120; ++k) {
        const std::string body = "b" + std::to_string(k);
        text += "  " + body + ": {mass: 1, inertia: [0.1, 0.01, 0.1], place: {position: [0, " +
                std::to_string(-k) + ".5, 0]}}\n";
        joints +=
            "  j" + std::to_string(k) + ": {type: ball, between: [" +
            (k == 0 ? "ground" : "{on: b" + std::to_string(k - 1) + ", position: [0, -0.5, 0]}") +
            ", {on: " + body + ", position: [0, 0.5, 0]}]}\n";
    }
    const std::string analyses[] = {"{type: static, from: first}", "{type: eigen, about: first}"};
    for (const std::string& second : analyses) {
        SCOPED_TRACE(second);
        writeModel(text + joints +
                   "analyses:\n  first: {type: transient, duration: 1e-6, interval: 1e-6}\n"
                   "  second: " +
                   second + "\n");
        std::filesystem::remove(folder / "model.results.h5");
        const pid_t child = start({});
        const auto isFirstKept = [&] {
            if (access((folder / "model.results.h5").c_str(), F_OK) != 0) return false;
            const auto kept = readResults(folder / "model.results.h5").analyses;
            return !kept.empty() && kept[0].isComplete;
        };
        testing::await("the first analysis",
                       [&] { return isFirstKept() || testing::hasEnded(child); });
        kill(child, SIGINT);
        const int status = await(child);
        const std::string log = testing::readText(folder / "child.log");
        ASSERT_TRUE(WIFEXITED(status));
        EXPECT_EQ(WEXITSTATUS(status), 130) << log;
        EXPECT_THAT(log, HasSubstr("stopped; what is complete is in 'model.results.h5'; continue "
                                   "with: simflex run model.yaml --resume"));
        EXPECT_TRUE(read("first").isComplete);
        EXPECT_EQ(readResults(folder / "model.results.h5").analyses.size(), 1u);
    }
}

TEST_F(ResumeTest, ARunOfAChangedModelIsDoneAnewAndWhatItHadStaysUntilThen) {
    writeModel(kModel);
    ASSERT_EQ(runModel("-o coarse.h5 --set solver.accuracy=1e-7"), 0) << err;
    ASSERT_EQ(runModel("-o fine.h5"), 0) << err;
    namespace fs = std::filesystem;
    const fs::path before(folder / "model.results.h5.before-1");
    const auto stop = [&](const std::vector<std::string>& arguments, const fs::path& sign) {
        const pid_t child = start(arguments);
        testing::await(sign.string(), [&] { return fs::exists(sign) || testing::hasEnded(child); });
        awaitCheckpoint(child);
        kill(child, SIGTERM);
        EXPECT_EQ(WEXITSTATUS(await(child)), 130);
        return testing::readText(folder / "child.log");
    };
    const std::string change = "other settings (then: solver.accuracy=1e-7; now: none)";
    stop({"--set", "solver.accuracy=1e-7"}, folder / "model.results.h5");
    EXPECT_THAT(stop({"--resume"}, before / "model.results.h5"), HasSubstr(change));
    // After a change by mistake, everything is still there and can be resumed.
    ASSERT_TRUE(fs::exists(before / "model.results.h5.checkpoint"));
    for (const auto& file : fs::directory_iterator(before))
        fs::copy(file, folder / file.path().filename().string(),
                 fs::copy_options::overwrite_existing);
    ASSERT_EQ(runModel("--resume --set solver.accuracy=1e-7 -o model.results.h5"), 0) << err;
    EXPECT_THAT(err, ::testing::Not(HasSubstr("out of date")));
    EXPECT_TRUE(readWithoutSeconds("coarse.h5") == readWithoutSeconds("model.results.h5"));
    EXPECT_FALSE(fs::exists(before));

    // After a deliberate change: from the beginning, and resumable in turn.
    EXPECT_THAT(stop({"--resume"}, before / "model.results.h5"), HasSubstr(change));
    EXPECT_TRUE(readWithoutSeconds("coarse.h5") ==
                readWithoutSeconds("model.results.h5.before-1/model.results.h5"));
    ASSERT_EQ(runModel("--resume"), 0) << err;
    EXPECT_THAT(err, ::testing::Not(HasSubstr("out of date")));
    EXPECT_TRUE(readWithoutSeconds("fine.h5") == readWithoutSeconds("model.results.h5"));
    EXPECT_FALSE(fs::exists(before));

    std::string text = kModel;
    text.replace(text.find("duration: 10"), 12, "duration: 1.");
    writeModel(text);
    EXPECT_EQ(runModel("--resume"), 0);
    EXPECT_THAT(err, HasSubstr("simflex: warning: the results of short, long in 'model.results.h5' "
                               "are out of date: the model file 'model.yaml' has changed since, "
                               "first in line 25. They stay in 'model.results.h5.before-1' until "
                               "they have been done anew; this run does all of them"));
    EXPECT_EQ(read("long").time.back(), 1.0);
}

/** Two analyses whose inputs change in between. **/
class ChangedInputs : public ResumeTest {
protected:
    void SetUp() override {
        ResumeTest::SetUp();
        writeBar(7850);
        testing::writeText(folder / "push.csv", "t,force\n0,1\n1,1\n");
        writeModel(R"(simflex: 1
gravity: [0, -9.81, 0]
parts: {bar: {deck: bar.inp, interfaces: {root: LEFT, tip: RIGHT}, modes: 14}}
tables: {push: {file: push.csv}}
bodies: {bar: {part: bar, damping: 0.1}}
joints: {hold: {type: weld, between: [ground, bar.root]}}
loads: {push: {on: bar.tip, force: [0, push(t), 0]}}
probes: {tip: {position: bar.tip}, force: {reaction: hold}}
analyses:
  rest: {type: static}
  swing: {type: transient, duration: 0.01}
)");
    }
    void writeBar(double density, const std::string& remark = "") {
        testing::Brick bar;
        bar.type = "C3D8I";
        bar.rho = density;
        testing::writeText(folder / "bar.inp", remark + bar.text());
    }
    /** Tries each way to reuse model.results.h5: reading refuses, computing starts anew. **/
    void expectAnew(const std::string& change) {
        const std::string cached = "SIMFLEX_CACHE=cache '" SIMFLEX_PROGRAM "'";
        EXPECT_NE(
            runProgram(cached, "post model.results.h5 -q --set 'probes.more={expression: t}'"), 0);
        EXPECT_THAT(err, HasSubstr(change + " has changed since"));
        EXPECT_EQ(runProgram(cached, "report model.results.h5 -o page.html"), 0) << err;
        EXPECT_THAT(err, HasSubstr("the page shows no motion: " + change + " has changed since"));

        const std::string old = testing::readText(folder / "model.results.h5"),
                          before = "model.results.h5.before-1/model.results.h5";
        ASSERT_EQ(runModel("--only swing"), 0) << err;
        EXPECT_THAT(
            err,
            HasSubstr(
                "simflex: warning: the results of rest in 'model.results.h5' are out of date: " +
                change +
                " has changed since. They stay in 'model.results.h5.before-1' until they have been "
                "done anew; this run does none of them\n"));
        EXPECT_EQ(readResults(folder / "model.results.h5").analyses.size(), 1u);
        EXPECT_TRUE(testing::readText(folder / before) == old);
        ASSERT_EQ(runModel("--only rest"), 0) << err;
        EXPECT_EQ(err, "");
        EXPECT_FALSE(std::filesystem::exists(folder / "model.results.h5.before-1"));
        ASSERT_EQ(runModel("-o anew.h5"), 0) << err;
        for (const char* analysis : {"rest", "swing"}) {
            const Results::Analysis mine = read(analysis), fresh = read(analysis, "anew.h5");
            EXPECT_EQ(find(mine, "tip").rows, find(fresh, "tip").rows);
            EXPECT_EQ(find(mine, "force").rows, find(fresh, "force").rows);
        }
        ASSERT_EQ(runModel("--resume"), 0) << err;
        EXPECT_EQ(err, "");
    }
};

TEST_F(ChangedInputs, AreNamedByAllThatTakesUpEarlierResults) {
    ASSERT_EQ(runModel("--only rest"), 0) << err;
    ASSERT_EQ(runModel("--only swing"), 0) << err;
    ASSERT_EQ(runModel("--resume"), 0) << err;
    writeBar(8000);
    expectAnew("the part of body 'bar'");
    testing::writeText(folder / "push.csv", "t,force\n0,1\n1,2\n");
    expectAnew("the file 'push.csv'");
    // An edit that changes no number of the part changes nothing.
    writeBar(8000, "** a remark\n");
    // Neither does a file with the name of another entry of the model.
    for (const char* name : {"rest", "bar", "push"}) testing::writeText(folder / name, "a note");
    EXPECT_EQ(runModel("--resume"), 0) << err;
    EXPECT_EQ(err, "");
    testing::writeText(folder / "push.csv", "t,force\n0,1\n1,3\n");
    EXPECT_EQ(runModel("--resume"), 0) << err;
    EXPECT_THAT(err, HasSubstr("the results of swing, rest in 'model.results.h5' are out of date: "
                               "the file 'push.csv' has changed since."));
    EXPECT_FALSE(std::filesystem::exists(folder / "model.results.h5.before-1"));
    EXPECT_GT(find(read("swing"), "tip").rows.back()[1],
              find(read("swing", "anew.h5"), "tip").rows.back()[1]);
}

TEST_F(ChangedInputs, ResultsStayWhileARunFailsAndWhileAnotherWritesThem) {
    ASSERT_EQ(runModel(), 0) << err;
    const std::string old = testing::readText(folder / "model.results.h5");
    EXPECT_NE(runModel("--resume --set analyses.rest.from=nothing"), 0);
    EXPECT_TRUE(testing::readText(folder / "model.results.h5") == old);
    {
        const model::ResultWriter other(folder / "model.results.h5");
        EXPECT_NE(runModel("--resume --set bodies.bar.damping=0.2"), 0);
        EXPECT_THAT(err, HasSubstr("is being written by another run"));
    }
    EXPECT_TRUE(testing::readText(folder / "model.results.h5") == old);
    // Each state reached by a run has its own folder until one run has completed everything.
    for (const char* load : {"1", "2"}) {
        EXPECT_EQ(runModel(std::string("--only rest --set loads.push.force.x=") + load), 0) << err;
    }
    namespace fs = std::filesystem;
    EXPECT_TRUE(fs::exists(folder / "model.results.h5.before-1"));
    EXPECT_FALSE(fs::exists(folder / "model.results.h5.before-2")) << "rest was replaced";
    testing::writeText(folder / "model.results.h5.before-1/note.txt", "of mine");
    ASSERT_EQ(runModel("--only swing"), 0) << err;
    EXPECT_TRUE(fs::exists(folder / "model.results.h5.before-2/model.results.h5"));
    ASSERT_EQ(runModel(), 0) << err;
    EXPECT_FALSE(fs::exists(folder / "model.results.h5.before-2"));
    EXPECT_FALSE(fs::exists(folder / "model.results.h5.before-1/model.results.h5"));
    EXPECT_EQ(testing::readText(folder / "model.results.h5.before-1/note.txt"), "of mine");
}

TEST(PartChecksum, KnowsAllThatARunReadsAndNothingElse) {
    ReducedBody part;
    part.mass = 1;
    part.numModes = 1;
    part.omegaSquared = {4};
    part.I1 = {1, 2, 3, 4, 5, 6};
    for (auto& matrix : part.I2) matrix = {1};
    for (auto& matrix : part.N) matrix = {0};
    part.mesh.nodeNumbers = {1, 2};
    part.mesh.positions = {0, 0, 0, 1, 0, 0};
    part.mesh.nodeSets = {{"SET", {0}}};
    part.mesh.elements = {{ElementType::Tet4, {0, 1, 0, 1}}};
    part.Phi = {1, 2, 3, 4, 5, 6};
    part.interfaces = {{"seat", {1, 2, 3}, {1, 2, 3}, {1, 2, 3}, {0, 1}}};
    part.stiffening.emplace();
    for (auto& matrix : part.stiffening->turning) matrix = {1};
    part.stiffening->interfaces.resize(1);
    for (auto& matrix : part.stiffening->interfaces[0]) matrix = {1};
    part.modalStress = ReducedBody::ModalStress{{0}, {1, 2, 3, 4, 5, 6}, {1, 2, 3, 4, 5, 6}};
    part.report.emplace();
    part.finer = std::make_shared<ReducedBody>(part);

    using Change = void (*)(ReducedBody&);
    const auto sumOfChanged = [&](Change change) {
        ReducedBody other = part;
        change(other);
        return model::calcPartChecksum(other);
    };
    const std::string sum = model::calcPartChecksum(part);
    const std::vector<Change> changes{
        [](ReducedBody& p) { p.mass = 2; },
        [](ReducedBody& p) { p.centerOfMass[1] = 2; },
        [](ReducedBody& p) { p.inertia[4] = 2; },
        [](ReducedBody& p) { p.omegaSquared[0] = 2; },
        [](ReducedBody& p) { p.I1[3] = 2; },
        [](ReducedBody& p) { p.I2[5][0] = 2; },
        [](ReducedBody& p) { p.N[2][0] = 2; },
        [](ReducedBody& p) { p.Phi[5] = 2; },
        [](ReducedBody& p) { p.interfaces[0].name = "other"; },
        [](ReducedBody& p) { p.interfaces[0].position[0] = 2; },
        [](ReducedBody& p) { p.interfaces[0].Phi[0] = 2; },
        [](ReducedBody& p) { p.interfaces[0].Psi[0] = 2; },
        [](ReducedBody& p) { p.interfaces[0].nodes = {1}; },
        [](ReducedBody& p) { p.interfaces[0].tie = TieType::Distributing; },
        [](ReducedBody& p) {
            p.interfaces[0].weights = {0.5, 0.5};
        },
        [](ReducedBody& p) { p.stiffening->turning[0][0] = 2; },
        [](ReducedBody& p) { p.stiffening->interfaces[0][5][0] = 2; },
        [](ReducedBody& p) { p.stiffening.reset(); },
        [](ReducedBody& p) { p.modalStress->stress[5] = 2; },
        [](ReducedBody& p) { p.modalStress->strain[5] = 2; },
        [](ReducedBody& p) { p.modalStress.reset(); },
        [](ReducedBody& p) { p.mesh.nodeNumbers[1] = 3; },
        [](ReducedBody& p) { p.mesh.positions[5] = 2; },
        [](ReducedBody& p) { p.mesh.nodeSets["SET"] = {1}; },
        [](ReducedBody& p) { p.mesh.elements[0].type = ElementType::Hex8; },
        [](ReducedBody& p) { p.mesh.elements[0].nodes[3] = 0; },
        [](ReducedBody& p) { p.mesh.elements[0].isShell = true; },
        [](ReducedBody& p) {
            p.further = ReducedBody::Further{{1}, {1}};
        },
        [](ReducedBody& p) { p.finer.reset(); },
        [](ReducedBody& p) {
            ReducedBody finer = *p.finer;
            finer.modalStress->stress[0] = 2;
            p.finer = std::make_shared<ReducedBody>(finer);
        }};
    std::set<std::string> sums{sum};
    for (size_t k = 0; k < changes.size(); ++k)
        EXPECT_TRUE(sums.insert(sumOfChanged(changes[k])).second) << "change " << k;
    EXPECT_EQ(sumOfChanged([](ReducedBody& p) { p.provenance.created = "today"; }), sum);
    EXPECT_EQ(sumOfChanged([](ReducedBody& p) { p.report->conditionNumber = 2; }), sum);
}

TEST(RunCheckpoint, FramesAreAppended) {
    const testing::TestFolder folder;
    const std::string path = folder / "run.checkpoint", frames = model::getFramesPath(path);
    model::RunCheckpoint checkpoint;
    checkpoint.analysis = "run";
    const auto add = [&](int count) {
        for (int k = 0; k < count; ++k) {
            const double t = double(checkpoint.frames.size());
            checkpoint.frames.push_back({t, {t, 2 * t, 3}, {-t}, {t / 2}, {1, 0}});
        }
        model::writeRunCheckpoint(path, checkpoint);
    };
    add(100);
    const std::string first = testing::readText(frames), small = testing::readText(path);
    add(200);
    const std::string both = testing::readText(frames);
    EXPECT_TRUE(both.compare(0, first.size(), first) == 0);
    EXPECT_EQ(both.size(), 3 * first.size());
    EXPECT_EQ(testing::readText(path).size(), small.size()) << "the checkpoint has no frames";

    const auto check = [&](size_t count) {
        const model::RunCheckpoint found = model::readRunCheckpoint(path);
        ASSERT_EQ(found.frames.size(), count);
        for (size_t k = 0; k < count; ++k) {
            EXPECT_EQ(found.frames[k].time, double(k));
            EXPECT_EQ(found.frames[k].q, (std::vector<double>{double(k), 2.0 * double(k), 3}));
            EXPECT_EQ(found.frames[k].u, (std::vector<double>{-double(k)}));
            EXPECT_EQ(found.frames[k].holding, (std::vector<double>{1, 0}));
            EXPECT_EQ(found.frames[k].z, (std::vector<double>{double(k) / 2}));
        }
    };
    check(300);
    // After a kill between frames and checkpoint, frames unknown to the checkpoint are overwritten.
    testing::writeText(path, small);
    check(100);
    checkpoint = model::readRunCheckpoint(path);
    add(50);
    check(150);
    EXPECT_EQ(testing::readText(frames), both.substr(0, both.size() / 2));

    // Truncated and corrupted files.
    const std::string good = testing::readText(frames);
    testing::writeText(frames, good.substr(0, good.size() - 1));
    EXPECT_THROW(model::readRunCheckpoint(path), std::runtime_error);
    std::string bad = good;
    bad[good.size() / 2] ^= 1;
    testing::writeText(frames, bad);
    EXPECT_THROW(model::readRunCheckpoint(path), std::runtime_error);
    model::removeRunCheckpoint(path);
    EXPECT_FALSE(std::filesystem::exists(path) || std::filesystem::exists(frames));
}

TEST_F(ResumeTest, DamagedCheckpointsAreRefused) {
    std::string text = kModel;
    text.erase(text.find("  short:"), text.find("  long:") - text.find("  short:"));
    writeModel(text);
    const pid_t child = start({});
    awaitCheckpoint(child);
    kill(child, SIGINT);
    ASSERT_EQ(WEXITSTATUS(await(child)), 130);
    const std::string path = folder / "model.results.h5.checkpoint";
    const std::string whole = testing::readText(path);
    for (const size_t size :
         {size_t(0), size_t(10), size_t(40), whole.size() / 2, whole.size() - 1}) {
        testing::writeText(path, whole.substr(0, size));
        EXPECT_EQ(runModel("--resume"), 1) << size;
        EXPECT_THAT(err, HasSubstr("checkpoint"));
    }
    std::string flipped = whole;
    flipped[flipped.size() / 2] = char(flipped[flipped.size() / 2] ^ 1);
    testing::writeText(path, flipped);
    EXPECT_EQ(runModel("--resume"), 1);
    EXPECT_THAT(err, HasSubstr("damaged"));
    testing::writeText(path, whole);
    EXPECT_EQ(runModel("--resume"), 0) << err;
}

TEST_F(ResumeTest, ARunWithoutRoomKeepsWhatItHas) {
    writeModel(kModel);
    ASSERT_EQ(runModel("-o whole.h5"), 0) << err;
    // 64 KiB for any file, in bash's units of 1 KiB.
    const int status =
        runProgram("bash -c 'ulimit -f 64; exec \"$0\" \"$@\"' '" SIMFLEX_PROGRAM "'",
                   "run model.yaml --quiet");
    EXPECT_EQ(status, 1) << err;
    EXPECT_THAT(err, HasSubstr("model.results.h5"));
    const Results kept = readResults(folder / "model.results.h5");
    EXPECT_FALSE(kept.analyses.back().isComplete);
    EXPECT_GT(kept.analyses.back().time.size(), 10u);
    ASSERT_EQ(runModel("--resume"), 0) << err;
    EXPECT_TRUE(readWithoutSeconds("whole.h5") == readWithoutSeconds("model.results.h5"));
}

TEST_F(ResumeTest, ResumeOfNothingBeginsAnew) {
    writeModel(makePendulum("1", "analyses: {run: {type: transient, duration: 0.1}}\n"));
    ASSERT_EQ(runModel("--resume"), 0) << err;
    EXPECT_TRUE(read("run").isComplete);
}

TEST_F(ResumeTest, AJournalWithoutItsFileIsNothingToGoOnWith) {
    // A run killed before its first file exists may leave any part of the journal's header.
    writeModel(makePendulum("1", "analyses: {run: {type: transient, duration: 0.1}}\n"));
    std::string journal = "simflex ";
    for (const char* arguments : {"", "--resume", "--only run"}) {
        testing::writeText(folder / "model.results.h5.rows", journal);
        EXPECT_EQ(runModel(arguments), 0) << err;
        std::filesystem::remove(folder / "model.results.h5");
        journal = journal.substr(0, journal.size() / 3);
    }
    testing::writeText(folder / "model.results.h5.rows", "a table of somebody's");
    EXPECT_EQ(runModel(), 1);
    EXPECT_THAT(
        err,
        HasSubstr("is not the journal that a run keeps there of its rows, so it is not replaced"));
}

TEST_F(ResumeTest, AJournalThatWasOnlyBegunChangesNothingOfItsFile) {
    writeModel(makePendulum("1", "analyses: {run: {type: transient, duration: 0.1}}\n"));
    ASSERT_EQ(runModel(), 0) << err;
    const std::string whole = testing::readText(folder / "model.results.h5");
    // A run killed as it starts to replace the file may leave any part of the journal's header.
    for (const std::string journal : {"", "simf", "simflex rows  2\n", "simflex rows  2\n\1\0\0"}) {
        testing::writeText(folder / "model.results.h5.rows", journal);
        ASSERT_EQ(runModel("--resume"), 0) << err;
        EXPECT_TRUE(testing::readText(folder / "model.results.h5") == whole);
        EXPECT_FALSE(std::filesystem::exists(folder / "model.results.h5.rows"));
    }
    testing::writeText(folder / "model.results.h5.rows", "a table of somebody's");
    for (const char* more : {"", " --set parameters.angle=2"}) {
        EXPECT_EQ(runModel(std::string("--resume") + more), 1);
        EXPECT_THAT(
            err,
            HasSubstr(
                "is not the journal that a run keeps there of its rows, so it is not replaced"));
        EXPECT_EQ(testing::readText(folder / "model.results.h5.rows"), "a table of somebody's");
    }
}

TEST_F(ResumeTest, AJournalThatIsCutDuringTheRunIsAnError) {
    writeModel(kModel);
    ASSERT_EQ(runModel("-o whole.h5"), 0) << err;
    const pid_t child = start({});
    awaitCheckpoint(child);
    testing::writeText(folder / "model.results.h5.rows", "");
    EXPECT_EQ(await(child), 1 << 8);
    EXPECT_THAT(testing::readText(folder / "child.log"),
                HasSubstr("was cut by another program during the run; --resume continues"));
    ASSERT_EQ(runModel("--resume"), 0) << err;
    EXPECT_TRUE(readWithoutSeconds("whole.h5") == readWithoutSeconds("model.results.h5"));
}

}  // namespace
}  // namespace simflex
