#pragma once
/** @file
The journal of a result file: everything that a run records, appended record by record. Each record
carries a checksum; a torn one at the end, left by a kill or a full disk, counts as not written.
Internal to results. **/

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "simflex/model/Results.h"

namespace simflex {
namespace model {

class ResultJournal {
public:
    /** An analysis; the rows of a transient one stay in the file. **/
    struct Analysis {
        Results::Analysis contents;
        int numColumns = 0, numStates = 0;  ///< in a row
        struct Segment {
            std::uint64_t offset;  ///< of its first row's record
            int first, count;
        };
        std::vector<Segment> segments;
        std::uint64_t start = 0;  ///< end of its first record
        int numRows = 0;

        /** Numbers in a row: time, columns, states in their order. **/
        int getRowSize() const { return 1 + numColumns + numStates; }
    };

    enum class Access { Create, Append, Read };
    /** Opens; Append and Read take what the file holds.
    @throws std::runtime_error if it cannot be opened, is no journal, or is being written by another
        process. **/
    ResultJournal(const std::string& path, Access access);
    ~ResultJournal();
    ResultJournal(const ResultJournal&) = delete;
    ResultJournal& operator=(const ResultJournal&) = delete;

    /** Whether there is more than the beginning that a kill leaves; only with Access::Append it may
    be missing. **/
    bool hasHeader() const { return m_hasHeader; }
    const ResultHeader& getHeader() const { return m_header; }
    const std::vector<Analysis>& getAnalyses() const { return m_analyses; }
    /** The analysis of that name; null if there is none. **/
    const Analysis* find(const std::string& name) const;
    /** Of an analysis, which need not have begun; empty name: of all. **/
    const std::vector<std::string>& getWarnings(const std::string& analysis) const;

    /** @name Appending. Names are not checked. **/
    /**@{**/
    void addHeader(const ResultHeader& header);
    void addAnalysis(const Analysis& analysis);
    /** A row of the last analysis. **/
    void addRow(const std::vector<double>& row);
    void addStatistics(const std::string& analysis, const std::map<std::string, double>& values);
    void addEvents(const std::string& analysis,
                   const std::vector<Results::Analysis::Event>& events);
    void addComplete(const std::string& analysis);
    /** @param analysis  empty: of all **/
    void addWarning(const std::string& analysis, const std::string& text);
    /** Drops whatever came after the first `numRows` rows of an analysis. **/
    void cut(const std::string& analysis, int numRows);
    /** Waits until the disk has it all. **/
    void sync();
    /**@}**/

    /** Rows `first` … of an analysis, one behind the other. **/
    std::vector<double> readRows(const Analysis& analysis, int first, int count) const;

private:
    void scan();
    /** @throws std::runtime_error if the file has become shorter than what was written **/
    void checkSize() const;
    void append(std::uint64_t kind, const std::string& payload);
    /** Keeps a record's contents. @throws std::runtime_error if it makes no sense. **/
    void take(std::uint64_t kind, const std::string& payload, std::uint64_t offset);
    Analysis& update(const std::string& name);
    void countRow(std::uint64_t offset);

    std::string m_path;
    int m_file = -1;
    std::uint64_t m_end = 0;  ///< of the last whole record
    bool m_hasHeader = false;
    ResultHeader m_header;
    std::vector<Analysis> m_analyses;
    std::map<std::string, std::vector<std::string>> m_warnings;  ///< by analysis
    std::string m_record;                                        ///< room for one
};

}  // namespace model
}  // namespace simflex
