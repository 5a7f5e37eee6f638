#include "simflex/cli/ChildProcess.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>

namespace simflex {
namespace cli {
namespace {

/** This process's environment with the settings in it. **/
std::vector<std::string> makeEnvironment(const std::map<std::string, std::string>& settings) {
    std::vector<std::string> environment;
    for (char** entry = environ; entry && *entry; ++entry) {
        const std::string text = *entry;
        if (!settings.count(text.substr(0, text.find('=')))) environment.push_back(text);
    }
    for (const auto& [name, value] : settings) environment.push_back(name + "=" + value);
    return environment;
}

std::vector<char*> makePointers(std::vector<std::string>& texts) {
    std::vector<char*> pointers;
    for (std::string& text : texts) pointers.push_back(text.data());
    pointers.push_back(nullptr);
    return pointers;
}

/** What posix_spawn() wants, freed. **/
struct SpawnRequest {
    SpawnRequest() {
        posix_spawn_file_actions_init(&actions);
        posix_spawnattr_init(&attributes);
    }
    ~SpawnRequest() {
        posix_spawn_file_actions_destroy(&actions);
        posix_spawnattr_destroy(&attributes);
    }
    SpawnRequest(const SpawnRequest&) = delete;
    SpawnRequest& operator=(const SpawnRequest&) = delete;

    void redirect(int given, int target, int flags) {
        if (given < 0) {
            posix_spawn_file_actions_addopen(&actions, target, "/dev/null", flags, 0);
        } else {
            posix_spawn_file_actions_adddup2(&actions, given, target);
        }
    }

    posix_spawn_file_actions_t actions;
    posix_spawnattr_t attributes;
};

}  // namespace

pid_t startChild(const ChildSetup& setup) {
    std::vector<std::string> arguments = setup.arguments;
    std::vector<std::string> environment = makeEnvironment(setup.environment);
    SpawnRequest request;
    request.redirect(setup.input, STDIN_FILENO, O_RDONLY);
    request.redirect(setup.output, STDOUT_FILENO, O_WRONLY);
    request.redirect(setup.error, STDERR_FILENO, O_WRONLY);
    if (!setup.folder.empty())
        posix_spawn_file_actions_addchdir_np(&request.actions, setup.folder.c_str());
    if (setup.isOwnGroup) {
        posix_spawnattr_setflags(&request.attributes, POSIX_SPAWN_SETPGROUP);
        posix_spawnattr_setpgroup(&request.attributes, 0);
    }
    pid_t child = 0;
    const int status =
        posix_spawnp(&child, arguments.at(0).c_str(), &request.actions, &request.attributes,
                     makePointers(arguments).data(), makePointers(environment).data());
    if (status != 0)
        throw std::runtime_error("cannot start '" + arguments[0] + "': " + std::strerror(status));
    return child;
}

int getExitStatus(int waitStatus) {
    return WIFEXITED(waitStatus) ? WEXITSTATUS(waitStatus) : 128 + WTERMSIG(waitStatus);
}

int waitForChild(pid_t child) {
    int status = 0;
    while (waitpid(child, &status, 0) < 0)
        if (errno != EINTR) throw std::runtime_error("lost a program that was started");
    return getExitStatus(status);
}

}  // namespace cli
}  // namespace simflex
