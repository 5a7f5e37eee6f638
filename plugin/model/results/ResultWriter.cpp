#include "simflex/model/results/ResultWriter.h"

#include <algorithm>
#include <filesystem>
#include <stdexcept>

#include "simflex/base/InputFile.h"
#include "simflex/base/SecondsSince.h"
#include "simflex/base/UnfinishedFile.h"
#include "simflex/model/file/NearestName.h"
#include "simflex/model/results/ResultLayout.h"
#include "simflex/part/FileChecksum.h"

namespace simflex {
namespace model {
namespace {

namespace fs = std::filesystem;
constexpr double MostOfTheTime = 0.1;  // spent on replacing the file in flush()

bool isSameRun(const ResultHeader& a, const ResultHeader& b) {
    return a.title == b.title && a.modelPath == b.modelPath && a.modelText == b.modelText &&
           joinNames(a.settings, "\n") == joinNames(b.settings, "\n") && a.isRigid == b.isRigid &&
           a.inputs == b.inputs;
}

/** True if the journal has everything in the file and is of the same run. **/
bool continues(const ResultJournal& journal, const Results& file) {
    if (!isSameRun(journal.getHeader(), file.header)) return false;
    for (const auto& analysis : file.analyses) {
        const auto* found = journal.find(analysis.name);
        if (!found || found->contents.type != analysis.type ||
            (analysis.isComplete && !found->contents.isComplete) ||
            found->numRows < int(analysis.time.size()))
            return false;
    }
    return true;
}

/** Adds the rows of a transient analysis from the journal. **/
void fillRows(const ResultJournal& journal, const ResultJournal::Analysis& analysis,
              ReadStates states, Results::Analysis& result) {
    constexpr int RowsPerBlock = 256;
    const size_t rowSize = size_t(analysis.getRowSize());
    for (int first = 0; first < analysis.numRows; first += RowsPerBlock) {
        const int count = std::min(RowsPerBlock, analysis.numRows - first);
        const std::vector<double> rows = journal.readRows(analysis, first, count);
        for (size_t k = 0; k < size_t(count); ++k) {
            auto at = rows.begin() + std::ptrdiff_t(k * rowSize);
            const auto take = [&](size_t width) {
                at += std::ptrdiff_t(width);
                return std::vector<double>(at - std::ptrdiff_t(width), at);
            };
            result.time.push_back(take(1)[0]);
            for (auto& series : result.probes)
                series.rows.push_back(take(series.column.columns.size()));
            if (states == ReadStates::No || analysis.numStates == 0) continue;
            for (const ResultState& state : ResultStates)
                if (const size_t width = result.stateColumns[state.name].size(); width > 0)
                    (result.*state.rows).push_back(take(width));
        }
    }
    checkTimes(result.time);
}

Results readJournal(const ResultJournal& journal, ReadStates states) {
    Results data;
    data.header = journal.getHeader();
    data.warnings = journal.getWarnings("");
    for (const auto& analysis : journal.getAnalyses()) {
        data.analyses.push_back(analysis.contents);
        data.analyses.back().warnings = journal.getWarnings(analysis.contents.name);
        if (states == ReadStates::No)
            for (const ResultState& state : ResultStates)
                (data.analyses.back().*state.rows).clear();
        fillRows(journal, analysis, states, data.analyses.back());
    }
    return data;
}

void checkName(const std::string& what, const std::string& name) {
    if (name.empty() || name == "." || name.find('/') != std::string::npos)
        throw std::runtime_error(
            what + " cannot be called '" + name +
            "' in a result file: a name is not empty, not '.', and has no '/'");
}

void checkCount(const char* what, size_t found, size_t expected) {
    if (found != expected)
        throw std::runtime_error(std::to_string(found) + " " + what + ", expected " +
                                 std::to_string(expected));
}

void checkShapes(const Results::Analysis& analysis) {
    for (const Results::Series& series : analysis.probes) {
        checkName("a probe", series.column.name);
        for (const std::string& column : series.column.columns)
            if (column.find(',') != std::string::npos)
                throw std::runtime_error("column '" + column + "' of probe '" + series.column.name +
                                         "' has a comma in its name");
        for (const auto& row : series.rows)
            checkCount("values of a probe", row.size(), series.column.columns.size());
    }
    for (const ResultState& state : ResultStates)
        for (const auto& row : analysis.*state.rows) {
            const auto columns = analysis.stateColumns.find(state.name);
            checkCount("names of columns of states",
                       columns == analysis.stateColumns.end() ? 0 : columns->second.size(),
                       row.size());
        }
    const auto &frequency = analysis.frequency, &damping = analysis.dampingRatio;
    if (analysis.type == "campbell")
        checkCount("rows of frequencies", frequency.size(), analysis.speeds.size());
    if (analysis.type == "frequency_response") return;
    checkCount("rows of damping ratios", damping.size(), frequency.size());
    for (size_t k = 0; k < frequency.size(); ++k) {
        checkCount("frequencies at a speed", frequency[k].size(), frequency[0].size());
        checkCount("damping ratios at a speed", damping[k].size(), frequency[0].size());
    }
}

}  // namespace

/** Runs `work` and adds the file's name to its errors. **/
template <class Work>
void ResultWriter::guard(const Work& work) {
    try {
        work();
    } catch (const std::runtime_error& error) {
        throw std::runtime_error("result file '" + m_path + "': " + error.what());
    }
}

ResultWriter::ResultWriter(const std::string& path, const ResultHeader& header,
                           const std::vector<Results::Analysis>& kept)
    : m_path(path) {
    guard([&] {
        removeLeftovers();
        m_journal.emplace(getJournalPath(path), ResultJournal::Access::Create);
        m_journal->addHeader(header);
        for (const Results::Analysis& analysis : kept) append(analysis);
        replaceFile();
    });
}

ResultWriter::ResultWriter(const std::string& path) : m_path(path) {
    guard([&] {
        removeLeftovers();
        reopen();
        replaceFile();
    });
}

ResultWriter::~ResultWriter() {
    try {
        if (m_isChanged) replaceFile();
        fs::remove(getJournalPath(m_path));
    } catch (const std::exception&) {  // the journal remains, with all data
    }
}

void ResultWriter::removeLeftovers() const {
    const fs::path file(m_path);
    removeUnfinishedFiles(file.parent_path(), file.filename().string() + ".");
}

/** Continues the journal of a killed run, or makes one from the file. **/
void ResultWriter::reopen() {
    const Results file = readResultLayout(m_path, ReadStates::Yes);
    const std::string path = getJournalPath(m_path);
    if (fs::exists(path)) {
        m_journal.emplace(path, ResultJournal::Access::Append);
        if (m_journal->hasHeader() && continues(*m_journal, file)) return;
        m_journal.reset();
    }
    beginJournal(file);
}

void ResultWriter::beginJournal(const Results& contents) {
    m_journal.emplace(getJournalPath(m_path), ResultJournal::Access::Create);
    m_journal->addHeader(contents.header);
    for (const std::string& warning : contents.warnings) m_journal->addWarning("", warning);
    for (const Results::Analysis& analysis : contents.analyses) append(analysis);
}

/** Removes an analysis from the journal, since only the last one can be continued. **/
Results::Analysis ResultWriter::takeOut(const std::string& name) {
    replaceFile();  // preserves all data until the journal has it again
    Results rest = readJournal(*m_journal, ReadStates::Yes);
    m_journal.reset();
    const auto found = std::find_if(rest.analyses.begin(), rest.analyses.end(),
                                    [&](const Results::Analysis& one) { return one.name == name; });
    Results::Analysis taken = std::move(*found);
    rest.analyses.erase(found);
    beginJournal(rest);
    return taken;
}

/** Writes a new HDF5 file beside the old one and renames it. **/
void ResultWriter::replaceFile() {
    const Clock::time_point start = Clock::now();
    UnfinishedFile file(m_path);
    writeResultLayout(file.getPath(), *m_journal);
    appendChecksum(file.getPath());
    file.finish();
    m_replaced = Clock::now();
    m_cost = secondsSince(start);
    m_isChanged = false;
}

ResultJournal& ResultWriter::updJournal() {
    m_isChanged = true;
    return *m_journal;
}

void ResultWriter::begin(const ResultJournal::Analysis& analysis) {
    const std::string& name = analysis.contents.name;
    checkName("an analysis", name);
    if (const auto* earlier = m_journal->find(name)) {
        if (earlier->contents.isComplete)
            throw std::runtime_error("it has an analysis '" + name + "' already");
        takeOut(name);
    }
    updJournal().addAnalysis(analysis);
}

void ResultWriter::append(const Results::Analysis& source) {
    checkShapes(source);
    ResultJournal::Analysis analysis;
    analysis.contents = source;
    analysis.contents.isComplete = false;
    if (source.type == "transient") {  // rows follow
        for (Results::Series& series : analysis.contents.probes) series.rows.clear();
        for (const ResultState& state : ResultStates) {
            (analysis.contents.*state.rows).clear();
            if (!source.time.empty() && (source.*state.rows).empty())
                analysis.contents.stateColumns.erase(state.name);
        }
    }
    for (const auto& [name, columns] : analysis.contents.stateColumns)
        analysis.numStates += int(columns.size());
    begin(analysis);
    for (const std::string& warning : source.warnings)  // before the rows, which may be cut
        m_journal->addWarning(source.name, warning);
    for (size_t k = 0; k < source.time.size(); ++k) {
        std::vector<double> values;
        for (const auto& series : source.probes)
            values.insert(values.end(), series.rows[k].begin(), series.rows[k].end());
        std::vector<double> states;
        for (const ResultState& state : ResultStates)
            if (const auto& rows = source.*state.rows; !rows.empty())
                states.insert(states.end(), rows[k].begin(), rows[k].end());
        appendRow(source.time[k], values, states);
    }
    if (!source.statistics.empty()) m_journal->addStatistics(source.name, source.statistics);
    if (!source.events.empty()) m_journal->addEvents(source.name, source.events);
    if (source.isComplete) m_journal->addComplete(source.name);
}

void ResultWriter::appendRow(double time, const std::vector<double>& values,
                             const std::vector<double>& states) {
    const auto& analyses = m_journal->getAnalyses();
    if (analyses.empty() || analyses.back().contents.type != "transient")
        throw std::runtime_error("no transient analysis has begun");
    checkCount("values in a row", values.size(), size_t(analyses.back().numColumns));
    checkCount("numbers of states in a row", states.size(), size_t(analyses.back().numStates));
    m_row.assign(1, time);
    m_row.insert(m_row.end(), values.begin(), values.end());
    m_row.insert(m_row.end(), states.begin(), states.end());
    updJournal().addRow(m_row);
}

void ResultWriter::add(const Results::Analysis& analysis) {
    guard([&] {
        append(analysis);
        if (analysis.isComplete) replaceFile();
    });
}

void ResultWriter::beginTransient(const std::string& name, const std::vector<ResultColumn>& probes,
                                  const std::map<std::string, std::vector<std::string>>& states) {
    guard([&] {
        ResultJournal::Analysis analysis;
        analysis.contents.name = name;
        analysis.contents.type = "transient";
        for (const ResultColumn& probe : probes) analysis.contents.probes.push_back({probe, {}});
        checkShapes(analysis.contents);
        analysis.contents.stateColumns = states;
        for (const auto& [table, columns] : states) analysis.numStates += int(columns.size());
        begin(analysis);
    });
}

void ResultWriter::resumeTransient(const std::string& name, int numRows) {
    guard([&] {
        const auto* analysis = m_journal->find(name);
        if (!analysis || analysis->contents.type != "transient")
            throw std::runtime_error("it has no transient analysis '" + name + "' to continue");
        if (analysis != &m_journal->getAnalyses().back()) append(takeOut(name));
        updJournal().cut(name, numRows);
    });
}

void ResultWriter::addRow(double time, const std::vector<double>& values,
                          const std::vector<double>& states) {
    guard([&] { appendRow(time, values, states); });
}

void ResultWriter::flush() {
    if (!m_isChanged) return;
    guard([&] {
        m_journal->sync();
        if (secondsSince(m_replaced) * MostOfTheTime > m_cost) replaceFile();
    });
}

void ResultWriter::setStatistics(const std::string& name,
                                 const std::map<std::string, double>& values) {
    guard([&] { updJournal().addStatistics(name, values); });
}

void ResultWriter::setEvents(const std::string& name,
                             const std::vector<Results::Analysis::Event>& events) {
    guard([&] { updJournal().addEvents(name, events); });
}

void ResultWriter::addWarning(const std::string& analysis, const std::string& text) {
    const std::vector<std::string>& known = m_journal->getWarnings(analysis);
    if (std::find(known.begin(), known.end(), text) != known.end()) return;
    guard([&] { updJournal().addWarning(analysis, text); });
}

void ResultWriter::setComplete(const std::string& name) {
    guard([&] {
        updJournal().addComplete(name);
        replaceFile();
    });
}

}  // namespace model

using namespace model;

Results readResults(const std::string& path, ReadStates states) {
    if (!isInputFile(path)) throw std::runtime_error("result file '" + path + "' does not exist");
    try {
        checkChecksum(path);
        Results file = readResultLayout(path, states);
        const std::string journalPath = getJournalPath(path);
        if (!fs::exists(journalPath)) return file;
        try {
            const ResultJournal journal(journalPath, ResultJournal::Access::Read);
            if (continues(journal, file)) return readJournal(journal, states);
        } catch (const std::runtime_error&) {  // ignore an unusable journal
        }
        return file;
    } catch (const std::exception& error) {
        throw std::runtime_error("result file '" + path + "' cannot be used: " + error.what());
    }
}

}  // namespace simflex
