#pragma once
/** @file
The library of an FMU and an instance of it, in this process. It depends on nothing else in simflex,
since simflex_fmu_host consists of it. Internal. **/

#include <memory>
#include <string>

#include "simflex/fmi/FmuCalls.h"

namespace simflex {

class FmuLibrary : public FmuInstanceCalls {
public:
    /** Loads the library and creates the instance. @throws std::runtime_error naming a missing
    function or with the library's message. **/
    explicit FmuLibrary(const FmuInstanceSetup& setup);
    ~FmuLibrary() override;
    FmuLibrary(const FmuLibrary&) = delete;
    FmuLibrary& operator=(const FmuLibrary&) = delete;

    FmuReply ask(const std::vector<FmuCall>& calls) override;

    /** Called by the library's logger. **/
    void hear(const std::string& message) { m_said = message; }

private:
    struct Callbacks;

    bool isThird() const { return m_setup.version == 3; }
    /** @throws std::runtime_error if the library has no such function. **/
    template <class Function>
    Function* find(const char* name) const;
    void instantiate();
    [[noreturn]] void fail(const std::string& what) const;
    void require(int status, const std::string& what);
    /** Calls a function of the instance and arguments that returns a status. **/
    template <class... Arguments>
    void call(const char* name, const std::string& what, Arguments... arguments);

    FmuAnswer answer(const FmuCall& call);
    void enterInitialization(double time, const std::string& what);
    void set(const FmuCall& call);
    double get(const FmuCall& call);
    bool doStep(const FmuCall& call);
    std::string save(const std::string& what);
    void restore(const std::string& bytes, const std::string& what);

    FmuInstanceSetup m_setup;
    void* m_library = nullptr;
    void* m_instance = nullptr;
    std::unique_ptr<Callbacks> m_callbacks;
    std::string m_said;
};

}  // namespace simflex
