#pragma once
/** @file
What a run leaves: one HDF5 file, which h5py and MATLAB read.

    /              attributes simflex_results = 1 (version of the format), version ("0.1.0"), title
    /model         text of the model file; attributes path, settings (one a line),
                   bodies ("as_given" or "rigid")
    /warnings      texts: what changes the meaning of all results; left out where there are none
    /analyses/NAME attributes type (transient, static, eigen, campbell), index (0, 1 … in the order
                   of the run), complete (1 once the analysis has reached its end)
        time              n    [s]; transient
        probes/PROBE      n×k  attributes unit, columns (comma-separated; empty for k = 1), index;
                               static: n = 1
        states/q, u       n×…  Simbody's numbering; left out where states are not kept
        statistics             attributes: steps, iterations …
        warnings               texts, as above: of this analysis
        speeds            n    campbell
        frequency, damping_ratio  n modes of eigen [Hz], n speeds × modes of campbell

The file is replaced as a whole, by renaming: at no moment is it half written. What has come since
stands in a journal beside it, FILE.rows, which a run that ends removes; readResults() takes what a
killed run has left there, and a run that goes on begins with it. So a killed run loses at most the
row being written, and a power cut what came after the last flush(). Nothing carries a time stamp:
the same run gives the same bytes, flushed and resumed or not. **/

#include <map>
#include <memory>
#include <string>
#include <vector>

namespace simflex {
namespace model {

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

/** What a file holds. **/
struct ResultData {
    struct Series {
        ResultColumn column;
        std::vector<std::vector<double>> rows;  ///< n×k; static: one row
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
        std::vector<std::string> warnings;
    };
    ResultHeader header;
    std::vector<std::string> warnings;  ///< of all analyses
    std::vector<Analysis> analyses;
};

/** Writes. Every method throws std::runtime_error naming the file (no space left …); rows flushed
before stay readable. **/
class ResultWriter {
public:
    /** Makes the file anew, with the analyses `kept` of an earlier run of the same model.
    @throws also if another run is writing it. **/
    ResultWriter(const std::string& path, const ResultHeader& header,
                 const std::vector<ResultData::Analysis>& kept = {});
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

enum class ReadStates { Yes, No };
/** Reads; checks every shape. @throws std::runtime_error naming file and object. **/
ResultData readResults(const std::string& path, ReadStates states = ReadStates::Yes);

/** One CSV file: time, then every column as "probe.x [m]"; of eigen and campbell the frequencies.
Numbers with 17 digits. @throws std::runtime_error. **/
void writeResultCsv(const std::string& path, const ResultData::Analysis& analysis);

}  // namespace model
}  // namespace simflex
