#include "simflex/base/ChildProcess.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <sstream>
#include <stdexcept>
#include <thread>
#include <utility>

#include "simflex/base/Sandbox.h"

extern char** environ;

namespace simflex {
namespace {

/** Pointers to the texts, with the null that exec wants at the end. **/
std::vector<char*> pointersTo(std::vector<std::string>& texts) {
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

pid_t spawn(const ChildSetup& setup) {
    std::vector<std::string> arguments = setup.arguments, environment;
    for (const auto& [name, value] : setup.environment) environment.push_back(name + "=" + value);
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
    pid_t child = -1;
    const int status =
        posix_spawnp(&child, arguments.at(0).c_str(), &request.actions, &request.attributes,
                     pointersTo(arguments).data(), pointersTo(environment).data());
    if (status != 0)
        throw std::runtime_error("cannot run '" + arguments[0] + "': " + std::strerror(status));
    return child;
}

/** From a thread that has shut itself in: what it starts inherits that, and nothing else does. **/
pid_t spawnShutIn(const ChildSetup& setup) {
    pid_t child = -1;
    std::exception_ptr failure;
    std::thread([&] {
        try {
            enterSandbox(*setup.sandbox);
            child = spawn(setup);
        } catch (...) {
            failure = std::current_exception();
        }
    }).join();
    if (failure) std::rethrow_exception(failure);
    return child;
}

}  // namespace

std::map<std::string, std::string> getEnvironment() {
    std::map<std::string, std::string> variables;
    for (char** entry = environ; entry && *entry; ++entry) {
        const std::string text = *entry;
        const size_t equals = text.find('=');
        if (equals != std::string::npos)
            variables.emplace(text.substr(0, equals), text.substr(equals + 1));
    }
    return variables;
}

std::string findProgram(const std::string& name) {
    if (name.find('/') != std::string::npos) return access(name.c_str(), X_OK) == 0 ? name : "";
    const char* path = std::getenv("PATH");
    std::istringstream folders(path ? path : "");
    for (std::string folder; std::getline(folders, folder, ':');) {
        const std::string file = (folder.empty() ? "." : folder) + "/" + name;
        if (access(file.c_str(), X_OK) == 0) return file;
    }
    return "";
}

std::string ChildEnd::describe() const {
    if (signal == 0) return "left with exit status " + std::to_string(exitCode);
    return "was ended by signal " + std::to_string(signal) + " (" + strsignal(signal) + ")" +
           (signal == SIGKILL ? "; is memory short?" : "");
}

ChildProcess::ChildProcess(const ChildSetup& setup)
    : _process(setup.sandbox ? spawnShutIn(setup) : spawn(setup)) {}

ChildProcess::~ChildProcess() {
    if (_process < 0) return;
    kill(_process, SIGKILL);
    while (waitpid(_process, nullptr, 0) < 0 && errno == EINTR) {
    }
}

ChildProcess& ChildProcess::operator=(ChildProcess&& other) noexcept {
    std::swap(_process, other._process);
    std::swap(_end, other._end);
    return *this;
}

bool ChildProcess::look(int options) {
    if (_process < 0) return true;
    int status = 0;
    const pid_t ended = waitpid(_process, &status, options);
    if (ended == 0 || (ended < 0 && errno == EINTR)) return false;
    _process = -1;
    if (ended < 0) throw std::runtime_error("lost the process of a program");
    _end.exitCode = WIFEXITED(status) ? WEXITSTATUS(status) : 0;
    _end.signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
    return true;
}

bool ChildProcess::hasEnded() {
    return look(WNOHANG);
}

const ChildEnd& ChildProcess::wait() {
    while (!look(0)) {
    }
    return _end;
}

void ChildProcess::sendSignal(int signal) {
    if (_process >= 0) kill(_process, signal);
}

}  // namespace simflex
