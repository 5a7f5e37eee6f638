#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <functional>
#include <string>

#include "simflex/base/TemporaryFolder.h"
#include "support/TestFolder.h"

namespace simflex {
namespace {

namespace fs = std::filesystem;

/** Runs in a child process that ends without destructors, as by SIGKILL. **/
void runAndKill(const std::function<void()>& work) {
    const pid_t process = fork();
    if (process == 0) {
        work();
        _exit(0);
    }
    int status = 1;
    waitpid(process, &status, 0);
    ASSERT_EQ(status, 0);
}

int countFolders() {
    int count = 0;
    for (const auto& entry : fs::directory_iterator(std::getenv("TMPDIR")))
        count += entry.path().filename().string().rfind("simflex-", 0) == 0;
    return count;
}

TEST(TemporaryFolder, ThoseOfKilledProcessesAreRemovedByTheNext) {
    const testing::TestFolder place;
    for (int k = 0; k < 2; ++k) {
        runAndKill([] {
            const TemporaryFolder* left = new TemporaryFolder;
            fs::create_directory(left->path() / "more");
        });
        EXPECT_EQ(countFolders(), 1) << k;  // the previous one has been removed
    }
}

TEST(TemporaryFolder, ThoseInUseStay) {
    const testing::TestFolder place;
    fs::path path;
    {
        const TemporaryFolder mine;
        path = mine.path();
        runAndKill([] { new TemporaryFolder; });
        EXPECT_TRUE(fs::exists(path));
        EXPECT_EQ(countFolders(), 2);
    }
    EXPECT_FALSE(fs::exists(path));
}

}  // namespace
}  // namespace simflex
