#pragma once
/** @file
Writes result files. **/

#include <memory>

#include "simflex/model/Results.h"

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

    /** Begins an analysis of rows over time. **/
    void beginTransient(const std::string& analysis, const std::vector<ResultColumn>& probes,
                        int numQ, int numU);
    /** Goes on with one after its first `numRows` rows; later ones are dropped. **/
    void resumeTransient(const std::string& analysis, int numRows);
    /** @param values  of all probes, column after column
    @param q, u  empty where states are not kept **/
    void addRow(double time, const std::vector<double>& values, const std::vector<double>& q,
                const std::vector<double>& u);
    int getNumRows() const;
    /** Everything so far is on the disk, where readResults() finds it. The HDF5 file is replaced
    too, unless that would take more than a tenth of the time. **/
    void flush();

    void addStatic(const std::string& analysis, const std::vector<ResultColumn>& probes,
                   const std::vector<double>& values, const std::vector<double>& q);
    void addEigen(const std::string& analysis, const std::vector<double>& frequency,
                  const std::vector<double>& dampingRatio);
    /** @param frequency, dampingRatio  one row a speed **/
    void addCampbell(const std::string& analysis, const std::vector<double>& speeds,
                     const std::vector<std::vector<double>>& frequency,
                     const std::vector<std::vector<double>>& dampingRatio);
    void setStatistics(const std::string& analysis, const std::map<std::string, double>& values);
    /** Each text counts once. **/
    void addWarning(const std::string& text);
    /** @param analysis  need not have begun **/
    void addWarning(const std::string& analysis, const std::string& text);
    /** Replaces the HDF5 file, too. **/
    void setComplete(const std::string& analysis);

private:
    class Implementation;
    std::unique_ptr<Implementation> _impl;
};

}  // namespace model
}  // namespace simflex
