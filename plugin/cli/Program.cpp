/** @file
The whole program, for either way of running it. **/

#include "simflex/cli/Program.h"

#include <hdf5.h>

#include <cstdio>
#include <exception>
#include <string>

#include "simflex/cli/Commands.h"
#include "simflex/cli/ProgressBar.h"
#include "simflex/cli/Stopped.h"
#include "simflex/fe/Progress.h"

namespace simflex {
namespace cli {

int runProgram(int argc, char** argv, const std::shared_ptr<StiffnessSolver>& solver) {
    CLI::App app("simflex: flexible bodies for Simbody, from finite elements to frames.",
                 "simflex");
    app.set_version_flag("--version", std::string("simflex ") + SIMFLEX_VERSION);
    app.require_subcommand(1);
    app.fallthrough();
    app.get_formatter()->column_width(34);
    addReduceCommand(app, solver);
    addInfoCommand(app);
    addModesCommand(app);
    addExportCommand(app);
    addRunCommand(app);
    addShellCommand(app);
    addSchemaCommand(app);
    addKeysCommand(app);
    addCacheCommand(app);
    addPlotCommand(app);
    addCompareCommand(app);
    addSweepCommand(app);
    catchInterrupts();
    // A file that could not be written (disk full) cannot be closed; at exit HDF5 would crash over
    // it.
    H5dont_atexit();
    try {
        app.parse(argc, argv);
        return 0;
    } catch (const CLI::RuntimeError& error) {  // said already what is wrong
        return error.get_exit_code();
    } catch (const CLI::ParseError& error) {
        if (error.get_exit_code() == 0) return app.exit(error);
        std::fprintf(stderr, "simflex: %s (see simflex --help)\n", error.what());
        return 2;
    } catch (const Cancelled&) {
        std::fprintf(stderr, "simflex: stopped; nothing was written\n");
        return 130;
    } catch (const Stopped& stopped) {
        std::fprintf(stderr, "simflex: stopped; %s\n", stopped.what());
        return 130;
    } catch (const std::exception& error) {
        if (wasInterrupted()) {
            std::fprintf(stderr, "simflex: stopped; nothing was written\n");
            return 130;
        }
        std::fprintf(stderr, "simflex: %s\n", error.what());
        return 1;
    }
}

}  // namespace cli
}  // namespace simflex
