#pragma once
/** @file
Runs Gmsh: on one thread, in a folder of their own, with their output in a file.
Internal to fe. **/

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
    std::filesystem::path folder;  ///< where it works
    std::filesystem::path log;     ///< takes its output
    std::string cure;              ///< what to do if it is not there, for the message
    /** All variables that it sees. **/
    std::map<std::string, std::string> environment = getSerialEnvironment();
    const Sandbox* sandbox = nullptr;

    /** This process's, with one thread for each program. **/
    static std::map<std::string, std::string> getSerialEnvironment();
};

/** @throws std::runtime_error if it cannot be started. **/
ChildProcess startProgram(const ProgramRun& run);

/** Of programs that go on where they cannot write.
@param consequence  "Gmsh cannot write its mesh"
@throws std::runtime_error if the disk of a temporary folder is full **/
void checkSpace(const std::filesystem::path& folder, const std::string& consequence);

/** Waits for its end, and kills it if progress asks to stop. @throws Cancelled. **/
const ChildEnd& waitForProgram(ChildProcess& process, const std::string& phase,
                               const ProgressCallback& progress);

/** The last lines of a file that hold something, each on a line of its own, indented. **/
std::string readLastLines(const std::filesystem::path& file, size_t most);

}  // namespace simflex
