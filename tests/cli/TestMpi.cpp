/** @file
simflex_mpi, SLEPc and MUMPS over two processes, against simflex. **/

#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>

#include "CliTest.h"
#include "simflex/part/ReducedBodyFile.h"

namespace simflex {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

/** Returns the largest difference of two lists relative to the largest entry. **/
double compare(const std::vector<double>& a, const std::vector<double>& b) {
    if (a.size() != b.size()) return INFINITY;
    double difference = 0, largest = 0;
    for (size_t k = 0; k < a.size(); ++k) {
        difference = std::max(difference, std::abs(a[k] - b[k]));
        largest = std::max(largest, std::abs(a[k]));
    }
    return difference == 0 ? 0 : difference / largest;
}

class MpiTest : public CliTest {
protected:
    void SetUp() override {
        CliTest::SetUp();
        // Also as root and on one processor; one thread per process.
        setenv("OMPI_ALLOW_RUN_AS_ROOT", "1", 1);
        setenv("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1", 1);
        setenv("OMPI_MCA_rmaps_base_oversubscribe", "1", 1);
    }

    int runMpi(const std::string& arguments, int numThreads = 1) {
        return runProgram("OMP_NUM_THREADS=" + std::to_string(numThreads) +
                              " mpirun -n 2 '" SIMFLEX_MPI_PROGRAM "'",
                          arguments);
    }

    void expectSameParts(const std::string& arguments) {
        ASSERT_EQ(run("reduce -q brick.inp -o one.h5 " + arguments), 0) << err;
        ASSERT_EQ(runMpi("reduce -q brick.inp -o two.h5 " + arguments), 0) << err;
        const ReducedBody one = readReducedBody(folder / "one.h5"),
                          two = readReducedBody(folder / "two.h5");
        for (int k = 0; k < one.numModes; ++k)
            EXPECT_NEAR(two.omegaSquared[size_t(k)], one.omegaSquared[size_t(k)],
                        1e-8 * one.omegaSquared[size_t(k)]);
        EXPECT_LT(compare(one.Phi, two.Phi), 1e-8);
        EXPECT_LT(compare(one.I1, two.I1), 1e-8);
        for (size_t c = 0; c < 6; ++c) EXPECT_LT(compare(one.I2[c], two.I2[c]), 1e-8);
        for (size_t k = 0; k < one.interfaces.size(); ++k) {
            EXPECT_LT(compare(one.interfaces[k].Phi, two.interfaces[k].Phi), 1e-8);
            EXPECT_LT(compare(one.interfaces[k].Psi, two.interfaces[k].Psi), 1e-8);
        }
        ASSERT_TRUE(two.report);
        EXPECT_LT(compare(one.report->normalFrequencies, two.report->normalFrequencies), 1e-8);
        EXPECT_LT(compare(one.report->effectiveMasses, two.report->effectiveMasses), 1e-8);
    }
};

TEST_F(MpiTest, RigidInterfaces) {
    expectSameParts("-i left=LEFT -i right=RIGHT -m 24");
}

TEST_F(MpiTest, DistributingInterfacesAndLoadPoints) {
    expectSameParts("--distributing left=LEFT --distributing right=RIGHT --load-point node:5=yz");
}

TEST_F(MpiTest, BothKindsUpToAFrequency) {
    expectSameParts("-i left=LEFT --distributing right=RIGHT --up-to 20000");
}

TEST_F(MpiTest, FreeParts) {
    expectSameParts("-m 20");
}

TEST_F(MpiTest, OnePointMassesToo) {
    testing::Brick brick;
    brick.type = "C3D8R";  // its mass matrix has a null space
    testing::writeText(folder / "brick.inp", brick.text());
    expectSameParts("-i left=LEFT -i right=RIGHT -m 24");
}

TEST_F(MpiTest, ErrorsAreToldOnceAndNothingHangs) {
    EXPECT_NE(runMpi("reduce -q brick.inp -i left=NOWHERE -o two.h5"), 0);
    EXPECT_THAT(err, AllOf(HasSubstr("'NOWHERE'"), HasSubstr("RIGHT (9)")));
    EXPECT_EQ(err.find("NOWHERE"), err.rfind("NOWHERE"));
}

TEST_F(MpiTest, AnErrorOfOneRankEndsAllWithItsName) {
    const std::string program =
        "'" SIMFLEX_MPI_PROGRAM "' reduce -q brick.inp -i left=LEFT -m 14 -o two.h5";
    for (const char* function : {"MatCholeskyFactorNumeric", "MatSolve", "EPSSolve"})
        for (const int rank : {0, 1}) {
            SCOPED_TRACE(std::string(function) + ", rank " + std::to_string(rank));
            const std::string failing =
                std::string("env FAILS_IN=") + function +
                " ASAN_OPTIONS=verify_asan_link_order=0 LD_PRELOAD='" FAILING_RANK "' " + program;
            const std::string ranks = "-n 1 " + (rank == 0 ? failing : program) + " : -n 1 " +
                                      (rank == 1 ? failing : program);
            const int status = runProgram("timeout 60 mpirun", ranks);
            EXPECT_NE(status, 0);
            EXPECT_NE(status, 124) << "it hangs";
            EXPECT_THAT(err, HasSubstr("simflex: process " + std::to_string(rank + 1) +
                                       " of 2 has failed, so all of them end: PETSc could not "));
            EXPECT_THAT(err, HasSubstr("Out of memory"));
            EXPECT_FALSE(std::filesystem::exists(folder / "two.h5"));
        }
}

TEST_F(MpiTest, PartsDependOnThreadsNoMoreThanOnTheOrderOfMessages) {
    // MUMPS adds what processes send each other as it arrives.
    const std::string arguments = "reduce -q brick.inp -i left=LEFT -i right=RIGHT -m 24 -o ";
    ASSERT_EQ(runMpi(arguments + "one.h5", 1), 0) << err;
    ASSERT_EQ(runMpi(arguments + "two.h5", 2), 0) << err;
    const ReducedBody one = readReducedBody(folder / "one.h5"),
                      two = readReducedBody(folder / "two.h5");
    EXPECT_LT(compare(one.omegaSquared, two.omegaSquared), 1e-12);
    EXPECT_LT(compare(one.Phi, two.Phi), 1e-9);
    EXPECT_LT(compare(one.I1, two.I1), 1e-9);
}

}  // namespace
}  // namespace simflex
