/** @file
simflex cache, as built. **/

#include <chrono>
#include <filesystem>
#include <fstream>

#include "RunTest.h"

namespace simflex {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

class CacheCommandTest : public RunTest {
protected:
    void SetUp() override {
        RunTest::SetUp();
        writeModel(
            "simflex: 1\nparameters: {modes: 8}\n"
            "parts: {beam: {deck: brick.inp, interfaces: {left: LEFT}, modes: modes}}\n"
            "bodies: {a: {part: beam}}\n"
            "analyses: {natural: {type: eigen}}\n");
    }
    int runCache(const std::string& arguments = "") {
        return runProgram("SIMFLEX_CACHE=cache '" SIMFLEX_PROGRAM "'", "cache " + arguments);
    }
    std::vector<std::string> listCache() const { return testing::listFiles(folder / "cache"); }
};

TEST_F(CacheCommandTest, ListsPartsAndRemovesThoseThatWereNotUsedForLong) {
    ASSERT_EQ(runCache(), 0) << err;
    EXPECT_EQ(out, "cache: 0 parts, 0.0 kB\n");
    ASSERT_EQ(runModel(), 0) << err;
    ASSERT_EQ(listCache().size(), 1u);
    const std::string used = listCache()[0];
    ASSERT_EQ(runModel("--set parameters.modes=9"), 0) << err;
    ASSERT_EQ(listCache().size(), 2u);
    for (const std::string& name : listCache())
        fs::last_write_time(folder / "cache/" + name,
                            fs::file_time_type::clock::now() - std::chrono::hours(24 * 40));
    ASSERT_EQ(runModel(), 0) << err;

    ASSERT_EQ(runCache(), 0) << err;
    EXPECT_THAT(out, AllOf(HasSubstr("last used"), HasSubstr(used.substr(0, 32)),
                           HasSubstr("  beam\n"), HasSubstr("cache: 2 parts, ")));
    ASSERT_EQ(runCache("--clear --older-than 30"), 0) << err;
    EXPECT_THAT(out, HasSubstr("cache: 1 part removed, "));
    EXPECT_THAT(listCache(), ::testing::ElementsAre(used));
    ASSERT_EQ(runCache("--clear"), 0) << err;
    EXPECT_THAT(out, HasSubstr("cache: 1 part removed, "));
    EXPECT_TRUE(listCache().empty());
    EXPECT_EQ(runCache("--older-than 30"), 2);
    EXPECT_THAT(err, HasSubstr("--clear"));
}

/** What another code has reduced, of the same version even, is not taken for its own. **/
TEST_F(CacheCommandTest, PartsAreOfTheCodeThatReducesThem) {
    const fs::path library =
        fs::path(SIMFLEX_PROGRAM).parent_path().parent_path() / "lib" / "libsimflex_reduction.so.0";
    if (!fs::exists(library)) GTEST_SKIP() << "the program is linked statically";
    const std::string changed = "LD_LIBRARY_PATH=. SIMFLEX_CACHE=cache '" SIMFLEX_PROGRAM "'";
    fs::copy_file(library, folder / library.filename());
    ASSERT_EQ(runModel(), 0) << err;
    ASSERT_EQ(runProgram(changed, "run model.yaml"), 0) << err;
    ASSERT_EQ(listCache().size(), 1u);
    std::ofstream(folder / library.filename(), std::ios::app) << "another";
    ASSERT_EQ(runProgram(changed, "run model.yaml"), 0) << err;
    EXPECT_EQ(listCache().size(), 2u);
}

}  // namespace
}  // namespace simflex
