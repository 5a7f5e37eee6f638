#pragma once
/** @file
Writes result files. **/

#include <chrono>
#include <optional>

#include "simflex/model/results/ResultJournal.h"

namespace simflex {
namespace model {

/** Writes a result file. Every method throws std::runtime_error naming the file (disk full …); rows
flushed before remain readable. **/
class ResultWriter {
public:
    /** Creates the file, with the analyses `kept` from an earlier run of the same model.
    @throws also if another run is writing it. **/
    ResultWriter(const std::string& path, const ResultHeader& header,
                 const std::vector<Results::Analysis>& kept = {});
    /** Continues the file of an earlier run. **/
    explicit ResultWriter(const std::string& path);
    ~ResultWriter();
    ResultWriter(const ResultWriter&) = delete;
    ResultWriter& operator=(const ResultWriter&) = delete;

    /** Starts a transient analysis, replacing an incomplete one of that name.
    @param states  names of the state columns, by their array names in Results **/
    void beginTransient(const std::string& analysis, const std::vector<ResultColumn>& probes,
                        const std::map<std::string, std::vector<std::string>>& states = {});
    /** Continues an analysis after its first `numRows` rows; later rows are dropped. **/
    void resumeTransient(const std::string& analysis, int numRows);
    /** @param values  of all probes, column after column
    @param states  one after another in the order of ResultStates **/
    void addRow(double time, const std::vector<double>& values,
                const std::vector<double>& states = {});
    /** Writes everything so far to the disk, where readResults() finds it. Also replaces the HDF5
    file, unless that would take more than a tenth of the run time. **/
    void flush();

    /** Adds a whole analysis, replacing an incomplete one of that name. A complete analysis also
    replaces the HDF5 file. **/
    void add(const Results::Analysis& analysis);
    void setStatistics(const std::string& analysis, const std::map<std::string, double>& values);
    void setEvents(const std::string& analysis,
                   const std::vector<Results::Analysis::Event>& events);
    /** Adds a warning unless it exists already.
    @param analysis  need not have begun; empty: all **/
    void addWarning(const std::string& analysis, const std::string& text);
    /** Also replaces the HDF5 file. **/
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
    double m_cost = 0;  ///< duration of the last replacement [s]
};

}  // namespace model
}  // namespace simflex
