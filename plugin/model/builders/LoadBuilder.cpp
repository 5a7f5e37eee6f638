#include "simflex/model/builders/LoadBuilder.h"

#include <algorithm>
#include <array>
#include <type_traits>

#include "simflex/forces/AttachmentForce.h"
#include "simflex/forces/DistributedLoad.h"
#include "simflex/forces/LoadShape.h"
#include "simflex/forces/StateForces.h"
#include "simflex/model/builders/InitialValues.h"
#include "simflex/model/builders/ModelGeometry.h"
#include "simflex/model/builders/Seat.h"

namespace simflex {
namespace model {

using namespace SimTK;

namespace {

std::array<Expression, 3> readVector(const ModelValue& value) {
    if (!value.isGiven()) return {};
    const std::vector<Expression> components = value.getExpressions();
    return {components[0], components[1], components[2]};
}

Vec3 calcVector(const std::array<Expression, 3>& vector, double time) {
    return Vec3(vector[0].calcValue(time), vector[1].calcValue(time), vector[2].calcValue(time));
}

bool isLaw(const ModelValue& vector) {
    for (int i = 0; vector.isGiven() && i < vector.getSize(); ++i)
        if (vector.at(i).isLaw()) return true;
    return false;
}

std::array<Signal, 3> readLaws(const ModelValue& vector, SignalBuilder& signals) {
    if (!vector.isGiven()) return {};
    return {signals.make(vector.at(0)), signals.make(vector.at(1)), signals.make(vector.at(2))};
}

void addForce(const ModelValue& value, const ModelFrames& frames, SignalBuilder& signals,
              ModelSystem& system) {
    const bool turns = value.get("axes").getText() == "frame";
    const FrameOnBody frame = findSeat(value.get("on"), frames);
    if (frame.body < 0) value.get("on").fail("a load cannot act on ground");
    if (isLaw(value.get("force")) || isLaw(value.get("torque"))) {
        const auto force = readLaws(value.get("force"), signals),
                   torque = readLaws(value.get("torque"), signals);
        system.lawLoads[value.getName()] = {torque[0], torque[1], torque[2],
                                            force[0],  force[1],  force[2]};
        withPlace(value.get("on"), [&] {
            StateForce(system.flexible, frames.attach(frame, system), force, torque,
                       turns ? StateForce::Axes::Attachment : StateForce::Axes::Ground,
                       value.getName());
        });
        return;
    }
    const auto force = readVector(value.get("force")), torque = readVector(value.get("torque"));
    withPlace(value.get("on"), [&] {
        AttachmentForce(
            system.flexible, frames.attach(frame, system),
            [force, torque](Real t) {
                return SpatialVec(calcVector(torque, t), calcVector(force, t));
            },
            turns ? AttachmentForce::Axes::Attachment : AttachmentForce::Axes::Ground,
            value.getName());
    });
}

/** A load of unit size on `nodes`, the name of a set or a list of mesh indices. **/
template <class Nodes>
LoadShape makeNodalShape(const ReducedBody& part, const Nodes& nodes, const std::string& kind,
                         const ModelValue& what) {
    if (kind == "pressure") return LoadShape::pressure(part, nodes);
    if (kind == "traction") return LoadShape::traction(part, nodes, what.getVec3());
    if constexpr (std::is_same_v<Nodes, std::string>)
        return LoadShape::nodeSetForce(part, nodes, what.getVec3());
    else
        return LoadShape::nodeForce(part, nodes, what.getVec3());
}

/** Mesh indices of nodes by number, without duplicates. **/
std::vector<int> readNodes(const ModelValue& list, const ReducedBody& part) {
    std::vector<int> nodes;
    for (int i = 0; i < list.getSize(); ++i) {
        const int node =
            withPlace(list.at(i), [&] { return part.mesh.indexOf(list.at(i).getInteger()); });
        if (std::find(nodes.begin(), nodes.end(), node) != nodes.end())
            list.at(i).fail("the node is in the list already");
        nodes.push_back(node);
    }
    return nodes;
}

void addDistributedLoad(const ModelValue& value, const ModelFrames& frames, SignalBuilder& signals,
                        ModelSystem& system) {
    const int index = frames.findBody(value.get("body"));
    if (!frames.getPart(index))
        value.get("body").fail("'" + value.get("body").getText() +
                               "' is rigid: put a force `on` a frame of it");
    const FlexibleBody& body = *system.bodies[size_t(index)].flexible;
    const LoadShape shape = makeLoadShape(value, body);
    const ModelValue factor = value.has("pressure") ? value.get("pressure") : value.get("scale");
    if (factor.isGiven() && factor.isLaw()) {
        const Signal size = signals.make(factor);
        system.lawLoads[value.getName()] = {size};
        withPlace(factor, [&] { StateLoad(system.flexible, body, shape, size, value.getName()); });
        return;
    }
    const Expression scale = factor.getExpression();
    DistributedLoad(
        system.flexible, body, shape, [scale](Real t) { return scale.calcValue(t); },
        value.getName());
}

}  // namespace

std::vector<int> listLoadNodes(const ModelValue& load, const ReducedBody& part) {
    const ModelValue nodes = load.get("nodes");
    if (nodes.isList()) return readNodes(nodes, part);
    const auto set = part.mesh.nodeSets.find(nodes.getText());
    return set == part.mesh.nodeSets.end() ? std::vector<int>() : set->second;
}

LoadShape makeLoadShape(const ModelValue& load, const FlexibleBody& body) {
    std::string kind;
    for (const char* one : {"pressure", "traction", "total_force", "modes"})
        if (load.has(one)) kind = one;
    if (kind != "modes" && !load.has("nodes"))
        load.fail("say on which node set it acts: nodes: SET");
    const ModelValue what = load.get(kind);
    return withPlace(load.has("nodes") ? load.get("nodes") : what, [&] {
        const ReducedBody& part = body.getPart();
        if (kind == "modes") return LoadShape::fromModalForces(readModes(what, body.getNumModes()));
        const ModelValue nodes = load.get("nodes");
        if (nodes.isList()) return makeNodalShape(part, readNodes(nodes, part), kind, what);
        return makeNodalShape(part, nodes.getText(), kind, what);
    });
}

void addLoads(const ModelValue& file, const ModelFrames& frames, SignalBuilder& signals,
              ModelSystem& system) {
    const ModelValue loads = file.get("loads");
    for (const std::string& name : loads.getKeys()) {
        const ModelValue value = loads.get(name);
        if (value.has("on"))
            addForce(value, frames, signals, system);
        else
            addDistributedLoad(value, frames, signals, system);
    }
}

}  // namespace model
}  // namespace simflex
