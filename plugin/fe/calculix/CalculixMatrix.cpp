#include "CalculixMatrix.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <numeric>
#include <stdexcept>
#include <tuple>
#include <utility>

namespace simflex {
namespace {

namespace fs = std::filesystem;
constexpr size_t BufferSize = size_t(4) << 20, LongestLine = 1000;

/** One line of the file. **/
struct TripletLine {
    int row = 0, column = 0;  // of the result, row ≥ column
    int fileRow = 0, fileColumn = 0;
    const char *value = nullptr, *end = nullptr;
};

class TripletFile {
public:
    TripletFile(const fs::path& path, const std::vector<int>& dofs)
        : m_path(path), m_dofs(dofs), m_file(open(path.c_str(), O_RDONLY | O_CLOEXEC)) {
        if (m_file < 0)
            throw std::runtime_error("CalculiX did not write " + path.filename().string());
        m_size = fs::file_size(path);
        posix_fadvise(m_file, 0, 0, POSIX_FADV_SEQUENTIAL);
        m_buffer.resize(BufferSize + 1);
    }
    ~TripletFile() { close(m_file); }
    TripletFile(const TripletFile&) = delete;
    TripletFile& operator=(const TripletFile&) = delete;

    /** Calls visit(line) for every line that is not blank.
    @param before, share  of the progress: what is done, and what this pass adds **/
    template <class Visit>
    void visitLines(const char* phase, const ProgressCallback& progress, double before,
                    double share, const Visit& visit) {
        if (lseek(m_file, 0, SEEK_SET) != 0) fail("cannot be read");
        m_lineNumber = 0;
        size_t held = 0, done = 0;
        for (bool atEnd = false; !atEnd;) {
            const ssize_t got = read(m_file, m_buffer.data() + held, BufferSize - held);
            if (got < 0) {
                if (errno == EINTR) continue;
                fail(std::strerror(errno));
            }
            atEnd = got == 0;
            held += size_t(got);
            done += size_t(got);
            if (atEnd && held > 0) fail("is cut off");
            const char *at = m_buffer.data(), *end = at + held;
            while (const void* found = std::memchr(at, '\n', size_t(end - at))) {
                const char* stop = static_cast<const char*>(found);
                ++m_lineNumber;
                TripletLine line;
                if (parse(at, stop, line)) visit(line);
                at = stop + 1;
            }
            held = size_t(end - at);
            if (held > LongestLine) fail("has a line too long");
            std::memmove(m_buffer.data(), at, held);
            reportProgress(progress, phase,
                           before + share * double(done) / double(std::max<size_t>(m_size, 1)));
        }
    }

    double readValue(const TripletLine& line) const {
        double value = 0;
        const auto result = std::from_chars(line.value, line.end, value);
        const char* at = result.ptr;
        while (at < line.end && (*at == ' ' || *at == '\r')) ++at;
        if (result.ec != std::errc() || at != line.end) failNumber();
        if (!std::isfinite(value))
            throw std::invalid_argument(
                "the matrix in " + m_path.filename().string() + " has " + std::to_string(value) +
                " in row " + std::to_string(line.fileRow) + ", column " +
                std::to_string(line.fileColumn) + "; it must be a finite number");
        return value;
    }

    /** CalculiX writes all of the diagonal, column after column. **/
    [[noreturn]] void failDiagonal(const std::vector<int>& dofs, int dof) const {
        const auto equation = std::find(dofs.begin(), dofs.end(), dof) - dofs.begin();
        throw std::runtime_error(m_path.filename().string() +
                                 " has no diagonal entry of equation " +
                                 std::to_string(equation + 1) + ": is it cut off?");
    }

private:
    /** @returns false for a blank line. **/
    bool parse(const char* at, const char* end, TripletLine& line) const {
        const auto skipBlanks = [&] {
            while (at < end && (*at == ' ' || *at == '\r')) ++at;
        };
        const auto readInteger = [&] {
            skipBlanks();
            int value = 0;
            const auto result = std::from_chars(at, end, value);
            if (result.ec != std::errc()) failNumber();
            at = result.ptr;
            return value;
        };
        skipBlanks();
        if (at == end) return false;
        line.fileRow = readInteger();
        line.fileColumn = readInteger();
        if (std::min(line.fileRow, line.fileColumn) < 1 ||
            size_t(std::max(line.fileRow, line.fileColumn)) > m_dofs.size())
            throw std::runtime_error("CalculiX names an equation outside the matrix in " +
                                     m_path.filename().string());
        const int a = m_dofs[size_t(line.fileRow - 1)], b = m_dofs[size_t(line.fileColumn - 1)];
        line.row = std::max(a, b);
        line.column = std::min(a, b);
        skipBlanks();
        line.value = at;
        line.end = end;
        return true;
    }

    [[noreturn]] void failNumber() const {
        throw std::runtime_error("CalculiX wrote something that is no number in " +
                                 m_path.filename().string() + ", line " +
                                 std::to_string(m_lineNumber));
    }

    [[noreturn]] void fail(const std::string& what) const {
        throw std::runtime_error(m_path.filename().string() + " " + what + ", line " +
                                 std::to_string(m_lineNumber));
    }

    const fs::path m_path;
    const std::vector<int>& m_dofs;
    const int m_file;
    size_t m_size = 0;
    std::vector<char> m_buffer;
    long m_lineNumber = 0;
};

/** True if the text says 0, without reading the number. **/
bool isZero(const TripletLine& line) {
    for (const char* at = line.value; at < line.end && *at != 'e' && *at != 'E'; ++at)
        if (*at != '0' && *at != '.' && *at != '-' && *at != '+' && *at != ' ' && *at != '\r')
            return false;
    return true;
}

/** Rows ascending within each column, entries given twice added. **/
void sortColumns(SymmetricMatrix& A) {
    std::vector<std::pair<std::int32_t, double>> entries;
    std::int64_t kept = 0;
    for (int column = 0; column < A.size; ++column) {
        const auto begin = A.columnStarts[size_t(column)], end = A.columnStarts[size_t(column) + 1];
        if (!std::is_sorted(A.rows.begin() + begin, A.rows.begin() + end)) {
            entries.clear();
            for (auto k = begin; k < end; ++k)
                entries.emplace_back(A.rows[size_t(k)], A.values[size_t(k)]);
            std::stable_sort(entries.begin(), entries.end(),
                             [](const auto& a, const auto& b) { return a.first < b.first; });
            for (auto k = begin; k < end; ++k)
                std::tie(A.rows[size_t(k)], A.values[size_t(k)]) = entries[size_t(k - begin)];
        }
        A.columnStarts[size_t(column)] = kept;
        for (auto k = begin; k < end; ++k) {
            if (kept > A.columnStarts[size_t(column)] &&
                A.rows[size_t(kept - 1)] == A.rows[size_t(k)]) {
                A.values[size_t(kept - 1)] += A.values[size_t(k)];
                continue;
            }
            A.rows[size_t(kept)] = A.rows[size_t(k)];
            A.values[size_t(kept++)] = A.values[size_t(k)];
        }
    }
    A.columnStarts[size_t(A.size)] = kept;
    A.rows.resize(size_t(kept));
    A.values.resize(size_t(kept));
}

}  // namespace

SymmetricMatrix readCalculixMatrix(const fs::path& path, const std::vector<int>& dofs,
                                   const char* phase, const ProgressCallback& progress) {
    constexpr double Counting = 0.3;  // part of the time
    TripletFile file(path, dofs);
    SymmetricMatrix A;
    A.size = dofs.empty() ? 0 : 1 + *std::max_element(dofs.begin(), dofs.end());
    A.columnStarts.assign(size_t(A.size) + 1, 0);
    const auto isLeftOut = [](const TripletLine& line) {
        return line.row != line.column && isZero(line);
    };
    file.visitLines(phase, progress, 0, Counting, [&](const TripletLine& line) {
        if (!isLeftOut(line)) ++A.columnStarts[size_t(line.column) + 1];
    });
    std::partial_sum(A.columnStarts.begin(), A.columnStarts.end(), A.columnStarts.begin());
    A.rows.resize(size_t(A.columnStarts.back()));
    A.values.resize(size_t(A.columnStarts.back()));
    std::vector<std::int64_t> next(A.columnStarts.begin(), A.columnStarts.end() - 1);
    file.visitLines(phase, progress, Counting, 1 - Counting, [&](const TripletLine& line) {
        const double value = file.readValue(line);
        if (isLeftOut(line)) return;
        const auto at = size_t(next[size_t(line.column)]++);
        A.rows[at] = line.row;
        A.values[at] = value;
    });
    sortColumns(A);
    for (const int dof : dofs) {
        const auto first = size_t(A.columnStarts[size_t(dof)]);
        if (first == A.rows.size() || A.rows[first] != dof) file.failDiagonal(dofs, dof);
    }
    return A;
}

}  // namespace simflex
