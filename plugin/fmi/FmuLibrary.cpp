#include "simflex/fmi/FmuLibrary.h"

#include <dlfcn.h>

#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>

#include "simflex/base/SecondsSince.h"
#include "simflex/fmi/Fmi2.h"
#include "simflex/fmi/Fmi3.h"

namespace simflex {

struct FmuLibrary::Callbacks {
    fmi2::Callbacks second{};
};

namespace {

extern "C" void hearSecond(void* library, fmi2::Text, fmi2::Status status, fmi2::Text,
                           fmi2::Text format, ...) {
    if (!library || !format || status < fmi2::Status::Discard) return;
    char message[1000];
    std::va_list arguments;
    va_start(arguments, format);
    std::vsnprintf(message, sizeof message, format, arguments);
    va_end(arguments);
    static_cast<FmuLibrary*>(library)->hear(message);
}

extern "C" void hearThird(void* library, fmi3::Status status, fmi3::Text, fmi3::Text message) {
    if (library && message && status >= fmi3::Status::Discard)
        static_cast<FmuLibrary*>(library)->hear(message);
}

constexpr int Discard = 2, Fatal = 4;

}  // namespace

FmuLibrary::FmuLibrary(const FmuInstanceSetup& setup)
    : m_setup(setup), m_callbacks(std::make_unique<Callbacks>()) {
    m_library = dlopen(setup.library.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (!m_library)
        throw std::runtime_error(std::string("its library cannot be loaded: ") + dlerror());
    try {
        instantiate();
    } catch (...) {
        dlclose(m_library);
        throw;
    }
}

FmuLibrary::~FmuLibrary() {
    try {
        if (m_instance)
            find<void(void*)>(isThird() ? "fmi3FreeInstance" : "fmi2FreeInstance")(m_instance);
    } catch (const std::exception&) {
        // It cannot be freed then.
    }
    dlclose(m_library);
}

template <class Function>
Function* FmuLibrary::find(const char* name) const {
    void* const symbol = dlsym(m_library, name);
    if (!symbol) throw std::runtime_error(std::string("its library has no function ") + name);
    return reinterpret_cast<Function*>(symbol);
}

void FmuLibrary::instantiate() {
    if (isThird()) {
        using Instantiate =
            void*(const char*, const char*, const char*, bool, bool, bool, bool, const unsigned*,
                  std::size_t, void*, fmi3::Logger, fmi3::IntermediateUpdate);
        m_instance = find<Instantiate>("fmi3InstantiateCoSimulation")(
            m_setup.name.c_str(), m_setup.token.c_str(), (m_setup.resources + '/').c_str(), false,
            false, false, false, nullptr, 0, this, hearThird, nullptr);
    } else {
        m_callbacks->second = {hearSecond, std::calloc, std::free, nullptr, this};
        using Instantiate = void*(const char*, fmi2::Kind, const char*, const char*,
                                  const fmi2::Callbacks*, int, int);
        m_instance = find<Instantiate>("fmi2Instantiate")(
            m_setup.name.c_str(), fmi2::Kind::CoSimulation, m_setup.token.c_str(),
            ("file://" + m_setup.resources).c_str(), &m_callbacks->second, 0, 0);
    }
    if (!m_instance) fail("it gives no instance");
}

void FmuLibrary::fail(const std::string& what) const {
    throw std::runtime_error(what + (m_said.empty() ? "" : ": " + m_said));
}

void FmuLibrary::require(int status, const std::string& what) {
    if (status == Fatal) m_instance = nullptr;  // no further calls are allowed, not even to free it
    if (status >= Discard) fail(what + " has failed");
}

template <class... Arguments>
void FmuLibrary::call(const char* name, const std::string& what, Arguments... arguments) {
    m_said.clear();
    require(find<int(void*, Arguments...)>(name)(m_instance, arguments...), what);
}

FmuReply FmuLibrary::ask(const std::vector<FmuCall>& calls) {
    const auto start = std::chrono::steady_clock::now();
    FmuReply reply;
    try {
        for (const FmuCall& call : calls) {
            if (!m_instance) throw std::runtime_error("it has failed for good before");
            reply.answers.push_back(answer(call));
            if (call.kind == FmuCall::DoStep && reply.answers.back().value == 0) break;
        }
    } catch (const std::exception& error) {
        reply.error = error.what();
    }
    reply.seconds = secondsSince(start);
    return reply;
}

FmuAnswer FmuLibrary::answer(const FmuCall& call) {
    switch (call.kind) {
        case FmuCall::EnterInitialization:
            enterInitialization(call.value, call.what);
            return {};
        case FmuCall::ExitInitialization:
            this->call(isThird() ? "fmi3ExitInitializationMode" : "fmi2ExitInitializationMode",
                       call.what);
            return {};
        case FmuCall::Reset:
            this->call(isThird() ? "fmi3Reset" : "fmi2Reset", call.what);
            return {};
        case FmuCall::SetReal:
        case FmuCall::SetInteger:
        case FmuCall::SetBoolean:
            set(call);
            return {};
        case FmuCall::DoStep:
            return {doStep(call) ? 1. : 0., {}};
        case FmuCall::Save:
            return {0, save(call.what)};
        case FmuCall::Restore:
            restore(call.bytes, call.what);
            return {};
        default:
            return {get(call), {}};
    }
}

void FmuLibrary::enterInitialization(double time, const std::string& what) {
    if (isThird()) {
        call("fmi3EnterInitializationMode", what, false, 0., time, false, 0.);
        return;
    }
    call("fmi2SetupExperiment", "the setup", 0, 0., time, 0, 0.);
    call("fmi2EnterInitializationMode", what);
}

void FmuLibrary::set(const FmuCall& asked) {
    const std::string& what = asked.what;
    const unsigned* const reference = &asked.reference;
    const std::size_t one = 1;
    if (asked.kind == FmuCall::SetReal) {
        if (isThird())
            call("fmi3SetFloat64", what, reference, one, &asked.value, one);
        else
            call("fmi2SetReal", what, reference, one, &asked.value);
    } else if (asked.kind == FmuCall::SetInteger) {
        const int number = int(asked.value);
        if (isThird())
            call("fmi3SetInt32", what, reference, one, &number, one);
        else
            call("fmi2SetInteger", what, reference, one, &number);
    } else if (isThird()) {
        const bool isTrue = asked.value != 0;
        call("fmi3SetBoolean", what, reference, one, &isTrue, one);
    } else {
        const int isTrue = asked.value != 0;
        call("fmi2SetBoolean", what, reference, one, &isTrue);
    }
}

double FmuLibrary::get(const FmuCall& asked) {
    const std::string& what = asked.what;
    const unsigned* const reference = &asked.reference;
    const std::size_t one = 1;
    if (asked.kind == FmuCall::GetReal) {
        double value = 0;
        if (isThird())
            call("fmi3GetFloat64", what, reference, one, &value, one);
        else
            call("fmi2GetReal", what, reference, one, &value);
        return value;
    }
    if (asked.kind == FmuCall::GetInteger) {
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

bool FmuLibrary::doStep(const FmuCall& asked) {
    m_said.clear();
    if (isThird()) {
        bool needsEvent = false, isOver = false, isEarly = false;
        double reached = asked.value;
        call("fmi3DoStep", asked.what, asked.value, asked.length, false, &needsEvent, &isOver,
             &isEarly, &reached);
        return !isOver;
    }
    const int status = find<int(void*, double, double, int)>("fmi2DoStep")(m_instance, asked.value,
                                                                           asked.length, 0);
    if (status == Discard) {
        int isOver = 0;
        const int known = find<int(void*, fmi2::StatusKind, int*)>("fmi2GetBooleanStatus")(
            m_instance, fmi2::StatusKind::Terminated, &isOver);
        if (known < Discard && isOver) return false;
    }
    require(status, asked.what);
    return true;
}

std::string FmuLibrary::save(const std::string& what) {
    void* state = nullptr;
    std::size_t size = 0;
    call(isThird() ? "fmi3GetFMUState" : "fmi2GetFMUstate", what, &state);
    const auto drop = [&] {
        call(isThird() ? "fmi3FreeFMUState" : "fmi2FreeFMUstate", what, &state);
    };
    std::string bytes;
    try {
        call(isThird() ? "fmi3SerializedFMUStateSize" : "fmi2SerializedFMUstateSize", what, state,
             &size);
        bytes.resize(size);
        call(isThird() ? "fmi3SerializeFMUState" : "fmi2SerializeFMUstate", what, state,
             bytes.data(), size);
    } catch (...) {
        if (m_instance) drop();
        throw;
    }
    drop();
    return bytes;
}

void FmuLibrary::restore(const std::string& bytes, const std::string& what) {
    void* state = nullptr;
    call(isThird() ? "fmi3DeserializeFMUState" : "fmi2DeSerializeFMUstate", what, bytes.data(),
         bytes.size(), &state);
    const auto drop = [&] {
        call(isThird() ? "fmi3FreeFMUState" : "fmi2FreeFMUstate", what, &state);
    };
    try {
        call(isThird() ? "fmi3SetFMUState" : "fmi2SetFMUstate", what, state);
    } catch (...) {
        if (m_instance) drop();
        throw;
    }
    drop();
}

}  // namespace simflex
