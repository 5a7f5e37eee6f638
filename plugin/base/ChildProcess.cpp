#include "simflex/base/ChildProcess.h"

#include <fcntl.h>
#include <pthread.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <future>
#include <sstream>
#include <stdexcept>
#include <system_error>
#include <thread>
#include <utility>

#include "simflex/base/Sandbox.h"

extern char** environ;

namespace simflex {
namespace {

/** Returns a null-terminated array of pointers, as exec() requires. **/
std::vector<char*> pointersTo(std::vector<std::string>& texts) {
    std::vector<char*> pointers;
    for (std::string& text : texts) pointers.push_back(text.data());
    pointers.push_back(nullptr);
    return pointers;
}

/** Blocks all signals in this thread until the end of the scope. **/
class SignalPause {
public:
    SignalPause() {
        sigset_t all;
        sigfillset(&all);
        pthread_sigmask(SIG_BLOCK, &all, &m_before);
    }
    ~SignalPause() { pthread_sigmask(SIG_SETMASK, &m_before, nullptr); }
    SignalPause(const SignalPause&) = delete;
    SignalPause& operator=(const SignalPause&) = delete;

    const sigset_t& getBefore() const { return m_before; }

private:
    sigset_t m_before;
};

/** Everything a new process needs until it calls exec(). **/
struct Launch {
    const ChildSetup& setup;
    const char* program;
    char* const* arguments;
    char* const* environment;
    const sigset_t& signals;
    pid_t parent;
    int report;  ///< descriptor that receives errno on failure

    /** Runs in the new process, which shares the memory of its waiting parent: system calls
    only. **/
    [[noreturn]] void run() const {
        if (!prepare()) _exit(fail());
        execve(program, arguments, environment);
        _exit(fail());
    }

private:
    bool prepare() const {
        // A process killed by SIGKILL cannot end its children itself. It may have died before this
        // call.
        if (prctl(PR_SET_PDEATHSIG, SIGKILL) != 0) return false;
        if (getppid() != parent) _exit(1);
        if (setup.isOwnGroup && setpgid(0, 0) != 0) return false;
        if (!redirect(setup.input, STDIN_FILENO, O_RDONLY) ||
            !redirect(setup.output, STDOUT_FILENO, O_WRONLY) ||
            !redirect(setup.error, STDERR_FILENO, O_WRONLY))
            return false;
        if (!setup.folder.empty() && chdir(setup.folder.c_str()) != 0) return false;
        // None of the parent's signal handlers may run here.
        for (int signal = 1; signal < NSIG; ++signal) {
            struct sigaction action {};
            if (sigaction(signal, nullptr, &action) != 0 || action.sa_handler == SIG_IGN) continue;
            action = {};
            action.sa_handler = SIG_DFL;
            sigaction(signal, &action, nullptr);
        }
        return sigprocmask(SIG_SETMASK, &signals, nullptr) == 0;
    }

    static bool redirect(int given, int target, int flags) {
        const int file = given < 0 ? open("/dev/null", flags) : given;
        if (file < 0 || dup2(file, target) < 0) return false;
        if (given < 0 && file != target) close(file);
        return true;
    }

    int fail() const {
        const int error = errno;
        return write(report, &error, sizeof error) == sizeof error ? 127 : 126;
    }
};

/** A duplicate of a descriptor above the standard three, so that none of these replaces another
while they are assigned, even if this process has closed some of them. **/
class HighCopy {
public:
    explicit HighCopy(int file)
        : m_file(file < 0 ? -1 : fcntl(file, F_DUPFD_CLOEXEC, STDERR_FILENO + 1)) {}
    ~HighCopy() { drop(); }
    HighCopy(const HighCopy&) = delete;
    HighCopy& operator=(const HighCopy&) = delete;

    int get() const { return m_file; }
    void drop() {
        if (m_file >= 0) close(m_file);
        m_file = -1;
    }

private:
    int m_file;
};

/** @pre all signals are blocked; @param signals  mask of the new program **/
pid_t spawn(const ChildSetup& given, const sigset_t& signals) {
    std::vector<std::string> arguments = given.arguments, environment;
    for (const auto& [name, value] : given.environment) environment.push_back(name + "=" + value);
    const std::string& name = arguments.at(0);
    const std::vector<char*> argumentPointers = pointersTo(arguments),
                             environmentPointers = pointersTo(environment);
    const std::string found = findProgram(name), program = found.empty() ? name : found;

    const auto refuse = [&](int reason) {
        throw std::system_error(reason, std::generic_category(), "cannot run '" + name + "'");
    };
    ChildSetup setup = given;
    const HighCopy input(given.input), output(given.output), errors(given.error);
    setup.input = input.get(), setup.output = output.get(), setup.error = errors.get();
    const bool areCopied = (input.get() < 0) == (given.input < 0) &&
                           (output.get() < 0) == (given.output < 0) &&
                           (errors.get() < 0) == (given.error < 0);
    if (!areCopied) refuse(errno);
    int pipe[2];
    if (pipe2(pipe, O_CLOEXEC) != 0) refuse(errno);
    const HighCopy read(pipe[0]);
    HighCopy written(pipe[1]);
    close(pipe[0]), close(pipe[1]);
    if (read.get() < 0 || written.get() < 0) refuse(errno);
    const Launch launch{
        setup,    program.c_str(), argumentPointers.data(), environmentPointers.data(), signals,
        getpid(), written.get()};
    const pid_t child = vfork();
    if (child == 0) launch.run();
    int error = child < 0 ? errno : 0;
    written.drop();
    while (child > 0 && ::read(read.get(), &error, sizeof error) < 0 && errno == EINTR) {
    }
    if (error == 0) return child;
    while (child > 0 && waitpid(child, nullptr, 0) < 0 && errno == EINTR) {
    }
    refuse(error);
    return -1;
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

/** The thread that starts a program and lives as long as the program runs: the kernel ends the
program with the thread, not with the process. A sandbox restricts this thread and its child
only. **/
class ChildProcess::Starter {
public:
    explicit Starter(const ChildSetup& setup) {
        std::promise<pid_t> promise;
        std::future<pid_t> child = promise.get_future();
        {
            const SignalPause pause;  // the thread must not take signals meant for others
            auto wait = [&setup, signals = pause.getBefore(), end = m_end.get_future(),
                         started = std::move(promise)]() mutable {
                try {
                    if (setup.sandbox) enterSandbox(*setup.sandbox);
                    started.set_value(spawn(setup, signals));
                } catch (...) {
                    started.set_exception(std::current_exception());
                }
                end.wait();
            };
            try {
                m_thread = std::thread(std::move(wait));
            } catch (const std::system_error& error) {
                throw std::runtime_error("cannot run '" + setup.arguments.at(0) +
                                         "': there is no thread to wait for it (" + error.what() +
                                         "): is memory short, or a limit (ulimit -u, -v) reached?");
            }
        }
        try {
            m_child = child.get();
        } catch (...) {
            release();
            throw;
        }
    }
    ~Starter() { release(); }
    Starter(const Starter&) = delete;
    Starter& operator=(const Starter&) = delete;

    pid_t getChild() const { return m_child; }

private:
    void release() {
        if (!m_thread.joinable()) return;
        m_end.set_value();
        m_thread.join();
    }

    std::promise<void> m_end;
    std::thread m_thread;
    pid_t m_child = -1;
};

ChildProcess::ChildProcess(const ChildSetup& setup)
    : m_starter(std::make_shared<Starter>(setup)), m_process(m_starter->getChild()) {}

ChildProcess::~ChildProcess() {
    if (m_process < 0) return;
    kill(m_process, SIGKILL);
    while (waitpid(m_process, nullptr, 0) < 0 && errno == EINTR) {
    }
}

ChildProcess& ChildProcess::operator=(ChildProcess&& other) noexcept {
    std::swap(m_starter, other.m_starter);
    std::swap(m_process, other.m_process);
    std::swap(m_end, other.m_end);
    return *this;
}

bool ChildProcess::look(int options) {
    if (m_process < 0) return true;
    int status = 0;
    const pid_t ended = waitpid(m_process, &status, options);
    if (ended == 0 || (ended < 0 && errno == EINTR)) return false;
    m_process = -1;
    m_starter.reset();
    if (ended < 0) throw std::runtime_error("lost the process of a program");
    m_end.exitCode = WIFEXITED(status) ? WEXITSTATUS(status) : 0;
    m_end.signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
    return true;
}

bool ChildProcess::hasEnded() {
    return look(WNOHANG);
}

const ChildEnd& ChildProcess::wait() {
    while (!look(0)) {
    }
    return m_end;
}

void ChildProcess::sendSignal(int signal) {
    if (m_process >= 0) kill(m_process, signal);
}

}  // namespace simflex
