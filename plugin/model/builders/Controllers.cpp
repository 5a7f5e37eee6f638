#include "simflex/model/builders/Controllers.h"

#include <cmath>
#include <filesystem>
#include <map>
#include <mutex>

#include "simflex/base/Archive.h"
#include "simflex/base/NumberText.h"
#include "simflex/model/builders/ModelSystem.h"

namespace simflex {
namespace model {

using SimTK::Stage;
using SimTK::State;
using SimTK::Value;

namespace fs = std::filesystem;

//-------------------------------------------------------------------------------------------------
// Text in States

class StateText::Guts : public SimTK::Subsystem::Guts {
public:
    Guts() : SimTK::Subsystem::Guts("controller", "1") {}
    Guts* cloneImpl() const override { return new Guts(*this); }
    int realizeSubsystemTopologyImpl(State& state) const override {
        m_index = state.allocateDiscreteVariable(getMySubsystemIndex(), Stage::Dynamics,
                                                 new Value<std::string>());
        return 0;
    }

    mutable SimTK::DiscreteVariableIndex m_index;
};

StateText::StateText(SimTK::System& system) {
    m_subsystem.adoptSubsystemGuts(new Guts());
    system.adoptSubsystem(m_subsystem);
}

const std::string& StateText::get(const State& state) const {
    const auto index = static_cast<const Guts&>(m_subsystem.getSubsystemGuts()).m_index;
    return Value<std::string>::downcast(
               state.getDiscreteVariable(m_subsystem.getMySubsystemIndex(), index))
        .get();
}

void StateText::set(State& state, const std::string& text) const {
    const auto index = static_cast<const Guts&>(m_subsystem.getSubsystemGuts()).m_index;
    Value<std::string>::updDowncast(
        state.updDiscreteVariable(m_subsystem.getMySubsystemIndex(), index))
        .upd() = text;
}

//-------------------------------------------------------------------------------------------------
// Controller

namespace {

/** Unpacks a file only once for all systems built from a model. **/
std::shared_ptr<const FmuUnit> obtainUnit(const std::string& path) {
    static std::mutex mutex;
    static std::map<std::pair<std::string, fs::file_time_type>, std::weak_ptr<const FmuUnit>> units;
    std::error_code error;
    const fs::file_time_type written = fs::last_write_time(path, error);
    const std::lock_guard<std::mutex> lock(mutex);
    std::weak_ptr<const FmuUnit>& known = units[{fs::absolute(path).string(), written}];
    std::shared_ptr<const FmuUnit> unit = known.lock();
    if (!unit) known = unit = std::make_shared<const FmuUnit>(path);
    return unit;
}

void visitMemory(Archive& archive, double& time, std::string& bytes) {
    archive.visit(time, bytes);
}

}  // namespace

void refuseForeignFmus(const ModelValue& file, const AllowedCode& code) {
    if (code.fmus != AllowedCode::Fmus::Refused) return;
    const ModelValue controllers = file.get("controllers");
    for (const std::string& name : controllers.getKeys()) {
        const ModelValue fmu = controllers.get(name).get("fmu");
        fmu.fail("FMU '" + fmu.getText() +
                 "' is a program, which runs with all your rights; if you trust it, give "
                 "--allow-fmus (in Python: allow_fmus=True)");
    }
}

Controller::Controller(const ModelValue& entry, const AllowedCode& code,
                       std::function<bool()> goesOn)
    : m_name(entry.getName()), m_code(code), m_goesOn(std::move(goesOn)) {
    const ModelValue file = entry.get("fmu");
    m_unit = withPlace(file, [&] { return obtainUnit(file.getFilePath()); });
    const FmuDescription& description = m_unit->getDescription();
    const auto require = [&](const ModelValue& place, const std::string& name,
                             FmuVariable::Causality causality, const char* what) {
        std::vector<std::string> known;
        for (const FmuVariable& variable : description.variables)
            if (variable.causality == causality) known.push_back(variable.name);
        const FmuVariable* const variable = description.find(name);
        if (!variable || variable->causality != causality)
            place.failUnknown(std::string(what) + " of the FMU", name, known);
        if (variable->isArray || variable->type == FmuVariable::Type::Other)
            place.fail("'" + name + "' is " +
                       (variable->isArray ? "an array" : "of type " + variable->typeText) +
                       ": real numbers, whole ones and booleans can be connected");
    };
    const ModelValue inputs = entry.get("inputs"), outputs = entry.get("outputs"),
                     start = entry.get("start");
    for (const std::string& name : inputs.getKeys()) {
        require(inputs.get(name), name, FmuVariable::Causality::Input, "input");
        m_inputs.push_back(name);
    }
    const auto addOutput = [&](const ModelValue& place, const std::string& own,
                               const std::string& variable) {
        require(place, variable, FmuVariable::Causality::Output, "output");
        m_outputs.push_back(own);
        m_variables.push_back(variable);
    };
    for (int i = 0; outputs.isList() && i < outputs.getSize(); ++i)
        addOutput(outputs.at(i), outputs.at(i).getText(), outputs.at(i).getText());
    for (const std::string& name : outputs.getKeys())
        addOutput(outputs.get(name), name, outputs.get(name).getText());
    for (const std::string& name : start.getKeys()) {
        if (!description.find(name) ||
            description.find(name)->causality == FmuVariable::Causality::Output)
            require(start.get(name), name, FmuVariable::Causality::Parameter, "parameter");
        m_parameters.emplace_back(name, start.get(name).getNumber());
    }
}

std::vector<std::pair<std::string, double>> Controller::nameInputs(
    const std::vector<double>& inputs) const {
    std::vector<std::pair<std::string, double>> named;
    for (size_t i = 0; i < m_inputs.size(); ++i) named.emplace_back(m_inputs[i], inputs[i]);
    return named;
}

FmuCost Controller::getCost() const {
    FmuCost cost = m_costBefore;
    if (m_slave) cost += m_slave->getCost();
    return cost;
}

void Controller::drop() {
    m_costBefore = getCost();
    m_slave.reset();
    m_memory.clear();
}

template <class Work>
Controller::Moment Controller::workOrDrop(const Work& work) {
    try {
        return work();
    } catch (...) {
        drop();  // the instance may be unusable
        throw;
    }
}

void Controller::begin() {
    drop();
    m_slave = std::make_unique<FmuSlave>(m_unit, m_name, m_code, m_goesOn);
    m_slave->set(m_parameters);
    m_slave->enterInitialization(m_startTime);
    m_slave->set(nameInputs(m_startInputs));
    m_slave->exitInitialization();
}

Controller::Moment Controller::look(double time) {
    const std::vector<double> outputs = m_slave->get(m_variables);
    return keep(time, outputs, canSave() ? m_slave->save() : "");
}

Controller::Moment Controller::keep(double time, const std::vector<double>& outputs,
                                    std::string bytes) {
    for (size_t i = 0; i < m_variables.size(); ++i)
        if (!std::isfinite(outputs[i]))
            throw std::runtime_error("controller '" + m_name + "' gives no finite '" +
                                     m_variables[i] + "' at t = " + writeGeneral(time, 6) + " s");
    // Without serialization, the memory is a unique step number.
    if (!canSave()) bytes = std::to_string(m_numSteps);
    Archive archive;
    visitMemory(archive, time, bytes);
    m_memory = archive.getBytes();
    return {outputs, m_memory};
}

Controller::Moment Controller::describe(double time) const {
    Moment moment;
    for (const std::string& variable : m_variables)
        moment.outputs.push_back(m_unit->getDescription().find(variable)->start.value_or(0));
    std::string bytes;
    Archive archive;
    visitMemory(archive, time, bytes);
    moment.memory = archive.getBytes();
    return moment;
}

Controller::Moment Controller::start(double time, const std::vector<double>& inputs) {
    if (m_code.fmus == AllowedCode::Fmus::Described) return describe(time);
    if (m_slave && time == m_startTime && inputs == m_startInputs) return m_start;
    m_startTime = time;
    m_startInputs = inputs;
    ++m_numSteps;
    return m_start = workOrDrop([&] {
               begin();
               return look(time);
           });
}

void Controller::goTo(const std::string& memory) {
    if (memory == m_memory) return;
    if (memory == m_start.memory) {
        begin();
    } else if (canSave()) {
        Archive archive(memory);
        double time = 0;
        std::string bytes;
        visitMemory(archive, time, bytes);
        if (!m_slave) begin();
        m_slave->restore(bytes);
    } else {
        throw std::runtime_error("controller '" + m_name + "' cannot be restored: FMU '" +
                                 m_unit->getPath() +
                                 "' cannot save its state (canSerializeFMUState)");
    }
    m_memory = memory;
}

Controller::Moment Controller::goOn(const std::string& memory, double time,
                                    const std::vector<double>& inputs) {
    if (m_code.fmus == AllowedCode::Fmus::Described)
        throw std::logic_error("controller '" + m_name + "' is not run here");
    goTo(memory);
    Archive archive(memory);
    double last = 0;
    std::string bytes;
    visitMemory(archive, last, bytes);
    m_memory.clear();
    return workOrDrop([&] {
        const auto sample =
            m_slave->sample(nameInputs(inputs), last, time - last, m_variables, canSave());
        if (!sample)
            throw std::runtime_error("controller '" + m_name +
                                     "' has ended its simulation at t = " + writeGeneral(time, 6) +
                                     " s");
        ++m_numSteps;
        return keep(time, sample->outputs, sample->memory);
    });
}

void ControllerSampling::show(const Controller::Moment& moment,
                              const FlexibleBodySubsystem& flexible, State& state) const {
    for (size_t i = 0; i < outputs.size(); ++i)
        flexible.setStateValue(state, outputs[i], moment.outputs[i]);
    memory->set(state, moment.memory);
}

}  // namespace model
}  // namespace simflex
