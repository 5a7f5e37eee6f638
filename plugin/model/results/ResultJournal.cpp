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
#include "simflex/base/InputFile.h"

namespace simflex {
namespace model {
namespace {

constexpr char JournalMark[] = "simflex rows  2\n";  // 16 bytes
constexpr std::uint64_t JournalMarkSize = sizeof JournalMark - 1;
constexpr std::uint64_t RecordFrame =
    3 * sizeof(std::uint64_t);  // kind and size before the payload, checksum after it
constexpr size_t LeastSeries = 4 * sizeof(std::uint64_t),
                 LeastStatistic = 2 * sizeof(std::uint64_t);
enum EntryKind : std::uint64_t { Header = 1, Begin, Row, Statistics, Complete, Warning, Events };

std::uint64_t calcSum(const char* bytes, size_t size) {
    Hash hash;
    hash.addBytes(bytes, size);
    return hash.get();
}

std::string explain(const std::string& what, const std::string& path) {
    const int code = errno;
    return "cannot " + what + " '" + path + "': " + std::strerror(code) +
           (code == ENOSPC ? "; make room and continue with --resume" : "");
}

/** @returns the number of bytes read. **/
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
    archive.visit(header.title, header.modelPath, header.modelText, header.settings,
                  header.version);
    int isRigid = header.isRigid;
    archive.visitCount(isRigid);
    header.isRigid = isRigid != 0;
    std::vector<std::string> inputs;
    for (const auto& entry : header.inputs) inputs.push_back(entry.first);
    archive.visit(inputs);
    for (const std::string& input : inputs) archive.visit(header.inputs[input]);
}

/** Visits all but the rows. **/
void visit(Archive& archive, ResultJournal::Analysis& analysis) {
    Results::Analysis& contents = analysis.contents;
    archive.visit(contents.name, contents.type);
    contents.probes.resize(archive.visitSize(contents.probes.size(), LeastSeries));
    analysis.numColumns = 0;
    for (Results::Series& series : contents.probes) {
        ResultColumn& column = series.column;
        archive.visit(column.name, column.unit, column.columns, series.rows);
        analysis.numColumns += int(column.columns.size());
    }
    analysis.numStates = 0;
    for (const ResultState& state : ResultStates) {
        std::vector<std::string>& columns = contents.stateColumns[state.name];
        archive.visit(columns, contents.*state.rows);
        analysis.numStates += int(columns.size());
    }
    archive.visit(contents.speeds, contents.frequency, contents.dampingRatio);
    archive.visit(contents.inputs, contents.outputs, contents.inputUnits, contents.outputUnits);
    std::vector<std::string> names;
    for (const auto& entry : contents.matrices) names.push_back(entry.first);
    archive.visit(names);
    for (const std::string& name : names) archive.visit(contents.matrices[name]);
}

/** Packs texts and numbers into a record. **/
template <class... Values>
std::string pack(Values... values) {
    Archive archive;
    (archive.visit(values), ...);
    return archive.getBytes();
}

}  // namespace

ResultJournal::ResultJournal(const std::string& path, Access access) : m_path(path) {
    const int flags = access == Access::Read     ? O_RDONLY
                      : access == Access::Append ? O_RDWR
                                                 : O_RDWR | O_CREAT | O_NOFOLLOW;
    if (std::filesystem::exists(path) && !isInputFile(path))
        throw std::runtime_error("'" + path +
                                 "' is no file on a disk, and the journal of a run is kept there; "
                                 "remove it, or choose another result file with -o");
    m_file = open(path.c_str(), flags | O_CLOEXEC, 0666);
    if (m_file < 0) throw std::runtime_error(explain("open", path));
    try {
        if (access != Access::Read && flock(m_file, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)
            throw std::runtime_error("'" + path + "' is being written by another run");
        if (access == Access::Create) {
            char mark[JournalMarkSize];
            const size_t found = readAt(m_file, 0, mark, JournalMarkSize);
            if (std::memcmp(mark, JournalMark, found) != 0)
                throw std::runtime_error(
                    "'" + path +
                    "' is not the journal that a run keeps there of its rows, so it is not "
                    "replaced; rename it, or choose another result file with -o");
            if (ftruncate(m_file, 0) != 0 || !writeAt(m_file, 0, JournalMark, JournalMarkSize))
                throw std::runtime_error(explain("write", path));
            m_end = JournalMarkSize;
        } else {
            scan();
            if (!m_hasHeader && access == Access::Read)
                throw std::runtime_error("'" + path +
                                         "' is not the journal of a run, or is damaged");
            if (access == Access::Append && m_hasHeader && ftruncate(m_file, off_t(m_end)) != 0)
                throw std::runtime_error(explain("write", path));
        }
    } catch (...) {
        close(m_file);
        throw;
    }
}

ResultJournal::~ResultJournal() {
    close(m_file);
}

const ResultJournal::Analysis* ResultJournal::find(const std::string& name) const {
    for (const Analysis& analysis : m_analyses)
        if (analysis.contents.name == name) return &analysis;
    return nullptr;
}

const std::vector<std::string>& ResultJournal::getWarnings(const std::string& analysis) const {
    static const std::vector<std::string> none;
    const auto found = m_warnings.find(analysis);
    return found == m_warnings.end() ? none : found->second;
}

ResultJournal::Analysis& ResultJournal::update(const std::string& name) {
    for (Analysis& analysis : m_analyses)
        if (analysis.contents.name == name) return analysis;
    throw std::runtime_error("'" + m_path + "' has no analysis '" + name + "'");
}

void ResultJournal::scan() {
    m_hasHeader = false;
    m_analyses.clear();
    m_warnings.clear();
    m_end = 0;
    char mark[JournalMarkSize];
    if (readAt(m_file, 0, mark, JournalMarkSize) != JournalMarkSize ||
        std::memcmp(mark, JournalMark, JournalMarkSize) != 0)
        return;
    m_end = JournalMarkSize;
    struct stat status {};
    if (fstat(m_file, &status) != 0) throw std::runtime_error(explain("read", m_path));
    const std::uint64_t size = std::uint64_t(status.st_size);
    std::string record, payload;
    while (m_end + RecordFrame <= size) {
        std::uint64_t head[2], sum = 0;
        if (readAt(m_file, m_end, reinterpret_cast<char*>(head), sizeof head) != sizeof head)
            return;
        if (head[1] > size - m_end - RecordFrame) return;
        record.resize(RecordFrame + head[1]);
        if (readAt(m_file, m_end, record.data(), record.size()) != record.size()) return;
        std::memcpy(&sum, record.data() + record.size() - sizeof sum, sizeof sum);
        if (calcSum(record.data(), record.size() - sizeof sum) != sum) return;
        payload.assign(record, sizeof head, head[1]);
        take(head[0], payload, m_end);
        m_end += record.size();
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
        visit(archive, m_header);
        m_hasHeader = true;
    } else if (kind == Begin) {
        visit(archive, m_analyses.emplace_back());
        m_analyses.back().start = offset + RecordFrame + payload.size();
    } else if (kind == Row) {
        if (m_analyses.empty() ||
            payload.size() != size_t(m_analyses.back().getRowSize()) * sizeof(double))
            throw std::runtime_error("the journal '" + m_path +
                                     "' is damaged: a row has another length; remove it to "
                                     "continue from what the result file has");
        countRow(offset);
    } else if (kind == Statistics) {
        auto& statistics = update(getText()).contents.statistics;
        statistics.clear();
        for (size_t left = archive.visitSize(0, LeastStatistic); left > 0; --left) {
            const std::string name = getText();
            std::vector<double> value;
            archive.visit(value);
            if (value.size() == 1) statistics[name] = value[0];
        }
    } else if (kind == Events) {
        auto& events = update(getText()).contents.events;
        events.clear();
        std::vector<std::string> names;
        std::vector<double> times;
        archive.visit(names, times);
        for (size_t i = 0; i < std::min(names.size(), times.size()); ++i)
            events.push_back({names[i], times[i]});
    } else if (kind == Complete) {
        update(getText()).contents.isComplete = true;
    } else if (kind == Warning) {
        const std::string analysis = getText();
        m_warnings[analysis].push_back(getText());
    } else {
        throw std::runtime_error("the journal '" + m_path +
                                 "' is of a newer simflex: continue the run with that");
    }
}

void ResultJournal::countRow(std::uint64_t offset) {
    Analysis& analysis = m_analyses.back();
    const std::uint64_t size = RecordFrame + std::uint64_t(analysis.getRowSize()) * sizeof(double);
    auto& segments = analysis.segments;
    if (segments.empty() ||
        segments.back().offset + std::uint64_t(segments.back().count) * size != offset)
        segments.push_back({offset, analysis.numRows, 0});
    ++segments.back().count;
    ++analysis.numRows;
}

void ResultJournal::checkSize() const {
    struct stat status {};
    if (fstat(m_file, &status) != 0) throw std::runtime_error(explain("read", m_path));
    if (std::uint64_t(status.st_size) < m_end)
        throw std::runtime_error("the journal '" + m_path +
                                 "' was cut by another program during the run; --resume continues "
                                 "from what the result file has");
}

void ResultJournal::append(std::uint64_t kind, const std::string& payload) {
    checkSize();  // in a truncated file, zeros would fill the gap
    const std::uint64_t head[2] = {kind, payload.size()};
    m_record.assign(reinterpret_cast<const char*>(head), sizeof head);
    m_record += payload;
    const std::uint64_t sum = calcSum(m_record.data(), m_record.size());
    m_record.append(reinterpret_cast<const char*>(&sum), sizeof sum);
    if (!writeAt(m_file, m_end, m_record.data(), m_record.size())) {
        const std::string what = explain("write", m_path);
        (void)!ftruncate(m_file, off_t(m_end));
        throw std::runtime_error(what);
    }
    const std::uint64_t offset = m_end;
    m_end += m_record.size();
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

void ResultJournal::addEvents(const std::string& analysis,
                              const std::vector<Results::Analysis::Event>& events) {
    std::vector<std::string> names;
    std::vector<double> times;
    for (const Results::Analysis::Event& event : events) {
        names.push_back(event.name);
        times.push_back(event.time);
    }
    append(Events, pack(analysis, names, times));
}

void ResultJournal::addComplete(const std::string& analysis) {
    append(Complete, pack(analysis));
}

void ResultJournal::addWarning(const std::string& analysis, const std::string& text) {
    append(Warning, pack(analysis, text));
}

void ResultJournal::cut(const std::string& name, int numRows) {
    const Analysis& analysis = update(name);
    const std::uint64_t size = RecordFrame + std::uint64_t(analysis.getRowSize()) * sizeof(double);
    if (numRows > analysis.numRows)
        throw std::runtime_error("'" + m_path + "' has " + std::to_string(analysis.numRows) +
                                 " rows of analysis '" + name + "', its checkpoint " +
                                 std::to_string(numRows) +
                                 ": remove the checkpoint to begin the analysis anew");
    std::uint64_t end = analysis.start;
    for (const auto& segment : analysis.segments)
        if (segment.first < numRows && numRows <= segment.first + segment.count)
            end = segment.offset + std::uint64_t(numRows - segment.first) * size;
    if (ftruncate(m_file, off_t(end)) != 0) throw std::runtime_error(explain("write", m_path));
    scan();
}

void ResultJournal::sync() {
    if (fdatasync(m_file) != 0 && errno != EINVAL && errno != EROFS)
        throw std::runtime_error(explain("write", m_path));
}

std::vector<double> ResultJournal::readRows(const Analysis& analysis, int first, int count) const {
    const size_t numbers = size_t(analysis.getRowSize());
    const std::uint64_t size = RecordFrame + numbers * sizeof(double);
    std::vector<double> rows(numbers * size_t(count));
    std::string records;
    int done = 0;
    for (const auto& segment : analysis.segments) {
        const int begin = std::max(first + done, segment.first);
        const int end = std::min(first + count, segment.first + segment.count);
        if (begin >= end) continue;
        records.resize(size_t(end - begin) * size);
        if (readAt(m_file, segment.offset + std::uint64_t(begin - segment.first) * size,
                   records.data(), records.size()) != records.size()) {
            checkSize();
            throw std::runtime_error(explain("read", m_path));
        }
        for (int k = begin; k < end; ++k) {
            const char* record = records.data() + size_t(k - begin) * size;
            std::uint64_t sum = 0;
            std::memcpy(&sum, record + size - sizeof sum, sizeof sum);
            if (calcSum(record, size - sizeof sum) != sum)
                throw std::runtime_error("the journal '" + m_path +
                                         "' has a damaged row of analysis '" +
                                         analysis.contents.name + "'; run it anew");
            std::memcpy(&rows[size_t(k - first) * numbers], record + 2 * sizeof(std::uint64_t),
                        numbers * sizeof(double));
        }
        done = end - first;
    }
    if (done != count) throw std::runtime_error("'" + m_path + "' was cut while being read");
    return rows;
}

}  // namespace model
}  // namespace simflex
