#include "simflex/cli/Program.h"

int main(int argc, char** argv) {
    return simflex::cli::runProgram(argc, argv);
}
