/** @file
Result files: written data can be read back, however the writer ends. **/

#include <gmock/gmock.h>
#include <hdf5.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <functional>
#include <numeric>

#include "TestResults.h"
#include "support/Await.h"

namespace simflex {
namespace {

using namespace model;
using namespace testing;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class ResultFileTest : public ::testing::Test {
protected:
    std::string readError(const std::string& file) {
        try {
            readResults(file);
        } catch (const std::runtime_error& error) {
            return error.what();
        }
        return "no error";
    }

    TestFolder folder;
    std::string path = folder / "run.h5";
};

TEST_F(ResultFileTest, WarningsStayThroughFlushResumeAndCut) {
    const std::string bent = "'boom' is bent too far", open = "joint 'pin' is not closed";
    const auto check = [&] {
        const Results data = readResults(path);
        EXPECT_THAT(data.warnings, ElementsAre(open));
        ASSERT_EQ(data.analyses.size(), 1u);
        EXPECT_THAT(data.analyses[0].warnings, ElementsAre(bent));
        EXPECT_EQ(data.analyses[0].time.size(), 5u);
    };
    {
        ResultWriter writer(path, makeHeader());
        writer.addWarning("", open);
        writer.beginTransient("run", makeProbes(), makeStates());
        writer.addWarning("run", bent);
        addCircle(writer, 0, 5);
        writer.flush();
        check();
    }
    check();
    {
        ResultWriter writer(path);
        writer.addWarning("", open);
        writer.addWarning("run", bent);  // once is enough
        writer.flush();
        check();
        addCircle(writer, 5, 8);
        writer.addWarning("run", "of what is cut");
        addCircle(writer, 8, 9);
        writer.resumeTransient("run", 5);
    }
    check();
    EXPECT_THAT(readResults(path).analyses[0].probes[0].rows, ::testing::SizeIs(5));
}

TEST_F(ResultFileTest, EverythingWrittenIsReadBackInTheSameOrder) {
    writeRun(path);
    const Results data = readResults(path);
    EXPECT_EQ(data.header.title, "Swing");
    EXPECT_EQ(data.header.modelPath, "swing.yaml");
    EXPECT_EQ(data.header.modelText, "simflex: 1\n# a swing\n");
    EXPECT_THAT(data.header.settings, ElementsAre("speed=3", "solver.threads=1"));
    EXPECT_FALSE(data.header.isRigid);
    ASSERT_EQ(data.analyses.size(), 4u);
    const auto &rest = data.analyses[0], &run = data.analyses[1];
    EXPECT_EQ(rest.name, "rest");
    EXPECT_EQ(rest.type, "static");
    EXPECT_THAT(rest.probes[0].rows, ElementsAre(std::vector<double>{2, 0}));
    EXPECT_THAT(rest.q, ElementsAre(std::vector<double>{0.5}));
    EXPECT_THAT(rest.stateColumns.at("q"), ElementsAre("turn"));
    EXPECT_THAT(run.stateColumns.at("u"), ElementsAre("one", "two"));
    EXPECT_EQ(run.type, "transient");
    EXPECT_TRUE(run.isComplete);
    EXPECT_EQ(run.time.size(), 100u);
    EXPECT_TRUE(isCircle(run));
    EXPECT_EQ(run.probes[0].column.name, "swing");  // not in alphabetical order
    EXPECT_THAT(run.probes[0].column.columns, ElementsAre("x", "y"));
    EXPECT_EQ(run.probes[1].column.unit, "rad");
    EXPECT_THAT(run.probes[1].column.columns, ElementsAre(""));
    EXPECT_EQ(run.statistics.at("iterations"), 30);
    EXPECT_THAT(data.analyses[2].frequency, ElementsAre(std::vector<double>{1, 2.5, 40}));
    EXPECT_THAT(data.analyses[2].dampingRatio, ElementsAre(std::vector<double>{0.01, 0, -0.02}));
    EXPECT_THAT(data.analyses[3].speeds, ElementsAre(0, 100));
    EXPECT_EQ(data.analyses[3].frequency[1][1], 23);
    EXPECT_EQ(data.analyses[3].dampingRatio[1][1], -0.01);
    EXPECT_THAT(listFiles(folder.path()), ElementsAre("run.h5", "tmp"));
}

TEST_F(ResultFileTest, TheSameRunGivesTheSameBytesHoweverOftenFlushedOrResumed) {
    writeRun(folder / "once.h5");
    {
        ResultWriter writer(path, makeHeader());
        writer.add(makeAnalysis("static"));
        writer.beginTransient("run", makeProbes(), makeStates());
        for (int k = 0; k < 60; ++k) {
            addCircleRow(writer, k);
            if (k % 7 == 0) writer.flush();
        }
    }
    for (const int numRows : {40, 0, 23}) {
        ResultWriter writer(path);
        writer.resumeTransient("run", numRows);
        addCircle(writer, numRows, 77);
    }
    {
        ResultWriter writer(path);
        writer.resumeTransient("run", 77);
        addCircle(writer, 77, 100);
        writer.setStatistics("run", {{"steps", 12}, {"iterations", 30}});
        writer.setComplete("run");
    }
    {
        ResultWriter writer(path);
        writer.add(makeAnalysis("eigen"));
        writer.add(makeAnalysis("campbell"));
    }
    EXPECT_EQ(readText(path), readText(folder / "once.h5"));
}

TEST_F(ResultFileTest, GoingOnDropsLaterRowsAndKeepsOtherAnalyses) {
    writeRun(path);
    {
        ResultWriter writer(path);
        writer.resumeTransient("run", 10);
    }
    const Results data = readResults(path);
    ASSERT_EQ(data.analyses.size(), 4u);
    for (size_t k = 0; k < 3; ++k) {
        EXPECT_TRUE(data.analyses[k].isComplete);
        EXPECT_EQ(data.analyses[k].type, (std::vector{"static", "eigen", "campbell"}[k]));
    }
    const Results::Analysis& run = data.analyses[3];
    EXPECT_EQ(run.time.size(), 10u);
    EXPECT_FALSE(run.isComplete);
    EXPECT_TRUE(run.statistics.empty());
    ResultWriter writer(path);
    EXPECT_THROW(writer.resumeTransient("run", 11), std::runtime_error);
    EXPECT_THROW(writer.resumeTransient("walk", 1), std::runtime_error);
}

TEST_F(ResultFileTest, AnAnalysisThatWasCutOffIsReplaced) {
    for (const char* type : {"static", "eigen", "campbell"}) {
        Results::Analysis begun = makeAnalysis(type);
        begun.isComplete = false;
        ResultWriter(path, makeHeader()).add(begun);
        ResultWriter(path).add(makeAnalysis(type));
        const Results data = readResults(path);
        ASSERT_EQ(data.analyses.size(), 1u) << type;
        EXPECT_TRUE(data.analyses[0].isComplete) << type;
        EXPECT_THROW(ResultWriter(path).add(makeAnalysis(type)), std::runtime_error);
    }
}

TEST_F(ResultFileTest, RowsThatFollowStatisticsAreKeptToo) {
    {
        ResultWriter writer(path, makeHeader());
        writer.beginTransient("run", makeProbes(), makeStates());
        addCircle(writer, 0, 10);
        writer.setStatistics("run", {{"steps", 1}});
        addCircle(writer, 10, 30);
    }
    EXPECT_EQ(readResults(path).analyses[0].time.size(), 30u);
    EXPECT_TRUE(isCircle(readResults(path).analyses[0]));
}

TEST_F(ResultFileTest, ARunningRunCanBeReadByOthersAndWrittenByNoOther) {
    ResultWriter writer(path, makeHeader());
    writer.beginTransient("run", makeProbes(), makeStates());
    addCircle(writer, 0, 5);
    EXPECT_EQ(readResults(path).analyses[0].time.size(), 5u);
    EXPECT_FALSE(readResults(path).analyses[0].isComplete);
    try {
        ResultWriter other(path, makeHeader());
        FAIL();
    } catch (const std::runtime_error& error) {
        EXPECT_THAT(error.what(), AllOf(HasSubstr(path), HasSubstr("another run")));
    }
}

/** Runs `work` in a child process and kills it when it has reported `moment`. @returns the largest
number reported. **/
int killAt(int moment, const std::function<void(volatile int&)>& work) {
    void* shared = mmap(nullptr, 4096, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    volatile int& told = *static_cast<volatile int*>(shared);
    const pid_t child = startChild([&] {
        work(told);
        return 0;
    });
    await("moment " + std::to_string(moment), [&] { return told >= moment || hasEnded(child); });
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
    const int last = told;
    munmap(shared, 4096);
    return last;
}

TEST_F(ResultFileTest, AWriterKilledAtAnyMomentLeavesEveryFlushedRow) {
    std::srand(1);
    for (int round = 0; round < 25; ++round) {
        const int flushed = killAt(1 + std::rand() % 100, [&](volatile int& told) {
            ResultWriter writer(path, makeHeader());
            writer.beginTransient("run", makeProbes(), makeStates());
            for (int k = 0; k < 100000; ++k) {
                addCircleRow(writer, k);
                if (k % 3 != 0) continue;
                if (k % 30 == 0) {
                    writer.setComplete("run");  // replaces the HDF5 file
                } else {
                    writer.flush();
                }
                told = k + 1;
            }
        });
        const Results data = readResults(path);
        ASSERT_EQ(data.analyses.size(), 1u);
        EXPECT_GE(int(data.analyses[0].time.size()), flushed);
        EXPECT_TRUE(isCircle(data.analyses[0]));
        // Any program can read the HDF5 file by itself, too.
        std::filesystem::rename(path + ".rows", folder / "aside");
        ASSERT_EQ(readResults(path).analyses.size(), 1u);
        EXPECT_TRUE(isCircle(readResults(path).analyses[0]));
        std::filesystem::rename(folder / "aside", path + ".rows");
        // The run can be resumed.
        ResultWriter writer(path);
        writer.resumeTransient("run", flushed);
        addCircle(writer, flushed, flushed + 10);
        writer.setComplete("run");
        EXPECT_EQ(int(readResults(path).analyses[0].time.size()), flushed + 10);
    }
    EXPECT_THAT(listFiles(folder.path()), ElementsAre("run.h5", "tmp"));
}

TEST_F(ResultFileTest, AFullDiskIsToldAndLosesNothingOfBefore) {
    const pid_t child = startChild([&] {
        signal(SIGXFSZ, SIG_IGN);
        const rlimit limit{60000, 60000};  // file size [bytes], beyond which writing fails
        setrlimit(RLIMIT_FSIZE, &limit);
        int rows = 0;
        try {
            ResultWriter writer(path, makeHeader());
            writer.beginTransient("run", makeProbes(), makeStates());
            for (;; ++rows) addCircleRow(writer, rows);
        } catch (const std::runtime_error& error) {
            writeText(folder / "error", error.what());
        }
        return rows / 10;
    });
    int status = 0;
    waitpid(child, &status, 0);
    EXPECT_THAT(readText(folder / "error"), AllOf(HasSubstr(path), HasSubstr("File too large")));
    ASSERT_TRUE(WIFEXITED(status));
    const Results data = readResults(path);
    EXPECT_EQ(int(data.analyses.at(0).time.size()) / 10, WEXITSTATUS(status));
    EXPECT_GT(data.analyses[0].time.size(), 400u);
    EXPECT_TRUE(isCircle(data.analyses[0]));
}

TEST_F(ResultFileTest, DamagedAndForeignFilesAreRefusedByName) {
    EXPECT_THAT(readError(path), AllOf(HasSubstr(path), HasSubstr("does not exist")));
    writeText(path, "time,x\n0,1\n");
    EXPECT_THAT(readError(path), AllOf(HasSubstr(path), HasSubstr("another kind")));
    writeRun(path);
    const std::string bytes = readText(path);
    for (size_t size = 0; size < bytes.size(); size += 1 + bytes.size() / 37) {
        writeText(path, bytes.substr(0, size));
        EXPECT_THAT(readError(path), HasSubstr("'" + path + "' cannot be used"));
    }
    std::string damaged = bytes;
    damaged[damaged.size() / 2] ^= 1;
    writeText(path, damaged);
    EXPECT_THAT(readError(path), HasSubstr("checksum"));
    const hid_t file = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
    H5Fclose(file);
    EXPECT_THAT(readError(path), AllOf(HasSubstr(path), HasSubstr("not a result file of simflex")));
}

TEST_F(ResultFileTest, ANewerFormatIsRefused) {
    writeRun(path);
    const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
    const hid_t attribute = H5Aopen(file, "simflex_results", H5P_DEFAULT);
    const int newer = 2;
    H5Awrite(attribute, H5T_NATIVE_INT, &newer);
    H5Aclose(attribute);
    H5Fclose(file);
    EXPECT_THAT(readError(path),
                AllOf(HasSubstr(path), HasSubstr("is 2"), HasSubstr("newer simflex")));
}

/** Replaces the times of the transient analysis of writeRun(), of 100 rows. **/
void replaceTimes(const std::string& path, const std::vector<double>& times) {
    const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
    H5Ldelete(file, "analyses/run/time", H5P_DEFAULT);
    const hsize_t count = times.size();
    const hid_t space = H5Screate_simple(1, &count, nullptr);
    const hid_t data = H5Dcreate2(file, "analyses/run/time", H5T_NATIVE_DOUBLE, space, H5P_DEFAULT,
                                  H5P_DEFAULT, H5P_DEFAULT);
    H5Dwrite(data, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, times.data());
    H5Dclose(data);
    H5Sclose(space);
    H5Fclose(file);
}

TEST_F(ResultFileTest, AProbeOfAnotherLengthIsRefusedByName) {
    writeRun(path);
    std::vector<double> times(99);
    std::iota(times.begin(), times.end(), 0.0);
    replaceTimes(path, times);
    EXPECT_THAT(readError(path),
                AllOf(HasSubstr(path), HasSubstr("'run'"), HasSubstr("'swing' has extent 100")));
}

TEST_F(ResultFileTest, TimesThatDoNotIncreaseOrAreTooLargeAreRefusedByName) {
    writeRun(path);
    std::vector<double> rising(100);
    std::iota(rising.begin(), rising.end(), -50.0);
    const auto errorOf = [&](int row, double time) {
        std::vector<double> times = rising;
        times[size_t(row)] = time;
        replaceTimes(path, times);
        return readError(path);
    };
    replaceTimes(path, rising);
    EXPECT_EQ(readResults(path).analyses[1].time, rising);
    for (const double same : {0.0, 1e308}) {
        replaceTimes(path, std::vector<double>(100, same));
        EXPECT_THAT(readError(path),
                    AllOf(HasSubstr(path), HasSubstr("'run'"), HasSubstr("'time'")));
    }
    EXPECT_THAT(errorOf(7, rising[6]), HasSubstr("'time' does not increase at row 7"));
    EXPECT_THAT(errorOf(7, 0), HasSubstr("'time' does not increase at row 8"));
    for (const double wrong : {1e300, double(INFINITY), double(NAN)})
        EXPECT_THAT(errorOf(99, wrong), HasSubstr("'time' is out of range at row 99"));
    EXPECT_THAT(errorOf(0, -1e300), HasSubstr("'time' is out of range at row 0"));
}

TEST_F(ResultFileTest, AJournalOfAnotherRunIsNotMistakenForThisOnes) {
    writeRun(path);
    ResultHeader other = makeHeader();
    other.title = "Other";
    killAt(1, [&](volatile int& told) {
        ResultWriter writer(folder / "other.h5", other);
        writer.beginTransient("run", makeProbes(), makeStates());
        addCircle(writer, 0, 500);
        told = 1;
        for (;;) pause();
    });
    std::filesystem::rename(folder / "other.h5.rows", path + ".rows");
    EXPECT_EQ(readResults(path).header.title, "Swing");
    EXPECT_EQ(readResults(path).analyses[1].time.size(), 100u);
}

TEST_F(ResultFileTest, NamesThatWouldMakeFoldersOfTheirOwnAreRefused) {
    ResultWriter writer(path, makeHeader());
    EXPECT_THROW(writer.beginTransient("a/b", makeProbes()), std::runtime_error);
    EXPECT_THROW(writer.beginTransient("run", {{"../x", "m", {""}}}), std::runtime_error);
    EXPECT_THROW(writer.addRow(0, {1}), std::runtime_error);
}

TEST_F(ResultFileTest, NamesThatATerminalWouldObeyAreRefused) {
    for (const char* name : {"run\x1b[31m", "run\nsimflex: all is well", "run\u202E"}) {
        ResultWriter(path, makeHeader()).beginTransient(name, makeProbes());
        EXPECT_THROW(readResults(path), std::runtime_error) << name;
        std::filesystem::remove(path);
        ResultWriter(path, makeHeader()).beginTransient("run", {{name, "m", {""}}});
        EXPECT_THROW(readResults(path), std::runtime_error) << name;
        std::filesystem::remove(path);
    }
}

TEST_F(ResultFileTest, NoTitleOfACsvFileIsAFormula) {
    Results::Analysis analysis = makeAnalysis("static");
    for (const char* name : {"=1+1", "+1+1", "-1+1", "@f"}) {
        analysis.probes[0].column.name = name;
        writeResultCsv(folder / "run.csv", analysis);
        const std::string text = readText(folder / "run.csv");
        EXPECT_THAT(text, HasSubstr("'" + std::string(name))) << name;
        EXPECT_THAT(text, ::testing::Not(HasSubstr("," + std::string(name)))) << name;
    }
}

TEST_F(ResultFileTest, CsvHasOneTitledColumnForEachNumberAndAllDigits) {
    writeRun(path, 3);
    const Results data = readResults(path, ReadStates::No);
    EXPECT_TRUE(data.analyses[1].q.empty());
    writeResultCsv(folder / "run.csv", data.analyses[1]);
    const std::string text = readText(folder / "run.csv");
    EXPECT_THAT(text, HasSubstr("time [s],swing.x [m],swing.y [m],angle [rad]\n0,2,0,0\n"));
    double t, x, y, angle;
    ASSERT_EQ(
        std::sscanf(text.c_str() + text.rfind("\n0.02") + 1, "%lf,%lf,%lf,%lf", &t, &x, &y, &angle),
        4);
    EXPECT_EQ(x, 2 * std::cos(t));
    EXPECT_EQ(y, 2 * std::sin(t));
    writeResultCsv(folder / "map.csv", data.analyses[3]);
    EXPECT_EQ(readText(folder / "map.csv"),
              "speed,frequency 1 [Hz],frequency 2 [Hz],damping ratio 1,damping ratio 2\n"
              "0,10,20,0.01,0.02\n"
              "100,8,23,0.029999999999999999,-0.01\n");
    EXPECT_THROW(writeResultCsv(folder / "none/run.csv", data.analyses[1]), std::runtime_error);
}

TEST_F(ResultFileTest, PythonReadsTheSameNumbers) {
    writeRun(path);
    const std::string command = "/usr/bin/python3 '" SIMFLEX_SOURCE_DIR
                                "/tests/cli/results/check_result_file.py' '" SIMFLEX_SOURCE_DIR
                                "/examples/result_file.py' '" +
                                path + "' >'" + (folder / "out") + "' 2>&1";
    EXPECT_EQ(std::system(command.c_str()), 0) << readText(folder / "out");
}

}  // namespace
}  // namespace simflex
