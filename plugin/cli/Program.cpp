/** @file
The complete program, with or without MPI. **/

#include "simflex/cli/Program.h"

#include <string>

#include "simflex/cli/Commands.h"
#include "simflex/cli/Invocation.h"
#include "simflex/cli/part/InterfacePicture.h"

namespace simflex {
namespace cli {

int runProgram(int argc, char** argv, const std::shared_ptr<StiffnessSolver>& solver) {
    CLI::App app("simflex: flexible bodies for Simbody, from finite elements to frames", "simflex");
    app.set_version_flag("--version", std::string("simflex ") + SIMFLEX_VERSION);
    app.require_subcommand(1);
    app.fallthrough();
    app.get_formatter()->column_width(34);
    addReduceCommand(app, solver, [](const ReducedBody& part, const std::string& file) {
        drawInterfaces(part).writePng(file);
    });
    addInfoCommand(app);
    addModesCommand(app);
    addExportCommand(app);
    addRunCommand(app);
    addShellCommand(app);
    addSchemaCommand(app);
    addKeysCommand(app);
    addCacheCommand(app);
    addPostCommand(app);
    addReportCommand(app);
    addPlotCommand(app);
    addCompareCommand(app);
    addMacCommand(app);
    addSweepCommand(app);
    addFmuCommand(app);
    return runCommandLine(app, argc, argv);
}

}  // namespace cli
}  // namespace simflex
