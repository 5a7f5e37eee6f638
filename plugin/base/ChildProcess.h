#pragma once
/** @file
Programs that simflex starts: from a list of arguments, never through a shell.

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

/** The variables of this process's environment. **/
std::map<std::string, std::string> getEnvironment();

/** Where a program of that name is: itself if it has a '/', else on the PATH; empty: nowhere. **/
std::string findProgram(const std::string& name);

struct ChildSetup {
    std::vector<std::string>
        arguments;  ///< the program first, searched in PATH unless it has a '/'
    std::map<std::string, std::string> environment = getEnvironment();
    /** Open files that become the child's; -1: /dev/null. **/
    int input = -1, output = -1, error = -1;
    std::string folder;  ///< where it works; empty: here
    /** A group of its own: Ctrl-C at the terminal does not reach it. **/
    bool isOwnGroup = false;
    const Sandbox* sandbox = nullptr;  ///< it can do no more than this allows
};

/** How a program ended. **/
struct ChildEnd {
    int exitCode = 0;
    int signal = 0;  ///< that ended it; 0: it left by itself

    bool isSuccess() const { return signal == 0 && exitCode == 0; }
    /** "left with exit status 2", "was ended by signal 9 (Killed); is memory short?" **/
    std::string describe() const;
};

/** A program that runs. Killed if it still does when this goes, or when this process ends in
whatever way, by SIGKILL too. **/
class ChildProcess {
public:
    /** None. **/
    ChildProcess() = default;
    /** Starts it. @throws std::runtime_error naming the program. **/
    explicit ChildProcess(const ChildSetup& setup);
    ~ChildProcess();
    ChildProcess(ChildProcess&& other) noexcept { *this = static_cast<ChildProcess&&>(other); }
    ChildProcess& operator=(ChildProcess&& other) noexcept;

    /** Looks whether it has ended; true if there is none. **/
    bool hasEnded();
    /** Waits until it has ended. **/
    const ChildEnd& wait();
    /** Of one that runs. **/
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
