#pragma once
/** @file
Runs a program's command line and converts errors to messages. **/

#include <CLI/CLI.hpp>

namespace simflex {
namespace cli {

/** Parses the command line and runs the subcommand. @returns the exit status: 0 success, 1 failure,
2 usage error, 3 the input of the run to resume has changed, 130 stopped by Ctrl-C. **/
int runCommandLine(CLI::App& app, int argc, char** argv);

/** Ends the process without static destructors: OpenBLAS's waits for its threads, and forever if
these wait for memory that is not available. **/
[[noreturn]] void leave(int status);

}  // namespace cli
}  // namespace simflex
