#pragma once
/** @file
The journal of a result file: everything that a run records, one record after another. Each record
has a checksum; an incomplete last record, after a kill or on a full disk, counts as not written.
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
    /** An analysis; the rows of a transient one remain in the file. **/
    struct Analysis {
        Results::Analysis contents;
        int numColumns = 0, numStates = 0;  ///< in a row
        struct Segment {
            std::uint64_t offset;  ///< of the record of its first row
            int first, count;
        };
        std::vector<Segment> segments;
        std::uint64_t start = 0;  ///< end of its first record
        int numRows = 0;

        /** Numbers in a row: time, columns, then states in the order of ResultStates. **/
        int getRowSize() const { return 1 + numColumns + numStates; }
    };

    enum class Access { Create, Append, Read };
    /** Opens the journal; Append and Read load its contents.
    @throws std::runtime_error if it cannot be opened, is not a journal, or is being written by
    another process. **/
    ResultJournal(const std::string& path, Access access);
    ~ResultJournal();
    ResultJournal(const ResultJournal&) = delete;
    ResultJournal& operator=(const ResultJournal&) = delete;

    /** False if a kill left only the start of the file. Access::Read refuses such a file. **/
    bool hasHeader() const { return m_hasHeader; }
    const ResultHeader& getHeader() const { return m_header; }
    const std::vector<Analysis>& getAnalyses() const { return m_analyses; }
    /** The analysis of that name; null if none. **/
    const Analysis* find(const std::string& name) const;
    /** Warnings of an analysis, which need not have begun; empty name: of all analyses. **/
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
    /** Drops everything after the first `numRows` rows of an analysis. **/
    void cut(const std::string& analysis, int numRows);
    /** Waits until all data is on the disk. **/
    void sync();
    /**@}**/

    /** Reads rows `first` … of an analysis, one behind the other. **/
    std::vector<double> readRows(const Analysis& analysis, int first, int count) const;

private:
    void scan();
    /** @throws std::runtime_error if the file is shorter than what was written **/
    void checkSize() const;
    void append(std::uint64_t kind, const std::string& payload);
    /** Applies a record.
    @throws std::runtime_error if it is invalid. **/
    void take(std::uint64_t kind, const std::string& payload, std::uint64_t offset);
    Analysis& update(const std::string& name);
    void countRow(std::uint64_t offset);

    std::string m_path;
    int m_file = -1;
    std::uint64_t m_end = 0;  ///< end of the last complete record
    bool m_hasHeader = false;
    ResultHeader m_header;
    std::vector<Analysis> m_analyses;
    std::map<std::string, std::vector<std::string>> m_warnings;  ///< by analysis
    std::string m_record;                                        ///< buffer for a record
};

}  // namespace model
}  // namespace simflex
