/** @file
The functions of FMI 3.0 for co-simulation. They do not throw. **/

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <exception>
#include <memory>
#include <vector>

#include "simflex/fmi/Fmi3.h"
#include "simflex/fmu/FmuInstance.h"

#define SIMFLEX_FMI extern "C" __attribute__((visibility("default")))

namespace simflex {
namespace {

using namespace fmi3;
using fmu::FmuInstance;

struct Unit3 {
    void* environment;
    Logger logger;
    bool isLogging;
    std::unique_ptr<FmuInstance> instance;
};

void tell(void* environment, Logger logger, bool isLogging, FmuInstance::Level level,
          const std::string& message) {
    const bool isError = level == FmuInstance::Level::Error;
    if (!logger || !(isError || isLogging)) return;
    logger(environment, isError ? Status::Error : Status::Warning,
           isError ? "logStatusError" : "logStatusWarning", message.c_str());
}

/** Calls work(instance). **/
template <class Work>
Status guard(Instance handle, const Work& work) {
    Unit3* const unit = static_cast<Unit3*>(handle);
    if (!unit) return Status::Error;
    try {
        work(*unit->instance);
        return Status::Ok;
    } catch (const std::exception& error) {
        unit->instance->log(FmuInstance::Level::Error, error.what());
    } catch (...) {
        unit->instance->log(FmuInstance::Level::Error, "an unknown error");
    }
    return Status::Error;
}

Status refuse(Instance handle, const char* what) {
    return guard(handle, [&](FmuInstance&) {
        throw std::runtime_error(std::string(what) + " is not offered");
    });
}

void requireSameCount(std::size_t references, std::size_t values) {
    if (references != values)
        throw std::runtime_error("there are " + std::to_string(references) + " variables and " +
                                 std::to_string(values) + " values");
}

}  // namespace
}  // namespace simflex

using namespace simflex;
using namespace simflex::fmi3;
using simflex::fmu::FmuInstance;

SIMFLEX_FMI const char* fmi3GetVersion() {
    return "3.0";
}

SIMFLEX_FMI Status fmi3SetDebugLogging(Instance handle, bool isOn, std::size_t, const Text*) {
    if (!handle) return Status::Error;
    static_cast<Unit3*>(handle)->isLogging = isOn;
    return Status::Ok;
}

SIMFLEX_FMI Instance fmi3InstantiateCoSimulation(Text, Text token, Text resources, bool,
                                                 bool isLogging, bool, bool, const Reference*,
                                                 std::size_t, void* environment, Logger logger,
                                                 IntermediateUpdate) {
    try {
        if (!resources || !token) throw std::runtime_error("it needs its resources and its token");
        auto unit = std::make_unique<Unit3>();
        unit->environment = environment;
        unit->logger = logger;
        unit->isLogging = isLogging;
        unit->instance = std::make_unique<FmuInstance>(
            resources, token,
            [at = unit.get()](FmuInstance::Level level, const std::string& message) {
                tell(at->environment, at->logger, at->isLogging, level, message);
            });
        return unit.release();
    } catch (const std::exception& error) {
        tell(environment, logger, true, FmuInstance::Level::Error, error.what());
    } catch (...) {
        tell(environment, logger, true, FmuInstance::Level::Error, "an unknown error");
    }
    return nullptr;
}

SIMFLEX_FMI Instance fmi3InstantiateModelExchange(Text, Text, Text, bool, bool, void* environment,
                                                  Logger logger) {
    tell(environment, logger, true, FmuInstance::Level::Error, "it is for co-simulation only");
    return nullptr;
}

SIMFLEX_FMI Instance fmi3InstantiateScheduledExecution(Text, Text, Text, bool, bool,
                                                       void* environment, Logger logger,
                                                       void (*)(void*), void (*)(), void (*)()) {
    tell(environment, logger, true, FmuInstance::Level::Error, "it is for co-simulation only");
    return nullptr;
}

SIMFLEX_FMI void fmi3FreeInstance(Instance handle) {
    delete static_cast<Unit3*>(handle);
}

SIMFLEX_FMI Status fmi3EnterInitializationMode(Instance handle, bool, double, double startTime,
                                               bool, double) {
    return guard(handle, [&](FmuInstance& instance) {
        instance.setStartTime(startTime);
        instance.enterInitialization();
    });
}

SIMFLEX_FMI Status fmi3ExitInitializationMode(Instance handle) {
    return guard(handle, [](FmuInstance& instance) { instance.exitInitialization(); });
}

SIMFLEX_FMI Status fmi3Terminate(Instance handle) {
    return guard(handle, [](FmuInstance&) {});
}

SIMFLEX_FMI Status fmi3Reset(Instance handle) {
    return guard(handle, [](FmuInstance& instance) { instance.reset(); });
}

SIMFLEX_FMI Status fmi3GetFloat64(Instance handle, const Reference* references, std::size_t count,
                                  double* values, std::size_t numValues) {
    return guard(handle, [&](FmuInstance& instance) {
        requireSameCount(count, numValues);
        for (std::size_t i = 0; i < count; ++i) values[i] = instance.get(references[i]);
    });
}

SIMFLEX_FMI Status fmi3SetFloat64(Instance handle, const Reference* references, std::size_t count,
                                  const double* values, std::size_t numValues) {
    return guard(handle, [&](FmuInstance& instance) {
        requireSameCount(count, numValues);
        for (std::size_t i = 0; i < count; ++i) instance.set(references[i], values[i]);
    });
}

/** Accessors of types that no variable has. **/
#define SIMFLEX_NO_VARIABLES(TYPE, NUMBER)                                                 \
    SIMFLEX_FMI Status fmi3Get##TYPE(Instance handle, const Reference*, std::size_t count, \
                                     NUMBER*, std::size_t) {                               \
        return count == 0 ? Status::Ok : refuse(handle, "fmi3Get" #TYPE);                  \
    }                                                                                      \
    SIMFLEX_FMI Status fmi3Set##TYPE(Instance handle, const Reference*, std::size_t count, \
                                     const NUMBER*, std::size_t) {                         \
        return count == 0 ? Status::Ok : refuse(handle, "fmi3Set" #TYPE);                  \
    }
SIMFLEX_NO_VARIABLES(Float32, float)
SIMFLEX_NO_VARIABLES(Int8, std::int8_t)
SIMFLEX_NO_VARIABLES(UInt8, std::uint8_t)
SIMFLEX_NO_VARIABLES(Int16, std::int16_t)
SIMFLEX_NO_VARIABLES(UInt16, std::uint16_t)
SIMFLEX_NO_VARIABLES(Int32, std::int32_t)
SIMFLEX_NO_VARIABLES(UInt32, std::uint32_t)
SIMFLEX_NO_VARIABLES(Int64, std::int64_t)
SIMFLEX_NO_VARIABLES(UInt64, std::uint64_t)
SIMFLEX_NO_VARIABLES(Boolean, bool)
SIMFLEX_NO_VARIABLES(String, Text)

SIMFLEX_FMI Status fmi3GetBinary(Instance handle, const Reference*, std::size_t count, std::size_t*,
                                 const std::uint8_t**, std::size_t) {
    return count == 0 ? Status::Ok : refuse(handle, "fmi3GetBinary");
}

SIMFLEX_FMI Status fmi3SetBinary(Instance handle, const Reference*, std::size_t count,
                                 const std::size_t*, const std::uint8_t* const*, std::size_t) {
    return count == 0 ? Status::Ok : refuse(handle, "fmi3SetBinary");
}

SIMFLEX_FMI Status fmi3GetClock(Instance handle, const Reference*, std::size_t count, bool*) {
    return count == 0 ? Status::Ok : refuse(handle, "fmi3GetClock");
}

SIMFLEX_FMI Status fmi3SetClock(Instance handle, const Reference*, std::size_t count, const bool*) {
    return count == 0 ? Status::Ok : refuse(handle, "fmi3SetClock");
}

SIMFLEX_FMI Status fmi3GetFMUState(Instance handle, FmuState* state) {
    return guard(handle, [&](FmuInstance& instance) {
        auto kept = std::make_unique<FmuInstance::Kept>(instance.keep());
        delete static_cast<FmuInstance::Kept*>(*state);
        *state = kept.release();
    });
}

SIMFLEX_FMI Status fmi3SetFMUState(Instance handle, FmuState state) {
    return guard(handle, [&](FmuInstance& instance) {
        instance.restore(*static_cast<FmuInstance::Kept*>(state));
    });
}

SIMFLEX_FMI Status fmi3FreeFMUState(Instance, FmuState* state) {
    if (!state) return Status::Ok;
    delete static_cast<FmuInstance::Kept*>(*state);
    *state = nullptr;
    return Status::Ok;
}

SIMFLEX_FMI Status fmi3SerializedFMUStateSize(Instance handle, FmuState state, std::size_t* size) {
    return guard(handle, [&](FmuInstance& instance) {
        *size = instance.pack(*static_cast<FmuInstance::Kept*>(state)).size();
    });
}

SIMFLEX_FMI Status fmi3SerializeFMUState(Instance handle, FmuState state, std::uint8_t* bytes,
                                         std::size_t size) {
    return guard(handle, [&](FmuInstance& instance) {
        const std::string packed = instance.pack(*static_cast<FmuInstance::Kept*>(state));
        if (packed.size() > size)
            throw std::runtime_error("there is too little room for the state");
        std::memcpy(bytes, packed.data(), packed.size());
    });
}

SIMFLEX_FMI Status fmi3DeserializeFMUState(Instance handle, const std::uint8_t* bytes,
                                           std::size_t size, FmuState* state) {
    return guard(handle, [&](FmuInstance& instance) {
        auto kept = std::make_unique<FmuInstance::Kept>(
            instance.unpack(std::string(reinterpret_cast<const char*>(bytes), size)));
        delete static_cast<FmuInstance::Kept*>(*state);
        *state = kept.release();
    });
}

SIMFLEX_FMI Status fmi3DoStep(Instance handle, double time, double length, bool,
                              bool* eventHandlingNeeded, bool* terminateSimulation,
                              bool* earlyReturn, double* lastSuccessfulTime) {
    return guard(handle, [&](FmuInstance& instance) {
        if (eventHandlingNeeded) *eventHandlingNeeded = false;
        if (earlyReturn) *earlyReturn = false;
        if (terminateSimulation) *terminateSimulation = instance.isTerminated();
        if (lastSuccessfulTime) *lastSuccessfulTime = instance.getTime();
        const bool isOver = instance.doStep(time, length) == FmuInstance::Outcome::Terminated;
        if (terminateSimulation) *terminateSimulation = isOver;
        if (lastSuccessfulTime) *lastSuccessfulTime = instance.getTime();
    });
}

SIMFLEX_FMI Status fmi3GetDirectionalDerivative(Instance handle, const Reference* unknowns,
                                                std::size_t numUnknowns, const Reference* knowns,
                                                std::size_t numKnowns, const double* seeds,
                                                std::size_t numSeeds, double* sensitivities,
                                                std::size_t numSensitivities) {
    return guard(handle, [&](FmuInstance& instance) {
        requireSameCount(numKnowns, numSeeds);
        requireSameCount(numUnknowns, numSensitivities);
        const std::vector<double> derivative = instance.calcDirectionalDerivative(
            {unknowns, unknowns + numUnknowns}, {knowns, knowns + numKnowns},
            {seeds, seeds + numSeeds});
        std::copy(derivative.begin(), derivative.end(), sensitivities);
    });
}

/** Functions not required without event mode, clocks and model exchange. **/
#define SIMFLEX_NOT_OFFERED(NAME, ...)     \
    SIMFLEX_FMI Status NAME(__VA_ARGS__) { \
        return refuse(handle, #NAME);      \
    }
SIMFLEX_NOT_OFFERED(fmi3EnterEventMode, Instance handle)
SIMFLEX_NOT_OFFERED(fmi3EnterStepMode, Instance handle)
SIMFLEX_NOT_OFFERED(fmi3EnterConfigurationMode, Instance handle)
SIMFLEX_NOT_OFFERED(fmi3ExitConfigurationMode, Instance handle)
SIMFLEX_NOT_OFFERED(fmi3EnterContinuousTimeMode, Instance handle)
SIMFLEX_NOT_OFFERED(fmi3EvaluateDiscreteStates, Instance handle)
SIMFLEX_NOT_OFFERED(fmi3UpdateDiscreteStates, Instance handle, bool*, bool*, bool*, bool*, bool*,
                    double*)
SIMFLEX_NOT_OFFERED(fmi3GetNumberOfVariableDependencies, Instance handle, Reference, std::size_t*)
SIMFLEX_NOT_OFFERED(fmi3GetVariableDependencies, Instance handle, Reference, std::size_t*,
                    Reference*, std::size_t*, int*, std::size_t)
SIMFLEX_NOT_OFFERED(fmi3GetAdjointDerivative, Instance handle, const Reference*, std::size_t,
                    const Reference*, std::size_t, const double*, std::size_t, double*, std::size_t)
SIMFLEX_NOT_OFFERED(fmi3GetOutputDerivatives, Instance handle, const Reference*, std::size_t,
                    const std::int32_t*, double*, std::size_t)
SIMFLEX_NOT_OFFERED(fmi3GetIntervalDecimal, Instance handle, const Reference*, std::size_t, double*,
                    int*)
SIMFLEX_NOT_OFFERED(fmi3GetIntervalFraction, Instance handle, const Reference*, std::size_t,
                    std::uint64_t*, std::uint64_t*, int*)
SIMFLEX_NOT_OFFERED(fmi3GetShiftDecimal, Instance handle, const Reference*, std::size_t, double*)
SIMFLEX_NOT_OFFERED(fmi3GetShiftFraction, Instance handle, const Reference*, std::size_t,
                    std::uint64_t*, std::uint64_t*)
SIMFLEX_NOT_OFFERED(fmi3SetIntervalDecimal, Instance handle, const Reference*, std::size_t,
                    const double*)
SIMFLEX_NOT_OFFERED(fmi3SetIntervalFraction, Instance handle, const Reference*, std::size_t,
                    const std::uint64_t*, const std::uint64_t*)
SIMFLEX_NOT_OFFERED(fmi3SetShiftDecimal, Instance handle, const Reference*, std::size_t,
                    const double*)
SIMFLEX_NOT_OFFERED(fmi3SetShiftFraction, Instance handle, const Reference*, std::size_t,
                    const std::uint64_t*, const std::uint64_t*)
SIMFLEX_NOT_OFFERED(fmi3CompletedIntegratorStep, Instance handle, bool, bool*, bool*)
SIMFLEX_NOT_OFFERED(fmi3SetTime, Instance handle, double)
SIMFLEX_NOT_OFFERED(fmi3SetContinuousStates, Instance handle, const double*, std::size_t)
SIMFLEX_NOT_OFFERED(fmi3GetContinuousStateDerivatives, Instance handle, double*, std::size_t)
SIMFLEX_NOT_OFFERED(fmi3GetEventIndicators, Instance handle, double*, std::size_t)
SIMFLEX_NOT_OFFERED(fmi3GetContinuousStates, Instance handle, double*, std::size_t)
SIMFLEX_NOT_OFFERED(fmi3GetNominalsOfContinuousStates, Instance handle, double*, std::size_t)
SIMFLEX_NOT_OFFERED(fmi3GetNumberOfEventIndicators, Instance handle, std::size_t*)
SIMFLEX_NOT_OFFERED(fmi3GetNumberOfContinuousStates, Instance handle, std::size_t*)
SIMFLEX_NOT_OFFERED(fmi3ActivateModelPartition, Instance handle, Reference, double)
