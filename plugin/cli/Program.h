#pragma once
/** @file
Main function of the programs simflex and simflex_mpi. **/

#include <memory>

namespace simflex {

class StiffnessSolver;

namespace cli {

/** Parses the command line and runs the subcommand. @returns the exit status, as runCommandLine().
@param solver  for `reduce`; null: the library's own **/
int runProgram(int argc, char** argv, const std::shared_ptr<StiffnessSolver>& solver = {});

}  // namespace cli
}  // namespace simflex
