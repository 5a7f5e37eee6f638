#pragma once
/** @file
Exports a model as an FMU for co-simulation, FMI 2.0 or 3.0: parameters, inputs and probes are its
variables.

    FmuExportOptions options;
    options.version = 3;
    exportFmu(loadModelText("arm.yaml"), "arm.fmu", options);

The archive contains modelDescription.xml; in `resources` the model, its reduced parts and the files
it reads; in `binaries` the library simflex_fmu and, unless it is thin, copies of its
dependencies. **/

#include <string>
#include <vector>

#include "simflex/model/Session.h"

namespace simflex {

struct FmuExportOptions {
    int version = 2;      ///< FMI version: 2 or 3
    bool isThin = false;  ///< without copies of simflex's libraries
    AllowedCode code;     ///< FMUs that control the model run in the new FMU's process
    std::string library;  ///< path of simflex_fmu; empty: beside this library
    Listener listener;
};

struct FmuExportReport {
    std::vector<std::string> parameters, inputs, outputs;
    std::vector<std::string> fixed;  ///< parameters that determine reduced parts and cannot change
    int numLibraries = 0;
    double bytes = 0;  ///< size of the archive
};

/** @throws ModelError, and std::runtime_error naming a file that cannot be written or found. **/
FmuExportReport exportFmu(const ModelText& text, const std::string& path,
                          const FmuExportOptions& options = {});

namespace fmu {

/** Contents of the FMU's resources. **/
struct Manifest {
    static constexpr const char* FileName = "simflex.txt";

    std::string token;
    std::string model;                  ///< file name
    std::vector<std::string> settings;  ///< settings of the model
    std::vector<std::string> parameters, inputs, outputs;

    std::string write() const;
    /** @throws std::runtime_error if it is no manifest, or of another version of simflex. **/
    static Manifest read(const std::string& text);
};

/** Returns the value reference of a variable: parameters come first, then inputs, then outputs; 0
is the time. **/
inline unsigned getReference(size_t index) {
    return unsigned(index) + 1;
}

/** Returns the names of all columns of the probes: "height", "tip.x". **/
std::vector<std::string> listOutputs(const std::vector<model::Probe>& probes);

}  // namespace fmu
}  // namespace simflex
