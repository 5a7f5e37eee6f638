#include "ProgramRun.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <deque>
#include <fstream>
#include <stdexcept>
#include <system_error>
#include <thread>

namespace simflex {
namespace {

constexpr auto ProgramPollInterval = std::chrono::milliseconds(20);

/** A log file, closed by the destructor. **/
struct LogFile {
    explicit LogFile(const std::filesystem::path& path)
        : descriptor(open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600)) {
        if (descriptor < 0)
            throw std::runtime_error("cannot write '" + path.string() +
                                     "': " + std::strerror(errno));
    }
    ~LogFile() { close(descriptor); }
    LogFile(const LogFile&) = delete;
    LogFile& operator=(const LogFile&) = delete;

    const int descriptor;
};

}  // namespace

std::map<std::string, std::string> ProgramRun::getSerialEnvironment() {
    std::map<std::string, std::string> environment = simflex::getEnvironment();
    for (auto entry = environment.begin(); entry != environment.end();)
        entry = entry->first.compare(0, 9, "CCX_NPROC") == 0 ? environment.erase(entry)
                                                             : std::next(entry);
    environment.erase("NUMBER_OF_CPUS");
    environment["OMP_NUM_THREADS"] = "1";
    return environment;
}

ChildProcess startProgram(const ProgramRun& run) {
    const LogFile log(run.log);
    ChildSetup setup;
    setup.arguments = {run.program};
    setup.arguments.insert(setup.arguments.end(), run.arguments.begin(), run.arguments.end());
    setup.environment = run.environment;
    setup.output = setup.error = log.descriptor;
    setup.folder = run.folder.string();
    setup.sandbox = run.sandbox;
    try {
        return ChildProcess(setup);
    } catch (const std::system_error& error) {
        // Installation does not help against process limits or lack of memory.
        if (error.code() != std::errc::no_such_file_or_directory &&
            error.code() != std::errc::permission_denied)
            throw;
        throw std::runtime_error(std::string(error.what()) + ". " + run.cure);
    }
}

void checkSpace(const std::filesystem::path& folder, const std::string& consequence) {
    constexpr std::uintmax_t LeastSpace = 4096;  // smallest free space of a disk that is not full
                                                 // [bytes]
    std::error_code unknown;
    if (std::filesystem::space(folder, unknown).available < LeastSpace)
        throw std::runtime_error("the disk of '" + folder.parent_path().string() +
                                 "' is full: " + consequence +
                                 "; make room, or set TMPDIR to a folder on another disk");
}

const ChildEnd& waitForProgram(ChildProcess& process, const std::string& phase,
                               const ProgressCallback& progress) {
    while (!process.hasEnded()) {
        reportProgress(progress, phase, -1);
        std::this_thread::sleep_for(ProgramPollInterval);
    }
    return process.getEnd();
}

std::string readLastLines(const std::filesystem::path& file, size_t most) {
    std::ifstream in(file);
    std::deque<std::string> lines;
    for (std::string text; std::getline(in, text);) {
        const size_t begin = text.find_first_not_of(' ');
        if (begin == std::string::npos) continue;
        lines.push_back("\n    " + text.substr(begin));
        if (lines.size() > most) lines.pop_front();
    }
    std::string result;
    for (const std::string& line : lines) result += line;
    return result;
}

}  // namespace simflex
