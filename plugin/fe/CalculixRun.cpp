#include "CalculixRun.h"

#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <fstream>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

#include "CalculixMatrix.h"
#include "MatrixEntries.h"
#include "ProgramRun.h"

namespace simflex {
namespace {

namespace fs = std::filesystem;
constexpr auto kPollInterval = std::chrono::milliseconds(20);
constexpr int kMostErrorLines = 12, kTailLines = 8;

const char* const kCure = "Install it (Debian: calculix-ccx), or set SIMFLEX_CCX to its path.";

/** ccx's own *ERROR lines with the lines that go on below them. **/
std::string errorTextOf(const fs::path& log) {
    std::ifstream in(log);
    std::string text, result;
    int numLines = 0;
    bool inside = false;
    while (std::getline(in, text) && numLines < kMostErrorLines) {
        const size_t begin = text.find_first_not_of(' ');
        if (begin == std::string::npos) {
            inside = false;
            continue;
        }
        if (text.find("*ERROR") != std::string::npos) inside = true;
        if (!inside) continue;
        result += "\n    " + text.substr(begin);
        ++numLines;
    }
    return result;
}

/** The last lines of a file that hold something. **/
std::string tailOf(const fs::path& log) {
    std::ifstream in(log);
    std::deque<std::string> lines;
    for (std::string text; std::getline(in, text);) {
        const size_t begin = text.find_first_not_of(' ');
        if (begin == std::string::npos) continue;
        lines.push_back("\n    " + text.substr(begin));
        if (int(lines.size()) > kTailLines) lines.pop_front();
    }
    std::string result;
    for (const std::string& line : lines) result += line;
    return result;
}

/** Walks through the whitespace-separated integers of a file held in memory. **/
class NumberReader {
public:
    explicit NumberReader(const fs::path& path) : _path(path) {
        std::ifstream in(path, std::ios::binary);
        if (!in) throw std::runtime_error("CalculiX did not write " + path.filename().string());
        _text.resize(fs::file_size(path));
        in.read(_text.data(), std::streamsize(_text.size()));
        _at = _text.data();
    }

    bool atEnd() {
        while (*_at == ' ' || *_at == '\n' || *_at == '\r') ++_at;
        return *_at == 0;
    }

    int readInteger() {
        skipBlanks();
        if (*_at < '0' || *_at > '9') fail();
        long value = 0;
        while (*_at >= '0' && *_at <= '9') value = 10 * value + (*_at++ - '0');
        return int(value);
    }

    void skip(char expected) {
        if (*_at++ != expected) fail();
    }

private:
    void skipBlanks() {
        while (*_at == ' ') ++_at;
    }

    [[noreturn]] void fail() const {
        const long line = 1 + std::count(_text.data(), _at, '\n');
        throw std::runtime_error("CalculiX wrote something that is no number in " +
                                 _path.filename().string() + ", line " + std::to_string(line));
    }

    fs::path _path;
    std::string _text;
    const char* _at = nullptr;
};

/** dof = 3·node + axis of each equation. **/
std::vector<int> readEquations(const fs::path& path, const Mesh& mesh,
                               const std::vector<char>& expected) {
    NumberReader reader(path);
    std::vector<int> dofs;
    std::vector<char> seen(3 * size_t(mesh.numNodes()), 0);
    while (!reader.atEnd()) {
        const int node = reader.readInteger();
        reader.skip('.');
        const int axis = reader.readInteger();
        if (axis < 1 || axis > 3)
            throw std::invalid_argument("CalculiX gave node " + std::to_string(node) +
                                        " a degree of freedom that is no translation");
        dofs.push_back(3 * mesh.indexOf(node) + axis - 1);
        seen[dofs.back()] = 1;
    }
    for (size_t dof = 0; dof < seen.size(); ++dof)
        if (!seen[dof] && expected[dof / 3])
            throw std::invalid_argument(
                "CalculiX left out direction " + std::to_string(dof % 3 + 1) + " of node " +
                std::to_string(mesh.nodeNumbers[dof / 3]) + "; K must be free");
    return dofs;
}

}  // namespace

TemporaryFolder::TemporaryFolder() {
    const char* place = std::getenv("TMPDIR");
    std::string pattern = std::string(place && *place ? place : "/tmp") + "/simflex-XXXXXX";
    if (!mkdtemp(pattern.data()))
        throw std::runtime_error("cannot make a temporary folder '" + pattern +
                                 "': " + std::strerror(errno));
    _path = pattern;
}

TemporaryFolder::~TemporaryFolder() {
    std::error_code ignored;
    fs::remove_all(_path, ignored);
}

std::string chooseCalculixProgram(const std::string& program) {
    const char* fromEnvironment = std::getenv("SIMFLEX_CCX");
    std::string chosen = !program.empty() ? program : fromEnvironment ? fromEnvironment : "";
    if (chosen.empty()) return "ccx";
    // It will run in another folder.
    return chosen.find('/') == std::string::npos ? chosen : fs::absolute(chosen).string();
}

std::string readCalculixVersion(const std::string& program) {
    TemporaryFolder folder;
    const pid_t pid = startProgram(program, {"-v"}, folder.path(), folder.path() / "log", kCure);
    for (int status = 0; !hasEnded(pid, status);) std::this_thread::sleep_for(kPollInterval);
    std::ifstream in(folder.path() / "log");
    for (std::string text; std::getline(in, text);) {
        const size_t at = text.find("Version ");
        if (at != std::string::npos) return "CalculiX " + text.substr(at + 8);
    }
    return "CalculiX";
}

CalculixProcess::~CalculixProcess() {
    if (_pid < 0) return;
    kill(_pid, SIGKILL);
    waitpid(_pid, &_status, 0);
}

void CalculixProcess::start(const std::string& program, const fs::path& folder,
                            const std::string& job) {
    _program = program;
    _log = folder / (job + ".log");
    _pid = startProgram(program, {job}, folder, _log, kCure);
}

bool CalculixProcess::poll() {
    if (_pid >= 0 && hasEnded(_pid, _status)) _pid = -1;
    return _pid < 0;
}

void CalculixProcess::checkResult() const {
    const std::string errors = errorTextOf(_log);
    const bool exited = WIFEXITED(_status);
    if (exited && WEXITSTATUS(_status) == 127)
        throw std::runtime_error("cannot run '" + _program + "'. " + kCure);
    if (exited && WEXITSTATUS(_status) == 0 && errors.empty()) return;
    const std::string text =
        exited
            ? "CalculiX refused the deck (exit status " + std::to_string(WEXITSTATUS(_status)) + ")"
            : "CalculiX was ended by signal " + std::to_string(WTERMSIG(_status));
    if (!errors.empty()) throw std::runtime_error(text + ":" + errors);
    const std::string tail = tailOf(_log);
    throw std::runtime_error(text + " and wrote no *ERROR line" +
                             (tail.empty() ? "" : "; the end of its output:" + tail));
}

void runCalculix(const std::string& program, const fs::path& folder, const std::string& job,
                 const ProgressCallback& progress) {
    CalculixProcess process;
    process.start(program, folder, job);
    while (!process.poll()) {
        reportProgress(progress, "CalculiX assembles K and M", -1);
        std::this_thread::sleep_for(kPollInterval);
    }
    process.checkResult();
}

void readCalculixMatrices(const fs::path& folder, const std::string& job,
                          const std::vector<char>& expected, FeModel& model,
                          const ProgressCallback& progress) {
    const auto dofs = readEquations(folder / (job + ".dof"), model.mesh, expected);
    const auto read = [&](const char* ending, const char* phase) {
        SymmetricMatrix A = readCalculixMatrix(folder / (job + ending), dofs, phase, progress);
        // Nodes that are only tied may come last.
        A.size = 3 * model.mesh.numNodes();
        A.columnStarts.resize(size_t(A.size) + 1, A.numEntries());
        return A;
    };
    model.K = read(".sti", "reading K");
    model.m = takeNodalMass(read(".mas", "reading M"), model.mesh);
}

}  // namespace simflex
