#pragma once
/** @file
The simflex program in a folder of the test, which contains a brick's deck. **/

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <string>

#include "fe/TestDecks.h"
#include "support/Await.h"

namespace simflex {

class CliTest : public ::testing::Test {
protected:
    void SetUp() override {
        testing::Brick brick;
        brick.type = "C3D8I";  // which does not lock
        testing::writeText(folder / "brick.inp", brick.text());
    }

    /** Runs simflex with these arguments in the folder and stores its output. @returns exit
    status. **/
    int run(const std::string& arguments) { return runProgram("'" SIMFLEX_PROGRAM "'", arguments); }

    int runProgram(const std::string& program, const std::string& arguments) {
        const std::string command =
            "cd '" + folder.path() + "' && " + program + " " + arguments + " >tmp.out 2>tmp.err";
        const int status = std::system(command.c_str());
        out = testing::readText(folder / "tmp.out");
        err = testing::readText(folder / "tmp.err");
        unlink((folder / "tmp.out").c_str());
        unlink((folder / "tmp.err").c_str());
        return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
    }

    testing::TestFolder folder;
    std::string out, err;
};

}  // namespace simflex
