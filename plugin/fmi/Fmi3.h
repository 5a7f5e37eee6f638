#pragma once
/** @file
The binary interface of FMI 3.0 for co-simulation, in our own declarations (Functional Mock-up
Interface, Modelica Association, 2022, sections 2.2, 2.3 and 4.2). Internal. **/

#include <cstddef>
#include <cstdint>

namespace simflex {
namespace fmi3 {

using Instance = void*;
using FmuState = void*;
using Reference = std::uint32_t;
using Text = const char*;

enum class Status { Ok, Warning, Discard, Error, Fatal };

extern "C" {
using Logger = void (*)(void* environment, Status status, Text category, Text message);
using IntermediateUpdate = void (*)(void* environment, double time, bool setRequested,
                                    bool getAllowed, bool stepFinished, bool canReturnEarly,
                                    bool* earlyReturnRequested, double* earlyReturnTime);
}

}  // namespace fmi3
}  // namespace simflex
