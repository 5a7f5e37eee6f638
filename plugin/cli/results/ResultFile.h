#pragma once
/** @file
What a run leaves: one HDF5 file, which h5py and MATLAB read.

    /                          attributes: simflex_results = 1 (format), version ("0.1.0"), title
    /model                     text of the model file; attributes path, settings (one a line),
bodies
                               ("as_given", "rigid")
    /analyses/NAME             attribute type: transient, static, eigen, campbell
        complete               attribute: 1 once the analysis has reached its end
        time           n       [s]; transient
        probes/PROBE   n×k     attributes unit, columns (comma-separated, empty for k = 1); static:
n = 1 states/q, u    n×…     optional, Simbody's numbering statistics             attributes: steps,
iterations … frequency, damping_ratio     n      eigen speeds n; frequency, damping_ratio  n×m
campbell

Transient data grow by appending: rows are written in blocks and flushed, so that a killed run
leaves a readable file that lacks at most what came after the last flush(). Nothing carries a time
stamp: the same run gives the same bytes. **/

#include <map>
#include <memory>
#include <string>
#include <vector>

namespace simflex {
namespace cli {

/** Name, unit and columns of a probe. **/
struct ResultColumn {
    std::string name;
    std::string unit;
    std::vector<std::string> columns{""};
};

struct ResultHeader {
    std::string title;
    std::string modelPath;
    std::string modelText;
    std::vector<std::string> settings;
    bool isRigid = false;
};

/** Writes. Every method throws std::runtime_error naming the file (no space left …); rows flushed
before stay readable. **/
class ResultWriter {
public:
    /** Makes the file anew. **/
    ResultWriter(const std::string& path, const ResultHeader& header);
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
    /** Everything so far is on the disk, in a file that can be read. **/
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
    void setComplete(const std::string& analysis);

private:
    class Implementation;
    std::unique_ptr<Implementation> _impl;
};

/** Reads; checks every shape. @throws std::runtime_error naming file and object. **/
struct ResultData {
    struct Series {
        ResultColumn column;
        std::vector<std::vector<double>> rows;  ///< n×k
    };
    struct Analysis {
        std::string name, type;
        bool isComplete = false;
        std::vector<double> time;
        std::vector<Series> probes;
        std::vector<std::vector<double>> q, u;
        std::vector<double> speeds;
        std::vector<std::vector<double>> frequency, dampingRatio;  ///< eigen: one row
        std::map<std::string, double> statistics;
    };
    ResultHeader header;
    std::vector<Analysis> analyses;
};
ResultData readResults(const std::string& path);

/** One CSV file: time, then every column as "probe.x [m]". Numbers with 17 digits. **/
void writeResultCsv(const std::string& path, const ResultData::Analysis& analysis);

}  // namespace cli
}  // namespace simflex
