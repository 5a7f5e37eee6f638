#include "simflex/cli/Invocation.h"

#include <fcntl.h>
#include <hdf5.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <iostream>
#include <system_error>

#include "simflex/base/Interruption.h"
#include "simflex/base/Progress.h"
#include "simflex/base/TemporaryFolder.h"
#include "simflex/base/Utf8.h"

namespace simflex {
namespace cli {

namespace {

/** Opens missing standard descriptors: otherwise the next opened file would get their number and
the program's output. **/
void openStandardFiles() {
    for (int file = STDIN_FILENO; file <= STDERR_FILENO; ++file)
        if (fcntl(file, F_GETFD) < 0 && open("/dev/null", O_RDWR) != file) std::abort();
}

bool hasEnded = false;  // the command has ended

/** Detects calls of exit() by other code in this process, whose status 0 would indicate
success. **/
void refuseExit() {
    if (hasEnded) return;
    std::fprintf(stderr, "simflex: code within this process (an FMU?) has ended it\n");
    std::fflush(nullptr);
    _exit(1);
}

/** @returns whether all output was written **/
bool finishOutput() {
    std::cout.flush();
    errno = 0;
    if (std::fflush(stdout) == 0 && !std::ferror(stdout) && std::cout) return true;
    std::fprintf(stderr, "simflex: cannot write the output%s%s\n", errno ? ": " : "",
                 errno ? std::strerror(errno) : "");
    return false;
}

/** @returns the exit status **/
int reportError(std::string error) {
    constexpr size_t Longest = 5000;  // a file may have a word of any length, which is quoted
    if (error.size() > Longest) error = error.substr(0, Longest) + "…";
    const bool isStopped = wasInterrupted();
    std::fprintf(stderr, "simflex: %s\n",
                 makePrintable(isStopped ? Cancelled().what() : error).c_str());
    return isStopped ? 130 : 1;
}

int runCommand(CLI::App& app, int argc, char** argv) {
    // A file that could not be written (disk full) cannot be closed; HDF5 would crash on it at
    // exit.
    H5dont_atexit();
    try {
        app.parse(argc, argv);
        return 0;
    } catch (const CLI::RuntimeError& error) {  // the error has been printed
        return error.get_exit_code();
    } catch (const CLI::ParseError& error) {
        if (error.get_exit_code() == 0) return app.exit(error);
        std::fprintf(stderr, "simflex: %s (see simflex --help)\n",
                     makePrintable(error.what()).c_str());
        return 2;
    } catch (const Cancelled& stopped) {
        std::fprintf(stderr, "simflex: %s\n", stopped.what());
        return 130;
    } catch (const std::system_error& error) {
        if (error.code() != std::errc::resource_unavailable_try_again)
            return reportError(error.what());
        return reportError(
            "the machine gives no more threads: is memory short, or a limit (ulimit -u, "
            "-v) reached?");
    } catch (const std::bad_alloc&) {
        return reportError("there is not enough memory for this command");
    } catch (const std::exception& error) {
        return reportError(error.what());
    }
}

}  // namespace

int runCommandLine(CLI::App& app, int argc, char** argv) {
    openStandardFiles();
    catchInterrupts();
    std::atexit(refuseExit);
    TemporaryFolder::removeAbandoned();
    const int status = runCommand(app, argc, argv);
    hasEnded = true;
    return finishOutput() ? status : std::max(status, 1);
}

void leave(int status) {
    std::fflush(nullptr);
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    std::exit(status);  // runs the leak check
#else
    _exit(status);
#endif
}

}  // namespace cli
}  // namespace simflex
