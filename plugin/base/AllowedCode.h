#pragma once
/** @file
Programs inside models: which of them may run. Everything else in a model is data and never runs.

    ModelOptions options;
    options.code.fmus = AllowedCode::Fmus::ChildProcess;  **/

namespace simflex {

struct AllowedCode {
    enum class Fmus {
        Refused,
        Described,     ///< their descriptions are read, their libraries are not loaded
        ChildProcess,  ///< each instance in a process of its own
        ThisProcess    ///< faster; one that crashes ends this process
    };
    Fmus fmus = Fmus::Refused;
    double fmuTimeout = 60;  ///< [s] that a child process may take for one answer
    bool scripts = false;    ///< of Gmsh, outside the sandbox
};

}  // namespace simflex
