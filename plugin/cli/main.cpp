#include "simflex/cli/Invocation.h"
#include "simflex/cli/Program.h"

int main(int argc, char** argv) {
    simflex::cli::leave(simflex::cli::runProgram(argc, argv));
}
