#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <string>

#include "simflex/base/UnfinishedFile.h"
#include "support/TestFolder.h"

namespace simflex {
namespace {

using ::testing::ElementsAre;
using testing::listFiles;
using testing::readText;
using testing::writeText;

struct UnfinishedFileTest : ::testing::Test {
    const testing::TestFolder parent;
    const std::filesystem::path folder = parent.makeFolder("results");
    const std::string path = (folder / "result.txt").string();
};

TEST_F(UnfinishedFileTest, HasItsNameOnlyWhenItIsFinished) {
    for (const Durability durability : {Durability::ProcessEnd, Durability::PowerFailure}) {
        writeText(path, "old");
        UnfinishedFile file(path);
        writeText(file.getPath(), "new");
        EXPECT_EQ(readText(path), "old");
        file.finish(durability);
        EXPECT_EQ(readText(path), "new");
        EXPECT_THAT(listFiles(folder.string()), ElementsAre("result.txt"));
    }
}

TEST_F(UnfinishedFileTest, LeavesTheOldOneAndNothingElseWhenItIsGivenUp) {
    writeText(path, "old");
    {
        const UnfinishedFile file(path);
        writeText(file.getPath(), "half of the n");
    }
    EXPECT_EQ(readText(path), "old");
    EXPECT_THAT(listFiles(folder.string()), ElementsAre("result.txt"));
}

TEST_F(UnfinishedFileTest, TellsWhyItCannotHaveItsName) {
    std::filesystem::create_directories(folder / "result.txt/full");
    UnfinishedFile file(path);
    writeText(file.getPath(), "new");
    try {
        file.finish();
        ADD_FAILURE() << "it took the place of a folder";
    } catch (const std::runtime_error& error) {
        EXPECT_EQ(std::string(error.what()), "cannot write '" + path + "': Is a directory");
    }
}

TEST_F(UnfinishedFileTest, ReplacesWholeFilesOfAnyBytes) {
    const std::string bytes("\0 and more\n\xff", 12);
    replaceFile(path, bytes);
    EXPECT_EQ(readText(path), bytes);
    replaceFile(path, "");
    EXPECT_EQ(readText(path), "");
}

TEST_F(UnfinishedFileTest, KeepsTheOldFileWhereTheNewOneDoesNotFit) {
    replaceFile(path, "old");
    rlimit before{};
    getrlimit(RLIMIT_FSIZE, &before);
    const rlimit small{4096, before.rlim_max};
    const auto oldHandler = signal(SIGXFSZ, SIG_IGN);
    setrlimit(RLIMIT_FSIZE, &small);
    std::string message = "no error";
    try {
        replaceFile(path, std::string(10000, 'x'));
    } catch (const std::runtime_error& error) {
        message = error.what();
    }
    setrlimit(RLIMIT_FSIZE, &before);
    signal(SIGXFSZ, oldHandler);
    EXPECT_EQ(message, "cannot write '" + path + "': File too large");
    EXPECT_EQ(readText(path), "old");
    EXPECT_THAT(listFiles(folder.string()), ElementsAre("result.txt"));
    EXPECT_THROW(replaceFile(folder / "none/result.txt", "new"), std::runtime_error);
}

TEST_F(UnfinishedFileTest, SymbolicLinksStayAndTheirTargetsAreReplaced) {
    namespace fs = std::filesystem;
    const fs::path disk = parent.makeFolder("disk");
    fs::create_symlink("../disk/new.txt", folder / "first");
    fs::create_symlink("first", folder / "result.txt");
    for (const char* text : {"new", "newer"}) {
        checkWritable(path);
        replaceFile(path, text);
        EXPECT_EQ(readText((disk / "new.txt").string()), text);
        EXPECT_TRUE(fs::is_symlink(path));
    }
    EXPECT_THAT(listFiles(disk.string()), ElementsAre("new.txt"));
}

/** Those who may write to the folder know the name of the unfinished file beforehand. **/
TEST_F(UnfinishedFileTest, LinksInItsPlaceAreNotWrittenThrough) {
    namespace fs = std::filesystem;
    const fs::path victim = folder / "victim";
    writeText(victim.string(), "precious");
    const std::string planted = path + ".part-" + std::to_string(getpid());
    fs::create_symlink("victim", planted);
    replaceFile(path, "new");
    EXPECT_EQ(readText(path), "new");
    {
        UnfinishedFile first(path), second(path);
        EXPECT_NE(first.getPath(), second.getPath());
        writeText(first.getPath(), "first");
        writeText(second.getPath(), "second");
        first.finish();
        EXPECT_EQ(readText(path), "first");
        second.finish();
    }
    EXPECT_EQ(readText(path), "second");
    EXPECT_EQ(readText(victim.string()), "precious");
    fs::create_symlink("victim", folder / "journal");
    EXPECT_THROW(appendToFile(folder / "journal", 0, "new"), std::runtime_error);
    EXPECT_EQ(readText(victim.string()), "precious");
}

TEST_F(UnfinishedFileTest, WhatIsNoRegularFileIsNotReplaced) {
    ASSERT_EQ(mkfifo(path.c_str(), 0600), 0);
    std::filesystem::create_symlink("/dev/full", folder / "full");
    for (const std::string& name : {path, (folder / "full").string()}) {
        EXPECT_THROW(checkWritable(name), std::runtime_error);
        EXPECT_THROW(replaceFile(name, "new"), std::runtime_error);
    }
    EXPECT_TRUE(std::filesystem::is_fifo(path));
    EXPECT_TRUE(std::filesystem::is_character_file("/dev/full"));
}

TEST_F(UnfinishedFileTest, WhatKilledProcessesLeftIsRemovedAndNothingElse) {
    for (const char* name :
         {"run.mp4.part-999999999", "run.mp4.part-999999999.nut", "run.mp4.part-1", "run.mp4",
          "run.mp4.part-", "run.mp4.part-x", "other.mp4.part-999999999"})
        writeText((folder / name).string(), "");
    const std::string living = (folder / ("run.mp4.part-" + std::to_string(getpid()))).string();
    writeText(living, "");
    removeUnfinishedFiles(folder, "run.mp4.");
    EXPECT_TRUE(std::filesystem::remove(living));
    EXPECT_THAT(listFiles(folder.string()),
                ElementsAre("other.mp4.part-999999999", "run.mp4", "run.mp4.part-",
                            "run.mp4.part-1", "run.mp4.part-x"));
    removeUnfinishedFiles(folder / "none", "");  // is no error

    writeText((folder / "run.mp4.part-999999999").string(), "half");
    replaceFile(folder / "run.mp4", std::string_view("whole"));
    EXPECT_FALSE(std::filesystem::exists(folder / "run.mp4.part-999999999"));
}

}  // namespace
}  // namespace simflex
