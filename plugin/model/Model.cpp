#include "simflex/model/Model.h"

#include <utility>

#include "simflex/body/StateCopy.h"
#include "simflex/model/builders/Controllers.h"
#include "simflex/model/builders/ModelBuilder.h"
#include "simflex/model/builders/ModelTrigger.h"
#include "simflex/model/file/NearestName.h"

namespace simflex {

using namespace SimTK;
using namespace model;

ModelSystem::~ModelSystem() = default;

ModelSystem::ModelSystem() : matter(system), forces(system), flexible(system, matter) {
    matter.setShowDefaultGeometry(false);
}

struct Model::Contents {
    Contents(const ModelValue& file, const ModelOptions& options)
        : builder((refuseForeignFmus(file, options.code), file), options),
          system(builder.build()),
          initialState(builder.makePlacedState(*system)) {
        builder.noteDoubts(*system, initialState);
        builder.setStarts(*system, initialState);
        // With bodies held rigid, more keys remain unread.
        if (options.bodies == ModelOptions::Bodies::AsGiven) checkRead(file);
    }

    /** Refuses keys without effect, except those that runs and pictures read later. **/
    static void checkRead(const ModelValue& file) {
        file.get("initial").get("start").getText();
        for (const char* section : {"gravity", "parts", "bodies", "frames", "joints", "motions",
                                    "loads", "connectors", "states", "events", "initial"})
            file.get(section).checkRead();
    }

    ModelBuilder builder;
    std::unique_ptr<ModelSystem> system;
    State initialState;
};

Model::Model(const ModelText& text, const ModelOptions& options)
    : Model(readModel(text), options) {}

Model::Model(const ModelValue& file, const ModelOptions& options)
    : m_contents(std::make_unique<Contents>(file, options)) {}

Model::~Model() = default;

const ModelValue& Model::getFile() const {
    return m_contents->builder.getFile();
}

const MultibodySystem& Model::getSystem() const {
    return m_contents->system->system;
}

const SimbodyMatterSubsystem& Model::getMatter() const {
    return m_contents->system->matter;
}

const FlexibleBodySubsystem& Model::getFlexibleBodies() const {
    return m_contents->system->flexible;
}

const std::vector<Model::BodyEntry>& Model::getBodies() const {
    return m_contents->system->bodies;
}

const std::vector<Model::JointEntry>& Model::getJoints() const {
    return m_contents->system->joints;
}

const std::vector<Model::MotionEntry>& Model::getMotions() const {
    return m_contents->system->motions;
}

const std::map<std::string, Signal>& Model::getStates() const {
    return m_contents->system->states;
}

const std::vector<Model::InputEntry>& Model::getInputs() const {
    return m_contents->system->inputs;
}

const Model::InputEntry* Model::findInput(const std::string& name) const {
    for (const InputEntry& input : getInputs())
        if (input.name == name) return &input;
    return nullptr;
}

const std::map<std::string, int>& Model::getSettableStates() const {
    return m_contents->system->settableStates;
}

const std::map<std::string, std::array<Signal, 6>>& Model::getLawLoads() const {
    return m_contents->system->lawLoads;
}

std::vector<std::pair<std::string, double>> Model::takeOccurrences() const {
    std::vector<std::pair<std::string, double>> list;
    for (const ModelSystem::Occurrence& occurrence : *m_contents->system->occurrences)
        list.emplace_back(occurrence.event, occurrence.time);
    m_contents->system->occurrences->clear();
    return list;
}

std::vector<std::string> Model::takeEventWarnings() const {
    return std::exchange(*m_contents->system->eventWarnings, {});
}

bool Model::changeWithEvents(State& state, const std::function<void()>& change) const {
    bool shouldTerminate = false;
    changeWithTriggers(*m_contents->system, state, shouldTerminate, change);
    return shouldTerminate;
}

std::vector<std::string> Model::findEventsThatHold(const State& state) const {
    std::vector<std::string> names;
    for (const ModelSystem::EventEntry& event : m_contents->system->events)
        if (getFlexibleBodies().getStateValue(state, event.waitingState) > 0.5 &&
            event.margin.calcValue(getFlexibleBodies(), state) > 0)
            names.push_back(event.name);
    return names;
}

Vec3 Model::findNamedOrigin(const std::string& joint) const {
    const auto& origins = m_contents->system->namedOrigins;
    const auto found = origins.find(joint);
    return found == origins.end() ? Vec3(0) : found->second;
}

const std::vector<Joint::Lock>& Model::getLocks(const std::string& joint) const {
    static const std::vector<Joint::Lock> none;
    const auto found = m_contents->system->locks.find(joint);
    return found != m_contents->system->locks.end() ? found->second : none;
}

const std::string& Model::getLawFailure() const {
    return *m_contents->system->lawFailure;
}

void Model::forgetLawFailure() const {
    m_contents->system->lawFailure->clear();
}

const Signal& Model::findState(const ModelValue& name) const {
    const auto found = getStates().find(name.getText());
    if (found != getStates().end()) return found->second;
    std::vector<std::string> known;
    for (const auto& state : getStates()) known.push_back(state.first);
    name.failUnknown("state", name.getText(), known);
}

const Model::BodyEntry& Model::findBody(const ModelValue& name) const {
    return findEntry(getBodies(), "body", name.getText(), name);
}

const Model::JointEntry& Model::findJoint(const ModelValue& name) const {
    return findEntry(getJoints(), "joint", name.getText(), name);
}

const Model::MotionEntry& Model::findMotion(const ModelValue& name) const {
    return findEntry(getMotions(), "motion", name.getText(), name);
}

Attachment Model::findFrame(const ModelValue& frame) const {
    const ModelFrames& frames = m_contents->builder.getFrames();
    const FrameOnBody found = frames.find(frame);
    return withPlace(frame, [&] { return frames.attach(found, *m_contents->system); });
}

Attachment Model::findFrame(const std::string& name) const {
    const ModelFrames& frames = m_contents->builder.getFrames();
    const auto fail = [](const std::string& what, const std::string& found,
                         const std::vector<std::string>& known) {
        throw std::invalid_argument(describeUnknown(what, found, known));
    };
    return frames.attach(frames.find(name, fail), *m_contents->system);
}

State Model::makePlacedState() const {
    return m_contents->builder.makePlacedState(*m_contents->system);
}

State Model::makeInitialState() const {
    State state = copyState(m_contents->initialState);
    startStates(state);
    return state;
}

void Model::startStates(State& state) const {
    getSystem().realize(state, Stage::Velocity);
    std::vector<double> values;
    for (const auto& follower : m_contents->system->followers)
        values.push_back(follower.second.calcValue(getFlexibleBodies(), state));
    for (size_t i = 0; i < values.size(); ++i)
        getFlexibleBodies().setStateValue(state, m_contents->system->followers[i].first, values[i]);
    getSystem().realize(state, Stage::Velocity);
    if (m_contents->system->controllers.empty()) return;
    for (const ControllerSampling& sampling : m_contents->system->controllers) {
        std::vector<double> inputs;
        for (const Signal& input : sampling.inputs)
            inputs.push_back(input.calcValue(getFlexibleBodies(), state));
        sampling.show(sampling.controller->start(state.getTime(), inputs), getFlexibleBodies(),
                      state);
        getSystem().realize(state, Stage::Velocity);
    }
}

FmuCost Model::getFmuCost() const {
    FmuCost cost;
    for (const ControllerSampling& sampling : m_contents->system->controllers)
        cost += sampling.controller->getCost();
    return cost;
}

void Model::copyMemories(const State& from, State& to) const {
    for (const ControllerSampling& sampling : m_contents->system->controllers)
        sampling.memory->set(to, sampling.memory->get(from));
}

}  // namespace simflex
