#pragma once
/** @file
Child processes, started from an argument list and never through a shell.

    ChildSetup setup;
    setup.arguments = {"gmsh", "-3", path};
    setup.environment["OMP_NUM_THREADS"] = "1";
    ChildProcess gmsh(setup);
    while (!gmsh.hasEnded()) wait();
    if (!gmsh.getEnd().isSuccess()) throw std::runtime_error("Gmsh " + gmsh.getEnd().describe());
**/

#include <sys/types.h>

#include <map>
#include <memory>
#include <string>
#include <vector>

namespace simflex {

struct Sandbox;

std::map<std::string, std::string> getEnvironment();

/** Locates a program: the name itself if it contains '/', else the PATH is searched. Returns "" if
it is not found. **/
std::string findProgram(const std::string& name);

struct ChildSetup {
    std::vector<std::string> arguments;  ///< program first; searched in PATH unless it contains '/'
    std::map<std::string, std::string> environment = getEnvironment();
    /** File descriptors that the child inherits; -1: /dev/null. **/
    int input = -1, output = -1, error = -1;
    std::string folder;  ///< working directory; empty: this process's
    /** Runs the child in its own process group, which Ctrl-C at the terminal does not reach. **/
    bool isOwnGroup = false;
    const Sandbox* sandbox = nullptr;  ///< restrictions on the child; null: none
};

/** Exit status of a program. **/
struct ChildEnd {
    int exitCode = 0;
    int signal = 0;  ///< that ended the program; 0: it exited by itself

    bool isSuccess() const { return signal == 0 && exitCode == 0; }
    /** "left with exit status 2", "was ended by signal 9 (Killed); is memory short?" **/
    std::string describe() const;
};

/** A running program. It is killed by the destructor, and when this process ends for any reason,
SIGKILL included. **/
class ChildProcess {
public:
    /** No program. **/
    ChildProcess() = default;
    /** Starts a program. @throws std::runtime_error naming the program. **/
    explicit ChildProcess(const ChildSetup& setup);
    ~ChildProcess();
    ChildProcess(ChildProcess&& other) noexcept { *this = static_cast<ChildProcess&&>(other); }
    ChildProcess& operator=(ChildProcess&& other) noexcept;

    /** Checks without waiting whether the program has ended; true if there is none. **/
    bool hasEnded();
    /** Waits until the program has ended. **/
    const ChildEnd& wait();
    /** Sends a signal to the program if it is running. **/
    void sendSignal(int signal);
    /** @pre hasEnded() **/
    const ChildEnd& getEnd() const { return m_end; }

private:
    bool look(int options);

    class Starter;

    std::shared_ptr<Starter> m_starter;
    pid_t m_process = -1;
    ChildEnd m_end;
};

}  // namespace simflex
