#include "simflex/model/pictures/ForcePictures.h"

#include <array>

#include "simflex/model/builders/LoadBuilder.h"

namespace simflex {
namespace model {

using SimTK::Real;
using SimTK::SpatialVec;
using SimTK::Vec3;

namespace {

using Formulas = std::array<Expression, 3>;

Formulas readFormulas(const ModelValue& value) {
    if (!value.isGiven()) return {};
    const std::vector<Expression> list = value.getExpressions();
    return {list.at(0), list.at(1), list.at(2)};
}

Vec3 calc(const Formulas& formulas, Real time) {
    return Vec3(formulas[0].calcValue(time), formulas[1].calcValue(time),
                formulas[2].calcValue(time));
}

ConnectorKind chooseKind(const ModelValue& connector) {
    const std::string type = connector.get("type").getText();
    if (type == "actuator") return ConnectorKind::Damper;
    if (type == "bushing") return ConnectorKind::Bushing;
    if (type == "stop") return ConnectorKind::Stop;
    if (type == "torsion_spring") return ConnectorKind::TorsionSpring;
    const auto isPositive = [&](const char* key) {
        return connector.get(key).isGiven() && connector.get(key).getNumber() > 0;
    };
    if (!isPositive("damping")) return ConnectorKind::Spring;
    return isPositive("stiffness") ? ConnectorKind::SpringDamper : ConnectorKind::Damper;
}

void addConnectors(const Model& model, OffscreenVisualizer& viz) {
    const ModelValue connectors = model.getFile().get("connectors");
    if (connectors.getKeys().empty()) return;
    const SimTK::State start = model.makeInitialState();
    for (const std::string& name : connectors.getKeys()) {
        const ModelValue value = connectors.get(name), between = value.get("between");
        if (!between.isGiven()) continue;  // a motor is inside its joint
        DrawnConnector connector{chooseKind(value), model.findFrame(between.at(0)),
                                 model.findFrame(between.at(1))};
        if (value.has("free_length")) connector.freeLength = value.get("free_length").getNumber();
        if (!(connector.freeLength > 0))
            connector.freeLength =
                (connector.F.calcMotion(start).X.p() - connector.M.calcMotion(start).X.p()).norm();
        viz.addConnector(connector);
    }
}

void addForce(const Model& model, const ModelValue& load, OffscreenVisualizer& viz) {
    const bool turns = load.has("axes") && load.get("axes").getText() == "frame";
    DrawnLoad drawn{model.findFrame(load.get("on")),
                    {},
                    turns ? DrawnLoad::Axes::Attachment : DrawnLoad::Axes::Ground};
    const auto law = model.getLawLoads().find(load.getName());
    if (law != model.getLawLoads().end()) {
        drawn.force = [&model, law = law->second](const SimTK::State& state) {
            SpatialVec force;
            for (int i = 0; i < 6; ++i)
                force[i / 3][i % 3] = law[size_t(i)].calcValue(model.getFlexibleBodies(), state);
            return force;
        };
    } else {
        const Formulas force = readFormulas(load.get("force")),
                       torque = readFormulas(load.get("torque"));
        drawn.force = [force, torque](const SimTK::State& state) {
            return SpatialVec(calc(torque, state.getTime()), calc(force, state.getTime()));
        };
    }
    viz.addLoad(drawn);
}

/** Loads on modes alone have no position and are not drawn. **/
void addSpreadLoad(const Model& model, const ModelValue& load, OffscreenVisualizer& viz) {
    if (!load.has("nodes")) return;
    const FlexibleBody& body = *model.findBody(load.get("body")).flexible;
    const ReducedBody& part = body.getPart();
    const LoadShape shape = makeLoadShape(load, body);
    const std::vector<int> nodes = listLoadNodes(load, part);
    Vec3 center(0);
    for (const int node : nodes) {
        const auto p = part.mesh.position(node);
        center += Vec3(p[0], p[1], p[2]) / Real(nodes.size());
    }
    const auto law = model.getLawLoads().find(load.getName());
    if (law != model.getLawLoads().end()) {
        viz.addLoad(DrawnLoad{
            Attachment::onShapes(body, center),
            [&model, size = law->second[0], force = shape.force](const SimTK::State& state) {
                return SpatialVec(Vec3(0),
                                  size.calcValue(model.getFlexibleBodies(), state) * force);
            },
            DrawnLoad::Axes::Attachment});
        return;
    }
    const ModelValue factor = load.get(load.has("pressure") ? "pressure" : "scale");
    const Expression scale = factor.isGiven() ? factor.getExpression() : Expression(1);
    viz.addLoad(DrawnSpreadLoad{body, center, shape.force, shape.modal,
                                [scale](Real t) { return scale.calcValue(t); }});
}

}  // namespace

void addForces(const Model& model, OffscreenVisualizer& viz) {
    addConnectors(model, viz);
    const ModelValue loads = model.getFile().get("loads");
    for (const std::string& name : loads.getKeys()) {
        if (loads.get(name).has("on"))
            addForce(model, loads.get(name), viz);
        else
            addSpreadLoad(model, loads.get(name), viz);
    }
}

}  // namespace model
}  // namespace simflex
