#pragma once
/** @file
The binary interface of FMI 2.0 for co-simulation, in our own declarations (Functional Mock-up
Interface, Modelica Association, 2014, section 2.1 and 4.2). Internal. **/

#include <cstddef>

namespace simflex {
namespace fmi2 {

using Component = void*;
using FmuState = void*;
using Reference = unsigned int;
using Text = const char*;
using Boolean = int;

enum class Status { Ok, Warning, Discard, Error, Fatal, Pending };
enum class Kind { ModelExchange, CoSimulation };
enum class StatusKind { DoStep, Pending, LastSuccessfulTime, Terminated };

extern "C" {
using Logger = void (*)(void* environment, Text instance, Status status, Text category,
                        Text message, ...);
}
struct Callbacks {
    Logger logger;
    void* (*allocateMemory)(std::size_t count, std::size_t size);
    void (*freeMemory)(void* memory);
    void (*stepFinished)(void* environment, Status status);
    void* environment;
};

}  // namespace fmi2
}  // namespace simflex
