/** @file
Child processes: their environment and termination. **/

#include <fcntl.h>
#include <gmock/gmock.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <memory>
#include <string>
#include <thread>

#include "simflex/base/ChildProcess.h"
#include "simflex/base/ProgramOutput.h"
#include "simflex/base/TemporaryFolder.h"

namespace simflex {
namespace {

using File = std::unique_ptr<FILE, int (*)(FILE*)>;

/** Returns its output. **/
std::string outputOf(ChildSetup setup) {
    const File output(std::tmpfile(), std::fclose);
    setup.output = fileno(output.get());
    ChildProcess(setup).wait();
    std::string text(10000, '\0');
    std::rewind(output.get());
    text.resize(std::fread(text.data(), 1, text.size(), output.get()));
    return text;
}

ChildSetup setupOf(const std::vector<std::string>& arguments) {
    ChildSetup setup;
    setup.arguments = arguments;
    return setup;
}

TEST(ChildProcess, ArgumentsArriveAsTheyAre) {
    const std::vector<std::string> words = {
        "a;touch b",  "$(touch c)", "`touch d`", "it's \"so\"",
        "two\nlines", "-v",         "",          " * ? ~ \\ & |"};
    std::vector<std::string> arguments = {"printf", "%s\\t"};
    std::string expected;
    for (const std::string& word : words) {
        arguments.push_back(word);
        expected += word + "\t";
    }
    const TemporaryFolder folder;
    ChildSetup setup = setupOf(arguments);
    setup.folder = folder.path().string();
    EXPECT_EQ(outputOf(setup), expected);
    EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(ChildProcess, FolderAndEnvironmentAreThoseAskedFor) {
    const TemporaryFolder folder;
    ChildSetup setup = setupOf({"/bin/pwd"});
    setup.folder = folder.path().string();
    EXPECT_EQ(outputOf(setup), std::filesystem::canonical(folder.path()).string() + "\n");
    setup = setupOf({"/usr/bin/env"});
    setup.environment = {{"NAME", "value = $HOME"}};
    EXPECT_EQ(outputOf(setup), "NAME=value = $HOME\n");
}

TEST(ChildProcess, WhatItWritesArrivesWhicheverStandardFilesAreClosedHere) {
    // The file for its output gets the descriptor of a closed one.
    for (const int closed : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
        const int kept = dup(closed);
        close(closed);
        const std::string text = outputOf(setupOf({"/bin/echo", "words"}));
        dup2(kept, closed);
        close(kept);
        EXPECT_EQ(text, "words\n") << closed;
    }
}

TEST(ChildProcess, HowItEndedIsTold) {
    EXPECT_TRUE(ChildProcess(setupOf({"true"})).wait().isSuccess());
    EXPECT_EQ(ChildProcess(setupOf({"sh", "-c", "exit 3"})).wait().describe(),
              "left with exit status 3");
    EXPECT_EQ(ChildProcess(setupOf({"sh", "-c", "kill -9 $$"})).wait().describe(),
              "was ended by signal 9 (Killed); is memory short?");
    EXPECT_EQ(ChildProcess(setupOf({"sh", "-c", "kill -6 $$"})).wait().describe(),
              "was ended by signal 6 (Aborted)");
    ChildProcess sleeper(setupOf({"sleep", "1000"}));
    EXPECT_FALSE(sleeper.hasEnded());
    sleeper.sendSignal(SIGTERM);
    EXPECT_EQ(sleeper.wait().signal, SIGTERM);
    EXPECT_TRUE(sleeper.hasEnded());
}

TEST(ChildProcess, WhatIsNotThereIsNamed) {
    EXPECT_THAT([] { ChildProcess(setupOf({"no-such-program"})); },
                ::testing::ThrowsMessage<std::runtime_error>(
                    "cannot run 'no-such-program': No such file or directory"));
    EXPECT_EQ(findProgram("no-such-program"), "");
    EXPECT_EQ(findProgram("/etc/passwd"), "");  // not a program
    EXPECT_THAT(findProgram("sh"), ::testing::EndsWith("/sh"));
}

/** It holds one end of a pipe, so the other end shows when it has ended. **/
TEST(ChildProcess, NoneOutlivesItsObject) {
    int ends[2];
    ASSERT_EQ(pipe2(ends, O_CLOEXEC), 0);
    {
        ChildSetup setup = setupOf({"sleep", "1000"});
        setup.output = ends[1];
        ChildProcess sleeper(setup);
        ChildProcess moved(std::move(sleeper));
        close(ends[1]);
        EXPECT_FALSE(moved.hasEnded());
    }
    char byte;
    EXPECT_EQ(read(ends[0], &byte, 1), 0);
    close(ends[0]);
}

/** Returns true if all holders of the other end of a pipe end within 20 s. **/
bool isLetGo(int end) {
    pollfd waiting{end, POLLIN, 0};
    char byte;
    return poll(&waiting, 1, 20000) == 1 && read(end, &byte, 1) == 0;
}

TEST(ChildProcess, NoneOutlivesAProcessThatIsKilled) {
    for (const bool isOwnGroup : {false, true}) {
        int ends[2];
        ASSERT_EQ(pipe2(ends, O_CLOEXEC), 0);
        const pid_t starter = fork();
        if (starter == 0) {
            ChildSetup setup = setupOf({"sleep", "1000"});
            setup.output = ends[1];
            setup.isOwnGroup = isOwnGroup;
            const ChildProcess sleeper(setup);
            kill(getpid(), SIGKILL);
        }
        close(ends[1]);
        int status = 0;
        ASSERT_EQ(waitpid(starter, &status, 0), starter);
        EXPECT_EQ(WTERMSIG(status), SIGKILL);
        EXPECT_TRUE(isLetGo(ends[0]));
        close(ends[0]);
    }
}

TEST(ChildProcess, OneOutlivesTheThreadThatStartsIt) {
    ChildProcess sleeper;
    std::thread([&] { sleeper = ChildProcess(setupOf({"sleep", "1000"})); }).join();
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    EXPECT_FALSE(sleeper.hasEnded());
    sleeper.sendSignal(SIGTERM);
    EXPECT_EQ(sleeper.wait().signal, SIGTERM);
}

TEST(ChildProcess, SignalsAreNewToAProgram) {
    // A signal that is caught and blocked here is neither in the child; an ignored one stays
    // ignored.
    struct sigaction caught {
    }, before{};
    caught.sa_handler = [](int) {};
    sigaction(SIGUSR1, &caught, &before);
    const auto ignored = signal(SIGUSR2, SIG_IGN);
    for (const auto& [name, ends] : {std::pair{"USR1", true}, {"USR2", false}}) {
        const ChildEnd end =
            ChildProcess(setupOf({"sh", "-c", std::string("kill -") + name + " $$"})).wait();
        EXPECT_EQ(end.isSuccess(), !ends) << end.describe();
    }
    sigaction(SIGUSR1, &before, nullptr);
    signal(SIGUSR2, ignored);
}

TEST(ProgramOutput, HoldsWhatAProgramSaid) {
    const ProgramOutput said;
    ChildSetup setup;
    setup.arguments = {"sh", "-c", "echo one; echo two >&2; head -c 200000 /dev/zero"};
    setup.output = setup.error = said.getDescriptor();
    EXPECT_TRUE(ChildProcess(setup).wait().isSuccess());
    EXPECT_EQ(said.read(8), "one\ntwo\n");
    EXPECT_EQ(said.read().size(), 4096u);
}

}  // namespace
}  // namespace simflex
