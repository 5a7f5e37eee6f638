#pragma once
/** @file
A Simbody system built from a model file, with its bodies, joints, motions, loads and connectors
under the names of the file.

    Model model(loadModelText("crank.yaml", {"solver.accuracy=1e-5"}));
    State state = model.makeInitialState();
    BdfIntegrator integrator(model.getSystem());  **/

#include <array>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "Simbody.h"
#include "simflex/base/AllowedCode.h"
#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"
#include "simflex/forces/Signal.h"
#include "simflex/model/Listener.h"
#include "simflex/model/file/ModelReader.h"

namespace simflex {
namespace model {
struct ControllerSampling;
class ModelTrigger;
}  // namespace model

struct FmuCost;
struct ModelSystem;

struct ModelOptions {
    enum class Bodies {
        AsGiven,
        Rigid,  ///< every flexible body is held rigid
        Finer   ///< every part has additional modes, see ReducedBody::finer
    };
    Bodies bodies = Bodies::AsGiven;
    AllowedCode code;
    /** Folder of the cache of reduced parts; empty: $SIMFLEX_CACHE, else $XDG_CACHE_HOME/simflex,
    else ~/.cache/simflex. **/
    std::string cacheFolder;
    Listener listener;  ///< called while parts are reduced and the system is built
    /** Adds things that a file cannot express (forces, constraints, handlers) to every system built
    from the model, before its topology is realized. **/
    std::function<void(ModelSystem&)> extend;
};

class Model {
public:
    /** Reduces parts that need it, builds the system and realizes its topology.
    @throws ModelError naming file, line and column. **/
    explicit Model(const ModelText& text, const ModelOptions& options = {});
    explicit Model(const model::ModelValue& file, const ModelOptions& options = {});
    ~Model();
    Model(const Model&) = delete;
    Model& operator=(const Model&) = delete;

    const model::ModelValue& getFile() const;
    const SimTK::MultibodySystem& getSystem() const;
    const SimTK::SimbodyMatterSubsystem& getMatter() const;
    const FlexibleBodySubsystem& getFlexibleBodies() const;

    /** A body of the file; `flexible` is empty for a rigid body. **/
    struct BodyEntry {
        std::string name;
        SimTK::MobilizedBody mobod;  ///< frame B of a flexible body
        std::optional<FlexibleBody> flexible;
        SimTK::Transform X_BP;  ///< coordinates of the part's deck in B
    };
    struct JointEntry {
        std::string name;
        Joint joint;
    };
    struct MotionEntry {
        std::string name;
        Joint joint;  ///< the prescribed motion
        model::Expression position;
    };

    /** @name Named entries in the file's order
    find…() throw ModelError by value.failUnknown(). **/
    /**@{**/
    const std::vector<BodyEntry>& getBodies() const;
    const std::vector<JointEntry>& getJoints() const;
    const std::vector<MotionEntry>& getMotions() const;
    /** Names and times of events that have happened in motions since the last call. **/
    std::vector<std::pair<std::string, double>> takeOccurrences() const;
    /** Warnings about the actions of events since the last call. **/
    std::vector<std::string> takeEventWarnings() const;
    /** Changes a State at Stage::Velocity; events whose conditions become true by the change
    happen.
    @returns true if one of them ends the simulation **/
    bool changeWithEvents(SimTK::State& state, const std::function<void()>& change) const;
    /** Names of events whose awaited condition already holds; requires Stage::Velocity. **/
    std::vector<std::string> findEventsThatHold(const SimTK::State& state) const;
    /** Why a law had no value at any evaluation since forgetLawFailure(); empty if all had one. **/
    const std::string& getLawFailure() const;
    void forgetLawFailure() const;
    /** Torque and force of the loads that are laws, by name. **/
    const std::map<std::string, std::array<Signal, 6>>& getLawLoads() const;
    /** Values of inputs, outputs of states and counts of events, by name. **/
    const std::map<std::string, Signal>& getStates() const;
    /** An input: its value is the state with this number, its rate the next state. **/
    struct InputEntry {
        std::string name, unit;
        int state;
    };
    const std::vector<InputEntry>& getInputs() const;
    const InputEntry* findInput(const std::string& name) const;  ///< null if there is none
    /** Numbers of the states that can be set: those defined by a rate, and counts. **/
    const std::map<std::string, int>& getSettableStates() const;
    const BodyEntry& findBody(const model::ModelValue& name) const;
    const JointEntry& findJoint(const model::ModelValue& name) const;
    const MotionEntry& findMotion(const model::ModelValue& name) const;
    const Signal& findState(const model::ModelValue& name) const;
    /** Origin of the frame F that the file names for a joint, in the joint's own F. For a joint
    with an axis, its own F has its origin where M is placed. **/
    SimTK::Vec3 findNamedOrigin(const std::string& joint) const;
    /** Locks of a joint's coordinates, if events lock them. **/
    const std::vector<Joint::Lock>& getLocks(const std::string& joint) const;

    /** The attachment for a frame of the file, see "frame" in the key reference. **/
    Attachment findFrame(const model::ModelValue& frame) const;
    /** The same from text, as typed at a prompt.
    @throws std::invalid_argument. **/
    Attachment findFrame(const std::string& name) const;
    /**@}**/

    /** The State as placed and with the file's initial values, realized to Stage::Velocity. Joints
    are assembled only if the file gives initial coordinates or rates of joints. Flexible bodies are
    held rigid where the model requires it. **/
    SimTK::State makeInitialState() const;
    /** The same before joints get initial coordinates or rates: nothing is assembled. **/
    SimTK::State makePlacedState() const;

    /** Starts filters at the values of their inputs, and realizes to Stage::Velocity. Call this on
    the first State of a motion unless makeInitialState() made it. **/
    void startStates(SimTK::State& state) const;
    /** Copies the memories of controllers. **/
    void copyMemories(const SimTK::State& from, SimTK::State& to) const;
    /** Cost of all controllers' FMUs so far. **/
    FmuCost getFmuCost() const;

private:
    class Builder;
    struct Contents;
    std::unique_ptr<Contents> m_contents;
};

/** The Simbody system of a model, with the names of its file. **/
struct ModelSystem {
    ModelSystem();
    ~ModelSystem();

    SimTK::MultibodySystem system;
    SimTK::SimbodyMatterSubsystem matter;
    SimTK::GeneralForceSubsystem forces;
    FlexibleBodySubsystem flexible;
    std::vector<Model::BodyEntry> bodies;
    std::vector<Model::JointEntry> joints;
    std::vector<Model::MotionEntry> motions;
    using InputEntry = Model::InputEntry;
    std::vector<InputEntry> inputs;
    std::map<std::string, Signal> states;                   ///< inputs and outputs of states
    std::map<std::string, int> settableStates;              ///< numbers of states defined by a rate
    std::map<std::string, std::array<Signal, 6>> lawLoads;  ///< torque and force, or factor
    struct EventEntry {
        std::string name;
        Signal margin;     ///< positive while the condition holds
        int waitingState;  ///< 1 while the event waits for its condition
    };
    std::vector<EventEntry> events;
    std::map<std::string, std::vector<Joint::Lock>> locks;  ///< locks of coordinates by joint
    /** Events that have happened in motions and were not taken yet. **/
    struct Occurrence {
        std::string event;
        double time;
    };
    std::shared_ptr<std::vector<Occurrence>> occurrences =
        std::make_shared<std::vector<Occurrence>>();
    /** Warnings about the actions of events. **/
    std::shared_ptr<std::vector<std::string>> eventWarnings =
        std::make_shared<std::vector<std::string>>();
    /** Triggers of all events and relays. **/
    std::vector<const model::ModelTrigger*> triggers;
    /** Why a law had no value at its last evaluation; empty if it had one. **/
    std::shared_ptr<std::string> lawFailure = std::make_shared<std::string>();
    std::vector<model::ControllerSampling> controllers;
    /** States that start at the value of a signal, by number. **/
    std::vector<std::pair<int, Signal>> followers;
    std::map<std::string, SimTK::Vec3> namedOrigins;  ///< see Model::findNamedOrigin()
};

}  // namespace simflex
