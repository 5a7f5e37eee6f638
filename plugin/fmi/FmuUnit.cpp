#include "simflex/fmi/FmuUnit.h"
#include "simflex/base/ZipFile.h"

#include <dlfcn.h>

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <stdexcept>

#include "simflex/base/NumberText.h"
#include "simflex/fmi/Fmi2.h"
#include "simflex/fmi/Fmi3.h"

namespace simflex {

namespace fs = std::filesystem;

//-------------------------------------------------------------------------------------------------
// the unit

FmuUnit::FmuUnit(const fs::path& path) : m_path(path.string()) {
    open();
}

FmuUnit::~FmuUnit() {
    if (m_library) dlclose(m_library);
}

void FmuUnit::fail(const std::string& what) const {
    throw std::runtime_error("FMU '" + m_path + "': " + what);
}

void FmuUnit::open() {
    if (!fs::is_regular_file(m_path)) fail("there is no such file");
    unpackZip(m_path, m_folder.path());
    try {
        m_description = readFmuDescription(m_folder.path() / "modelDescription.xml");
    } catch (const std::exception& error) {
        fail(error.what());
    }
    if (m_description.needsTool) fail("it runs only with the program that made it");
    const fs::path binaries = m_folder.path() / "binaries",
                   folder = binaries / (m_description.version == 3 ? "x86_64-linux" : "linux64"),
                   library = folder / (m_description.identifier + ".so");
    if (!fs::is_regular_file(library)) {
        std::string others;
        if (fs::is_directory(binaries))
            for (const fs::directory_entry& entry : fs::directory_iterator(binaries))
                others += (others.empty() ? "" : ", ") + entry.path().filename().string();
        fail("it has no library " + folder.filename().string() + '/' + m_description.identifier +
             ".so" + (others.empty() ? "" : "; it is for " + others));
    }
    m_library = dlopen(library.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (!m_library) fail(std::string("its library cannot be loaded: ") + dlerror());
}

void* FmuUnit::findSymbol(const char* name) const {
    void* const symbol = dlsym(m_library, name);
    if (!symbol) fail(std::string("its library has no function ") + name);
    return symbol;
}

//-------------------------------------------------------------------------------------------------
// an instance

struct FmuSlave::Callbacks {
    fmi2::Callbacks second{};
};

namespace {

extern "C" void hearSecond(void* slave, fmi2::Text, fmi2::Status status, fmi2::Text,
                           fmi2::Text format, ...) {
    if (!slave || !format || status < fmi2::Status::Discard) return;
    char message[1000];
    std::va_list arguments;
    va_start(arguments, format);
    std::vsnprintf(message, sizeof message, format, arguments);
    va_end(arguments);
    static_cast<const FmuSlave*>(slave)->hear(message);
}

extern "C" void hearThird(void* slave, fmi3::Status status, fmi3::Text, fmi3::Text message) {
    if (slave && message && status >= fmi3::Status::Discard)
        static_cast<const FmuSlave*>(slave)->hear(message);
}

constexpr int Discard = 2;

}  // namespace

FmuSlave::FmuSlave(std::shared_ptr<const FmuUnit> unit, const std::string& name)
    : m_unit(std::move(unit)), m_name(name), m_callbacks(std::make_unique<Callbacks>()) {
    const FmuDescription& description = m_unit->getDescription();
    const std::string resources = m_unit->getResources().string();
    if (isThird()) {
        using Instantiate =
            void*(const char*, const char*, const char*, bool, bool, bool, bool, const unsigned*,
                  std::size_t, void*, fmi3::Logger, fmi3::IntermediateUpdate);
        m_instance = m_unit->find<Instantiate>("fmi3InstantiateCoSimulation")(
            m_name.c_str(), description.token.c_str(), (resources + '/').c_str(), false, false,
            false, false, nullptr, 0, this, hearThird, nullptr);
    } else {
        m_callbacks->second = {hearSecond, std::calloc, std::free, nullptr, this};
        using Instantiate = void*(const char*, fmi2::Kind, const char*, const char*,
                                  const fmi2::Callbacks*, int, int);
        m_instance = m_unit->find<Instantiate>("fmi2Instantiate")(
            m_name.c_str(), fmi2::Kind::CoSimulation, description.token.c_str(),
            ("file://" + resources).c_str(), &m_callbacks->second, 0, 0);
    }
    if (!m_instance) fail("it gives no instance");
}

FmuSlave::~FmuSlave() {
    try {
        if (m_instance)
            m_unit->find<void(void*)>(isThird() ? "fmi3FreeInstance"
                                                : "fmi2FreeInstance")(m_instance);
    } catch (const std::exception&) {
        // Then it cannot be freed.
    }
}

void FmuSlave::fail(const std::string& what) const {
    m_unit->fail("instance '" + m_name + "': " + what + (m_said.empty() ? "" : ": " + m_said));
}

void FmuSlave::require(int status, const std::string& what) const {
    if (status >= Discard) fail(what + " has failed");
}

template <class... Arguments>
void FmuSlave::call(const char* name, const std::string& what, Arguments... arguments) const {
    m_said.clear();
    require(m_unit->find<int(void*, Arguments...)>(name)(m_instance, arguments...), what);
}

void FmuSlave::enterInitialization(double time) {
    if (isThird()) {
        call("fmi3EnterInitializationMode", "initialization", false, 0., time, false, 0.);
        return;
    }
    call("fmi2SetupExperiment", "the setup", 0, 0., time, 0, 0.);
    call("fmi2EnterInitializationMode", "initialization");
}

void FmuSlave::exitInitialization() {
    call(isThird() ? "fmi3ExitInitializationMode" : "fmi2ExitInitializationMode", "initialization");
}

void FmuSlave::reset() {
    call(isThird() ? "fmi3Reset" : "fmi2Reset", "the reset");
}

const FmuVariable& FmuSlave::findVariable(const std::string& name) const {
    const FmuVariable* const variable = m_unit->getDescription().find(name);
    if (!variable) fail("there is no variable '" + name + "'");
    if (variable->isArray || variable->type == FmuVariable::Type::Other)
        fail("variable '" + name + "' is " +
             (variable->isArray ? "an array" : "of type " + variable->typeText) +
             "; real numbers, whole ones and booleans are known");
    return *variable;
}

void FmuSlave::set(const std::string& name, double value) {
    const FmuVariable& variable = findVariable(name);
    const std::string what = "setting '" + name + "'";
    const unsigned* const reference = &variable.reference;
    const std::size_t one = 1;
    if (variable.type == FmuVariable::Type::Real) {
        if (isThird())
            call("fmi3SetFloat64", what, reference, one, &value, one);
        else
            call("fmi2SetReal", what, reference, one, &value);
    } else if (variable.type == FmuVariable::Type::Integer) {
        constexpr double WholeTolerance = 1e-9;  // round-off of what was computed
        const double whole = std::round(value);
        if (!(std::abs(value - whole) <= WholeTolerance * std::max(1.0, std::abs(value)) &&
              std::abs(whole) <= double(std::numeric_limits<int>::max())))
            throw std::runtime_error("'" + name + "' of the FMU is a whole number and cannot be " +
                                     writeGeneral(value, 9) +
                                     "; floor(x + 0.5) is the nearest one");
        const int number = int(whole);
        if (isThird())
            call("fmi3SetInt32", what, reference, one, &number, one);
        else
            call("fmi2SetInteger", what, reference, one, &number);
    } else if (isThird()) {
        const bool isTrue = value > 0.5;
        call("fmi3SetBoolean", what, reference, one, &isTrue, one);
    } else {
        const int isTrue = value > 0.5;
        call("fmi2SetBoolean", what, reference, one, &isTrue);
    }
}

double FmuSlave::get(const std::string& name) const {
    const FmuVariable& variable = findVariable(name);
    const std::string what = "reading '" + name + "'";
    const unsigned* const reference = &variable.reference;
    const std::size_t one = 1;
    if (variable.type == FmuVariable::Type::Real) {
        double value = 0;
        if (isThird())
            call("fmi3GetFloat64", what, reference, one, &value, one);
        else
            call("fmi2GetReal", what, reference, one, &value);
        return value;
    }
    if (variable.type == FmuVariable::Type::Integer) {
        int number = 0;
        if (isThird())
            call("fmi3GetInt32", what, reference, one, &number, one);
        else
            call("fmi2GetInteger", what, reference, one, &number);
        return number;
    }
    if (isThird()) {
        bool isTrue = false;
        call("fmi3GetBoolean", what, reference, one, &isTrue, one);
        return isTrue;
    }
    int isTrue = 0;
    call("fmi2GetBoolean", what, reference, one, &isTrue);
    return isTrue != 0;
}

bool FmuSlave::doStep(double time, double length) {
    m_said.clear();
    if (isThird()) {
        bool needsEvent = false, isOver = false, isEarly = false;
        double reached = time;
        call("fmi3DoStep", "a step", time, length, false, &needsEvent, &isOver, &isEarly, &reached);
        return !isOver;
    }
    const int status =
        m_unit->find<int(void*, double, double, int)>("fmi2DoStep")(m_instance, time, length, 0);
    if (status == Discard) {
        int isOver = 0;
        const int known = m_unit->find<int(void*, fmi2::StatusKind, int*)>("fmi2GetBooleanStatus")(
            m_instance, fmi2::StatusKind::Terminated, &isOver);
        if (known < Discard && isOver) return false;
    }
    require(status, "a step");
    return true;
}

std::string FmuSlave::save() const {
    void* state = nullptr;
    std::size_t size = 0;
    call(isThird() ? "fmi3GetFMUState" : "fmi2GetFMUstate", "saving", &state);
    std::string bytes;
    try {
        call(isThird() ? "fmi3SerializedFMUStateSize" : "fmi2SerializedFMUstateSize", "saving",
             state, &size);
        bytes.resize(size);
        call(isThird() ? "fmi3SerializeFMUState" : "fmi2SerializeFMUstate", "saving", state,
             bytes.data(), size);
    } catch (...) {
        call(isThird() ? "fmi3FreeFMUState" : "fmi2FreeFMUstate", "saving", &state);
        throw;
    }
    call(isThird() ? "fmi3FreeFMUState" : "fmi2FreeFMUstate", "saving", &state);
    return bytes;
}

void FmuSlave::restore(const std::string& bytes) {
    void* state = nullptr;
    call(isThird() ? "fmi3DeserializeFMUState" : "fmi2DeSerializeFMUstate", "restoring",
         bytes.data(), bytes.size(), &state);
    try {
        call(isThird() ? "fmi3SetFMUState" : "fmi2SetFMUstate", "restoring", state);
    } catch (...) {
        call(isThird() ? "fmi3FreeFMUState" : "fmi2FreeFMUstate", "restoring", &state);
        throw;
    }
    call(isThird() ? "fmi3FreeFMUState" : "fmi2FreeFMUstate", "restoring", &state);
}

}  // namespace simflex
