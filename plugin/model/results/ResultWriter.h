#pragma once
/** @file
Writes result files. **/

#include <chrono>
#include <optional>

#include "simflex/model/results/ResultJournal.h"

namespace simflex {
namespace model {

/** Writes. Every method throws std::runtime_error naming the file (no space left …); rows flushed
before stay readable. **/
class ResultWriter {
public:
    /** Makes the file anew, with the analyses `kept` of an earlier run of the same model.
    @throws also if another run is writing it. **/
    ResultWriter(const std::string& path, const ResultHeader& header,
                 const std::vector<Results::Analysis>& kept = {});
    /** Goes on with a file that was left by a run: reopens it. **/
    explicit ResultWriter(const std::string& path);
    ~ResultWriter();
    ResultWriter(const ResultWriter&) = delete;
    ResultWriter& operator=(const ResultWriter&) = delete;

    /** Begins an analysis of rows over time; one of that name that is not complete is dropped.
    @param states  columns of states that are kept, by Results' names of them **/
    void beginTransient(const std::string& analysis, const std::vector<ResultColumn>& probes,
                        const std::map<std::string, std::vector<std::string>>& states = {});
    /** Goes on with one after its first `numRows` rows; its later ones are dropped. **/
    void resumeTransient(const std::string& analysis, int numRows);
    /** @param values  of all probes, column after column
    @param states  one behind the other in the order of ResultStates **/
    void addRow(double time, const std::vector<double>& values,
                const std::vector<double>& states = {});
    /** Everything so far is on the disk, where readResults() finds it. The HDF5 file is replaced
    too, unless that would take more than a tenth of the time. **/
    void flush();

    /** A whole analysis, in the place of one of that name that is not complete. A complete one
    replaces the HDF5 file. **/
    void add(const Results::Analysis& analysis);
    void setStatistics(const std::string& analysis, const std::map<std::string, double>& values);
    void setEvents(const std::string& analysis,
                   const std::vector<Results::Analysis::Event>& events);
    /** Each text counts once. @param analysis  need not have begun; empty: all **/
    void addWarning(const std::string& analysis, const std::string& text);
    /** Replaces the HDF5 file, too. **/
    void setComplete(const std::string& analysis);

private:
    using Clock = std::chrono::steady_clock;

    template <class Work>
    void guard(const Work& work);
    void removeLeftovers() const;
    void reopen();
    void beginJournal(const Results& contents);
    Results::Analysis takeOut(const std::string& name);
    void replaceFile();
    ResultJournal& updJournal();
    void begin(const ResultJournal::Analysis& analysis);
    void append(const Results::Analysis& analysis);
    void appendRow(double time, const std::vector<double>& values,
                   const std::vector<double>& states);

    std::string m_path;
    std::optional<ResultJournal> m_journal;
    std::vector<double> m_row;
    bool m_isChanged = true;
    Clock::time_point m_replaced = Clock::now();
    double m_cost = 0;  ///< of the last replacement [s]
};

}  // namespace model
}  // namespace simflex
