#pragma once
/** @file
FMUs that control a model. At each multiple of a period, a controller gets its inputs and advances
to that time; its outputs then hold until the next sample. Its memory is stored in the State as
bytes if the FMU can serialize its state. The integrator can then go back in time, and runs continue
from checkpoints. **/

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "simflex/fmi/FmuUnit.h"
#include "simflex/forces/Signal.h"
#include "simflex/model/file/ModelValue.h"

namespace simflex {
namespace model {

/** A text stored in States. **/
class StateText {
public:
    explicit StateText(SimTK::System& system);
    const std::string& get(const SimTK::State& state) const;
    void set(SimTK::State& state, const std::string& text) const;

private:
    class Guts;
    SimTK::Subsystem m_subsystem;
};

/** @throws ModelError naming an FMU of the model's controllers if none is allowed to run. **/
void refuseForeignFmus(const ModelValue& file, const AllowedCode& code);

class Controller {
public:
    /** @param entry   of `controllers`
    @param code    whether and where the FMU runs; if it is only described, its outputs are its
        start values, or 0
    @param goesOn  called while the FMU takes long; returning false stops the work **/
    Controller(const ModelValue& entry, const AllowedCode& code, std::function<bool()> goesOn);

    const std::vector<std::string>& getInputs() const { return m_inputs; }
    /** Names in the model. **/
    const std::vector<std::string>& getOutputs() const { return m_outputs; }

    struct Moment {
        std::vector<double> outputs;
        std::string memory;
    };
    Moment start(double time, const std::vector<double>& inputs);
    /** Restores `memory` and advances to `time`.
    @throws std::runtime_error from the FMU, or if the memory cannot be restored. **/
    Moment goOn(const std::string& memory, double time, const std::vector<double>& inputs);

    /** Cost of all instances so far. **/
    FmuCost getCost() const;

private:
    void begin();
    void drop();
    /** Returns the result of work(); drops the instance if it throws. **/
    template <class Work>
    Moment workOrDrop(const Work& work);
    std::vector<std::pair<std::string, double>> nameInputs(const std::vector<double>& inputs) const;
    Moment look(double time);
    /** @param bytes  serialized state of the instance, if it supports that **/
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
    std::string m_memory;  ///< current memory of the instance
    long m_numSteps = 0;
    double m_startTime = 0;
    std::vector<double> m_startInputs;
    Moment m_start;
    FmuCost m_costBefore;  ///< of instances already dropped
};

/** `number`: state with k of the last sample; `outputs`: states. **/
struct ControllerSampling {
    std::shared_ptr<Controller> controller;
    double period;
    int number;
    std::vector<int> outputs;
    std::vector<Signal> inputs;
    std::shared_ptr<const StateText> memory;

    void show(const Controller::Moment& moment, const FlexibleBodySubsystem& flexible,
              SimTK::State& state) const;
};

}  // namespace model
}  // namespace simflex
