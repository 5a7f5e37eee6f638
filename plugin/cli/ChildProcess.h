#pragma once
/** @file
Programs that simflex starts: from a list of arguments, never through a shell. **/

#include <sys/types.h>

#include <map>
#include <string>
#include <vector>

namespace simflex {
namespace cli {

struct ChildSetup {
    std::vector<std::string>
        arguments;  ///< the program first, searched in PATH unless it has a '/'
    std::map<std::string, std::string> environment;  ///< set besides what this process has
    /** Open files that become the child's; -1: /dev/null. **/
    int input = -1, output = -1, error = -1;
    std::string folder;  ///< where it works; empty: here
    /** A group of its own: Ctrl-C at the terminal does not reach it. **/
    bool isOwnGroup = false;
};

/** Starts it. @throws std::runtime_error naming the program. **/
pid_t startChild(const ChildSetup& setup);

/** Waits for its end. @returns its exit status; 128 + n if signal n ended it. **/
int waitForChild(pid_t child);

/** The same from the status that waitpid() gives. **/
int getExitStatus(int waitStatus);

}  // namespace cli
}  // namespace simflex
