#pragma once
/** @file
Runs FMUs of other tools, for co-simulation by FMI 2.0 or 3.0. Internal.

    const auto unit = std::make_shared<const FmuUnit>("controller.fmu");
    FmuSlave slave(unit, "pid", code);   // in a process of its own, or in this one
    slave.set("kp", 400);
    slave.enterInitialization(0);
    slave.set("angle", 0.1);
    slave.exitInitialization();
    slave.doStep(0, 1e-3);
    const double torque = slave.get("torque");  **/

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "simflex/base/AllowedCode.h"
#include "simflex/base/TemporaryFolder.h"
#include "simflex/fmi/FmuCalls.h"
#include "simflex/fmi/FmuCost.h"
#include "simflex/fmi/FmuDescription.h"

namespace simflex {

/** An unpacked FMU and its description. Its code is not run. **/
class FmuUnit {
public:
    /** @throws std::runtime_error naming the file and the error. **/
    explicit FmuUnit(const std::filesystem::path& path);
    FmuUnit(const FmuUnit&) = delete;
    FmuUnit& operator=(const FmuUnit&) = delete;

    const std::string& getPath() const { return m_path; }
    const FmuDescription& getDescription() const { return m_description; }
    /** Returns the library and the name of an instance to create. **/
    FmuInstanceSetup makeSetup(const std::string& name) const;
    [[noreturn]] void fail(const std::string& what) const;

private:
    void open();

    std::string m_path;
    TemporaryFolder m_folder;
    FmuDescription m_description;
    std::string m_library;  ///< path
};

/** An instance. Not thread-safe. **/
class FmuSlave {
public:
    /** @param name    for messages
    @param code    determines where it runs and the time limit of a reply
    @param goesOn  called while waiting for a reply; false cancels the work by Cancelled
    @throws std::runtime_error; std::logic_error if `code` does not allow FMUs. **/
    FmuSlave(std::shared_ptr<const FmuUnit> unit, const std::string& name, const AllowedCode& code,
             const std::function<bool()>& goesOn = {});

    const FmuUnit& getUnit() const { return *m_unit; }
    const FmuCost& getCost() const { return m_cost; }

    /** @name All throw std::runtime_error with the file, the instance and the unit's message, or
    the end of its process **/
    /**@{**/
    void enterInitialization(double time);
    void exitInitialization();
    void reset();
    /** @param variable  real, integer or boolean, not an array **/
    void set(const std::string& variable, double value) { set({{variable, value}}); }
    double get(const std::string& variable) { return get(std::vector<std::string>{variable})[0]; }
    /** Several values at once take a single exchange. **/
    void set(const std::vector<std::pair<std::string, double>>& values);
    std::vector<double> get(const std::vector<std::string>& variables);
    /** @returns false if the unit requests the end of the simulation **/
    bool doStep(double time, double length);
    /** Runs a sample in a single exchange: sets inputs, makes a step, reads outputs and, if `saves`
    is set, saves the unit's state.
    @returns nothing if the unit requests the end of the simulation **/
    struct Sample {
        std::vector<double> outputs;
        std::string memory;
    };
    std::optional<Sample> sample(const std::vector<std::pair<std::string, double>>& inputs,
                                 double time, double length,
                                 const std::vector<std::string>& outputs, bool saves);
    /** Returns the complete state of the unit as bytes. @pre canSerializeState **/
    std::string save();
    void restore(const std::string& bytes);
    /**@}**/

private:
    const FmuVariable& findVariable(const std::string& name) const;
    [[noreturn]] void fail(const std::string& what) const;
    std::vector<FmuCall> makeSets(const std::vector<std::pair<std::string, double>>& values) const;
    std::vector<FmuCall> makeGets(const std::vector<std::string>& variables) const;
    std::vector<FmuAnswer> ask(const std::vector<FmuCall>& calls);

    std::shared_ptr<const FmuUnit> m_unit;
    std::string m_name;
    std::unique_ptr<FmuInstanceCalls> m_instance;
    FmuCost m_cost;
};

}  // namespace simflex
