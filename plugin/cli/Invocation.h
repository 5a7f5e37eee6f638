#pragma once
/** @file
One call of a program: what was asked for is done, errors become messages. **/

#include <CLI/CLI.hpp>

namespace simflex {
namespace cli {

/** Parses the command line and runs the subcommand. @returns the exit status: 0 done, 1 failed, 2
wrong usage, 3 changed since what was to be gone on with, 130 stopped by Ctrl-C. **/
int runCommandLine(CLI::App& app, int argc, char** argv);

/** Ends the process without destructors of libraries: in its own, OpenBLAS waits for its threads,
which wait for memory, for ever where there is none. **/
[[noreturn]] void leave(int status);

}  // namespace cli
}  // namespace simflex
