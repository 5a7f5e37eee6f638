#pragma once
/** @file
Starts other programs (CalculiX, Gmsh) on one thread with their output in a file. Internal to fe.
**/

#include <sys/types.h>

#include <filesystem>
#include <string>
#include <vector>

#include "simflex/fe/Progress.h"

namespace simflex {

/** Starts `program arguments…` in `folder` with its output in `log`.
@param cure  what to do if it is not there, for the message.
@throws std::runtime_error if it cannot be started. **/
pid_t startProgram(const std::string& program, const std::vector<std::string>& arguments,
                   const std::filesystem::path& folder, const std::filesystem::path& log,
                   const std::string& cure);

/** True once the process has ended, with its wait status. **/
bool hasEnded(pid_t pid, int& status);

/** Runs a program to its end, or kills it if progress asks to stop. @returns its wait status.
@throws std::runtime_error if it cannot be started. @throws Cancelled. **/
int runProgram(const std::string& program, const std::vector<std::string>& arguments,
               const std::filesystem::path& folder, const std::filesystem::path& log,
               const std::string& cure, const std::string& phase, const ProgressCallback& progress);

}  // namespace simflex
