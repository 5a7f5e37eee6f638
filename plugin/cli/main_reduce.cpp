// simflex_reduce: the command `reduce` of simflex without the rest, which takes several times as
// long to build. For the parts of the examples; it is not installed.

#include "simflex/cli/ReduceProgram.h"

int main(int argc, char** argv) {
    return simflex::cli::runReduceProgram(argc, argv);
}
