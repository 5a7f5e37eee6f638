/** @file
The simflex program. Exit status: 0 done, 1 failed, 2 wrong usage, 130 stopped by Ctrl-C. **/

#include <cstdio>
#include <exception>
#include <string>

#include "Commands.h"
#include "ProgressBar.h"
#include "Stopped.h"
#include "simflex/fe/Progress.h"

int main(int argc, char** argv) {
    CLI::App app("simflex: flexible bodies for Simbody, from finite elements to frames.",
                 "simflex");
    app.set_version_flag("--version", std::string("simflex ") + SIMFLEX_VERSION);
    app.require_subcommand(1);
    app.fallthrough();
    app.get_formatter()->column_width(34);
    simflex::cli::addReduceCommand(app);
    simflex::cli::addInfoCommand(app);
    simflex::cli::addModesCommand(app);
    simflex::cli::addExportCommand(app);
    simflex::cli::catchInterrupts();
    try {
        app.parse(argc, argv);
        return 0;
    } catch (const CLI::ParseError& error) {
        if (error.get_exit_code() == 0) return app.exit(error);
        std::fprintf(stderr, "simflex: %s (see simflex --help)\n", error.what());
        return 2;
    } catch (const simflex::Cancelled&) {
        std::fprintf(stderr, "simflex: stopped; nothing was written\n");
        return 130;
    } catch (const simflex::cli::Stopped& stopped) {
        std::fprintf(stderr, "simflex: stopped; %s\n", stopped.what());
        return 130;
    } catch (const std::exception& error) {
        if (simflex::cli::wasInterrupted()) {
            std::fprintf(stderr, "simflex: stopped; nothing was written\n");
            return 130;
        }
        std::fprintf(stderr, "simflex: %s\n", error.what());
        return 1;
    }
}
