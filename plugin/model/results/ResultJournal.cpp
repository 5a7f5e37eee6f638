#include "simflex/model/results/ResultJournal.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "simflex/base/Archive.h"
#include "simflex/base/Hash.h"

namespace simflex {
namespace model {
namespace {

constexpr char kMark[] = "simflex journal\n";  // 16 bytes
constexpr std::uint64_t kMarkSize = sizeof kMark - 1;
constexpr std::uint64_t kFrame = 3 * sizeof(std::uint64_t);  // kind and size before, sum behind
constexpr size_t kLeastSeries = 4 * sizeof(std::uint64_t),
                 kLeastStatistic = 2 * sizeof(std::uint64_t);
enum EntryKind : std::uint64_t { Header = 1, Begin, Row, Statistics, Complete, Warning };

std::uint64_t calcSum(const char* bytes, size_t size) {
    Hash hash;
    hash.addBytes(bytes, size);
    return hash.get();
}

std::string explain(const std::string& what, const std::string& path) {
    const int code = errno;
    return "cannot " + what + " '" + path + "': " + std::strerror(code) +
           (code == ENOSPC ? "; make room and go on with --resume" : "");
}

/** @returns how many bytes there were. **/
size_t readAt(int file, std::uint64_t offset, char* bytes, size_t size) {
    size_t done = 0;
    while (done < size) {
        const ssize_t count = pread(file, bytes + done, size - done, off_t(offset + done));
        if (count < 0 && errno == EINTR) continue;
        if (count <= 0) break;
        done += size_t(count);
    }
    return done;
}

bool writeAt(int file, std::uint64_t offset, const char* bytes, size_t size) {
    size_t done = 0;
    while (done < size) {
        const ssize_t count = pwrite(file, bytes + done, size - done, off_t(offset + done));
        if (count < 0 && errno == EINTR) continue;
        if (count <= 0) return false;
        done += size_t(count);
    }
    return true;
}

void visit(Archive& archive, ResultHeader& header) {
    archive.visit(header.title, header.modelPath, header.modelText, header.settings);
    int isRigid = header.isRigid;
    archive.visitCount(isRigid);
    header.isRigid = isRigid != 0;
}

/** All but the rows. **/
void visit(Archive& archive, ResultJournal::Analysis& analysis) {
    Results::Analysis& contents = analysis.contents;
    archive.visit(contents.name, contents.type);
    archive.visitCount(analysis.numQ);
    archive.visitCount(analysis.numU);
    contents.probes.resize(archive.visitSize(contents.probes.size(), kLeastSeries));
    analysis.numColumns = 0;
    for (Results::Series& series : contents.probes) {
        ResultColumn& column = series.column;
        archive.visit(column.name, column.unit, column.columns, series.rows);
        analysis.numColumns += int(column.columns.size());
    }
    archive.visit(contents.q, contents.u, contents.speeds, contents.frequency,
                  contents.dampingRatio);
}

/** A record of texts and numbers. **/
template <class... Values>
std::string pack(Values... values) {
    Archive archive;
    (archive.visit(values), ...);
    return archive.getBytes();
}

}  // namespace

ResultJournal::ResultJournal(const std::string& path, Access access) : _path(path) {
    const int flags = access == Access::Read     ? O_RDONLY
                      : access == Access::Append ? O_RDWR
                                                 : O_RDWR | O_CREAT;
    _file = open(path.c_str(), flags | O_CLOEXEC, 0666);
    if (_file < 0) throw std::runtime_error(explain("open", path));
    try {
        if (access != Access::Read && flock(_file, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)
            throw std::runtime_error("'" + path + "' is being written by another run");
        if (access == Access::Create) {
            if (ftruncate(_file, 0) != 0 || !writeAt(_file, 0, kMark, kMarkSize))
                throw std::runtime_error(explain("write", path));
            _end = kMarkSize;
        } else {
            scan();
            if (!_hasHeader)
                throw std::runtime_error("'" + path + "' is no journal of simflex, or is damaged");
            if (access == Access::Append && ftruncate(_file, off_t(_end)) != 0)
                throw std::runtime_error(explain("write", path));
        }
    } catch (...) {
        close(_file);
        throw;
    }
}

ResultJournal::~ResultJournal() {
    close(_file);
}

const ResultJournal::Analysis* ResultJournal::find(const std::string& name) const {
    for (const Analysis& analysis : _analyses)
        if (analysis.contents.name == name) return &analysis;
    return nullptr;
}

const std::vector<std::string>& ResultJournal::getWarnings(const std::string& analysis) const {
    static const std::vector<std::string> none;
    const auto found = _warnings.find(analysis);
    return found == _warnings.end() ? none : found->second;
}

ResultJournal::Analysis& ResultJournal::update(const std::string& name) {
    for (Analysis& analysis : _analyses)
        if (analysis.contents.name == name) return analysis;
    throw std::runtime_error("'" + _path + "' has no analysis '" + name + "'");
}

void ResultJournal::scan() {
    _hasHeader = false;
    _analyses.clear();
    _warnings.clear();
    _end = 0;
    char mark[kMarkSize];
    if (readAt(_file, 0, mark, kMarkSize) != kMarkSize || std::memcmp(mark, kMark, kMarkSize) != 0)
        return;
    _end = kMarkSize;
    struct stat status {};
    if (fstat(_file, &status) != 0) throw std::runtime_error(explain("read", _path));
    const std::uint64_t size = std::uint64_t(status.st_size);
    std::string record, payload;
    while (_end + kFrame <= size) {
        std::uint64_t head[2], sum = 0;
        if (readAt(_file, _end, reinterpret_cast<char*>(head), sizeof head) != sizeof head) return;
        if (head[1] > size - _end - kFrame) return;
        record.resize(kFrame + head[1]);
        if (readAt(_file, _end, record.data(), record.size()) != record.size()) return;
        std::memcpy(&sum, record.data() + record.size() - sizeof sum, sizeof sum);
        if (calcSum(record.data(), record.size() - sizeof sum) != sum) return;
        payload.assign(record, sizeof head, head[1]);
        take(head[0], payload, _end);
        _end += record.size();
    }
}

void ResultJournal::take(std::uint64_t kind, const std::string& payload, std::uint64_t offset) {
    Archive archive(payload);
    const auto getText = [&archive] {
        std::string text;
        archive.visit(text);
        return text;
    };
    if (kind == Header) {
        visit(archive, _header);
        _hasHeader = true;
    } else if (kind == Begin) {
        visit(archive, _analyses.emplace_back());
        _analyses.back().start = offset + kFrame + payload.size();
    } else if (kind == Row) {
        if (_analyses.empty() ||
            payload.size() != size_t(_analyses.back().getRowSize()) * sizeof(double))
            throw std::runtime_error("'" + _path + "' has a row of another length");
        countRow(offset);
    } else if (kind == Statistics) {
        auto& statistics = update(getText()).contents.statistics;
        statistics.clear();
        for (size_t left = archive.visitSize(0, kLeastStatistic); left > 0; --left) {
            const std::string name = getText();
            std::vector<double> value;
            archive.visit(value);
            if (value.size() == 1) statistics[name] = value[0];
        }
    } else if (kind == Complete) {
        update(getText()).contents.isComplete = true;
    } else if (kind == Warning) {
        const std::string analysis = getText();
        _warnings[analysis].push_back(getText());
    } else {
        throw std::runtime_error("'" + _path + "' is of a newer simflex");
    }
}

void ResultJournal::countRow(std::uint64_t offset) {
    Analysis& analysis = _analyses.back();
    const std::uint64_t size = kFrame + std::uint64_t(analysis.getRowSize()) * sizeof(double);
    auto& segments = analysis.segments;
    if (segments.empty() ||
        segments.back().offset + std::uint64_t(segments.back().count) * size != offset)
        segments.push_back({offset, analysis.numRows, 0});
    ++segments.back().count;
    ++analysis.numRows;
}

void ResultJournal::append(std::uint64_t kind, const std::string& payload) {
    const std::uint64_t head[2] = {kind, payload.size()};
    _record.assign(reinterpret_cast<const char*>(head), sizeof head);
    _record += payload;
    const std::uint64_t sum = calcSum(_record.data(), _record.size());
    _record.append(reinterpret_cast<const char*>(&sum), sizeof sum);
    if (!writeAt(_file, _end, _record.data(), _record.size())) {
        const std::string what = explain("write", _path);
        (void)!ftruncate(_file, off_t(_end));
        throw std::runtime_error(what);
    }
    const std::uint64_t offset = _end;
    _end += _record.size();
    if (kind == Row) {
        countRow(offset);
    } else {
        take(kind, payload, offset);
    }
}

void ResultJournal::addHeader(const ResultHeader& header) {
    Archive archive;
    ResultHeader copy = header;
    visit(archive, copy);
    append(Header, archive.getBytes());
}

void ResultJournal::addAnalysis(const Analysis& analysis) {
    Archive archive;
    Analysis copy = analysis;
    visit(archive, copy);
    append(Begin, archive.getBytes());
}

void ResultJournal::addRow(const std::vector<double>& row) {
    append(Row, std::string(reinterpret_cast<const char*>(row.data()), row.size() * sizeof row[0]));
}

void ResultJournal::addStatistics(const std::string& analysis,
                                  const std::map<std::string, double>& values) {
    std::string bytes = pack(analysis, std::uint64_t(values.size()));
    for (const auto& [name, value] : values) bytes += pack(name, std::vector<double>{value});
    append(Statistics, bytes);
}

void ResultJournal::addComplete(const std::string& analysis) {
    append(Complete, pack(analysis));
}

void ResultJournal::addWarning(const std::string& analysis, const std::string& text) {
    append(Warning, pack(analysis, text));
}

void ResultJournal::cut(const std::string& name, int numRows) {
    const Analysis& analysis = update(name);
    const std::uint64_t size = kFrame + std::uint64_t(analysis.getRowSize()) * sizeof(double);
    if (numRows > analysis.numRows)
        throw std::runtime_error("'" + _path + "' has " + std::to_string(analysis.numRows) +
                                 " rows of analysis '" + name + "', fewer than the " +
                                 std::to_string(numRows) + " to go on after");
    std::uint64_t end = analysis.start;
    for (const auto& segment : analysis.segments)
        if (segment.first < numRows && numRows <= segment.first + segment.count)
            end = segment.offset + std::uint64_t(numRows - segment.first) * size;
    if (ftruncate(_file, off_t(end)) != 0) throw std::runtime_error(explain("write", _path));
    scan();
}

void ResultJournal::sync() {
    if (fdatasync(_file) != 0 && errno != EINVAL && errno != EROFS)
        throw std::runtime_error(explain("write", _path));
}

std::vector<double> ResultJournal::readRows(const Analysis& analysis, int first, int count) const {
    const size_t numbers = size_t(analysis.getRowSize());
    const std::uint64_t size = kFrame + numbers * sizeof(double);
    std::vector<double> rows(numbers * size_t(count));
    std::string records;
    int done = 0;
    for (const auto& segment : analysis.segments) {
        const int begin = std::max(first + done, segment.first);
        const int end = std::min(first + count, segment.first + segment.count);
        if (begin >= end) continue;
        records.resize(size_t(end - begin) * size);
        if (readAt(_file, segment.offset + std::uint64_t(begin - segment.first) * size,
                   records.data(), records.size()) != records.size())
            throw std::runtime_error(explain("read", _path));
        for (int k = begin; k < end; ++k)
            std::memcpy(&rows[size_t(k - first) * numbers],
                        &records[size_t(k - begin) * size + 2 * sizeof(std::uint64_t)],
                        numbers * sizeof(double));
        done = end - first;
    }
    if (done != count) throw std::runtime_error("'" + _path + "' was cut while being read");
    return rows;
}

}  // namespace model
}  // namespace simflex
