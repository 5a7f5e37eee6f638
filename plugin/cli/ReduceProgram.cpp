#include "simflex/cli/ReduceProgram.h"

#include "simflex/cli/Commands.h"
#include "simflex/cli/Invocation.h"

namespace simflex::cli {

int runReduceProgram(int argc, char** argv) {
    CLI::App app("The command reduce of simflex alone.", "simflex_reduce");
    app.require_subcommand(1);
    addReduceCommand(app);
    return runCommandLine(app, argc, argv);
}

}  // namespace simflex::cli
