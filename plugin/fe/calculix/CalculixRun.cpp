#include "CalculixRun.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

#include "CalculixMatrix.h"
#include "ProgramRun.h"
#include "simflex/fe/MatrixEntries.h"

namespace simflex {
namespace {

namespace fs = std::filesystem;
constexpr auto PollInterval = std::chrono::milliseconds(20);
constexpr int MostErrorLines = 12, TailLines = 8;

const char* const Cure = "Install it (Debian: calculix-ccx), or set SIMFLEX_CCX to its path.";

/** ccx's own *ERROR lines with the lines that go on below them. **/
std::string errorTextOf(const fs::path& log) {
    std::ifstream in(log);
    std::string text, result;
    int numLines = 0;
    bool inside = false;
    while (std::getline(in, text) && numLines < MostErrorLines) {
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

/** Walks through the whitespace-separated integers of a file held in memory. **/
class NumberReader {
public:
    explicit NumberReader(const fs::path& path) : m_path(path) {
        std::ifstream in(path, std::ios::binary);
        if (!in) throw std::runtime_error("CalculiX did not write " + path.filename().string());
        m_text.resize(fs::file_size(path));
        in.read(m_text.data(), std::streamsize(m_text.size()));
        m_at = m_text.data();
    }

    bool atEnd() {
        while (*m_at == ' ' || *m_at == '\n' || *m_at == '\r') ++m_at;
        return *m_at == 0;
    }

    int readInteger() {
        skipBlanks();
        int value = 0;
        const auto result = std::from_chars(m_at, m_text.data() + m_text.size(), value);
        if (result.ec != std::errc()) fail();
        m_at = result.ptr;
        return value;
    }

    void skip(char expected) {
        if (*m_at++ != expected) fail();
    }

private:
    void skipBlanks() {
        while (*m_at == ' ') ++m_at;
    }

    [[noreturn]] void fail() const {
        const long line = 1 + std::count(m_text.data(), m_at, '\n');
        throw std::runtime_error("CalculiX wrote something that is no number in " +
                                 m_path.filename().string() + ", line " + std::to_string(line));
    }

    fs::path m_path;
    std::string m_text;
    const char* m_at = nullptr;
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
        if (!std::binary_search(mesh.nodeNumbers.begin(), mesh.nodeNumbers.end(), node))
            throw std::runtime_error("CalculiX names node " + std::to_string(node) + " in " +
                                     path.filename().string() + ", which the mesh does not have");
        dofs.push_back(3 * mesh.indexOf(node) + axis - 1);
        if (seen[size_t(dofs.back())]++)
            throw std::runtime_error("CalculiX names direction " + std::to_string(axis) +
                                     " of node " + std::to_string(node) + " twice in " +
                                     path.filename().string());
    }
    for (size_t dof = 0; dof < seen.size(); ++dof)
        if (!seen[dof] && expected[dof / 3])
            throw std::invalid_argument(
                "CalculiX left out direction " + std::to_string(dof % 3 + 1) + " of node " +
                std::to_string(mesh.nodeNumbers[dof / 3]) + "; K must be free");
    return dofs;
}

}  // namespace

std::string chooseCalculixProgram(const std::string& program) {
    const char* fromEnvironment = std::getenv("SIMFLEX_CCX");
    std::string chosen = !program.empty() ? program : fromEnvironment ? fromEnvironment : "";
    if (chosen.empty()) return "ccx";
    // It will run in another folder.
    return chosen.find('/') == std::string::npos ? chosen : fs::absolute(chosen).string();
}

std::string readCalculixVersion(const std::string& program) {
    const TemporaryFolder folder;
    const fs::path log = folder.path() / "log";
    startProgram({program, {"-v"}, folder.path(), log, Cure}).wait();
    std::ifstream in(log);
    for (std::string text; std::getline(in, text);) {
        const size_t at = text.find("Version ");
        if (at != std::string::npos) return "CalculiX " + text.substr(at + 8);
    }
    return "CalculiX";
}

void CalculixProcess::start(const std::string& program, const fs::path& folder,
                            const std::string& job) {
    m_program = program;
    m_log = folder / (job + ".log");
    m_process = startProgram({program, {job}, folder, m_log, Cure});
}

void CalculixProcess::checkResult() const {
    // It goes on when it cannot write, and then its files lack their ends.
    const fs::path folder = m_log.parent_path();
    checkSpace(folder, "CalculiX cannot write its matrices");
    const std::string errors = errorTextOf(m_log);
    const ChildEnd& end = m_process.getEnd();
    if (end.exitCode == 127) throw std::runtime_error("cannot run '" + m_program + "'. " + Cure);
    if (end.isSuccess() && errors.empty()) return;
    const std::string text = end.signal == 0 ? "CalculiX refused the deck (exit status " +
                                                   std::to_string(end.exitCode) + ")"
                                             : "CalculiX " + end.describe();
    if (!errors.empty()) throw std::runtime_error(text + ":" + errors);
    const std::string tail = readLastLines(m_log, TailLines);
    throw std::runtime_error(text + ", and wrote no *ERROR line" +
                             (tail.empty() ? "" : "; the end of its output:" + tail));
}

void runCalculix(const std::string& program, const fs::path& folder, const std::string& job,
                 const ProgressCallback& progress) {
    CalculixProcess process;
    process.start(program, folder, job);
    while (!process.poll()) {
        reportProgress(progress, "CalculiX assembles K and M", -1);
        std::this_thread::sleep_for(PollInterval);
    }
    process.checkResult();
}

namespace {

/** CalculiX writes 14 digits. What they leave out holds a part: K loads rigid translations, and
that against more than a slender part's bending. The nodes' own blocks of K take it up; what is more
than round-off stays. **/
void balanceTranslations(SymmetricMatrix& K) {
    constexpr long double WrittenRoundOff = 1e-12L;
    using Sums = std::array<long double, 9>;
    std::vector<Sums> sums(size_t(K.size) / 3, Sums{}), sizes = sums;
    const auto visit = [&](const auto& apply) {
        for (std::int32_t column = 0; column < K.size; ++column)
            for (auto k = size_t(K.columnStarts[size_t(column)]);
                 k < size_t(K.columnStarts[size_t(column) + 1]); ++k)
                apply(K.rows[k], column, K.values[k]);
    };
    visit([&](int row, int column, double value) {
        const auto add = [&](int at, int axis) {
            sums[size_t(at) / 3][size_t(3 * (at % 3) + axis)] += value;
            sizes[size_t(at) / 3][size_t(3 * (at % 3) + axis)] += std::abs(value);
        };
        add(row, column % 3);
        if (row != column) add(column, row % 3);
    });
    visit([&](int row, int column, double& value) {
        if (row / 3 != column / 3) return;
        const size_t node = size_t(row) / 3, here = size_t(3 * (row % 3) + column % 3),
                     mirrored = size_t(3 * (column % 3) + row % 3);
        const long double sum = (sums[node][here] + sums[node][mirrored]) / 2;
        const long double size = *std::max_element(sizes[node].begin(), sizes[node].end());
        if (std::abs(sum) <= WrittenRoundOff * size) value = double(value - sum);
    });
}

}  // namespace

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
    balanceTranslations(model.K);
    model.m = takeNodalMass(read(".mas", "reading M"), model.mesh);
}

}  // namespace simflex
