/** @file
The simflex program from a user's point of view. **/

#include <gmock/gmock.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>

#include "cli/CliTest.h"
#include "simflex/fe/CalculixDeck.h"
#include "simflex/fe/MatrixMarket.h"
#include "simflex/part/ReducedBodyFile.h"

namespace simflex {
namespace {

using ::testing::AllOf;
using ::testing::ContainsRegex;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

TEST_F(CliTest, ReduceKeepsTheDerivativesThatAreAskedFor) {
    const std::string command = "reduce brick.inp --interface left=LEFT --modes 16 -o part.h5";
    ASSERT_EQ(run(command + " --derivative youngs_modulus:METAL --derivative density:METAL"), 0)
        << err;
    const auto derivatives = readReducedBody(folder / "part.h5").derivatives;
    ASSERT_EQ(derivatives.size(), 2u);
    EXPECT_EQ(derivatives[1].parameter, "density:METAL");
    ASSERT_EQ(run("info part.h5"), 0) << err;
    // √(E/ρ)
    EXPECT_THAT(out, AllOf(ContainsRegex("youngs_modulus:METAL +7e\\+10 Pa +0\\.5000 +0\\.5000"),
                           ContainsRegex("density:METAL +2700 kg/m\\^3 +-0\\.5000 +-0\\.5000")));
    ASSERT_EQ(run("info --json part.h5"), 0) << err;
    EXPECT_THAT(out, HasSubstr("\"parameter\": \"density:METAL\""));
    EXPECT_NE(run(command + " --derivative density:STEEL"), 0);
    EXPECT_THAT(err, AllOf(HasSubstr("'density:STEEL'"), HasSubstr("density:METAL")));
}

TEST_F(CliTest, ReduceKeepsTheStressThatIsAskedFor) {
    const std::string command = "reduce brick.inp --interface left=LEFT --modes 12 -o part.h5";
    const auto numNodes = [&] {
        return readReducedBody(folder / "part.h5").modalStress.value().nodes.size();
    };
    ASSERT_EQ(run(command), 0) << err;
    EXPECT_FALSE(readReducedBody(folder / "part.h5").modalStress);
    ASSERT_EQ(run(command + " --stress"), 0) << err;
    EXPECT_EQ(numNodes(), 9u * 9 - 7);  // all but those along the middle
    EXPECT_THAT(out, HasSubstr("stress at 74 nodes"));
    ASSERT_EQ(run(command + " --stress=all"), 0) << err;
    EXPECT_EQ(numNodes(), 81u);
    ASSERT_EQ(run(command + " --stress=LINE,right"), 0) << err;
    EXPECT_EQ(numNodes(), 9u + 9 - 1);
    EXPECT_NE(run(command + " --stress=TOP"), 0);
    EXPECT_THAT(err, AllOf(HasSubstr("'TOP'"), HasSubstr("LINE")));
    EXPECT_NE(run(command + " --stress=LEFT,,RIGHT"), 0);
}

TEST_F(CliTest, ReduceWritesAPartThatInfoShows) {
    ASSERT_EQ(
        run("reduce brick.inp --interface left=LEFT --interface right=right --modes 20 -o part.h5"),
        0)
        << err;
    EXPECT_THAT(out, AllOf(HasSubstr("14 modes"), HasSubstr("2 interfaces")));
    EXPECT_THAT(err, HasSubstr("K and M"));
    EXPECT_THAT(testing::listFiles(folder.path()), ElementsAre("brick.inp", "part.h5", "tmp"));
    EXPECT_THAT(folder.listTemporaryFiles(), IsEmpty());

    ASSERT_EQ(run("info part.h5"), 0) << err;
    EXPECT_THAT(out, AllOf(ContainsRegex("part +part"), ContainsRegex("mass +0\\.324 kg"),
                           HasSubstr("brick.inp"), ContainsRegex("left +rigid +9"),
                           HasSubstr("simflex, elements")));

    ASSERT_EQ(run("info part.h5 --json"), 0) << err;
    const ReducedBody body = readReducedBody(folder / "part.h5");
    char lowest[40];
    std::snprintf(lowest, sizeof lowest, "%.17g", std::sqrt(body.omegaSquared[0]) / (2 * M_PI));
    EXPECT_THAT(
        out, AllOf(StartsWith("{"), HasSubstr("\"name\": \"part\""), HasSubstr("\"num_modes\": 14"),
                   HasSubstr(std::string("\"frequencies\": [") + lowest)));
    EXPECT_EQ(std::count(out.begin(), out.end(), '{'), std::count(out.begin(), out.end(), '}'));
    EXPECT_EQ(std::count(out.begin(), out.end(), '['), std::count(out.begin(), out.end(), ']'));
}

TEST_F(CliTest, ReduceMakesGeometricStiffnessOnRequestAndInfoTellsIt) {
    ASSERT_EQ(run("reduce -q brick.inp -i left=LEFT -m 12 -o plain.h5"), 0) << err;
    EXPECT_FALSE(readReducedBody(folder / "plain.h5").stiffening);
    EXPECT_EQ(run("info plain.h5"), 0);
    EXPECT_THAT(out, ContainsRegex("stiffening +none \\(simflex reduce --stiffening\\)"));

    ASSERT_EQ(run("reduce --stiffening brick.inp -i left=LEFT -m 12 -o part.h5"), 0) << err;
    EXPECT_THAT(err, HasSubstr("geometric stiffness"));
    EXPECT_THAT(folder.listTemporaryFiles(), IsEmpty());
    EXPECT_TRUE(readReducedBody(folder / "part.h5").stiffening);
    EXPECT_EQ(run("info part.h5"), 0);
    EXPECT_THAT(out, ContainsRegex("stiffening +yes"));
    EXPECT_EQ(run("info part.h5 --json"), 0);
    EXPECT_THAT(out, HasSubstr("\"geometric_stiffness\": true"));
}

TEST_F(CliTest, ReduceReadsMatricesAndTheirNodes) {
    writeMatrixMarket(readCalculixDeck(folder / "brick.inp"), folder / "brick");
    const std::string interfaces = " -i left=LEFT -i right=RIGHT -m 20 ";
    ASSERT_EQ(run("reduce brick.inp -o deck.h5" + interfaces), 0) << err;
    ASSERT_EQ(run("reduce brick_K.mtx --mass-matrix brick_M.mtx --nodes brick_nodes.inp -o "
                  "matrices.h5" +
                  interfaces),
              0)
        << err;
    const ReducedBody deck = readReducedBody(folder / "deck.h5"),
                      matrices = readReducedBody(folder / "matrices.h5");
    for (size_t i = 0; i < deck.omegaSquared.size(); ++i)
        EXPECT_NEAR(matrices.omegaSquared[i] / deck.omegaSquared[i], 1, 1e-10);
    EXPECT_EQ(matrices.provenance.program, "Matrix Market");

    EXPECT_EQ(run("reduce brick_K.mtx -o no.h5"), 1);
    EXPECT_THAT(err, HasSubstr("needs --mass-matrix"));
    EXPECT_EQ(run("reduce brick_K.mtx --mass-matrix brick_M.mtx --nodes brick_nodes.inp "
                  "--stiffening -o no.h5"),
              1);
    EXPECT_THAT(err, HasSubstr("geometric stiffness needs the elements of the part"));
}

TEST_F(CliTest, ReduceMeshesGeometryOfAMaterial) {
    testing::writeText(folder / "box.geo",
                       "SetFactory(\"OpenCASCADE\"); Box(1) = {0, 0, 0, 60, 20, 10};\n"
                       "Physical Volume(\"BODY\") = {1}; Physical Surface(\"END\") = {1};\n");
    ASSERT_EQ(run("reduce box.geo --material titanium --length-unit mm --mesh-size 10 -i end=END "
                  "-m 12"),
              0)
        << err;
    EXPECT_NEAR(readReducedBody(folder / "box.h5").mass, 0.06 * 0.02 * 0.01 * 4430, 1e-9);
    EXPECT_THAT(err, HasSubstr("material titanium"));
    EXPECT_EQ(run("reduce box.geo --material wood"), 1);
    EXPECT_THAT(err, AllOf(HasSubstr("'wood'"), HasSubstr("titanium")));
    EXPECT_EQ(run("reduce box.geo --material steel --length-unit furlong"), 2);
    ASSERT_EQ(run("reduce box.geo --material titanium --length-unit 1e-3 --mesh-size 10 -i "
                  "end=END -m 12"),
              0)
        << err;
    EXPECT_NEAR(readReducedBody(folder / "box.h5").mass, 0.06 * 0.02 * 0.01 * 4430, 1e-9);
    EXPECT_EQ(run("reduce box.geo --material steel --gmsh Mesh.Algorithm3D=2*5"), 2);
    EXPECT_THAT(err, HasSubstr("'2*5' of 'Mesh.Algorithm3D=2*5' is not a number"));
}

TEST_F(CliTest, ForgottenUnitsAreReported) {
    testing::Brick brick;
    brick.E = 210e3;
    brick.rho = 7.85e-9;
    for (double& length : brick.size) length *= 1e3;
    testing::writeText(folder / "brick.inp", brick.text());
    ASSERT_EQ(run("reduce brick.inp -i left=LEFT -m 12 -o a.h5"), 0) << err;
    EXPECT_THAT(err, AllOf(HasSubstr("hardly"), HasSubstr("--units mm-t-s")));
    ASSERT_EQ(run("reduce brick.inp --units mm-t-s -i left=LEFT -m 12 -o b.h5"), 0) << err;
    EXPECT_THAT(err, Not(HasSubstr("hardly")));
    EXPECT_NEAR(readReducedBody(folder / "b.h5").mass, 0.2 * 0.03 * 0.02 * 7850, 1e-9);
}

TEST_F(CliTest, ExportWritesMbdynAndSidAndReadsMbdyn) {
    ASSERT_EQ(run("reduce -q brick.inp -i left=LEFT -i right=RIGHT -m 20 -o part.h5"), 0) << err;
    ASSERT_EQ(run("export part.h5 -o part.fem"), 0) << err;
    ASSERT_EQ(run("export part.h5 -o part.SID_FEM"), 0) << err;
    EXPECT_THAT(testing::readText(folder / "part.SID_FEM"), HasSubstr("end part"));
    ASSERT_EQ(run("export part.fem -o back.h5"), 0) << err;
    const ReducedBody part = readReducedBody(folder / "part.h5"),
                      back = readReducedBody(folder / "back.h5");
    for (size_t i = 0; i < part.omegaSquared.size(); ++i)
        EXPECT_NEAR(back.omegaSquared[i] / part.omegaSquared[i], 1, 1e-14);
    EXPECT_EQ(back.interfaces.size(), 2u);
    ASSERT_EQ(run("export part.fem -i seat=" + std::to_string(back.mesh.nodeNumbers.back()) +
                  " -o one.h5"),
              0)
        << err;
    EXPECT_EQ(readReducedBody(folder / "one.h5").getInterface("seat").Psi,
              back.getInterface("right").Psi);
    EXPECT_EQ(run("export part.fem -i seat=x -o one.h5"), 2);
}

TEST_F(CliTest, SameDeckGivesTheSameFile) {
    for (const char* name : {"a", "b"})
        ASSERT_EQ(run("reduce -q brick.inp -i left=LEFT -i right=RIGHT -m 20 --name brick -o " +
                      std::string(name) + ".h5"),
                  0);
    EXPECT_THAT(out + err, IsEmpty());
    EXPECT_TRUE(testing::readText(folder / "a.h5") == testing::readText(folder / "b.h5"));
}

TEST_F(CliTest, AnyNumberOfThreadsGivesTheSameFile) {
    testing::Brick brick;
    brick.size = {0.2, 0.1, 0.1};
    brick.elements = {24, 12, 12};
    testing::writeText(folder / "large.inp", brick.text());
    std::string first;
    for (const char* threads : {"OMP_NUM_THREADS=1", "OMP_NUM_THREADS=2", "OMP_NUM_THREADS=3",
                                "OPENBLAS_NUM_THREADS=4 OMP_NUM_THREADS=2", "taskset -c 0"}) {
        ASSERT_EQ(runProgram(std::string(threads) + " '" SIMFLEX_PROGRAM "'",
                             "reduce -q large.inp -i left=LEFT -i right=RIGHT -m 20 -o part.h5"),
                  0)
            << err;
        const std::string bytes = testing::readText(folder / "part.h5");
        if (first.empty()) first = bytes;
        EXPECT_TRUE(bytes == first) << threads;
    }
}

#ifndef __SANITIZE_ADDRESS__  // AddressSanitizer reserves terabytes of address space
TEST_F(CliTest, WithoutMemoryReductionsEnd) {
    for (const char* kilobytes : {"120000", "200000", "300000", "500000"}) {
        const int status = runProgram(
            "ulimit -v " + std::string(kilobytes) + "; timeout -k 1 60 '" SIMFLEX_PROGRAM "'",
            "reduce -q brick.inp -i left=LEFT -i right=RIGHT -o part.h5");
        EXPECT_NE(status, 124) << kilobytes;  // not ended by the time limit
        EXPECT_NE(status, 137) << kilobytes;
        EXPECT_TRUE(status == 0 || !err.empty()) << kilobytes;
    }
}
#endif

TEST_F(CliTest, PipesAreNoInputs) {
    for (const char* ending : {"yaml", "inp", "bdf", "cdb", "geo", "msh", "step", "npz", "mat",
                               "h5", "fem", "csv", "fmu", "stl"})
        ASSERT_EQ(mkfifo((folder / "pipe." + ending).c_str(), 0600), 0);
    testing::writeText(folder / "include.inp", "*INCLUDE, INPUT=pipe.inp\n");
    testing::writeText(folder / "table.yaml",
                       "simflex: 1\ntables: {road: pipe.csv}\nanalyses: {rest: {type: static}}\n");
    testing::writeText(folder / "shape.yaml",
                       "simflex: 1\nbodies: {a: {mass: 1, shape: {mesh: pipe.stl}}}\n"
                       "analyses: {rest: {type: static}}\n");
    for (const char* command : {"run pipe.yaml --check",
                                "sweep pipe.yaml --vary a=1",
                                "shell pipe.yaml -c list",
                                "fmu pipe.yaml",
                                "run table.yaml --check",
                                "run shape.yaml --check",
                                "reduce pipe.inp -o a.h5",
                                "reduce include.inp -o a.h5",
                                "reduce pipe.bdf -o a.h5",
                                "reduce pipe.cdb -o a.h5",
                                "reduce pipe.geo --material steel -o a.h5",
                                "reduce pipe.msh --material steel -o a.h5",
                                "reduce pipe.step --material steel -o a.h5",
                                "reduce pipe.npz -o a.h5",
                                "reduce pipe.mat -o a.h5",
                                "info pipe.h5",
                                "modes pipe.h5",
                                "export pipe.fem -o a.h5",
                                "post pipe.h5",
                                "report pipe.h5",
                                "plot pipe.h5 -o a.png",
                                "compare pipe.h5 pipe.h5",
                                "mac pipe.h5 pipe.h5"}) {
        const int status = runProgram("timeout -k 1 60 '" SIMFLEX_PROGRAM "'", command);
        EXPECT_TRUE(status == 1 || status == 2) << command << ": " << status;
        EXPECT_THAT(err, HasSubstr("pipe.")) << command;
    }
}

TEST_F(CliTest, MasterPointCanBeGiven) {
    ASSERT_EQ(run("reduce -q brick.inp -i left=LEFT --master left=-0.01,0.002,0 -m 12 -o part.h5"),
              0)
        << err;
    const ReducedBody body = readReducedBody(folder / "part.h5");
    EXPECT_NEAR(body.getInterface("left").position[0] + body.centerOfMass[0], -0.01, 1e-15);
    EXPECT_NEAR(body.getInterface("left").position[1], 0.002, 1e-12);
}

TEST_F(CliTest, HelpAndVersionSayWhatTheyShould) {
    EXPECT_EQ(run("--help"), 0);
    EXPECT_THAT(out, AllOf(HasSubstr("reduce"), HasSubstr("info")));
    EXPECT_EQ(run("reduce --help"), 0);
    EXPECT_THAT(out, AllOf(HasSubstr("--interface"), HasSubstr("--modes"), HasSubstr("--output"),
                           HasSubstr("50")));
    EXPECT_EQ(run("--version"), 0);
    EXPECT_EQ(out, "simflex " SIMFLEX_VERSION "\n");
}

TEST_F(CliTest, OutputThatDoesNotArriveIsAnError) {
    for (const std::string command : {"keys", "schema", "--help"}) {
        EXPECT_EQ(
            runProgram("bash -c '\"$0\" " + command + " >/dev/full' '" SIMFLEX_PROGRAM "'", ""), 1)
            << command;
        EXPECT_THAT(err, HasSubstr("simflex: cannot write the output"));
    }
}

TEST_F(CliTest, WrongUsageExitsWithTwoAndOneLine) {
    for (const char* arguments :
         {"", "frobnicate", "reduce", "info", "reduce brick.inp --modes many",
          "reduce brick.inp --interface LEFT", "reduce brick.inp --interface a=",
          "reduce brick.inp -i a=LEFT --master b=0,0,0", "info part.h5 --wrong"}) {
        EXPECT_EQ(run(arguments), 2) << arguments;
        EXPECT_THAT(err, StartsWith("simflex: ")) << arguments;
        EXPECT_EQ(std::count(err.begin(), err.end(), '\n'), 1) << err;
        EXPECT_THAT(out, IsEmpty());
    }
}

struct BadInput {
    const char* name;
    const char* arguments;
    const char* message;
};

void PrintTo(const BadInput& input, std::ostream* stream) {
    *stream << input.name;
}

class CliFailure : public CliTest, public ::testing::WithParamInterface<BadInput> {};

TEST_P(CliFailure, ExitsWithOneAndLeavesNoFile) {
    EXPECT_EQ(run(std::string("reduce -q -o part.h5 ") + GetParam().arguments), 1);
    EXPECT_THAT(err, AllOf(StartsWith("simflex: "), HasSubstr(GetParam().message)));
    EXPECT_THAT(testing::listFiles(folder.path()), ElementsAre("brick.inp", "tmp"));
    EXPECT_THAT(folder.listTemporaryFiles(), IsEmpty());
}

INSTANTIATE_TEST_SUITE_P(
    BadInputs, CliFailure,
    ::testing::Values(BadInput{"MissingDeck", "none.inp", "none.inp"},
                      BadInput{"MissingSet", "brick.inp -i a=PIN", "'PIN'"},
                      BadInput{"OneNode", "brick.inp -i a=ONE", "only 1 node"},
                      BadInput{"Overlap", "brick.inp -i a=LEFT -i b=CORNERS", "overlap"},
                      BadInput{"TooManyModes", "brick.inp -i a=LEFT -m 5000", "too many"},
                      BadInput{"OneNodeTwice", "brick.inp -i a=TWO", "only 2 nodes"}),
    [](const auto& input) { return input.param.name; });

TEST_F(CliTest, AFolderThatDoesNotExistIsFoundBeforeTheWork) {
    EXPECT_EQ(run("reduce brick.inp -o no/where.h5"), 1);
    EXPECT_THAT(err, AllOf(StartsWith("simflex: "), HasSubstr("no folder")));
    EXPECT_EQ(run("reduce brick.inp -o part.h5 --picture no/where.png"), 1);
    EXPECT_THAT(err, AllOf(StartsWith("simflex: "), HasSubstr("no folder")));
    EXPECT_THAT(testing::listFiles(folder.path()), ElementsAre("brick.inp", "tmp"));
}

TEST_F(CliTest, InfoOfAnythingElseFails) {
    EXPECT_EQ(run("info brick.inp"), 1);
    EXPECT_THAT(err, AllOf(StartsWith("simflex: "), HasSubstr("brick.inp")));
    EXPECT_EQ(run("info none.h5"), 1);
}

class CliSignal : public CliTest, public ::testing::WithParamInterface<int> {};

TEST_P(CliSignal, StopsAndLeavesNothing) {
    // A slow Gmsh script.
    testing::writeText(folder / "slow.geo", "For i In {1 : 1000000000}\n  x = i;\nEndFor\n");
    const pid_t pid = fork();
    if (pid == 0) {
        signal(SIGHUP, SIG_DFL);  // the tests may run under nohup
        if (chdir(folder.path().c_str()) != 0 || !freopen("err.txt", "w", stderr)) _exit(99);
        execl(SIMFLEX_PROGRAM, "simflex", "reduce", "slow.geo", "--material", "steel",
              "--allow-scripts", "-o", "part.h5", nullptr);
        _exit(99);
    }
    const auto isGmshRunning = [&] {
        return std::system(("pgrep -f '" + folder / "[s]low.geo" + "' >/dev/null").c_str()) == 0;
    };
    testing::await("Gmsh to be started", [&] { return isGmshRunning() || testing::hasEnded(pid); });
    kill(pid, GetParam());
    if (!testing::await("its end", [&] { return testing::hasEnded(pid); })) kill(pid, SIGKILL);
    int status = 0;
    waitpid(pid, &status, 0);
    EXPECT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), 130) << testing::readText(folder / "err.txt");
    EXPECT_FALSE(isGmshRunning());
    EXPECT_THAT(testing::readText(folder / "err.txt"),
                HasSubstr("simflex: stopped; nothing was written"));
    EXPECT_THAT(testing::listFiles(folder.path()),
                ElementsAre("brick.inp", "err.txt", "slow.geo", "tmp"));
    EXPECT_THAT(folder.listTemporaryFiles(), IsEmpty());
}

INSTANTIATE_TEST_SUITE_P(OfAnyKind, CliSignal, ::testing::Values(SIGINT, SIGTERM, SIGHUP));

}  // namespace
}  // namespace simflex
