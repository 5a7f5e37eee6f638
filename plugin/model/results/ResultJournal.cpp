#include "simflex/model/results/ResultJournal.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "simflex/base/Hash.h"

namespace simflex {
namespace model {
namespace {

constexpr char kMark[] = "simflex journal\n";  // 16 bytes
constexpr std::uint64_t kMarkSize = sizeof kMark - 1;
constexpr std::uint64_t kFrame = 3 * sizeof(std::uint64_t);  // kind and size before, sum behind
enum Kind : std::uint64_t { Header = 1, Begin, Row, Statistics, Complete, Warning };

std::uint64_t calcSum(const char* bytes, size_t size) {
    Hash hash;
    hash.addBytes(bytes, size);
    return hash.get();
}

/** Puts a record's contents together. **/
class Packer {
public:
    void add(std::uint64_t value) { addBytes(&value, sizeof value); }
    void add(const std::string& text) {
        add(std::uint64_t(text.size()));
        addBytes(text.data(), text.size());
    }
    void add(const std::vector<double>& values) {
        add(std::uint64_t(values.size()));
        addBytes(values.data(), values.size() * sizeof(double));
    }
    void add(const std::vector<std::string>& texts) { addAll(texts); }
    void add(const std::vector<std::vector<double>>& rows) { addAll(rows); }

    std::string bytes;

private:
    template <class List>
    void addAll(const List& list) {
        add(std::uint64_t(list.size()));
        for (const auto& item : list) add(item);
    }
    void addBytes(const void* data, size_t size) {
        bytes.append(static_cast<const char*>(data), size);
    }
};

/** Takes them apart again, in the same order. **/
class Unpacker {
public:
    explicit Unpacker(const std::string& bytes) : _bytes(bytes) {}

    std::uint64_t getCount() {
        std::uint64_t value = 0;
        std::memcpy(&value, take(sizeof value), sizeof value);
        return value;
    }
    std::string getText() {
        const std::uint64_t size = getCount();
        return std::string(take(size), size);
    }
    std::vector<double> getNumbers() {
        const std::uint64_t count = getCount();
        if (count > _bytes.size()) throw std::runtime_error("a record is too short");
        const char* bytes = take(count * sizeof(double));
        std::vector<double> values(count);
        if (count > 0) std::memcpy(values.data(), bytes, count * sizeof(double));
        return values;
    }
    std::vector<std::string> getTexts() {
        std::vector<std::string> texts;
        for (std::uint64_t left = getCount(); left > 0; --left) texts.push_back(getText());
        return texts;
    }
    std::vector<std::vector<double>> getRows() {
        std::vector<std::vector<double>> rows;
        for (std::uint64_t left = getCount(); left > 0; --left) rows.push_back(getNumbers());
        return rows;
    }

private:
    const char* take(std::uint64_t size) {
        if (size > _bytes.size() - _at) throw std::runtime_error("a record is too short");
        const char* here = _bytes.data() + _at;
        _at += size;
        return here;
    }
    const std::string& _bytes;
    size_t _at = 0;
};

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

std::string packAnalysis(const ResultJournal::Analysis& analysis) {
    const ResultData::Analysis& contents = analysis.contents;
    Packer packer;
    packer.add(contents.name);
    packer.add(contents.type);
    packer.add(std::uint64_t(analysis.numQ));
    packer.add(std::uint64_t(analysis.numU));
    packer.add(std::uint64_t(contents.probes.size()));
    for (const auto& series : contents.probes) {
        packer.add(series.column.name);
        packer.add(series.column.unit);
        packer.add(series.column.columns);
        packer.add(series.rows);
    }
    packer.add(contents.q);
    packer.add(contents.u);
    packer.add(contents.speeds);
    packer.add(contents.frequency);
    packer.add(contents.dampingRatio);
    return packer.bytes;
}

ResultJournal::Analysis unpackAnalysis(Unpacker& unpacker) {
    ResultJournal::Analysis analysis;
    ResultData::Analysis& contents = analysis.contents;
    contents.name = unpacker.getText();
    contents.type = unpacker.getText();
    analysis.numQ = int(unpacker.getCount());
    analysis.numU = int(unpacker.getCount());
    for (std::uint64_t left = unpacker.getCount(); left > 0; --left) {
        ResultData::Series series;
        series.column.name = unpacker.getText();
        series.column.unit = unpacker.getText();
        series.column.columns = unpacker.getTexts();
        series.rows = unpacker.getRows();
        analysis.numColumns += int(series.column.columns.size());
        contents.probes.push_back(std::move(series));
    }
    contents.q = unpacker.getRows();
    contents.u = unpacker.getRows();
    contents.speeds = unpacker.getNumbers();
    contents.frequency = unpacker.getRows();
    contents.dampingRatio = unpacker.getRows();
    return analysis;
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
    Unpacker unpacker(payload);
    if (kind == Header) {
        _header.title = unpacker.getText();
        _header.modelPath = unpacker.getText();
        _header.modelText = unpacker.getText();
        _header.settings = unpacker.getTexts();
        _header.isRigid = unpacker.getCount() != 0;
        _hasHeader = true;
    } else if (kind == Begin) {
        _analyses.push_back(unpackAnalysis(unpacker));
        _analyses.back().start = offset + kFrame + payload.size();
    } else if (kind == Row) {
        if (_analyses.empty() ||
            payload.size() != size_t(_analyses.back().getRowSize()) * sizeof(double))
            throw std::runtime_error("'" + _path + "' has a row of another length");
        countRow(offset);
    } else if (kind == Statistics) {
        auto& statistics = update(unpacker.getText()).contents.statistics;
        statistics.clear();
        for (std::uint64_t left = unpacker.getCount(); left > 0; --left) {
            const std::string name = unpacker.getText();
            const std::vector<double> value = unpacker.getNumbers();
            if (value.size() == 1) statistics[name] = value[0];
        }
    } else if (kind == Complete) {
        update(unpacker.getText()).contents.isComplete = true;
    } else if (kind == Warning) {
        const std::string analysis = unpacker.getText();
        _warnings[analysis].push_back(unpacker.getText());
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
    Packer packer;
    packer.add(header.title);
    packer.add(header.modelPath);
    packer.add(header.modelText);
    packer.add(header.settings);
    packer.add(std::uint64_t(header.isRigid));
    append(Header, packer.bytes);
}

void ResultJournal::addAnalysis(const Analysis& analysis) {
    append(Begin, packAnalysis(analysis));
}

void ResultJournal::addRow(const std::vector<double>& row) {
    append(Row, std::string(reinterpret_cast<const char*>(row.data()), row.size() * sizeof row[0]));
}

void ResultJournal::addStatistics(const std::string& analysis,
                                  const std::map<std::string, double>& values) {
    Packer packer;
    packer.add(analysis);
    packer.add(std::uint64_t(values.size()));
    for (const auto& [name, value] : values) {
        packer.add(name);
        packer.add(std::vector<double>{value});
    }
    append(Statistics, packer.bytes);
}

void ResultJournal::addComplete(const std::string& analysis) {
    Packer packer;
    packer.add(analysis);
    append(Complete, packer.bytes);
}

void ResultJournal::addWarning(const std::string& analysis, const std::string& text) {
    Packer packer;
    packer.add(analysis);
    packer.add(text);
    append(Warning, packer.bytes);
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
