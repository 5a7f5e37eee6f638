#pragma once
/** @file
What laws of a model file depend on: its probes and states as signals of the motion, with their
derivatives, and the states' equations.

    SignalBuilder signals(file, frames, options, system);
    signals.addStates();
    const Signal force = signals.make(value.get("law"), {{"length", length}}); **/

#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "simflex/forces/Signal.h"
#include "simflex/model/builders/HeldStates.h"
#include "simflex/model/builders/ModelFrames.h"

namespace simflex {
namespace model {

class VariableFormula;

class SignalBuilder {
public:
    using Locals = std::map<std::string, Signal>;

    /** @param options  those of FMUs, and who is asked whether to go on with them **/
    SignalBuilder(const ModelValue& file, const ModelFrames& frames, const ModelOptions& options,
                  ModelSystem& system);
    ~SignalBuilder();

    /** Adds inputs, which events and states may depend on. **/
    void addInputs();

    /** Adds the equations of all states, and their names to the system. **/
    void addStates();

    /** What is known of an event, in states of consecutive numbers: how often it has happened, what
    its name means, and 1 while it waits for its condition to hold, 0 for it to end. **/
    enum class EventState { Count, Waiting };
    void addEventStates(const ModelValue& event);
    /** Number of a state of type `rate`, or of an event's count. @throws ModelError. **/
    int findState(const ModelValue& name) const;

    /** Of a law that is a comparison: how far it holds, see Formula. **/
    Signal makeMargin(const ModelValue& condition);
    /** Of a law, or of a function of time.
    @throws ModelError if it names what no force can depend on, or depends on itself. **/
    Signal make(const ModelValue& value, const Locals& locals = {});

    /** A joint by name or {joint:, coordinate:}: its coordinate, which counts turns, and its rate.
    @param column  which, where the joint has several and `coordinate` is not given
    @throws ModelError if there is no such coordinate. **/
    std::pair<Joint, int> findCoordinateOf(const ModelValue& joint, int column = -1) const;
    Signal makeCoordinate(const ModelValue& joint, int column = -1);
    Signal makeCoordinateRate(const ModelValue& joint, int column = -1);

    /** On words of laws that mean something and are the names of something else. **/
    const std::vector<std::string>& getNotes() const { return m_notes; }

private:
    class StateEntry;

    /** @throws ModelError if something else that laws know has it. **/
    void checkNewName(const ModelValue& entry) const;
    void addEntry(const ModelValue& entry);
    /** How a formula is evaluated: itself, or its margin. **/
    enum class Value { Own, Margin };
    Signal compile(const ModelValue& formula, const Locals& locals, Value value = Value::Own);
    /** A probe whose name is an own quantity of a motor's law, and that measures just this. **/
    bool isOfSameCoordinate(const std::string& probeName, const ModelValue& law) const;
    void noteSharedWords(const VariableFormula& formula, const ModelValue& law,
                         const std::vector<std::string>& own);
    Signal find(const std::string& name, const ModelValue& law);
    /** Empty if it is not known. **/
    std::string findUnit(const std::string& name, bool isLocal) const;
    /** Those of a probe that laws can depend on; else none. **/
    std::vector<std::string> listColumns(const ModelValue& probe) const;
    Signal makeOfProbe(const ModelValue& probe, int column);
    Signal makeOfMobilizer(const ModelValue& map, bool isRate);
    Attachment attach(const ModelValue& frame);

    ModelValue m_file;
    const ModelFrames& m_frames;
    const ModelOptions& m_options;
    ModelSystem& m_system;
    std::vector<std::unique_ptr<StateEntry>> m_states;
    std::vector<Sampling> m_samplings;
    std::vector<std::string> m_open;  ///< probes and states that are being made
    std::vector<std::string> m_notes;

    struct OfProbe {
        Signal signal;
        double numFormulas;
    };
    std::map<std::string, OfProbe> m_ofProbes;  ///< that have been made
    double m_numFormulas = 0;  ///< of what has been made last, counted where they are named
};

/** The joint's name and number of a joint or {joint:, coordinate:}. **/
std::pair<ModelValue, int> readJointCoordinate(const ModelValue& value);

}  // namespace model
}  // namespace simflex
