#pragma once
/** @file
What a run leaves: one HDF5 file, which h5py and MATLAB read.

    /              attributes simflex_results = 1 (version of the format), version ("0.1.0"), title
    /model         text of the model file; attributes path, settings (one a line),
                   bodies ("as_given" or "rigid")
    /warnings      texts: what changes the meaning of all results; left out where there are none
    /analyses/NAME attributes type (transient, static, eigen, campbell, linear,
                   frequency_response), index (0, 1 … in the order
                   of the run), complete (1 once the analysis has reached its end)
        time              n    [s]; transient
        probes/PROBE      n×k  attributes unit, columns (comma-separated; empty for k = 1), index;
                               static: n = 1, with path its points, of which the last is the
                               result; "PROBE error" of runs with error bars
        states/q, u, udot n×…  Simbody's numbering; left out where states are not kept; as many
                               rows as probes of static, one of eigen, which has no udot and
multipliers states/z               values of states of controllers, filters and inputs
        states/holding         what events lock and release: FlexibleBodySubsystem::getHolding()
        states/multipliers     of constraints and friction, 0 where one is released
        states/moment     n×2  work of loads and dampers since the start [J], the State's own time
        states/columns/q …     names of columns of each
        statistics             attributes: steps, iterations …, of transient integration_seconds and
                               output_seconds: what each took by the clock; with controllers
                               fmu_exchanges, fmu_seconds and, of these, fmu_library_seconds
        warnings               texts, as above: of this analysis
        speeds            n    campbell
        path              n×3  static with path: the loads' factor, independent motions in which it
                               falls away, and 1 at a limit point, 2 at a bifurcation
        inputs, outputs        names of numbers of the model and columns of probes; linear and
                               frequency_response
        input_units, output_units
        matrices/A, B, C, D    linear
        matrices/magnitude, phase  n×(outputs·inputs), the inputs of the first output first;
                               frequency_response, phase [degrees]
        effective_mass         n×3 of eigen with participation [kg]; that of all bodies is a
                               statistic, "mass"
        shape_real, shape_imaginary  n×outputs, of eigen with outputs
        mode_real, mode_imaginary  n×u of eigen: displacements in the directions of Simbody's
                               speeds; left out where states are not kept
        M, D, K, G             of eigen with matrices: see Linearization
        matrices/density       n×outputs, of frequency_response with spectra; their effective
                               values are statistics, "rms of OUTPUT"
        frequency, damping_ratio  n modes of eigen [Hz], n speeds × modes of campbell; the
                               frequencies alone: of frequency_response [Hz]

The file is replaced as a whole, by renaming: at no moment is it half written. What has come since
stands in a journal beside it, FILE.rows, which a run that ends removes; readResults() takes what a
killed run has left there, and a run that goes on begins with it. So a killed run loses at most the
row being written, and a power cut what came after the last flush(). Nothing carries a time stamp:
but for these seconds the same run gives the same bytes, flushed and resumed or not. **/

#include <map>
#include <string>
#include <vector>

#include "simflex/model/RunOptions.h"

namespace simflex {

struct ModelText;

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
    /** Of simflex, that wrote the file. **/
    std::string version;
    /** Checksums of what the results depend on beside text and settings, by what they are of. **/
    std::map<std::string, std::string> inputs;
};

/** What a file holds.

    const Results results = runAnalyses(loadModelText("crank.yaml"));
    for (const auto& row : results.findAnalysis("swing").findProbe("tip").rows) plot(row[0]);  **/
struct Results {
    struct Series {
        ResultColumn column;
        std::vector<std::vector<double>> rows;  ///< n×k; static: one row
    };
    struct Analysis {
        std::string name, type;
        bool isComplete = false;
        std::vector<double> time;
        std::vector<Series> probes;
        std::vector<std::vector<double>> q, u, z, holding, uDot, multipliers, moment;
        /** Names of columns of these, by their names in the file; those of q of a static one. **/
        std::map<std::string, std::vector<std::string>> stateColumns;
        std::vector<double> speeds;
        std::vector<std::vector<double>> frequency, dampingRatio;  ///< eigen: one row
        std::vector<std::string> inputs, outputs, inputUnits, outputUnits;
        std::map<std::string, std::vector<std::vector<double>>> matrices;  ///< as above
        std::map<std::string, double> statistics;
        struct Event {
            std::string name;
            double time;
        };
        std::vector<Event> events;  ///< transient: what has happened, in its order
        std::vector<std::string> warnings;

        bool hasPath() const { return matrices.count("path") > 0; }  ///< of equilibria

        /** @throws std::out_of_range naming those there are. **/
        const Series& findProbe(const std::string& probe) const;
    };
    ResultHeader header;
    std::vector<std::string> warnings;  ///< of all analyses
    std::vector<Analysis> analyses;

    /** @throws std::out_of_range naming those there are. **/
    const Analysis& findAnalysis(const std::string& analysis) const;
};

/** Behind a probe's name: that of its error, see analyses/ErrorBars.h. **/
constexpr const char* ErrorSuffix = " error";

/** What stands in `states`, in this order. **/
struct ResultState {
    const char* name;
    std::vector<std::vector<double>> Results::Analysis::*rows;
};
inline const ResultState ResultStates[] = {
    {"q", &Results::Analysis::q},          {"u", &Results::Analysis::u},
    {"z", &Results::Analysis::z},          {"holding", &Results::Analysis::holding},
    {"udot", &Results::Analysis::uDot},    {"multipliers", &Results::Analysis::multipliers},
    {"moment", &Results::Analysis::moment}};

enum class ReadStates { Yes, No };
/** Reads; checks every shape. @throws std::runtime_error naming file and object. **/
Results readResults(const std::string& path, ReadStates states = ReadStates::Yes);

/** The name of a file that goes with results: "run.h5" and ".csv" make "run.csv". Any other ending
than that of HDF5 is part of the name, so that what belongs to "a.1" and "a.2" stays apart. **/
std::string makePathBeside(const std::string& results, const std::string& ending);

/** One CSV file: time, then every column as "probe.x [m]"; of eigen and campbell the frequencies;
of linear the matrices, of frequency_response magnitudes and phases. Numbers with 17 digits. @throws
std::runtime_error. **/
void writeResultCsv(const std::string& path, const Results::Analysis& analysis);

/** Does the analyses of a model and writes their result file, as `simflex run` does.
@throws ModelError; Cancelled if the listener stops it, after everything was kept;
    std::runtime_error if something fails, or could be done in part only. **/
Results runAnalyses(const ModelText& text, const RunOptions& options = {});

}  // namespace simflex
