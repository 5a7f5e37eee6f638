// simflex_reduce: only the command `reduce` of simflex, since the rest takes several times as long
// to build. For the parts of the examples; not installed.

#include "simflex/cli/Commands.h"
#include "simflex/cli/Invocation.h"

int main(int argc, char** argv) {
    CLI::App app("The command reduce of simflex alone", "simflex_reduce");
    app.require_subcommand(1);
    simflex::cli::addReduceCommand(app);
    simflex::cli::leave(simflex::cli::runCommandLine(app, argc, argv));
}
