#pragma once
/** @file
Runs Gmsh on one thread, in its own folder, with its output in a file. Internal to fe. **/

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "simflex/base/ChildProcess.h"
#include "simflex/base/Progress.h"

namespace simflex {

struct ProgramRun {
    std::string program;
    std::vector<std::string> arguments;
    std::filesystem::path folder;  ///< working directory
    std::filesystem::path log;     ///< receives its output
    std::string cure;              ///< remedy in the message if the program is missing
    /** Complete environment of the program. **/
    std::map<std::string, std::string> environment = getSerialEnvironment();
    const Sandbox* sandbox = nullptr;

    /** Returns this process's environment with settings for one thread. **/
    static std::map<std::string, std::string> getSerialEnvironment();
};

/** @throws std::runtime_error if the program cannot be started. **/
ChildProcess startProgram(const ProgramRun& run);

/** For programs that ignore write errors.
@param consequence  "Gmsh cannot write its mesh"
@throws std::runtime_error if the disk of a temporary folder is full **/
void checkSpace(const std::filesystem::path& folder, const std::string& consequence);

/** Waits for the program to end; kills it if progress requests cancellation. @throws Cancelled. **/
const ChildEnd& waitForProgram(ChildProcess& process, const std::string& phase,
                               const ProgressCallback& progress);

/** Returns the last non-blank lines of a file, each on a separate line, indented. **/
std::string readLastLines(const std::filesystem::path& file, size_t most);

}  // namespace simflex
