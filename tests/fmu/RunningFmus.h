#pragma once
/** @file Choice of the process in which FMUs run in tests. **/

#include "simflex/model/Session.h"

namespace simflex {

inline AllowedCode runFmusIn(AllowedCode::Fmus place) {
    AllowedCode code;
    code.fmus = place;
    return code;
}

inline AllowedCode inThisProcess() {
    return runFmusIn(AllowedCode::Fmus::ThisProcess);
}

inline AllowedCode inChildProcess() {
    return runFmusIn(AllowedCode::Fmus::ChildProcess);
}

inline ModelOptions allow(const AllowedCode& code) {
    ModelOptions options;
    options.code = code;
    return options;
}

}  // namespace simflex
