#pragma once
/** @file
What the program simflex_reduce does. **/

namespace simflex::cli {

/** Parses the command line and runs the command `reduce`. @returns the exit status, as
runCommandLine(). **/
int runReduceProgram(int argc, char** argv);

}  // namespace simflex::cli
