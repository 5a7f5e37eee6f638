#pragma once
/** @file
The results of a run: one HDF5 file, readable by h5py and MATLAB.

    /              attributes simflex_results = 1 (version of the format), version ("0.1.0"), title
    /model         text of the model file; attributes path, settings (one a line),
                   bodies ("as_given" or "rigid")
    /warnings      texts that affect the meaning of all results; omitted if there are none
    /analyses/NAME attributes type (transient, static, eigen, campbell, linear,
                   frequency_response), index (0, 1 … in the order of the run),
                   complete (1 once the analysis has reached its end)
        time              n    [s]; transient
        probes/PROBE      n×k  attributes unit, columns (comma-separated; empty for k = 1), index;
                               static: n = 1, or with path its points, of which the last is the
                               result; "PROBE error" in runs with error bars
        states/q, u, udot n×…  Simbody's numbering; omitted if states are not kept; static: as many
                               rows as probes; eigen: one row, without udot and multipliers
        states/z               states of controllers, filters and inputs
        states/holding         locks and releases by events: FlexibleBodySubsystem::getHolding()
        states/multipliers     of constraints and friction, 0 where one is released
        states/moment     n×2  work of loads and dampers since the start [J], the State's own time
        states/columns/q …     names of the columns of each
        statistics             attributes: steps, iterations …; transient: integration_seconds and
                               output_seconds of wall-clock time; with controllers fmu_exchanges,
                               fmu_seconds and fmu_library_seconds, a part of the former
        warnings               texts, as above: of this analysis
        speeds            n    campbell
        path              n×3  static with path: load factor, number of independent unstable
                               motions, and 1 at a limit point, 2 at a bifurcation
        inputs, outputs        names of numbers of the model and columns of probes; linear and
                               frequency_response
        input_units, output_units
        matrices/A, B, C, D    linear
        matrices/magnitude, phase  n×(outputs·inputs), all inputs of the first output first;
                               frequency_response, phase [degrees]
        effective_mass         n×3, eigen with participation [kg]; the total mass is the
                               statistic "mass"
        shape_real, shape_imaginary  n×outputs, eigen with outputs
        mode_real, mode_imaginary  n×u, eigen: displacements in the directions of Simbody's
                               speeds; omitted if states are not kept
        M, D, K, G             eigen with matrices: see Linearization
        matrices/density       n×outputs, frequency_response with spectra; the rms values are the
                               statistics "rms of OUTPUT"
        frequency, damping_ratio  n modes of eigen [Hz], n speeds × modes of campbell;
                               frequency_response: frequency alone [Hz]

The file is replaced as a whole, by renaming, so that it is never half written. Newer records are in
a journal beside it, FILE.rows, which is removed when the run ends. readResults() also reads the
journal of a killed run, and a resumed run continues from it. A killed run therefore loses at most
the row being written, and a power failure everything after the last flush(). Nothing has a time
stamp: apart from the seconds above, the same run writes the same bytes, flushed and resumed or not.
**/

#include <map>
#include <string>
#include <vector>

#include "simflex/model/RunOptions.h"

namespace simflex {

struct ModelText;

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
    /** Version of simflex that wrote the file. **/
    std::string version;
    /** Checksums of everything else that the results depend on, by description. **/
    std::map<std::string, std::string> inputs;
};

/** Contents of a result file.

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
        /** Column names of these arrays, by their names in the file. **/
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
        std::vector<Event> events;  ///< transient: in order of occurrence
        std::vector<std::string> warnings;

        bool hasPath() const { return matrices.count("path") > 0; }  ///< path of equilibria

        /** @throws std::out_of_range naming the existing probes. **/
        const Series& findProbe(const std::string& probe) const;
    };
    ResultHeader header;
    std::vector<std::string> warnings;  ///< of all analyses
    std::vector<Analysis> analyses;

    /** @throws std::out_of_range naming the existing analyses. **/
    const Analysis& findAnalysis(const std::string& analysis) const;
};

/** Suffix of the probe that holds the error of another one, see analyses/ErrorBars.h. **/
constexpr const char* ErrorSuffix = " error";

/** Arrays of the group `states`, in this order. **/
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
/** Reads a result file and checks all shapes.
@throws std::runtime_error naming file and object. **/
Results readResults(const std::string& path, ReadStates states = ReadStates::Yes);

/** Path of a file that belongs to a result file: "run.h5" and ".csv" give "run.csv". Only HDF5's
own extensions are replaced, so that the files of "a.1" and "a.2" stay apart. **/
std::string makePathBeside(const std::string& results, const std::string& ending);

/** Writes one CSV file: time, then every column as "probe.x [m]"; frequencies of eigen and
campbell, matrices of linear, magnitudes and phases of frequency_response. Numbers have 17 digits.
@throws std::runtime_error. **/
void writeResultCsv(const std::string& path, const Results::Analysis& analysis);

/** Runs the analyses of a model and writes their result file, as `simflex run` does.
@throws ModelError; Cancelled if the listener stops it, after everything was saved;
std::runtime_error if something fails or could only be done in part. **/
Results runAnalyses(const ModelText& text, const RunOptions& options = {});

}  // namespace simflex
