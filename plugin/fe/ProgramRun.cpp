#include "ProgramRun.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <stdexcept>
#include <thread>

extern char** environ;

namespace simflex {
namespace {

constexpr auto kPollInterval = std::chrono::milliseconds(20);

/** The environment with one thread for the program. **/
std::vector<std::string> singleThreadEnvironment() {
    std::vector<std::string> result;
    for (char** entry = environ; *entry; ++entry)
        if (std::strncmp(*entry, "OMP_NUM_THREADS=", 16) != 0 &&
            std::strncmp(*entry, "CCX_NPROC", 9) != 0 &&
            std::strncmp(*entry, "NUMBER_OF_CPUS=", 15) != 0)
            result.emplace_back(*entry);
    result.emplace_back("OMP_NUM_THREADS=1");
    return result;
}

/** Pointers to the texts, with the null that exec wants at the end. **/
std::vector<char*> pointersTo(std::vector<std::string>& texts) {
    std::vector<char*> pointers;
    for (std::string& text : texts) pointers.push_back(text.data());
    pointers.push_back(nullptr);
    return pointers;
}

/** Kills the process at the end if it still runs. **/
struct RunningProcess {
    pid_t pid;
    bool ended = false;
    ~RunningProcess() {
        if (ended) return;
        int status = 0;
        kill(pid, SIGKILL);
        waitpid(pid, &status, 0);
    }
};

}  // namespace

pid_t startProgram(const std::string& program, const std::vector<std::string>& arguments,
                   const std::filesystem::path& folder, const std::filesystem::path& log,
                   const std::string& cure) {
    auto environment = singleThreadEnvironment();
    std::vector<std::string> words{program};
    words.insert(words.end(), arguments.begin(), arguments.end());
    const auto argv = pointersTo(words), env = pointersTo(environment);

    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, log.c_str(),
                                     O_WRONLY | O_CREAT | O_TRUNC, 0600);
    posix_spawn_file_actions_adddup2(&actions, STDOUT_FILENO, STDERR_FILENO);
    posix_spawn_file_actions_addchdir_np(&actions, folder.c_str());
    pid_t pid = -1;
    const int error =
        posix_spawnp(&pid, words[0].c_str(), &actions, nullptr, argv.data(), env.data());
    posix_spawn_file_actions_destroy(&actions);
    if (error != 0)
        throw std::runtime_error("cannot run '" + program + "': " + std::strerror(error) + ". " +
                                 cure);
    return pid;
}

bool hasEnded(pid_t pid, int& status) {
    const pid_t done = waitpid(pid, &status, WNOHANG);
    if (done < 0 && errno != EINTR) throw std::runtime_error("lost the process of a program");
    return done == pid;
}

int runProgram(const std::string& program, const std::vector<std::string>& arguments,
               const std::filesystem::path& folder, const std::filesystem::path& log,
               const std::string& cure, const std::string& phase,
               const ProgressCallback& progress) {
    RunningProcess process{startProgram(program, arguments, folder, log, cure)};
    int status = 0;
    while (!hasEnded(process.pid, status)) {
        reportProgress(progress, phase, -1);
        std::this_thread::sleep_for(kPollInterval);
    }
    process.ended = true;
    return status;
}

}  // namespace simflex
