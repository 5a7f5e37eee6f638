#pragma once
/** @file
Which programs embedded in a model may run. All other content of a model is data and is never
executed.

    ModelOptions options;
    options.code.fmus = AllowedCode::Fmus::ChildProcess;  **/

namespace simflex {

struct AllowedCode {
    enum class Fmus {
        Refused,
        Described,     ///< the description is read, the library is not loaded
        ChildProcess,  ///< each instance runs in its own process
        ThisProcess    ///< faster, but a crash of the FMU ends this process
    };
    Fmus fmus = Fmus::Refused;
    double fmuTimeout = 60;  ///< time limit of a child process for one answer [s]
    bool scripts = false;    ///< Gmsh scripts, which run outside the sandbox
};

}  // namespace simflex
