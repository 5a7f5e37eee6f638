#pragma once
/** @file
Makes the quantities that laws of a model file depend on: probes and states, as signals of the
motion with their derivatives. Adds the states' equations to the system.

    SignalBuilder signals(file, frames, options, system);
    signals.addStates();
    const Signal force = signals.make(value.get("law"), {{"length", length}}); **/

#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "simflex/base/ReferenceChain.h"
#include "simflex/forces/Signal.h"
#include "simflex/model/builders/HeldStates.h"
#include "simflex/model/builders/ModelFrames.h"

namespace simflex {
namespace model {

class VariableFormula;

class SignalBuilder {
public:
    using Locals = std::map<std::string, Signal>;

    /** @param options  how FMUs are run, and the function that decides whether to go on **/
    SignalBuilder(const ModelValue& file, const ModelFrames& frames, const ModelOptions& options,
                  ModelSystem& system);
    ~SignalBuilder();

    /** Adds inputs, which events and states may depend on. **/
    void addInputs();

    /** Adds the equations of all states, and their names to the system. **/
    void addStates();

    /** The states of an event, which have consecutive numbers: Count is how often the event has
    happened, which its name stands for in laws; Waiting is 1 while the event waits for its
    condition to become true, 0 while it waits for the condition to become false. **/
    enum class EventState { Count, Waiting };
    void addEventStates(const ModelValue& event);
    /** Finds the number of a state of type `rate`, or of an event's count. @throws ModelError. **/
    int findState(const ModelValue& name) const;

    /** Makes the margin by which a law that is a comparison holds, see Formula. **/
    Signal makeMargin(const ModelValue& condition);
    /** Makes the signal of a law or of a function of time.
    @throws ModelError if it names a quantity that no force can depend on, or depends on itself. **/
    Signal make(const ModelValue& value, const Locals& locals = {});

    /** Coordinate, which counts turns, and rate of a joint given by name or {joint:, coordinate:}.
    @param column  number of the coordinate if the joint has several and `coordinate` is not given
    @throws ModelError if there is no such coordinate. **/
    std::pair<Joint, int> findCoordinateOf(const ModelValue& joint, int column = -1) const;
    Signal makeCoordinate(const ModelValue& joint, int column = -1);
    Signal makeCoordinateRate(const ModelValue& joint, int column = -1);

    /** Notes on words in laws that have a meaning there and are also names of something else. **/
    const std::vector<std::string>& getNotes() const { return m_notes; }

private:
    class StateEntry;

    /** @throws ModelError if another quantity that laws know has the entry's name. **/
    void checkNewName(const ModelValue& entry) const;
    void addEntry(const ModelValue& entry);
    /** Whether a formula gives its own value, or its margin. **/
    enum class Value { Own, Margin };
    Signal compile(const ModelValue& formula, const Locals& locals, Value value = Value::Own);
    /** Whether a probe that has the name of a motor's own quantity also measures that quantity. **/
    bool isOfSameCoordinate(const std::string& probeName, const ModelValue& law) const;
    void noteSharedWords(const VariableFormula& formula, const ModelValue& law,
                         const std::vector<std::string>& own);
    Signal find(const std::string& name, const ModelValue& law);
    /** Empty if the unit is not known. **/
    std::string findUnit(const std::string& name, bool isLocal) const;
    /** Columns of a probe that laws can depend on; empty for other probes. **/
    std::vector<std::string> listColumns(const ModelValue& probe) const;
    Signal makeOfProbe(const ModelValue& probe, int column);
    Signal makeOfMobilizer(const ModelValue& map, bool isRate);
    Attachment attach(const ModelValue& frame);

    ModelValue m_file;
    const ModelFrames& m_frames;
    const ModelOptions& m_options;
    ModelSystem& m_system;
    std::vector<std::unique_ptr<StateEntry>> m_states;
    std::map<std::string, StateEntry*> m_ofNames, m_ofOutputs;  ///< those of m_states
    std::vector<Sampling> m_samplings;
    /** Probes and states under construction. **/
    ReferenceChain m_chain{"probes and states", "it depends on itself",
                           "; a state in the loop, such as a low_pass, breaks it"};
    std::vector<std::string> m_notes;

    struct OfProbe {
        Signal signal;
        double numFormulas;
    };
    std::map<std::string, OfProbe> m_ofProbes;  ///< made so far
    double m_numFormulas = 0;  ///< in the last signal made; those of a name count at each use
};

/** Reads a joint, or {joint:, coordinate:}: the joint's name and the coordinate's number. **/
std::pair<ModelValue, int> readJointCoordinate(const ModelValue& value);

}  // namespace model
}  // namespace simflex
