/** @file
The functions of FMI 2.0 for co-simulation. They do not throw. **/

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <exception>
#include <memory>
#include <vector>

#include "simflex/base/AsciiText.h"
#include "simflex/fmi/Fmi2.h"
#include "simflex/fmu/FmuInstance.h"

#define SIMFLEX_FMI extern "C" __attribute__((visibility("default")))

namespace simflex {
namespace {

using namespace fmi2;
using fmu::FmuInstance;

struct Unit2 {
    std::string name;
    const Callbacks* callbacks;
    bool isLogging;
    std::unique_ptr<FmuInstance> instance;
};

void tell(const Callbacks* callbacks, const std::string& name, bool isLogging,
          FmuInstance::Level level, const std::string& message) {
    const bool isError = level == FmuInstance::Level::Error;
    if (!callbacks || !callbacks->logger || !(isError || isLogging)) return;
    callbacks->logger(callbacks->environment, name.c_str(),
                      isError ? Status::Error : Status::Warning,
                      isError ? "logStatusError" : "logStatusWarning", "%s", message.c_str());
}

/** Calls work(instance), which returns a Status. **/
template <class Work>
Status guard(Component component, const Work& work) {
    Unit2* const unit = static_cast<Unit2*>(component);
    if (!unit) return Status::Error;
    try {
        return work(*unit->instance);
    } catch (const std::exception& error) {
        unit->instance->log(FmuInstance::Level::Error, error.what());
    } catch (...) {
        unit->instance->log(FmuInstance::Level::Error, "an unknown error");
    }
    return Status::Error;
}

Status refuse(Component component, const char* what) {
    return guard(component, [&](FmuInstance& instance) {
        instance.log(FmuInstance::Level::Error, std::string(what) + " is not offered");
        return Status::Error;
    });
}

/** Converts "file:///a%20b" to "/a b". **/
std::string readUri(const std::string& uri) {
    const std::string scheme = "file:";
    if (uri.compare(0, scheme.size(), scheme) != 0) return uri;
    std::string path = uri.substr(scheme.size());
    if (path.compare(0, 2, "//") == 0) path.erase(0, std::min(path.find('/', 2), path.size()));
    std::string decoded;
    for (size_t i = 0; i < path.size(); ++i) {
        const auto digit = [&](size_t k) {
            const char c = k < path.size() ? path[k] : ' ';
            return c >= '0' && c <= '9'   ? c - '0'
                   : c >= 'a' && c <= 'f' ? c - 'a' + 10
                   : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                          : -1;
        };
        if (path[i] == '%' && digit(i + 1) >= 0 && digit(i + 2) >= 0) {
            decoded += char(16 * digit(i + 1) + digit(i + 2));
            i += 2;
        } else {
            decoded += path[i];
        }
    }
    return decoded;
}

}  // namespace
}  // namespace simflex

using namespace simflex;
using namespace simflex::fmi2;
using simflex::fmu::FmuInstance;

SIMFLEX_FMI const char* fmi2GetTypesPlatform() {
    return "default";
}

SIMFLEX_FMI const char* fmi2GetVersion() {
    return "2.0";
}

SIMFLEX_FMI Status fmi2SetDebugLogging(Component component, Boolean isOn, std::size_t,
                                       const Text*) {
    if (!component) return Status::Error;
    static_cast<Unit2*>(component)->isLogging = isOn;
    return Status::Ok;
}

SIMFLEX_FMI Component fmi2Instantiate(Text name, Kind kind, Text guid, Text resources,
                                      const Callbacks* callbacks, Boolean, Boolean isLogging) {
    const std::string own = name ? name : "";
    try {
        if (kind != Kind::CoSimulation) throw std::runtime_error("it is for co-simulation only");
        if (!resources || !guid) throw std::runtime_error("it needs its resources and its GUID");
        auto unit = std::make_unique<Unit2>();
        unit->name = own;
        unit->callbacks = callbacks;
        unit->isLogging = isLogging;
        unit->instance = std::make_unique<FmuInstance>(
            readUri(resources), guid,
            [at = unit.get()](FmuInstance::Level level, const std::string& message) {
                tell(at->callbacks, at->name, at->isLogging, level, message);
            });
        return unit.release();
    } catch (const std::exception& error) {
        tell(callbacks, own, true, FmuInstance::Level::Error, error.what());
    } catch (...) {
        tell(callbacks, own, true, FmuInstance::Level::Error, "an unknown error");
    }
    return nullptr;
}

SIMFLEX_FMI void fmi2FreeInstance(Component component) {
    delete static_cast<Unit2*>(component);
}

SIMFLEX_FMI Status fmi2SetupExperiment(Component component, Boolean, double, double startTime,
                                       Boolean, double) {
    return guard(component, [&](FmuInstance& instance) {
        instance.setStartTime(startTime);
        return Status::Ok;
    });
}

SIMFLEX_FMI Status fmi2EnterInitializationMode(Component component) {
    return guard(component, [](FmuInstance& instance) {
        instance.enterInitialization();
        return Status::Ok;
    });
}

SIMFLEX_FMI Status fmi2ExitInitializationMode(Component component) {
    return guard(component, [](FmuInstance& instance) {
        instance.exitInitialization();
        return Status::Ok;
    });
}

SIMFLEX_FMI Status fmi2Terminate(Component component) {
    return guard(component, [](FmuInstance&) { return Status::Ok; });
}

SIMFLEX_FMI Status fmi2Reset(Component component) {
    return guard(component, [](FmuInstance& instance) {
        instance.reset();
        return Status::Ok;
    });
}

SIMFLEX_FMI Status fmi2GetReal(Component component, const Reference* references, std::size_t count,
                               double* values) {
    return guard(component, [&](FmuInstance& instance) {
        for (std::size_t i = 0; i < count; ++i) values[i] = instance.get(references[i]);
        return Status::Ok;
    });
}

SIMFLEX_FMI Status fmi2SetReal(Component component, const Reference* references, std::size_t count,
                               const double* values) {
    return guard(component, [&](FmuInstance& instance) {
        for (std::size_t i = 0; i < count; ++i) instance.set(references[i], values[i]);
        return Status::Ok;
    });
}

/** Accessors of types that no variable has. **/
#define SIMFLEX_NO_VARIABLES(NAME, TYPE)                                                       \
    SIMFLEX_FMI Status NAME(Component component, const Reference*, std::size_t count, TYPE*) { \
        return count == 0 ? Status::Ok : refuse(component, #NAME);                             \
    }
SIMFLEX_NO_VARIABLES(fmi2GetInteger, int)
SIMFLEX_NO_VARIABLES(fmi2GetBoolean, Boolean)
SIMFLEX_NO_VARIABLES(fmi2GetString, Text)
SIMFLEX_NO_VARIABLES(fmi2SetInteger, const int)
SIMFLEX_NO_VARIABLES(fmi2SetBoolean, const Boolean)
SIMFLEX_NO_VARIABLES(fmi2SetString, const Text)

SIMFLEX_FMI Status fmi2GetFMUstate(Component component, FmuState* state) {
    return guard(component, [&](FmuInstance& instance) {
        auto kept = std::make_unique<FmuInstance::Kept>(instance.keep());
        delete static_cast<FmuInstance::Kept*>(*state);
        *state = kept.release();
        return Status::Ok;
    });
}

SIMFLEX_FMI Status fmi2SetFMUstate(Component component, FmuState state) {
    return guard(component, [&](FmuInstance& instance) {
        instance.restore(*static_cast<FmuInstance::Kept*>(state));
        return Status::Ok;
    });
}

SIMFLEX_FMI Status fmi2FreeFMUstate(Component, FmuState* state) {
    if (!state) return Status::Ok;
    delete static_cast<FmuInstance::Kept*>(*state);
    *state = nullptr;
    return Status::Ok;
}

SIMFLEX_FMI Status fmi2SerializedFMUstateSize(Component component, FmuState state,
                                              std::size_t* size) {
    return guard(component, [&](FmuInstance& instance) {
        *size = instance.pack(*static_cast<FmuInstance::Kept*>(state)).size();
        return Status::Ok;
    });
}

SIMFLEX_FMI Status fmi2SerializeFMUstate(Component component, FmuState state, char* bytes,
                                         std::size_t size) {
    return guard(component, [&](FmuInstance& instance) {
        const std::string packed = instance.pack(*static_cast<FmuInstance::Kept*>(state));
        if (packed.size() > size)
            throw std::runtime_error("there is too little room for the state");
        std::memcpy(bytes, packed.data(), packed.size());
        return Status::Ok;
    });
}

SIMFLEX_FMI Status fmi2DeSerializeFMUstate(Component component, const char* bytes, std::size_t size,
                                           FmuState* state) {
    return guard(component, [&](FmuInstance& instance) {
        auto kept = std::make_unique<FmuInstance::Kept>(instance.unpack(std::string(bytes, size)));
        delete static_cast<FmuInstance::Kept*>(*state);
        *state = kept.release();
        return Status::Ok;
    });
}

SIMFLEX_FMI Status fmi2GetDirectionalDerivative(Component component, const Reference* unknowns,
                                                std::size_t numUnknowns, const Reference* knowns,
                                                std::size_t numKnowns, const double* seeds,
                                                double* sensitivities) {
    return guard(component, [&](FmuInstance& instance) {
        const std::vector<double> derivative = instance.calcDirectionalDerivative(
            {unknowns, unknowns + numUnknowns}, {knowns, knowns + numKnowns},
            {seeds, seeds + numKnowns});
        std::copy(derivative.begin(), derivative.end(), sensitivities);
        return Status::Ok;
    });
}

SIMFLEX_FMI Status fmi2SetRealInputDerivatives(Component component, const Reference* references,
                                               std::size_t count, const int* orders,
                                               const double* values) {
    return guard(component, [&](FmuInstance& instance) {
        for (std::size_t i = 0; i < count; ++i) {
            if (orders[i] != 1) throw std::runtime_error("inputs have derivatives of order 1 only");
            instance.setRate(references[i], values[i]);
        }
        return Status::Ok;
    });
}

SIMFLEX_FMI Status fmi2GetRealOutputDerivatives(Component component, const Reference*,
                                                std::size_t count, const int*, double*) {
    return count == 0 ? Status::Ok : refuse(component, "fmi2GetRealOutputDerivatives");
}

SIMFLEX_FMI Status fmi2DoStep(Component component, double time, double length, Boolean) {
    return guard(component, [&](FmuInstance& instance) {
        return instance.doStep(time, length) == FmuInstance::Outcome::Done ? Status::Ok
                                                                           : Status::Discard;
    });
}

SIMFLEX_FMI Status fmi2CancelStep(Component component) {
    return refuse(component, "fmi2CancelStep");
}

SIMFLEX_FMI Status fmi2GetStatus(Component component, StatusKind, Status*) {
    return refuse(component, "fmi2GetStatus of steps that are under way");
}

SIMFLEX_FMI Status fmi2GetRealStatus(Component component, StatusKind kind, double* value) {
    return guard(component, [&](FmuInstance& instance) {
        if (kind != StatusKind::LastSuccessfulTime) return Status::Discard;
        *value = instance.getTime();
        return Status::Ok;
    });
}

SIMFLEX_FMI Status fmi2GetIntegerStatus(Component component, StatusKind, int*) {
    return refuse(component, "fmi2GetIntegerStatus");
}

SIMFLEX_FMI Status fmi2GetBooleanStatus(Component component, StatusKind kind, Boolean* value) {
    return guard(component, [&](FmuInstance& instance) {
        if (kind != StatusKind::Terminated) return Status::Discard;
        *value = instance.isTerminated();
        return Status::Ok;
    });
}

SIMFLEX_FMI Status fmi2GetStringStatus(Component component, StatusKind, Text*) {
    return refuse(component, "fmi2GetStringStatus");
}
