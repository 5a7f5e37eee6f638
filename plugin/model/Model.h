#pragma once
/** @file
A Simbody system made of a model file: bodies, joints, motions, loads and connectors by the names
that the file gives them.

    Model model(loadModelText("crank.yaml", {"solver.accuracy=1e-5"}));
    State state = model.makeInitialState();
    BdfIntegrator integrator(model.getSystem());  **/

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "Simbody.h"
#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"
#include "simflex/model/Listener.h"
#include "simflex/model/file/ModelReader.h"

namespace simflex {

struct ModelSystem;

struct ModelOptions {
    enum class Bodies { AsGiven, Rigid };
    Bodies bodies = Bodies::AsGiven;  ///< Rigid: every flexible body is held rigid
    bool allowsScripts = false;       ///< of Gmsh, outside the sandbox: see GmshOptions
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
    const BodyEntry& findBody(const model::ModelValue& name) const;
    const JointEntry& findJoint(const model::ModelValue& name) const;
    const MotionEntry& findMotion(const model::ModelValue& name) const;
    /** The attachment that a frame of the file means, see "frame" in the key reference. **/
    Attachment findFrame(const model::ModelValue& frame) const;
    /** The same from text, as typed at a prompt; throws std::invalid_argument. **/
    Attachment findFrame(const std::string& name) const;
    /**@}**/

    /** As placed and with the file's initial values, realized to Stage::Velocity. Joints are
    assembled only if the file gives initial coordinates or rates of joints. Flexible bodies are
    rigid where they should be. **/
    SimTK::State makeInitialState() const;

private:
    class Builder;
    struct Contents;
    std::unique_ptr<Contents> m_contents;
};

/** The Simbody system that a model becomes, with the names of its file. **/
struct ModelSystem {
    ModelSystem();

    SimTK::MultibodySystem system;
    SimTK::SimbodyMatterSubsystem matter;
    SimTK::GeneralForceSubsystem forces;
    FlexibleBodySubsystem flexible;
    std::vector<Model::BodyEntry> bodies;
    std::vector<Model::JointEntry> joints;
    std::vector<Model::MotionEntry> motions;
};

}  // namespace simflex
