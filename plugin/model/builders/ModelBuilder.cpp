#include "simflex/model/builders/ModelBuilder.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "simflex/base/NumberText.h"
#include "simflex/body/JointEquations.h"
#include "simflex/model/builders/BodyBuilder.h"
#include "simflex/model/builders/EventBuilder.h"
#include "simflex/model/builders/LoadBuilder.h"
#include "simflex/model/builders/ModelGeometry.h"
#include "simflex/model/file/AngleCheck.h"
#include "simflex/model/parts/PartBuilder.h"

namespace simflex {
namespace model {

using namespace SimTK;

namespace {

constexpr double CoarseAccuracy = 0.1;  ///< largest accuracy, relative to the model's size
constexpr double FarApart = 1e-3;       ///< error of a joint, relative to the model's size

}  // namespace

ModelBuilder::ModelBuilder(const ModelValue& file, const ModelOptions& options)
    : m_file(file),
      m_options(options),
      m_parts(makeParts(file, options)),
      m_frames(file, m_parts),
      m_placement(file, m_frames) {
    // Check unused frames as well.
    const ModelValue frames = file.get("frames");
    for (const std::string& name : frames.getKeys()) m_frames.find(frames.get(name));
}

std::unique_ptr<ModelSystem> ModelBuilder::build() const {
    auto system = std::make_unique<ModelSystem>();
    const Vec3 gravity = readVec3(m_file.get("gravity"));
    if (gravity.norm() > 0) Force::Gravity(system->forces, system->matter, gravity);
    addBodies(m_file, m_frames, m_placement, m_parts, m_options, *system);
    JointBuilder joints(m_file, m_frames, m_placement);
    joints.addTo(*system);
    addMotions(m_file, m_frames, joints, *system);
    countTurns(m_file, *system);
    SignalBuilder signals(m_file, m_frames, m_options, *system);
    signals.addInputs();
    addEventCounts(m_file, signals);
    signals.addStates();
    addLoads(m_file, m_frames, signals, *system);
    addConnectors(m_file, m_frames, m_placement, signals, *system);
    // If all bodies are placed at one point, the model's size is unknown.
    const double extent = m_placement.calcSize();
    addEvents(m_file, extent > Placement::LeastSize ? std::min(extent, 1.0) : 1, signals, *system);
    for (const std::string& note : signals.getNotes()) m_options.listener.tellNote(note);
    if (m_options.extend) m_options.extend(*system);
    system->system.realizeTopology();
    return system;
}

State ModelBuilder::makePlacedState(const ModelSystem& system) const {
    State state = system.system.getDefaultState();
    placeBodies(m_file, m_frames, m_placement, system, state);
    return state;
}

/** Warns if a set has all nodes of a solid element, since both its sides may be loaded. **/
void ModelBuilder::warnOfBothSides() const {
    const ModelValue loads = m_file.get("loads");
    for (const std::string& name : loads.getKeys()) {
        const ModelValue load = loads.get(name);
        if (!load.has("nodes") || !(load.has("pressure") || load.has("traction"))) continue;
        const auto part = m_frames.getPart(m_frames.findBody(load.get("body")));
        if (!part) continue;
        std::vector<char> isIn(size_t(part->mesh.numNodes()), 0);
        for (const int node : listLoadNodes(load, *part)) isIn[size_t(node)] = 1;
        size_t numWhole = 0;
        for (const ElementBlock& block : part->mesh.elements) {
            if (block.isShell) continue;  // loaded on its upper side
            const auto size = std::ptrdiff_t(numNodesOf(block.type));
            for (auto first = block.nodes.begin(); block.nodes.end() - first >= size; first += size)
                numWhole += std::all_of(first, first + size,
                                        [&](int node) { return node < 0 || isIn[size_t(node)]; });
        }
        if (numWhole > 0)
            m_options.listener.tellWarning(
                load.getPlace() + ": load '" + name + "' acts on both sides of " +
                std::to_string(numWhole) + " elements, all of whose nodes are in " +
                (load.get("nodes").isList() ? "its list"
                                            : "'" + load.get("nodes").getText() + "'") +
                ": a pressure cancels there and a traction counts twice; for one side give a "
                "total_force");
    }
}

void ModelBuilder::warnOfAccuracy(const ModelSystem& system, double size) const {
    for (const Model::BodyEntry& body : system.bodies) {
        const MassProperties& mass = body.mobod.getDefaultMassProperties();
        double radius = 0;
        if (body.flexible)
            radius = body.flexible->getPart().calcRadius();
        else if (mass.getMass() > 0)
            radius = std::sqrt(mass.getInertia().trace() / mass.getMass());
        size = std::max(size, 2 * radius);
    }
    const ModelValue accuracy = m_file.get("solver").get("accuracy");
    if (accuracy.getNumber() > CoarseAccuracy * size)
        m_options.listener.tellWarning(
            "the accuracy of " + writeGeneral(accuracy.getNumber(), 3) +
            " m is no part of the model's size of " + writeGeneral(size, 3) +
            " m: what moves less than the former is not followed; solver.accuracy is a "
            "displacement, as 1e-6");
}

void ModelBuilder::setStarts(const ModelSystem& system, State& state) const {
    if (m_file.get("initial").has("joints") || m_file.get("initial").has("rates"))
        for (const std::string& text : setJointStarts(m_file, system, state))
            m_options.listener.tellWarning(text);
}

void ModelBuilder::noteOpenCoupler(const Model::JointEntry& coupler, const State& placed) const {
    const auto& coefficients = coupler.joint.getEquations().getCoefficients();
    double largest = 0;
    for (const double coefficient : coefficients)
        largest = std::max(largest, std::abs(coefficient));
    const double error = coupler.joint.calcPositionErrors(placed)[0];
    if (!(std::abs(error) > FarApart * largest)) return;
    if (coupler.joint.getEquations().getKind() == std::string("Gear"))
        return m_options.listener.tellNote("gear '" + coupler.name +
                                           "' is not in mesh as placed: assembly turns its wheels");
    m_options.listener.tellWarning(
        "coupler '" + coupler.name + "' does not hold as placed: its sum is off by " +
        writeGeneral(error, 3) +
        "; assembly will move the bodies, unless 'constant' takes them as they are");
}

void ModelBuilder::noteDoubts(const ModelSystem& system, const State& placed) const {
    std::set<int> held;
    for (const std::string section : {"joints", "motions", "connectors"})
        for (const std::string& name : m_file.get(section).getKeys()) {
            const ModelValue value = m_file.get(section).get(name);
            for (int i = 0; value.has("between") && i < value.get("between").getSize(); ++i)
                held.insert(m_frames.find(value.get("between").at(i)).body);
        }
    for (size_t i = 0; i < system.bodies.size(); ++i)
        if (MobilizedBody::Free::isInstanceOf(system.bodies[i].mobod) && !held.count(int(i)))
            m_options.listener.tellNote("body '" + system.bodies[i].name +
                                        "' is held by no joint or connector: it is free");
    for (const std::string& doubt : listAngleDoubts(m_file)) m_options.listener.tellWarning(doubt);
    const bool areJointsLed = m_file.get("initial").has("joints");
    const double size = m_placement.calcSize();
    warnOfAccuracy(system, size);
    warnOfBothSides();
    for (const Model::JointEntry& joint : system.joints) {
        const ModelValue value = m_file.get("joints").get(joint.name);
        const std::string type = value.get("type").getText();
        if (type == "gear" || type == "coupler") {
            if (!areJointsLed) noteOpenCoupler(joint, placed);
            continue;
        }
        const Vector errors = joint.joint.calcPositionErrors(placed);
        double largest = 0;
        for (int i = 0; i < errors.size(); ++i) largest = std::max(largest, std::abs(errors[i]));
        if (!(largest > FarApart * std::min(size, 1.0))) continue;
        const Transform X_FM = ~joint.joint.getFrameF().calcMotion(placed).X *
                               joint.joint.getFrameM().calcMotion(placed).X;
        const double angle = std::abs(X_FM.R().convertRotationToAngleAxis()[0]);
        m_options.listener.tellWarning(
            "joint '" + joint.name + "' is not closed as placed: its error is " +
            writeGeneral(largest, 3) + ", its frames are " + writeGeneral(X_FM.p().norm(), 3) +
            " m apart and rotated relative to each other by " + writeGeneral(angle * 180 / Pi, 3) +
            " degrees; assembly will move the bodies" +
            (type == "rod" ? "" : "; 'as_placed: true' takes them as they are"));
    }
    for (const Model::MotionEntry& motion : system.motions) {
        const double largest = motion.joint.calcPositionErrors(placed).normInf();
        if (largest > FarApart * std::min(size, 1.0) && !areJointsLed)
            m_options.listener.tellNote("motion '" + motion.name + "' begins " +
                                        writeGeneral(largest, 3) +
                                        " m or rad from where bodies are placed: assembly moves "
                                        "them there");
    }
}

}  // namespace model
}  // namespace simflex
