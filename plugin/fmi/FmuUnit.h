#pragma once
/** @file
FMUs of others, for co-simulation by FMI 2.0 or 3.0, that run in this process. Internal.

    const auto unit = std::make_shared<const FmuUnit>("controller.fmu");
    FmuSlave slave(unit, "pid");
    slave.set("kp", 400);
    slave.enterInitialization(0);
    slave.set("angle", 0.1);
    slave.exitInitialization();
    slave.doStep(0, 1e-3);
    const double torque = slave.get("torque");  **/

#include <filesystem>
#include <memory>
#include <string>

#include "simflex/base/TemporaryFolder.h"
#include "simflex/fmi/FmuDescription.h"

namespace simflex {

/** What is in an FMU: unpacked, its library loaded. **/
class FmuUnit {
public:
    /** @throws std::runtime_error naming the file and what is wrong with it. **/
    explicit FmuUnit(const std::filesystem::path& path);
    ~FmuUnit();
    FmuUnit(const FmuUnit&) = delete;
    FmuUnit& operator=(const FmuUnit&) = delete;

    const std::string& getPath() const { return m_path; }
    const FmuDescription& getDescription() const { return m_description; }
    std::filesystem::path getResources() const { return m_folder.path() / "resources"; }

    /** Of the library. @throws std::runtime_error if it has none of that name. **/
    template <class Function>
    Function* find(const char* name) const {
        return reinterpret_cast<Function*>(findSymbol(name));
    }
    [[noreturn]] void fail(const std::string& what) const;

private:
    void* findSymbol(const char* name) const;
    void open();

    std::string m_path;
    TemporaryFolder m_folder;
    FmuDescription m_description;
    void* m_library = nullptr;
};

/** An instance. What it does is the library's: a thread at a time. **/
class FmuSlave {
public:
    /** @param name  for messages **/
    FmuSlave(std::shared_ptr<const FmuUnit> unit, const std::string& name);
    ~FmuSlave();
    FmuSlave(const FmuSlave&) = delete;
    FmuSlave& operator=(const FmuSlave&) = delete;

    const FmuUnit& getUnit() const { return *m_unit; }

    /** @name All throw std::runtime_error with the file, the instance and what the unit has said
     **/
    /**@{**/
    void enterInitialization(double time);
    void exitInitialization();
    void reset();
    /** @param variable  real, integer or boolean, no array **/
    void set(const std::string& variable, double value);
    double get(const std::string& variable) const;
    /** @returns false if the unit wants the simulation to end **/
    bool doStep(double time, double length);
    /** All that it remembers, as bytes. @pre canSerializeState **/
    std::string save() const;
    void restore(const std::string& bytes);
    /**@}**/

    /** For the library to call. **/
    void hear(const std::string& message) const { m_said = message; }

private:
    bool isThird() const { return m_unit->getDescription().version == 3; }
    const FmuVariable& findVariable(const std::string& name) const;
    void require(int status, const std::string& what) const;
    [[noreturn]] void fail(const std::string& what) const;
    /** A function that takes the instance, or its arguments first, and gives a status. **/
    template <class... Arguments>
    void call(const char* name, const std::string& what, Arguments... arguments) const;

    std::shared_ptr<const FmuUnit> m_unit;
    std::string m_name;
    void* m_instance = nullptr;
    struct Callbacks;
    std::unique_ptr<Callbacks> m_callbacks;
    mutable std::string m_said;
};

}  // namespace simflex
