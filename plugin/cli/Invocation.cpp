#include "simflex/cli/Invocation.h"

#include <hdf5.h>

#include <cstdio>
#include <exception>

#include "simflex/base/Interruption.h"
#include "simflex/base/Progress.h"

namespace simflex {
namespace cli {

int runCommandLine(CLI::App& app, int argc, char** argv) {
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
    } catch (const Cancelled& stopped) {
        std::fprintf(stderr, "simflex: %s\n", stopped.what());
        return 130;
    } catch (const std::exception& error) {
        const bool isStopped = wasInterrupted();
        std::fprintf(stderr, "simflex: %s\n", isStopped ? Cancelled().what() : error.what());
        return isStopped ? 130 : 1;
    }
}

}  // namespace cli
}  // namespace simflex
