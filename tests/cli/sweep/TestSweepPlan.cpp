/** @file
The cases of sweeps, and their distribution to processes. **/

#include <gmock/gmock.h>

#include <cstdlib>
#include <map>

#include "fe/TestDecks.h"
#include "simflex/model/sweep/SweepPlan.h"
#include "simflex/model/sweep/SweepShare.h"

namespace simflex {
namespace {

using namespace model;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::SizeIs;

std::vector<std::string> listFolders(const SweepPlan& plan) {
    std::vector<std::string> folders;
    for (const SweepCase& one : plan.cases) folders.push_back(one.folder);
    return folders;
}

template <class Work>
std::string catchError(Work work) {
    try {
        work();
    } catch (const std::exception& error) {
        return error.what();
    }
    return "no error";
}

TEST(SweepPlan, ValuesAreListsOrRanges) {
    EXPECT_THAT(parseSweptKey("speed=50, 100,150").values, ElementsAre("50", "100", "150"));
    EXPECT_THAT(parseSweptKey("length=0.1:0.2:5").values,
                ElementsAre("0.1", "0.125", "0.15", "0.175", "0.2"));
    EXPECT_THAT(parseSweptKey("gravity=[0,-1,0],[0,-9.81,0]").values,
                ElementsAre("[0,-1,0]", "[0,-9.81,0]"));
    for (const char* text : {"speed", "=5", "speed=", "speed=1,,2", "speed=0:1:0", "load=0,05"})
        EXPECT_THAT(catchError([&] { parseSweptKey(text); }), HasSubstr(text)) << text;
}

TEST(SweepPlan, ARangeWithoutAWholeCountIsExplained) {
    for (const char* text : {"load=1:2", "load=1:2:0.5", "load=1:2:3:4"})
        EXPECT_THAT(catchError([&] { parseSweptKey(text); }),
                    AllOf(HasSubstr(text), HasSubstr("load=FROM:TO:COUNT")));
}

TEST(SweepPlan, ASettingOfSeveralValuesPointsToVary) {
    ModelText model{"m.yaml", "simflex: 1\nparameters: {load: 1}\n", {"parameters.load=0.5,1,2"}};
    EXPECT_THAT(catchError([&] { checkSweepSettings(model); }),
                HasSubstr("--vary parameters.load=0.5,1,2"));
    model.settings = {"parameters.lod=0.5"};
    EXPECT_THAT(catchError([&] { checkSweepSettings(model); }),
                AllOf(HasSubstr("'load'"), Not(HasSubstr("--vary"))));
    model.settings = {"parameters.load=0.5"};
    EXPECT_EQ(catchError([&] { checkSweepSettings(model); }), "no error");
}

TEST(SweepPlan, ColumnsOfProbesThatTheModelHasNotAreRefusedBeforeAnyRun) {
    SweepPlan plan;
    plan.model = {
        "m.yaml", "simflex: 1\nprobes: {tool: {position: ground}, all: {energy: kinetic}}\n", {}};
    for (const char* text :
         {"tool", "tool.x", "tool.final", "tool.x.final", "t*.rms", "*", "all"}) {
        plan.of = {text};
        EXPECT_EQ(catchError([&] { checkSweepColumns(plan); }), "no error") << text;
    }
    plan.of = {"tool.x", "tipp.final"};
    EXPECT_THAT(catchError([&] { checkSweepColumns(plan); }),
                AllOf(HasSubstr("'tipp'"), HasSubstr("tool")));
    plan.of = {"tool.x.max"};
    EXPECT_THAT(catchError([&] { checkSweepColumns(plan); }),
                HasSubstr("'max' is not a statistic; did you mean 'tool.x.maximum'?"));
    plan.of = {"tool.minimun"};
    EXPECT_THAT(catchError([&] { checkSweepColumns(plan); }), HasSubstr("'tool.minimum'?"));
    plan.of = {"tool.peak"};
    EXPECT_THAT(catchError([&] { checkSweepColumns(plan); }), HasSubstr("maximum, minimum, mean"));
}

TEST(SweepPlan, AGridIsAllCombinationsAndTheLastKeyVariesFastest) {
    SweepPlan plan;
    plan.keys = {parseSweptKey("a=1,2"), parseSweptKey("b=3,4,5")};
    makeSweepCases(plan, SweepOrder::Grid);
    EXPECT_THAT(listFolders(plan),
                ElementsAre("a=1_b=3", "a=1_b=4", "a=1_b=5", "a=2_b=3", "a=2_b=4", "a=2_b=5"));
    EXPECT_THAT(catchError([&] { makeSweepCases(plan, SweepOrder::List); }),
                AllOf(HasSubstr("'b' has 3"), HasSubstr("'a' has 2")));
    plan.keys = {parseSweptKey("a=0:1:1000"), parseSweptKey("b=0:1:1000")};
    EXPECT_THAT(catchError([&] { makeSweepCases(plan, SweepOrder::Grid); }), HasSubstr("100000"));
}

TEST(SweepPlan, LongNamesThatDifferOnlyBehindTheirEndHaveFoldersOfTheirOwn) {
    // Hashes of these agree in their first 8 digits, 7aea4d3d.
    const std::string before(120, 'a');
    SweepPlan plan;
    plan.keys = {{"load", {before + "79954", before + "247254"}, {}}};
    makeSweepCases(plan, SweepOrder::Grid);
    ASSERT_THAT(plan.cases, SizeIs(2));
    EXPECT_NE(plan.cases[0].folder, plan.cases[1].folder);
    EXPECT_LE(plan.cases[0].folder.size(), 120u);
}

TEST(SweepPlan, DifferentCasesOfOneFolderAreRefusedAndEqualOnesDoneOnce) {
    SweepPlan plan;
    plan.keys = {{"a", {"1", "1_b=2", "1"}, {}}, {"b", {"2_b=3", "3", "2_b=3"}, {}}};
    EXPECT_THAT(catchError([&] { makeSweepCases(plan, SweepOrder::List); }),
                AllOf(HasSubstr("a = 1, b = 2_b=3"), HasSubstr("a = 1_b=2, b = 3"),
                      HasSubstr("'a=1_b=2_b=3'")));
    plan.keys = {{"a", {"1", "1"}, {}}, {"b", {"2", "2"}, {}}};
    makeSweepCases(plan, SweepOrder::List);
    EXPECT_THAT(plan.cases, SizeIs(1));
}

TEST(SweepPlan, FoldersStayApartAndInsideTheSweepsOwn) {
    SweepPlan plan;
    plan.keys = {parseSweptKey("file=../../a,..-..-a,/etc/x"), parseSweptKey("b=1,1")};
    makeSweepCases(plan, SweepOrder::Grid);
    ASSERT_THAT(plan.cases, SizeIs(3));  // the same values are one case
    for (const SweepCase& one : plan.cases) {
        EXPECT_EQ(one.folder.find('/'), std::string::npos);
        EXPECT_EQ(one.folder.find("file="), 0u);
    }
    EXPECT_NE(plan.cases[0].folder, plan.cases[1].folder);
}

TEST(SweepPlan, AListIsReadFromCsv) {
    testing::TestFolder folder;
    testing::writeText(folder / "cases.csv",
                       "# two\nspeed, solver.accuracy\r\n50,1e-5\n\n60, 1e-6\n");
    SweepPlan plan;
    plan.keys = readSweptKeys(folder / "cases.csv");
    makeSweepCases(plan, SweepOrder::List);
    EXPECT_THAT(listFolders(plan),
                ElementsAre("speed=50_solver.accuracy=1e-5", "speed=60_solver.accuracy=1e-6"));
    testing::writeText(folder / "cases.csv", "a,b\n1,2\n3\n");
    EXPECT_THAT(catchError([&] { readSweptKeys(folder / "cases.csv"); }),
                HasSubstr("cases.csv:3: 1 values for 2 columns"));
}

TEST(SweepPlan, TheModelsOwnSweepIsTaken) {
    testing::TestFolder folder;
    testing::writeText(
        folder / "m.yaml",
        "simflex: 1\nparameters: {speed: 1, length: 2}\n"
        "analyses:\n"
        "  rest: {type: static}\n"
        "  run: {type: transient, duration: speed, from: rest}\n"
        "  other: {type: eigen}\n"
        "  study: {type: sweep, analysis: run, of: [tip.maximum],\n"
        "          parameters: {speed: [50, 100], length: {from: 0.1, to: 0.2, count: 2}}}\n");
    SweepPlan plan;
    plan.model = loadModelText(folder / "m.yaml");
    takeModelSweep(plan, "");
    checkSweepCases(plan);
    EXPECT_THAT(listFolders(plan), ElementsAre("speed=50_length=0.1", "speed=50_length=0.2",
                                               "speed=100_length=0.1", "speed=100_length=0.2"));
    EXPECT_THAT(plan.only, ElementsAre("rest", "run"));
    EXPECT_THAT(plan.of, ElementsAre("tip.maximum"));
    EXPECT_THAT(plan.getSettings(plan.cases[1]),
                ElementsAre("parameters.speed=50", "parameters.length=0.2"));
    EXPECT_THAT(catchError([&] { takeModelSweep(plan, "studdy"); }), HasSubstr("study"));
    plan.keys = {parseSweptKey("sped=1")};
    EXPECT_THAT(catchError([&] { findSweptPaths(plan); }),
                AllOf(HasSubstr("m.yaml"), HasSubstr("'sped'"), HasSubstr("speed")));
    plan.keys = {parseSweptKey("gravity=[0,0,1]"), parseSweptKey("analyses.run.duration=2")};
    findSweptPaths(plan);
    EXPECT_EQ(plan.keys[0].path, "gravity");
    EXPECT_EQ(plan.keys[1].path, "analyses.run.duration");
}

TEST(SweepPlan, ACaseIsAnotherWhenAFileThatItsModelReadsIs) {
    testing::TestFolder folder;
    testing::writeText(folder / "road.csv", "0,1\n1,2\n");
    testing::writeText(folder / "m.yaml",
                       "simflex: 1\nparameters: {speed: 1}\ntables: {road: {file: road.csv}}\n"
                       "analyses: {run: {type: transient, duration: 1}}\n");
    const auto calcInputs = [&] {
        SweepPlan plan;
        plan.model = loadModelText(folder / "m.yaml");
        plan.keys = {parseSweptKey("speed=5")};
        makeSweepCases(plan, SweepOrder::Grid);
        checkSweepCases(plan);
        return plan.calcInputs(plan.cases[0]);
    };
    const InputChecksums before = calcInputs();
    EXPECT_EQ(calcInputs(), before);
    testing::writeText(folder / "road.csv", "0,1\n1,3\n");
    EXPECT_THAT(findChangedInput(before, calcInputs()),
                AllOf(HasSubstr("the file '"), HasSubstr("road.csv'"), HasSubstr("has changed")));
}

/** Sets an environment variable during its lifetime; "" unsets it. **/
class SweepShareTest : public ::testing::Test {
protected:
    void SetUp() override {
        for (const char* name : kNames) unsetenv(name);
    }
    void TearDown() override {
        for (const char* name : kNames) unsetenv(name);
    }
    SweepShare find(const std::map<std::string, std::string>& environment) {
        for (const char* name : kNames) unsetenv(name);
        for (const auto& [name, value] : environment) setenv(name.c_str(), value.c_str(), 1);
        return SweepShare::fromEnvironment();
    }
    static constexpr const char* kNames[] = {"OMPI_COMM_WORLD_RANK",
                                             "OMPI_COMM_WORLD_SIZE",
                                             "PMI_RANK",
                                             "PMI_SIZE",
                                             "SLURM_ARRAY_TASK_ID",
                                             "SLURM_ARRAY_TASK_COUNT",
                                             "SLURM_ARRAY_TASK_MIN",
                                             "SLURM_ARRAY_TASK_STEP",
                                             "SLURM_PROCID",
                                             "SLURM_STEP_NUM_TASKS"};
};

TEST_F(SweepShareTest, RanksAndArrayTasksKnowTheirShare) {
    EXPECT_EQ(find({}).kind, SweepShare::Kind::Alone);
    const SweepShare rank = find({{"OMPI_COMM_WORLD_RANK", "1"}, {"OMPI_COMM_WORLD_SIZE", "4"}});
    EXPECT_EQ(rank.kind, SweepShare::Kind::Rank);
    EXPECT_EQ(rank.describe(), "rank 1 of 4");
    EXPECT_EQ(find({{"PMI_RANK", "2"}, {"PMI_SIZE", "3"}}).index, 2);
    EXPECT_EQ(find({{"SLURM_PROCID", "5"}, {"SLURM_STEP_NUM_TASKS", "8"}}).count, 8);
    EXPECT_EQ(find({{"SLURM_PROCID", "0"}, {"SLURM_STEP_NUM_TASKS", "1"}}).kind,
              SweepShare::Kind::Alone);
    const SweepShare task = find({{"SLURM_ARRAY_TASK_ID", "14"},
                                  {"SLURM_ARRAY_TASK_MIN", "10"},
                                  {"SLURM_ARRAY_TASK_STEP", "2"},
                                  {"SLURM_ARRAY_TASK_COUNT", "5"}});
    EXPECT_EQ(task.kind, SweepShare::Kind::ArrayTask);
    EXPECT_EQ(task.index, 2);
    EXPECT_EQ(task.count, 5);
}

}  // namespace
}  // namespace simflex
