#pragma once
/** @file
A Simbody system made of a model file: bodies, joints, motions, loads and connectors by the names
that the file gives them.

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
        Finer   ///< every part has further modes, see ReducedBody::finer
    };
    Bodies bodies = Bodies::AsGiven;
    AllowedCode code;
    /** Folder of reduced parts, by content; empty: $SIMFLEX_CACHE, else $XDG_CACHE_HOME/simflex,
    else
    ~/.cache/simflex. **/
    std::string cacheFolder;
    Listener listener;  ///< told while parts are reduced and the system is built
    /** Adds what a file cannot say (forces, constraints, handlers) to every system that is made of
    the model, before its topology is realized. **/
    std::function<void(ModelSystem&)> extend;
};

class Model {
public:
    /** Reduces what must be, builds the system and realizes its topology.
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

    /** A body of the file; `flexible` is empty for a rigid one. **/
    struct BodyEntry {
        std::string name;
        SimTK::MobilizedBody mobod;  ///< of a flexible body: its frame B
        std::optional<FlexibleBody> flexible;
        SimTK::Transform X_BP;  ///< the part's own coordinates (deck) in B
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

    /** @name What the file names, in its order. find…() throw ModelError by value.failUnknown().
     * **/
    /**@{**/
    const std::vector<BodyEntry>& getBodies() const;
    const std::vector<JointEntry>& getJoints() const;
    const std::vector<MotionEntry>& getMotions() const;
    /** Events of motions that have happened since the last call: names and times. **/
    std::vector<std::pair<std::string, double>> takeOccurrences() const;
    /** What is to be known of what they did, since somebody took it last. **/
    std::vector<std::string> takeEventWarnings() const;
    /** Changes a State, Stage::Velocity; events whose conditions begin to hold thereby happen.
    @returns whether one ends the simulation **/
    bool changeWithEvents(SimTK::State& state, const std::function<void()>& change) const;
    /** Names of events that wait for a condition that holds already; Stage::Velocity. **/
    std::vector<std::string> findEventsThatHold(const SimTK::State& state) const;
    /** Why a law had no value, whatever was tried since forgetLawFailure(); empty: all had one. **/
    const std::string& getLawFailure() const;
    void forgetLawFailure() const;
    /** Torque and force of loads that are laws, by name. **/
    const std::map<std::string, std::array<Signal, 6>>& getLawLoads() const;
    /** What inputs are, what states put out and how often events have happened, by name. **/
    const std::map<std::string, Signal>& getStates() const;
    /** An input: its value is the state of this number, its rate the next. **/
    struct InputEntry {
        std::string name, unit;
        int state;
    };
    const std::vector<InputEntry>& getInputs() const;
    const InputEntry* findInput(const std::string& name) const;  ///< null: there is none
    /** Numbers of those whose value is one's own to set: of a rate of their own, and counts. **/
    const std::map<std::string, int>& getSettableStates() const;
    const BodyEntry& findBody(const model::ModelValue& name) const;
    const JointEntry& findJoint(const model::ModelValue& name) const;
    const MotionEntry& findMotion(const model::ModelValue& name) const;
    const Signal& findState(const model::ModelValue& name) const;
    /** Origin of the frame F that the file names for a joint, in the joint's own F: with an axis,
    that one has its origin where M is placed. **/
    SimTK::Vec3 findNamedOrigin(const std::string& joint) const;
    /** Of a joint's coordinates, if events lock them. **/
    const std::vector<Joint::Lock>& getLocks(const std::string& joint) const;

    /** The attachment that a frame of the file means, see "frame" in the key reference. **/
    Attachment findFrame(const model::ModelValue& frame) const;
    /** The same from text, as typed at a prompt; throws std::invalid_argument. **/
    Attachment findFrame(const std::string& name) const;
    /**@}**/

    /** As placed and with the file's initial values, realized to Stage::Velocity. Joints are
    assembled only if the file gives initial coordinates or rates of joints. Flexible bodies are
    rigid where they should be. **/
    SimTK::State makeInitialState() const;
    /** The same before joints are given initial coordinates or rates: nothing is assembled. **/
    SimTK::State makePlacedState() const;

    /** Filters begin at what they filter: to be called on a State that a motion begins with and
    that was not made by makeInitialState(). Realized to Stage::Velocity. **/
    void startStates(SimTK::State& state) const;
    /** What controllers remember. **/
    void copyMemories(const SimTK::State& from, SimTK::State& to) const;
    /** What their FMUs have cost so far. **/
    FmuCost getFmuCost() const;

private:
    class Builder;
    struct Contents;
    std::unique_ptr<Contents> m_contents;
};

/** The Simbody system that a model becomes, with the names of its file. **/
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
    std::map<std::string, Signal> states;                   ///< inputs, and what states put out
    std::map<std::string, int> settableStates;              ///< numbers of those of a rate
    std::map<std::string, std::array<Signal, 6>> lawLoads;  ///< torque and force, or factor
    struct EventEntry {
        std::string name;
        Signal margin;     ///< positive while its condition holds
        int waitingState;  ///< 1 while the event waits for that
    };
    std::vector<EventEntry> events;
    std::map<std::string, std::vector<Joint::Lock>> locks;  ///< by joint, of its coordinates
    /** What has happened in motions since somebody looked last. **/
    struct Occurrence {
        std::string event;
        double time;
    };
    std::shared_ptr<std::vector<Occurrence>> occurrences =
        std::make_shared<std::vector<Occurrence>>();
    /** What is to be known of what events did. **/
    std::shared_ptr<std::vector<std::string>> eventWarnings =
        std::make_shared<std::vector<std::string>>();
    /** All that waits for the motion: events and relays. **/
    std::vector<const model::ModelTrigger*> triggers;
    /** Why a law had no value when it was asked last. **/
    std::shared_ptr<std::string> lawFailure = std::make_shared<std::string>();
    std::vector<model::ControllerSampling> controllers;
    /** States that begin at the value of a signal, by number. **/
    std::vector<std::pair<int, Signal>> followers;
    std::map<std::string, SimTK::Vec3> namedOrigins;  ///< see Model::findNamedOrigin()
};

}  // namespace simflex
