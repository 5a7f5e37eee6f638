#pragma once
/** @file
FMUs of others, for co-simulation by FMI 2.0 or 3.0, that run here. Internal.

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

/** What is in an FMU: unpacked and described. Nothing of it runs. **/
class FmuUnit {
public:
    /** @throws std::runtime_error naming the file and what is wrong with it. **/
    explicit FmuUnit(const std::filesystem::path& path);
    FmuUnit(const FmuUnit&) = delete;
    FmuUnit& operator=(const FmuUnit&) = delete;

    const std::string& getPath() const { return m_path; }
    const FmuDescription& getDescription() const { return m_description; }
    /** The library, and an instance of that name to make of it. **/
    FmuInstanceSetup makeSetup(const std::string& name) const;
    [[noreturn]] void fail(const std::string& what) const;

private:
    void open();

    std::string m_path;
    TemporaryFolder m_folder;
    FmuDescription m_description;
    std::string m_library;  ///< path
};

/** An instance. A thread at a time asks it. **/
class FmuSlave {
public:
    /** @param name    for messages
    @param code    says where it runs, and for how long an answer is waited
    @param goesOn  asked while an answer takes long; false stops the work by Cancelled
    @throws std::runtime_error; std::logic_error if `code` lets none run. **/
    FmuSlave(std::shared_ptr<const FmuUnit> unit, const std::string& name, const AllowedCode& code,
             const std::function<bool()>& goesOn = {});

    const FmuUnit& getUnit() const { return *m_unit; }
    const FmuCost& getCost() const { return m_cost; }

    /** @name All throw std::runtime_error with the file, the instance and what the unit has said,
    or how its process ended **/
    /**@{**/
    void enterInitialization(double time);
    void exitInitialization();
    void reset();
    /** @param variable  real, integer or boolean, no array **/
    void set(const std::string& variable, double value) { set({{variable, value}}); }
    double get(const std::string& variable) { return get(std::vector<std::string>{variable})[0]; }
    /** Several at once are one exchange. **/
    void set(const std::vector<std::pair<std::string, double>>& values);
    std::vector<double> get(const std::vector<std::string>& variables);
    /** @returns false if the unit wants the simulation to end **/
    bool doStep(double time, double length);
    /** All that a sample is, in one exchange: inputs are set, a step is made, outputs are read, and
    with `saves` what it remembers is.
    @returns nothing if the unit wants the simulation to end **/
    struct Sample {
        std::vector<double> outputs;
        std::string memory;
    };
    std::optional<Sample> sample(const std::vector<std::pair<std::string, double>>& inputs,
                                 double time, double length,
                                 const std::vector<std::string>& outputs, bool saves);
    /** All that it remembers, as bytes. @pre canSerializeState **/
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
