/** @file
Valid and invalid names of input files. **/

#include <gmock/gmock.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "simflex/base/InputFile.h"
#include "simflex/base/TemporaryFolder.h"

namespace simflex {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class InputFileTest : public ::testing::Test {
protected:
    InputFileTest() { std::ofstream(file) << "some\nbytes"; }

    void expectRefused(const fs::path& path) const {
        EXPECT_FALSE(isInputFile(path)) << path;
        EXPECT_FALSE(openInputFile(path).is_open()) << path;
        EXPECT_THROW(readInputFile(path), std::runtime_error) << path;
        const fs::path link = folder.path() / "link";
        fs::create_symlink(path, link);
        EXPECT_FALSE(isInputFile(link)) << path;
        EXPECT_FALSE(openInputFile(link).is_open()) << path;
        fs::remove(link);
    }

    const TemporaryFolder folder;
    const fs::path file = folder.path() / "file";
};

TEST_F(InputFileTest, RegularFilesAndLinksToThemAreRead) {
    fs::create_symlink("file", folder.path() / "near");
    std::ofstream(folder.path() / "empty");
    EXPECT_EQ(readInputFile(file), "some\nbytes");
    EXPECT_EQ(readInputFile(folder.path() / "near"), "some\nbytes");
    EXPECT_EQ(readInputFile(folder.path() / "empty"), "");
    EXPECT_TRUE(openInputFile(folder.path() / "empty").is_open());
}

TEST_F(InputFileTest, PipesDevicesAndFoldersAreNot) {
    ASSERT_EQ(mkfifo((folder.path() / "pipe").c_str(), 0600), 0);
    for (const fs::path& path :
         {folder.path() / "pipe", folder.path(), fs::path("/dev/zero"), fs::path("/dev/null")})
        expectRefused(path);
}

TEST_F(InputFileTest, WhatTheKernelShowsOfItselfIsNot) {
    ASSERT_TRUE(fs::is_regular_file("/proc/self/status"));
    for (const char* path :
         {"/proc/self/status", "/proc/kmsg", "/proc/kcore", "/sys/kernel/uevent_seqnum"})
        expectRefused(path);
}

TEST_F(InputFileTest, ErrorsNameTheFileAndTheCause) {
    try {
        readInputFile(folder.path() / "nothing");
        FAIL();
    } catch (const std::runtime_error& error) {
        EXPECT_THAT(error.what(), HasSubstr((folder.path() / "nothing").string() + "': No such"));
    }
    try {
        readInputFile(folder.path());
        FAIL();
    } catch (const std::runtime_error& error) {
        EXPECT_THAT(error.what(), HasSubstr("it is no file on a disk"));
    }
}

}  // namespace
}  // namespace simflex
