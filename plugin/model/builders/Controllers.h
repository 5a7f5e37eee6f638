#pragma once
/** @file
FMUs that control a model: at each multiple of a period one is told what it measures, goes on to
that time, and what it puts out holds until the next. What it remembers is in the State, as bytes,
if the unit can write them: then one may go back, and runs go on from checkpoints. **/

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "simflex/fmi/FmuUnit.h"
#include "simflex/forces/Signal.h"
#include "simflex/model/file/ModelValue.h"

namespace simflex {
namespace model {

/** A text in States. **/
class StateText {
public:
    explicit StateText(SimTK::System& system);
    const std::string& get(const SimTK::State& state) const;
    void set(SimTK::State& state, const std::string& text) const;

private:
    class Guts;
    SimTK::Subsystem m_subsystem;
};

/** @throws ModelError naming an FMU of the model's controllers, if none is allowed. **/
void refuseForeignFmus(const ModelValue& file, const AllowedCode& code);

/** Its unit, instance and variables. **/
class Controller {
public:
    /** @param entry   of `controllers`
    @param code    says whether its FMU runs, and where; one that is only described puts out its
    start values, or 0
    @param goesOn  asked while the FMU takes long; false stops the work **/
    Controller(const ModelValue& entry, const AllowedCode& code, std::function<bool()> goesOn);

    const std::vector<std::string>& getInputs() const { return m_inputs; }
    /** Names of a model's own. **/
    const std::vector<std::string>& getOutputs() const { return m_outputs; }

    /** What it puts out, and what it remembers then. **/
    struct Moment {
        std::vector<double> outputs;
        std::string memory;
    };
    Moment start(double time, const std::vector<double>& inputs);
    /** @throws std::runtime_error of the unit's, or if it cannot be brought where `memory` says.
     * **/
    Moment goOn(const std::string& memory, double time, const std::vector<double>& inputs);

    /** Of all instances so far. **/
    FmuCost getCost() const;

private:
    void begin();
    void drop();
    /** What work() returns; an instance that it fails with is given up. **/
    template <class Work>
    Moment workOrDrop(const Work& work);
    std::vector<std::pair<std::string, double>> nameInputs(const std::vector<double>& inputs) const;
    Moment look(double time);
    /** @param bytes  what the instance remembers, if it can say so **/
    Moment keep(double time, const std::vector<double>& outputs, std::string bytes);
    bool canSave() const { return m_unit->getDescription().canSerializeState; }
    Moment describe(double time) const;
    void goTo(const std::string& memory);

    std::string m_name;
    AllowedCode m_code;
    std::function<bool()> m_goesOn;
    std::shared_ptr<const FmuUnit> m_unit;
    std::vector<std::string> m_inputs, m_outputs, m_variables;  ///< variables of the outputs
    std::vector<std::pair<std::string, double>> m_parameters;
    std::unique_ptr<FmuSlave> m_slave;
    std::string m_memory;  ///< where the instance is
    long m_numSteps = 0;
    double m_startTime = 0;
    std::vector<double> m_startInputs;
    Moment m_start;
    FmuCost m_costBefore;  ///< of instances that are gone
};

/** number = k of the last sample, outputs: states. **/
struct ControllerSampling {
    std::shared_ptr<Controller> controller;
    double period;
    int number;
    std::vector<int> outputs;
    std::vector<Signal> inputs;
    std::shared_ptr<const StateText> memory;

    /** Into the State. **/
    void show(const Controller::Moment& moment, const FlexibleBodySubsystem& flexible,
              SimTK::State& state) const;
};

}  // namespace model
}  // namespace simflex
