#pragma once
/** @file
A model as an FMU for co-simulation, FMI 2.0 or 3.0: parameters, inputs and probes are its
variables.

    FmuExportOptions options;
    options.version = 3;
    exportFmu(loadModelText("arm.yaml"), "arm.fmu", options);

The archive holds modelDescription.xml; in `resources` the model, its reduced parts and the files
that it reads; in `binaries` the library simflex_fmu and, unless it is thin, a copy of all that this
needs. **/

#include <string>
#include <vector>

#include "simflex/model/Session.h"

namespace simflex {

struct FmuExportOptions {
    int version = 2;      ///< of FMI: 2 or 3
    bool isThin = false;  ///< without a copy of simflex's libraries
    AllowedCode code;  ///< FMUs that control the model run where the new one does: in its process
    std::string library;  ///< path of simflex_fmu; empty: beside the library that this is in
    Listener listener;
};

struct FmuExportReport {
    std::vector<std::string> parameters, inputs, outputs;
    std::vector<std::string>
        fixed;  ///< parameters that parts were reduced with: they cannot change
    int numLibraries = 0;
    double bytes = 0;  ///< of the archive
};

/** @throws ModelError, and std::runtime_error that names what cannot be written or found. **/
FmuExportReport exportFmu(const ModelText& text, const std::string& path,
                          const FmuExportOptions& options = {});

namespace fmu {

/** What the unit finds in its resources. **/
struct Manifest {
    static constexpr const char* FileName = "simflex.txt";

    std::string token;
    std::string model;                  ///< name of the file
    std::vector<std::string> settings;  ///< of the model
    std::vector<std::string> parameters, inputs, outputs;

    std::string write() const;
    /** @throws std::runtime_error if it is none, or of another version of simflex. **/
    static Manifest read(const std::string& text);
};

/** Number by which a variable is known: parameters come first, then inputs, then outputs; 0 is the
time. **/
inline unsigned getReference(size_t index) {
    return unsigned(index) + 1;
}

/** Names of all columns of the probes: "height", "tip.x". **/
std::vector<std::string> listOutputs(const std::vector<model::Probe>& probes);

}  // namespace fmu
}  // namespace simflex
